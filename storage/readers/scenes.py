"""Scenes of several objects, with a material each: PLY, OBJ and GLB."""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened
from storage.readers.companions import file_beside
from storage.readers.glb_files import GlbFile, read_glb
from storage.readers.meshes import mesh_format, read_polygons, split_by_uv
from storage.readers.obj_files import ObjFile, read_obj
from storage.readers.opening import number, whole_file
from storage.readers.polygons import PolygonMesh, triangulate
from storage.readers.usable_polygons import usable_polygons

LEAST_ROUGHNESS = 1e-3
"""Mirrors, whose slope would be 0, are read as this rough."""

_LARGEST_LIBRARY = 16 << 20  # bytes
_DIELECTRIC = 0.04  # Fresnel reflectance at normal incidence that glTF 2.0 gives what is no metal


class Material(NamedTuple):
    """How a part reflects light.

    name: as in the file; names need not differ.
    albedo: diffuse reflectance in [0, 1], red, green and blue of linear sRGB.
    specular: Fresnel reflectance at normal incidence, F0, in [0, 1]; 0 is without gloss.
    roughness: Beckmann's slope m in (0, 1].
    """

    name: str
    albedo: tuple[float, float, float]
    specular: float
    roughness: float


class SceneFile(NamedTuple):
    """Triangles and their materials.

    vertices: (V, 3) float64; each belongs to a triangle.
    triangles: (F, 3) int64.
    part: (F,) int32, the row of ``materials`` of each triangle.
    materials: those that triangles have, in the order of the file.
    notes: what did not go as the file says, one sentence each.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    part: NDArray[np.int32]
    materials: tuple[Material, ...]
    notes: tuple[str, ...]


def default_material(name: str = "default") -> Material:
    """What a part has whose file gives it no material: a matt grey."""
    return Material(name, (0.6, 0.6, 0.6), 0.0, 0.3)


def read_scene(path: str | PathLike[str]) -> SceneFile:
    """Read a PLY, OBJ or GLB file as triangles with one material for each part.

    Polygons are cut into triangles, transforms of a GLB's nodes are applied (mirrored ones turn
    their triangles over), vertices without a face are left out. Degenerate faces stay: repeated
    corners and faces without area are for `pipelines.geometry.repair`. Textures, texture
    coordinates and colours of vertices are ignored; a note says where textures are.

    GLB: a part is what has one material. The diffuse albedo is the baseColorFactor, linear
    already, times (1 - metallicFactor); F0 goes from 0.04 to the mean base colour with the
    metallicFactor; m is the roughnessFactor squared, as glTF 2.0 (appendix B) has the slope of
    its GGX lobe, which Beckmann's is by convention.

    OBJ: a part is what has one ``usemtl``, or in a file without any an object (``o``), or in one
    without these a group (``g``), with the default material. Kd is the linear albedo, the mean
    of Ks is F0; m is ``Pr`` squared where there is one, else sqrt(2 / (Ns + 2)), the Beckmann lobe
    like Phong's of the exponent Ns (Walter et al., "Microfacet models for refraction", 2007). What
    a material leaves out is as in the default one. A library that is missing, and a name that
    is in none, make the default material and a note.

    PLY, and a GLB's primitives without a material: one part with the default material.

    Raises BadInput as `read_mesh` does, but for degenerate faces and texture coordinates; for
    a line of a material library with numbers that are missing, no numbers or out of range,
    naming the library; and for factors of a GLB's material that are.
    """
    file = Path(path)
    found = mesh_format(file)
    if found == "gltf":
        glb = read_glb(file)
        mesh, (rows, materials, notes) = glb.mesh, _glb_materials(file, glb)
    elif found == "obj":
        obj = read_obj(file)
        mesh, (rows, materials, notes) = obj.mesh, _obj_materials(file, obj)
    else:
        mesh = read_polygons(file)
        rows, materials, notes = np.zeros(1, np.int64), [default_material()], []
    return _scene(file, mesh, rows, materials, notes)


def _scene(
    file: Path,
    mesh: PolygonMesh,
    rows: NDArray[np.int64],
    materials: Sequence[Material],
    notes: Sequence[str],
) -> SceneFile:
    """``rows`` (parts of the mesh,): the row of ``materials`` of each."""
    mesh = mesh._replace(corner_uvs=None)  # not used: these may be wrong
    mesh = usable_polygons(file, mesh)
    triangles, owners = triangulate(mesh.positions, mesh.sizes, mesh.corners)
    parts = np.zeros(len(mesh.sizes), np.int64) if mesh.parts is None else mesh.parts
    vertices, triangles, _ = split_by_uv(mesh, triangles)
    printable = (
        "".join(c if c.isprintable() else "?" for c in note) for note in (*mesh.notes, *notes)
    )
    part = rows[parts[owners]].astype(np.int32)
    return SceneFile(vertices, triangles, part, tuple(materials), tuple(printable))


def _numbered(keys: Sequence[Hashable]) -> tuple[NDArray[np.int64], list[Any]]:
    """For each key its row among the different ones, and these in their order."""
    different = list(dict.fromkeys(keys))
    row = {key: number for number, key in enumerate(different)}
    return np.array([row[key] for key in keys], np.int64), different


# --- GLB ----------------------------------------------------------------------------------------


def _glb_materials(file: Path, glb: GlbFile) -> tuple[NDArray[np.int64], list[Material], list[str]]:
    """The row of each primitive, materials in the file's order and the default one last."""
    table = glb.materials if isinstance(glb.materials, list) else []
    used = np.unique(np.array(glb.mesh.parts, np.int64)).tolist()
    entries = {row: glb.primitives[row].get("material") for row in used}
    for entry in entries.values():
        known = type(entry) is int and 0 <= entry < len(table) and isinstance(table[entry], dict)
        if entry is not None and not known:
            expected = f"one of the file's {len(table)} materials, counted from 0"
            raise BadInput(file, "material of a primitive", f"{entry}"[:60], expected)
    different = sorted({entry for entry in entries.values() if entry is not None})
    if None in entries.values():
        different.append(None)
    rows = np.zeros(len(glb.primitives), np.int64)
    for primitive, entry in entries.items():
        rows[primitive] = different.index(entry)
    materials = [
        default_material() if entry is None else _glb_material(file, entry, table[entry])
        for entry in different
    ]
    textured = sum(_has_textures(table[entry]) for entry in different if entry is not None)
    things = f"{textured} material{'s have' if textured > 1 else ' has'} textures"
    notes = [f"{things}: they are ignored, and the factors alone count."] if textured else []
    return rows, materials, notes


def _glb_material(file: Path, number: int, entry: dict[str, Any]) -> Material:
    name = f"{entry.get('name') or f'material {number}'}"
    block = entry.get("pbrMetallicRoughness", {})
    if not isinstance(block, dict):
        found = f"{block}"[:60]
        raise BadInput(file, f"pbrMetallicRoughness of material '{name}'", found, "an object")

    def factor(key: str) -> float:
        value = block.get(key, 1.0)
        if not _is_fraction(value):
            field = f"{key} of material '{name}'"
            raise BadInput(file, field, f"{value}"[:60], "a number from 0 to 1")
        return float(value)

    colour = block.get("baseColorFactor", [1.0] * 4)
    if not (isinstance(colour, list) and len(colour) == 4 and all(map(_is_fraction, colour))):
        field = f"baseColorFactor of material '{name}'"
        raise BadInput(file, field, f"{colour}"[:60], "four numbers from 0 to 1")
    red, green, blue = (float(value) for value in colour[:3])
    metallic = factor("metallicFactor")
    matt = 1.0 - metallic
    return Material(
        name,
        (red * matt, green * matt, blue * matt),
        _DIELECTRIC + ((red + green + blue) / 3 - _DIELECTRIC) * metallic,
        _slope(factor("roughnessFactor")),
    )


def _is_fraction(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value <= 1


def _slope(roughness: float) -> float:
    """Perceptual roughness in [0, 1] to Beckmann's slope."""
    return max(roughness**2, LEAST_ROUGHNESS)


def _has_textures(entry: dict[str, Any]) -> bool:
    block = entry.get("pbrMetallicRoughness", {})
    return "baseColorTexture" in block or "metallicRoughnessTexture" in block


# --- OBJ ----------------------------------------------------------------------------------------


def _obj_materials(file: Path, obj: ObjFile) -> tuple[NDArray[np.int64], list[Material], list[str]]:
    """The row of each of the file's parts, materials in the order of their first polygons."""
    if not any(part.material for part in obj.parts):
        objects = any(part.object for part in obj.parts)
        rows, names = _numbered([part.object if objects else part.group for part in obj.parts])
        return rows, [default_material(name or "default") for name in names], []
    rows, names = _numbered([part.material for part in obj.parts])
    missing: dict[str, None] = {}  # in order, each once: a file may name one a million times
    there: dict[Path, None] = {}
    for line in dict.fromkeys(obj.libraries):
        libraries, absent = _libraries(file, line)
        missing |= dict.fromkeys(absent)
        there |= dict.fromkeys(libraries)
    known: dict[str, Material] = {"": default_material()}
    for library in there:
        known = _read_library(library) | known  # the first library that has a name is right
    unknown = [name for name in names if name not in known]
    if unknown and missing:
        notes = [
            f"{shortened(name)} is missing: its materials are the default grey." for name in missing
        ]
    else:
        notes = [
            f"'{shortened(name)}' is in no material library: it is the default grey."
            for name in unknown
        ]
    return rows, [known.get(name) or default_material(name) for name in names], notes


def _libraries(file: Path, line: str) -> tuple[list[Path], list[str]]:
    """The libraries that an ``mtllib`` line names (one, whose name may have spaces, or several
    apart by spaces), and the names of those that are not there."""
    whole = file_beside(file, line)
    if whole is not None:
        return [whole], []
    found = [(name, file_beside(file, name)) for name in line.split()]
    there = [library for _, library in found if library is not None]
    if not there:
        return [], [line]
    return there, [name for name, library in found if library is None]


def _read_library(file: Path) -> dict[str, Material]:
    """The materials of an MTL file by name; raises BadInput naming the line that is wrong."""
    text = whole_file(file, "a material library", _LARGEST_LIBRARY).decode("utf-8-sig", "replace")
    materials: dict[str, Material] = {}
    name: str | None = None
    with_roughness: set[str] = set()
    for row, line in enumerate(text.splitlines(), start=1):
        keyword, *words = line.split("#", 1)[0].split() or [""]
        if keyword == "newmtl":
            name = " ".join(line.split()[1:])
            materials[name] = default_material(name)
            with_roughness.discard(name)
        if keyword not in ("Kd", "Ks", "Ns", "Pr"):
            continue
        try:
            if name is None:
                raise ValueError("a line 'newmtl' before it")
            materials[name] = _with(materials[name], keyword, words, name in with_roughness)
        except ValueError as error:
            shown = line.strip()[:60]
            raise BadInput(file, f"line {row}", f"'{shown}'", str(error)) from None
        if keyword == "Pr":
            with_roughness.add(name)
    return materials


def _with(material: Material, keyword: str, words: list[str], has_roughness: bool) -> Material:
    """A material with what a line of its says; Ns changes nothing where there is a Pr."""
    if keyword == "Ns":
        exponent = _numbers(words, (1,), math.inf, "a finite number of at least 0")[0]
        slope = max(math.sqrt(2 / (exponent + 2)), LEAST_ROUGHNESS)
        return material if has_roughness else material._replace(roughness=slope)
    if keyword == "Pr":
        roughness = _numbers(words, (1,), 1.0, "a number from 0 to 1")[0]
        return material._replace(roughness=_slope(roughness))
    values = _numbers(words, (1, 3), 1.0, "1 or 3 numbers from 0 to 1")
    red, green, blue = values if len(values) == 3 else values * 3
    if keyword == "Ks":
        return material._replace(specular=(red + green + blue) / 3)
    return material._replace(albedo=(red, green, blue))


def _numbers(words: list[str], counts: tuple[int, ...], most: float, expected: str) -> list[float]:
    try:
        numbers = [number(word) for word in words]
    except ValueError:
        numbers = []
    within = all(math.isfinite(value) and 0 <= value <= most for value in numbers)
    if len(numbers) not in counts or not within:
        raise ValueError(expected)
    return numbers
