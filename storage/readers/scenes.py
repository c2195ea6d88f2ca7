"""Scenes of several objects, with a material each: PLY, OBJ, STL and glTF."""

from __future__ import annotations

import re
from collections.abc import Hashable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import shortened
from storage.readers.companions import companions
from storage.readers.gltf import GltfFile, read_gltf
from storage.readers.materials.description import Description, Map, grey
from storage.readers.materials.finishing import colour_of, finished, placed_uvs
from storage.readers.materials.gltf_materials import GltfMaterials
from storage.readers.materials.material import Colour, Material, default_material
from storage.readers.materials.mtl import read_library
from storage.readers.meshes import mesh_format, read_polygons
from storage.readers.obj_files import ObjFile, read_obj
from storage.readers.opening import whole_file
from storage.readers.polygons import PolygonMesh, triangulate
from storage.readers.references import file_beside
from storage.readers.usable_polygons import usable_polygons

__all__ = ["Material", "SceneFile", "check_scene", "default_material", "read_scene"]

_NOT_USED = re.compile(r"\d+ textures? not used")
"""What the reader of PLY says of the texture that is used here."""
_LARGEST_TEXTURE = 256 << 20  # bytes


class SceneFile(NamedTuple):
    """Triangles and their materials.

    vertices: (V, 3) float64; each belongs to a triangle.
    triangles: (F, 3) int64.
    part: (F,) int32, the row of ``materials`` of each triangle.
    materials: those that triangles have, in the order of the file.
    notes: what did not go as the file says, one sentence each.
    uvs: (F, 3, 2, 2) float32, of each corner the two texture coordinates that textures may lie by,
        v from the bottom; and colours: (F, 3, 3) float32, linear. Both are None where no material
        varies.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    part: NDArray[np.int32]
    materials: tuple[Material, ...]
    notes: tuple[str, ...]
    uvs: NDArray[np.float32] | None = None
    colours: NDArray[np.float32] | None = None


class _Described(NamedTuple):
    """A file's polygons. ``rows`` (parts of the mesh,): the row of ``descriptions`` of each;
    ``uvs``: sets of texture coordinates of the mesh's corners (corners, 2), by number."""

    mesh: PolygonMesh
    rows: NDArray[np.int64]
    descriptions: Sequence[Description]
    uvs: dict[int, NDArray[np.float64]]
    notes: Sequence[str]


def read_scene(path: str | PathLike[str]) -> SceneFile:
    """Read a PLY, OBJ, STL or glTF file as triangles with one material for each part.

    Polygons are cut into triangles, transforms of a glTF's nodes are applied (mirrored ones turn
    their triangles over), vertices without a face are left out. Degenerate faces stay: repeated
    corners and faces without area are for `pipelines.geometry.repair`.

    glTF: a part is what has one material. The diffuse albedo is the base colour, linear already,
    times (1 - metalness); F0 goes from that of what is no metal to the base colour with the
    metalness; m is the roughness squared, as glTF 2.0 (appendix B) has the slope of its GGX lobe,
    which Beckmann's is by convention. KHR_materials_ior, _specular, _pbrSpecularGlossiness and
    KHR_texture_transform are read.

    OBJ: a part is what has one ``usemtl``, or in a file without any an object (``o``), or in one
    without these a group (``g``), with the default material. Kd is the linear albedo, Ks is F0; m
    is ``Pr`` squared where there is one, else sqrt(2 / (Ns + 2)), the Beckmann lobe like Phong's
    of the exponent Ns (Walter et al., "Microfacet models for refraction", 2007). What a material
    leaves out is as in the default one. A library that is missing, and a name that is in none,
    make the default material and a note. See `materials.mtl`.

    PLY, STL, and a glTF's primitives without a material: one part with the default material; with
    colours of vertices or the texture that a PLY names, matt and of these.

    Textures of the base colour, of metalness and roughness and of normals are read and averaged
    down where they are many (`materials.pictures`); colours of corners multiply the base colour.
    A texture that is missing or damaged makes a note, and the numbers alone count.

    Raises BadInput as `read_mesh` does; for a line of a material library with numbers that are
    missing or no numbers, naming the library; and for factors of a glTF's material that are.
    """
    file = Path(path)
    return _scene(file, _described(file))


def check_scene(path: str | PathLike[str]) -> None:
    """Raise BadInput as `read_scene`, without looking into textures: these refuse nothing."""
    file = Path(path)
    usable_polygons(file, _described(file).mesh)


def _described(file: Path) -> _Described:
    found = mesh_format(file)
    if found == "gltf":
        return _of_gltf(file, read_gltf(file))
    if found == "obj":
        return _of_obj(file, read_obj(file))
    return _of_one_part(file, read_polygons(file))


def _scene(file: Path, described: _Described) -> SceneFile:
    given = described.mesh
    # Which of the corners are used is carried through as a colour would be.
    numbered = np.arange(len(given.corners), dtype=np.float64)[:, None]
    mesh = usable_polygons(file, given._replace(corner_uvs=None, corner_colours=numbered))
    assert mesh.corner_colours is not None
    kept = mesh.corner_colours[:, 0].astype(np.int64)
    triangles, owners = triangulate(mesh.positions, mesh.sizes, mesh.corners)
    parts = np.zeros(len(mesh.sizes), np.int64) if mesh.parts is None else mesh.parts
    part = described.rows[parts[owners]].astype(np.int32)
    corners = kept[triangles]

    uvs = {number: values[corners] for number, values in described.uvs.items()}
    colours = None
    if given.corner_colours is not None:
        colours = given.corner_colours[corners][..., :3].astype(np.float32)
    means = [_mean_colour(colours, part == row) for row in range(len(described.descriptions))]
    finish = finished(described.descriptions, means, set(uvs))
    used, vertices = np.unique(mesh.corners, return_inverse=True)
    notes = (*mesh.notes, *described.notes, *finish.notes)
    printable = tuple("".join(c if c.isprintable() else "?" for c in note) for note in notes)
    varies = any(material.varying is not None for material in finish.materials)
    if varies and colours is None:
        colours = np.ones((*part.shape, 3, 3), np.float32)
    return SceneFile(
        mesh.positions[used],
        vertices.reshape(-1)[triangles],
        part,
        finish.materials,
        printable,
        placed_uvs(uvs, part, finish.placings) if varies else None,
        colours if varies else None,
    )


def _mean_colour(colours: NDArray[np.float32] | None, chosen: NDArray[np.bool_]) -> Colour | None:
    """Of the corners (F, 3, 3) of some triangles (F,); None where all are white."""
    if colours is None or (colours[chosen] == 1).all():
        return None
    return colour_of(colours[chosen].mean(axis=(0, 1), dtype=np.float64))


def _numbered(keys: Sequence[Hashable]) -> tuple[NDArray[np.int64], list[Any]]:
    """For each key its row among the different ones, and these in their order."""
    different = list(dict.fromkeys(keys))
    row = {key: number for number, key in enumerate(different)}
    return np.array([row[key] for key in keys], np.int64), different


def _matt(description: Description, mesh: PolygonMesh) -> Description:
    """The default material, of colours where there are any: these are the albedo themselves."""
    has_colours = mesh.corner_colours is not None or description.colour is not None
    return description._replace(base=(1.0, 1.0, 1.0)) if has_colours else description


# --- PLY, STL -----------------------------------------------------------------------------------


def _of_one_part(file: Path, mesh: PolygonMesh) -> _Described:
    notes = []
    description = grey("default")
    textures = companions(file)
    if textures and mesh.corner_uvs is not None:
        first = textures[0]
        mesh = mesh._replace(notes=tuple(note for note in mesh.notes if not _NOT_USED.match(note)))
        description = description._replace(
            colour=Map(first, first.name, lambda: whole_file(first, "a picture", _LARGEST_TEXTURE))
        )
        if len(textures) > 1:
            names = ", ".join(shortened(texture.name) for texture in textures[1:4])
            notes.append(f"Of {len(textures)} textures the first is used, not {names}.")
    description = _matt(description, mesh)
    uvs = {} if mesh.corner_uvs is None else {0: mesh.corner_uvs}
    return _Described(mesh, np.zeros(1, np.int64), [description], uvs, notes)


# --- glTF ---------------------------------------------------------------------------------------


def _of_gltf(file: Path, gltf: GltfFile) -> _Described:
    """Materials in the file's order and the default one last."""
    reader = GltfMaterials(file, gltf.document, gltf.image)
    used = np.unique(np.array(gltf.mesh.parts, np.int64)).tolist()
    entries = {row: reader.check(gltf.primitives[row].get("material")) for row in used}
    different: list[int | None] = [*sorted({row for row in entries.values() if row is not None})]
    if None in entries.values():
        different.append(None)
    rows = np.zeros(len(gltf.primitives), np.int64)
    for primitive, entry in entries.items():
        rows[primitive] = different.index(entry)
    descriptions = [
        _matt(grey("default"), gltf.mesh) if row is None else reader.description(row)
        for row in different
    ]
    return _Described(gltf.mesh, rows, descriptions, gltf.uvs, reader.notes)


# --- OBJ ----------------------------------------------------------------------------------------


def _of_obj(file: Path, obj: ObjFile) -> _Described:
    """Materials in the order of their first polygons."""
    uvs = {} if obj.mesh.corner_uvs is None else {0: obj.mesh.corner_uvs}
    if not any(part.material for part in obj.parts):
        objects = any(part.object for part in obj.parts)
        rows, names = _numbered([part.object if objects else part.group for part in obj.parts])
        descriptions = [_matt(grey(name or "default"), obj.mesh) for name in names]
        return _Described(obj.mesh, rows, descriptions, uvs, ())
    rows, names = _numbered([part.material for part in obj.parts])
    missing: dict[str, None] = {}  # in order, each once: a file may name one a million times
    there: dict[Path, None] = {}
    for line in dict.fromkeys(obj.libraries):
        libraries, absent = _libraries(file, line)
        missing |= dict.fromkeys(absent)
        there |= dict.fromkeys(libraries)
    known: dict[str, Description] = {}
    said: dict[str, tuple[str, ...]] = {}
    for library in there:
        found, notes_of = read_library(library)
        said = {name: notes for name, notes in notes_of.items() if name not in known} | said
        known = found | known  # the first library that has a name is right
    if "" in names:
        known.setdefault("", grey("default"))
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
    notes += [note for name in names for note in said.get(name, ())]
    descriptions = [known.get(name) or _matt(grey(name), obj.mesh) for name in names]
    return _Described(obj.mesh, rows, descriptions, uvs, notes)


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
