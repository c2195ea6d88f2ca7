"""Streets for those who have no shader: tiles of points, and of Gaussian splats."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from storage.packages import Package
from tsuya.exports.format import Format, Notes

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_SYSTEMS = ("street_billboards",)
_SPACING = 2
"""Texels from a point to the next: 16 x 16 of a billboard."""
_SIGMA = 0.55
"""Of a splat, in spacings of points: neighbours leave no gap and blur little."""
_THIN = 0.001
"""Metres: sigma of a splat across its billboard."""
_HARMONIC_0 = 0.28209479177387814
_EXTENSION = "KHR_gaussian_splatting"
_FROM_ONE_SIDE = (
    "Points have the colours that each billboard shows from the middle of the directions that it "
    "was photographed from; what changes with the direction is left out, and so is the sky."
)
_MADE_OF_TEXELS = (
    "Splats are texels made flat ellipsoids, not fitted to the photographs: edges of masks blur by "
    "about half a point's spacing."
)


class _Points(NamedTuple):
    """Points of a tile."""

    places: NDArray[np.float32]
    """(n, 3), metres, z up."""
    colours: NDArray[np.uint8]
    """(n, 3), sRGB."""
    rotations: NDArray[np.float32]
    """(n, 4), x, y, z, w: to the axes of its billboard, row, column, normal."""
    spacings: NDArray[np.float32]
    """(n, 2), metres to the next point along a row and a column."""


def write_ply(package: Package, target: Path) -> Notes:
    """A folder of binary PLY point clouds, z up, sRGB colours, one a tile of road."""
    import numpy as np

    record = np.dtype([("xyz", "<f4", 3), ("rgb", "u1", 3)])
    properties = [*(f"float {axis}" for axis in "xyz"), *map("uchar {}".format, _CHANNELS)]
    for name, points in _tiles(package):
        lines = (
            "ply",
            "format binary_little_endian 1.0",
            f"comment {package.meta['title']}, metres, z up",
            f"element vertex {len(points.places)}",
            *(f"property {each}" for each in properties),
            "end_header\n",
        )
        values = np.empty(len(points.places), record)
        values["xyz"], values["rgb"] = points.places, points.colours
        _write(target / f"{name}.ply", "\n".join(lines).encode() + values.tobytes())
    return (_FROM_ONE_SIDE,)


def write_glb(package: Package, target: Path) -> Notes:
    """A folder of glTF point clouds, one a tile of road."""
    for name, points in _tiles(package):
        attributes: dict[str, NDArray[Any]] = {
            "POSITION": points.places,
            "COLOR_0": _linear(points.colours),
        }
        _write(target / f"{name}.glb", _point_glb(attributes))
    return (_FROM_ONE_SIDE,)


def write_splats(package: Package, target: Path) -> Notes:
    """A folder of Gaussian splats in glTF (KHR_gaussian_splatting), one a tile of road."""
    import numpy as np

    for name, points in _tiles(package):
        thin = np.full((len(points.places), 1), _THIN, np.float32)
        harmonic = (points.colours.astype(np.float32) / 255.0 - 0.5) / _HARMONIC_0
        attributes: dict[str, NDArray[Any]] = {
            "POSITION": points.places,
            "COLOR_0": _linear(points.colours),
            f"{_EXTENSION}:ROTATION": points.rotations,
            f"{_EXTENSION}:SCALE": np.hstack([_SIGMA * points.spacings, thin]),
            f"{_EXTENSION}:OPACITY": np.ones(len(points.places), np.float32),
            f"{_EXTENSION}:SH_DEGREE_0_COEF_0": harmonic,
        }
        said = {"kernel": "ellipse", "colorSpace": "srgb_rec709_display"}
        _write(target / f"{name}.glb", _point_glb(attributes, {_EXTENSION: said}))
    return (_FROM_ONE_SIDE, _MADE_OF_TEXELS)


_CHANNELS = ("red", "green", "blue")


def _tiles(package: Package) -> Iterator[tuple[str, _Points]]:
    """Names and points of tiles, each decoded when it is asked for. Raises BadInput."""
    import numpy as np
    from scipy.spatial.transform import Rotation

    from assets_defs.street_billboards.package_tiles import tiles_of
    from pipelines.street_billboards.live_tiles import texel_points
    from pipelines.street_billboards.textures.texture_tables import SIDE

    for number, tile in enumerate(tiles_of(package)):
        parts = []
        for places, colours, halves in texel_points(tile, _SPACING):
            lengths = np.maximum(np.linalg.norm(halves, axis=1), 1e-9)
            row, column = halves / lengths[:, None]
            axes = np.stack([row, column, np.cross(row, column)], axis=1)
            turn = Rotation.from_matrix(axes).as_quat().astype(np.float32)
            count = (len(places), 1)
            spacing = (2 * lengths * _SPACING / SIDE).astype(np.float32)
            parts.append((places, colours, np.tile(turn, count), np.tile(spacing, count)))
        if sum(len(part[0]) for part in parts):
            yield f"tile_{number:03d}", _Points(*map(np.concatenate, zip(*parts, strict=True)))


def _linear(colours: NDArray[np.uint8]) -> NDArray[np.float32]:
    """(n, 4), linear light and opacity, as glTF has vertices' colours."""
    import numpy as np

    from pipelines.drawing.colour import decode_srgb

    linear = np.ones((len(colours), 4), np.float32)
    linear[:, :3] = decode_srgb(colours / 255.0)
    return linear


def _point_glb(
    attributes: Mapping[str, NDArray[Any]], extensions: Mapping[str, Any] | None = None
) -> bytes:
    """Points of these attributes, all float32, z up under a node that turns z to y."""
    from storage.packages.glb import Z_UP_TO_Y_UP, GlbFile

    file = GlbFile()
    named = {name: file.values(values) for name, values in attributes.items()}
    primitive: dict[str, Any] = {"mode": 0, "attributes": named}
    document: dict[str, Any] = {
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "rotation": list(Z_UP_TO_Y_UP)}],
        "meshes": [{"primitives": [primitive]}],
    }
    if extensions:
        primitive["extensions"] = dict(extensions)
        document["extensionsUsed"] = sorted(extensions)
    return file.whole(document)


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(content)


FORMATS = (
    Format("ply", _SYSTEMS, "", "coloured points, a PLY a tile of road", write_ply),
    Format("glb", _SYSTEMS, "", "coloured points, a .glb a tile of road", write_glb),
    Format(
        "splats", _SYSTEMS, "", "Gaussian splats in glTF (KHR_gaussian_splatting)", write_splats
    ),
)
