"""Lit scenes for engines and renderers: glTF with what the sky sees and the shaders, and USD."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from storage.packages import Package
from tsuya.exports.format import Format, Notes

if TYPE_CHECKING:
    from pipelines.ssdf_lighting.compression.decoder_tables import DecoderTables

_SHADERS = ("lit_vertex.glsl", "lit_fragment.glsl", "lit_distances.glsl")
_LINE = 4
"""Numbers of a texel."""

_README = """\
scene.glb      the scene. COLOR_0 is the colour of the vertices times the share of the sky that each
               sees, weighted by the cosine; _SKY is that share alone; _SSDF is the vertex's row in
               distances.npz.
distances.npz  the signed distances as ssdf_lookup.glsl reads them, texels of four numbers:
               vectors (clusterVectors), weights (vertexWeights), sources (vertexSources); side is
               SIDE of its n x n directions.
lights.npz     the environment as spherical Gaussians: axes, sharpness, amplitudes.
glsl/          lit_distances.glsl finds the distances of all lobes at a vertex, lit_vertex.glsl with
               EDGES_FETCHED hands them on, lit_fragment.glsl makes the light of a pixel
               (bounced: reflected light of a vertex, zeros for none). Names in
               capitals are constants; #include takes the file of that name. z is up in the arrays:
               the scene's node turns it to y.
"""


def write_glb(package: Package, target: Path) -> Notes:
    """A folder: `scene.glb`, the distances, the lights, and the shaders that use them.

    Raises BadInput for a package that is damaged or of another schema.
    """
    import numpy as np

    from pipelines.drawing.glsl import SHADERS
    from tsuya.exports.lit_materials import scene_glb
    from tsuya.exports.lit_tables import decoder_tables, sky_shares

    _check_schema(package)
    tables = decoder_tables(package)
    (target / "glsl").mkdir(parents=True)
    (target / "scene.glb").write_bytes(scene_glb(package, sky_shares(package, tables)))
    (target / "README.txt").write_text(_README)
    names = ("axes", "sharpness", "amplitudes")
    lights: dict[str, Any] = {name: package.array(f"light_{name}") for name in names}
    np.savez_compressed(target / "lights.npz", **lights)
    np.savez_compressed(target / "distances.npz", **texels(tables))
    for name in _with_included(SHADERS, _SHADERS):
        (target / "glsl" / name).write_bytes((SHADERS / name).read_bytes())
    return (
        "COLOR_0 darkens what sees little sky in every viewer; _SKY is that share alone.",
        "glTF has no light of an environment: lights.npz holds it.",
    )


def texels(tables: DecoderTables) -> dict[str, Any]:
    """Lines of texels (T, 4) of ``DecoderTables``, as `ssdf_lookup.glsl` reads them."""
    import numpy as np

    directions = tables.resolution**2
    widths = -(-(tables.rank + 1) // _LINE)
    starts = np.concatenate([[0], np.cumsum(widths * directions)])
    vectors = np.zeros((starts[-1], _LINE), np.float32)
    for own, rank in enumerate(tables.rank):
        begin = tables.table_start[own]
        table = tables.table[begin : begin + directions * (rank + 1)].reshape(directions, rank + 1)
        padded = np.pad(table, ((0, 0), (0, _LINE * widths[own] - rank - 1)))
        vectors[starts[own] : starts[own + 1]] = padded.reshape(-1, _LINE)
    width = widths[tables.cluster]
    first = np.concatenate([[0], np.cumsum(width)])
    weights = np.zeros((first[-1], _LINE), np.float32)
    flat = weights.reshape(-1)
    for vertex, own in enumerate(tables.cluster):
        begin, rank = tables.weight_start[vertex], tables.rank[own]
        at = _LINE * first[vertex]
        flat[at] = 1.0
        flat[at + 1 : at + 1 + rank] = tables.weights[begin : begin + rank]
    sources = np.stack([starts[tables.cluster], width, first[:-1], 0 * width], axis=1)
    return {
        "vectors": vectors.astype(np.float16),
        "weights": weights,
        "sources": sources.astype(np.float32),
        "side": np.array(tables.resolution),
    }


def _with_included(folder: Path, names: tuple[str, ...]) -> list[str]:
    """The files and all that they include."""
    import re

    waiting, found = list(names), []
    while waiting:
        name = waiting.pop(0)
        if name not in found:
            found.append(name)
            waiting += re.findall(r'#include[ \t]+"([^"\n]*)"', (folder / name).read_text())
    return found


def write_usd(package: Package, target: Path) -> Notes:
    """A folder: `scene.usda` with its textures, and the environment as a dome light.

    Raises BadInput for a package that is damaged or of another schema.
    """
    import numpy as np

    from tsuya.exports.lit_materials import map_files
    from tsuya.exports.lit_usd import scene_usda
    from tsuya.picture_files import write_picture

    _check_schema(package)
    target.mkdir(parents=True)
    write_picture(package.array("environment").astype(np.float32), target / "environment", "exr")
    for name, picture in map_files(package).items():
        write_picture(picture, target / name.removesuffix(".png"), "png")
    (target / "scene.usda").write_text(scene_usda(package))
    return ("Shadows are the renderer's own: USD has no place for distances.",)


def _check_schema(package: Package) -> None:
    from storage.packages.ssdf_lighting import PACKAGE
    from storage.readers.bad_input import BadInput

    if package.meta["schema"] != PACKAGE.number:
        expected = f"{PACKAGE.number}, as this Tsuya makes them: make the package again"
        raise BadInput(package.name, "schema", f"{package.meta['schema']}", expected)


FORMATS = (
    Format("glb", ("ssdf_lighting",), "", "glTF with the sky's share, distances, GLSL", write_glb),
    Format("usd", ("ssdf_lighting",), "", "USD with materials and a dome light", write_usd),
)
