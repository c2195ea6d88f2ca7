"""glTF beyond the cases of `benchmarks.captures.gltf`, which run as tests, too."""

from __future__ import annotations

import base64
import io
import json
import shutil
import struct
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersGeometry import vtkCompositeDataGeometryFilter
from vtkmodules.vtkIOGeometry import vtkGLTFReader

from benchmarks.captures.case import Case, write_file
from benchmarks.captures.gltf_scenes import SCENES
from benchmarks.captures.gltf_writing import (
    PYRAMID,
    SIDES,
    GltfWriter,
    are_triangles,
    glb,
    one_mesh,
    pyramid_at,
)
from storage.readers.bad_input import BadInput
from storage.readers.companions import companions, travel_name
from storage.readers.gltf import GltfFile, read_gltf

PICTURE = b"\x89PNG no more than this"


def read(made: GltfWriter, folder: Path, name: str = "a.glb") -> GltfFile:
    made.write(folder / name)
    return read_gltf(folder / name)


def corners_of(found: GltfFile) -> Any:
    return found.mesh.positions[found.mesh.corners].reshape(-1, 3, 3)


# --- What materials need ------------------------------------------------------------------------


def test_parts_are_rows_of_all_primitives_also_of_meshes_that_are_not_drawn(tmp_path: Path) -> None:
    made = GltfWriter(scene=0, scenes=[{"nodes": [0]}])
    made.mesh()
    material = made.add("materials", name="red")
    first, second = made.primitive(triangles=SIDES[:2]), made.primitive(triangles=SIDES[2:])
    made.node(mesh=made.mesh(first, second | {"material": material}))
    found = read(made, tmp_path)
    assert len(found.primitives) == 3
    assert found.mesh.parts is not None
    assert found.mesh.parts.tolist() == [1, 1, 2, 2, 2, 2]
    assert found.primitives[2]["material"] == material
    assert found.document["materials"] == [{"name": "red"}]
    assert found.mesh.notes == ("1 mesh is not in the scene and left out.",)


def test_each_set_of_texture_coordinates_from_the_bottom(tmp_path: Path) -> None:
    made = GltfWriter()
    uvs = np.arange(10, dtype=np.float32).reshape(5, 2) / 16
    sets = {"TEXCOORD_0": made.accessor(uvs), "TEXCOORD_1": made.accessor(uvs[::-1])}
    made.node(mesh=made.mesh(made.primitive(**sets), made.primitive(TEXCOORD_1=sets["TEXCOORD_0"])))
    found = read(made, tmp_path)
    assert sorted(found.uvs) == [0, 1]
    assert found.mesh.corner_uvs is not None
    corners = SIDES.ravel()
    turned = np.column_stack([uvs[:, 0], 1 - uvs[:, 1]])
    np.testing.assert_allclose(found.uvs[0][:18], turned[corners])
    np.testing.assert_allclose(found.uvs[1][:18], turned[::-1][corners])
    np.testing.assert_allclose(found.uvs[1][18:], turned[corners])
    assert (found.uvs[0][18:] == 0).all()
    np.testing.assert_allclose(found.mesh.corner_uvs[:18], turned[corners])
    assert np.isnan(found.mesh.corner_uvs[18:]).all()


def test_images_lie_in_views_in_uris_and_beside(tmp_path: Path) -> None:
    made = one_mesh()
    made.add("images", bufferView=made.view(PICTURE), mimeType="image/png")
    made.add("images", uri="data:image/png;base64," + base64.b64encode(PICTURE * 20).decode())
    made.add("images", uri="my%20skin.png")
    made.add("images", uri="gone.png")
    made.add("images", name="none")
    (tmp_path / "my skin.png").write_bytes(PICTURE[::-1])
    found = read(made, tmp_path)
    assert found.image(0) == PICTURE
    assert found.image(1) == PICTURE * 20
    assert found.image(2) == PICTURE[::-1]
    for number, reason in ((3, "gone.png"), (4, "without a picture"), (5, "not in the file")):
        with pytest.raises(BadInput, match=reason):
            found.image(number)
    assert found.mesh.notes == ()


def test_colours_are_from_zero_to_one(tmp_path: Path) -> None:
    made = GltfWriter()
    colours = np.array([[-1, 0.5, 2], [np.nan, 0, 0], [0, 0, 0], [1, 1, 1], [0, 0, 0]], np.float32)
    made.node(mesh=made.mesh(made.primitive(COLOR_0=made.accessor(colours))))
    mesh = read(made, tmp_path).mesh
    assert mesh.notes == ("Colours of 2 vertices clamped to 0 to 1.",)
    read_colours = mesh.corner_colours
    assert read_colours is not None
    expected = np.clip(np.nan_to_num(colours, nan=1.0), 0, 1)[SIDES.ravel()]
    np.testing.assert_allclose(read_colours, np.column_stack([expected, np.ones(18)]))


# --- Companions ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["a.gltf", "a.glb"])
def test_what_a_gltf_names_travels_with_it(tmp_path: Path, name: str) -> None:
    home = tmp_path / "home"
    (home / "maps").mkdir(parents=True)
    made = one_mesh()
    made.document["buffers"] = [{"byteLength": len(made.binary), "uri": "the%20corners.bin"}]
    made.add("images", uri="maps/skin.png")
    made.add("images", uri="maps/gone.png")
    made.add("images", uri="data:image/png;base64,AAAA")
    (home / "the corners.bin").write_bytes(made.binary)
    (home / "maps" / "skin.png").write_bytes(PICTURE)
    text = made.json()
    (home / name).write_bytes(text if name == "a.gltf" else glb(text, None))
    found = companions(home / name)
    assert found == [home / "the corners.bin", home / "maps" / "skin.png"]
    away = tmp_path / "away"
    for companion in found:
        there = away / travel_name(home / name, companion)
        there.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(companion, there)
    shutil.copyfile(home / name, away / name)
    copy = read_gltf(away / name)
    assert are_triangles(corners_of(copy), pyramid_at())
    assert copy.image(0) == PICTURE


def test_a_broken_gltf_has_no_companions(tmp_path: Path) -> None:
    for text in ("", "{", "[]", '{"buffers": 3}', '{"images": [1, {"uri": 2}, {}]}'):
        (tmp_path / "a.gltf").write_text(text)
        assert companions(tmp_path / "a.gltf") == []


# --- A second reader ----------------------------------------------------------------------------

numbers = st.floats(-2, 2, width=32).map(lambda value: round(value, 2) or 0.5)
nodes = st.lists(
    st.tuples(
        st.integers(0, 9),
        st.lists(numbers, min_size=3, max_size=3),
        st.lists(numbers, min_size=4, max_size=4),
        st.lists(numbers, min_size=3, max_size=3),
    ),
    min_size=1,
    max_size=8,
)


@settings(deadline=None, max_examples=40)
@given(nodes)
def test_trees_of_nodes_are_placed_as_trimesh_places_them(
    tmp_path_factory: pytest.TempPathFactory, drawn: list[Any]
) -> None:
    made = GltfWriter()
    mesh = made.mesh()
    for row, (parent, translation, rotation, scale) in enumerate(drawn):
        unit = (np.array(rotation) / np.linalg.norm(rotation)).tolist()
        made.node(mesh=mesh, translation=translation, rotation=unit, scale=scale)
        if row:
            made.document["nodes"][parent % row].setdefault("children", []).append(row)
    made.document |= {"scene": 0, "scenes": [{"nodes": [0]}]}
    found = read(made, tmp_path_factory.mktemp("trees"))
    scene = trimesh.load_scene(io.BytesIO(made.glb()), file_type="glb", process=False)
    placed = []
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        corners = trimesh.transform_points(scene.geometry[name].vertices, matrix)
        mirrored = np.linalg.det(matrix[:3, :3]) < 0
        faces = scene.geometry[name].faces
        placed.append(corners[faces[:, ::-1] if mirrored else faces])
    order = np.lexsort(np.round(corners_of(found).mean(axis=1), 3).T)
    second = np.concatenate(placed)
    expected = np.lexsort(np.round(second.mean(axis=1), 3).T)
    assert len(order) == len(expected) == 6 * len(drawn)
    np.testing.assert_allclose(
        np.sort(corners_of(found).mean(axis=1), axis=0),
        np.sort(second.mean(axis=1), axis=0),
        atol=1e-3,
        rtol=1e-4,
    )
    volume = np.linalg.det(corners_of(found)).sum()
    np.testing.assert_allclose(volume, np.linalg.det(second).sum(), rtol=1e-3, atol=1e-2)


def test_shapes_that_trimesh_writes(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for row, shape in enumerate((trimesh.creation.icosphere(2), trimesh.creation.torus(2, 1))):
        matrix = trimesh.transformations.rotation_matrix(row + 0.3, [1, row, 2], [0, 1, 0])
        scene.add_geometry(shape, transform=matrix)
    scene.export(tmp_path / "a.glb")
    found = read_gltf(tmp_path / "a.glb")
    together = scene.to_mesh()
    np.testing.assert_allclose(
        [found.mesh.positions.min(axis=0), found.mesh.positions.max(axis=0)],
        together.bounds,
        atol=1e-5,
    )
    volume = np.linalg.det(corners_of(found)).sum() / 6
    assert volume == pytest.approx(together.volume, rel=1e-4)


VTK_LACKS = ("gltf_morph_sparse.glb", "gltf_skin_8.glb")  # targets without a view, JOINTS_1
POSED = [
    case
    for case in SCENES
    if case.kind in ("skins", "morph targets") and case.is_right and case.file not in VTK_LACKS
]


@pytest.mark.parametrize("case", POSED, ids=lambda case: case.file)
def test_skins_and_morph_targets_stand_as_vtk_has_them(tmp_path: Path, case: Case) -> None:
    """VTK turns no triangles of mirroring joints over: areas and places, not orientations."""
    path = write_file(case, tmp_path)
    reader = vtkGLTFReader()
    reader.SetFileName(str(path))
    reader.SetApplyDeformationsToGeometry(True)
    reader.Update()
    surface = vtkCompositeDataGeometryFilter()
    surface.SetInputConnection(reader.GetOutputPort())
    surface.Update()
    points = vtk_to_numpy(surface.GetOutput().GetPoints().GetData()).astype(float)
    triangles = vtk_to_numpy(surface.GetOutput().GetPolys().GetConnectivityArray()).reshape(-1, 3)
    second = points[triangles]
    found = corners_of(read_gltf(path))
    assert found.shape == second.shape
    assert are_triangles(np.sort(found, axis=1), np.sort(second, axis=1))


# --- Files that are wrong -----------------------------------------------------------------------


def test_a_glb_that_ends_anywhere_is_refused(tmp_path: Path) -> None:
    data = one_mesh().glb()
    for end in range(4, len(data), 7):
        (tmp_path / "a.glb").write_bytes(data[:end])
        with pytest.raises(BadInput):
            read_gltf(tmp_path / "a.glb")
        length = struct.pack("<I", end)
        if end > 12:  # also where its length agrees
            (tmp_path / "a.glb").write_bytes(data[:8] + length + data[12:end])
            with pytest.raises(BadInput):
                read_gltf(tmp_path / "a.glb")


def _draco_of_many(made: GltfWriter) -> None:
    head = b"DRACO\2\2\1\0\0\0" + b"\xff\xff\xff\xff\x0f" * 2  # sequential: 4e9 of each
    packed = {"bufferView": made.view(head + bytes(99)), "attributes": {"POSITION": 0}}
    primitive = made.document["meshes"][0]["primitives"][0]
    primitive["extensions"] = {"KHR_draco_mesh_compression": packed}


def _meshopt_of_many(made: GltfWriter) -> None:
    packed = {"buffer": 0, "byteLength": 40, "byteStride": 256, "count": 1 << 30}
    packed |= {"mode": "ATTRIBUTES"}
    made.document["bufferViews"][0]["extensions"] = {"EXT_meshopt_compression": packed}


def _many_targets(made: GltfWriter) -> None:
    zeros = made.add("accessors", componentType=5126, count=5, type="VEC3")
    made.document["accessors"][0] |= {"count": 5_000_000}
    del made.document["accessors"][0]["bufferView"]
    mesh = made.document["meshes"][0]
    mesh["primitives"][0]["targets"] = [{"POSITION": 0}] * 5000
    mesh["weights"] = [1.0] * 5000
    assert zeros


def _many_joints(made: GltfWriter) -> None:
    zeros = made.add("accessors", componentType=5126, count=1 << 40, type="MAT4")
    made.document["skins"] = [{"joints": [0], "inverseBindMatrices": zeros}]
    made.document["nodes"][0]["skin"] = 0


def _many_sets(made: GltfWriter) -> None:
    made.document["accessors"][1] |= {"count": 3_000_000}
    del made.document["accessors"][1]["bufferView"]
    uv = made.accessor(np.zeros((5, 2), np.float32))
    attributes = made.document["meshes"][0]["primitives"][0]["attributes"]
    attributes |= {f"TEXCOORD_{row}": uv for row in range(900)}


def _many_nodes(made: GltfWriter) -> None:
    made.document["nodes"] = [{}] * 600_000


@pytest.mark.parametrize(
    "change",
    [_draco_of_many, _meshopt_of_many, _many_targets, _many_joints, _many_sets, _many_nodes],
    ids=lambda change: change.__name__,
)
def test_what_would_take_too_much_is_refused_at_once(tmp_path: Path, change: Any) -> None:
    made = one_mesh()
    change(made)
    made.write(tmp_path / "a.glb")
    started = time.process_time()
    with pytest.raises(BadInput, match=r"MiB|triangles|at most"):
        read_gltf(tmp_path / "a.glb")
    assert time.process_time() - started < 3


def test_many_nodes_take_a_second(tmp_path: Path) -> None:
    made = one_mesh()
    made.document["nodes"] = [{"mesh": 0, "translation": [row, 0, 0]} for row in range(20_000)]
    made.document["scenes"] = [{"nodes": list(range(20_000))}]
    made.document["nodes"][0]["children"] = []
    started = time.process_time()
    found = read(made, tmp_path)
    assert time.process_time() - started < 2
    assert len(found.mesh.sizes) == 120_000


@pytest.mark.parametrize(
    ("place", "value", "reason"),
    [
        (("accessors", 0, "count"), -1, r"accessors\[0\]\.count is -1; expected a whole number"),
        (("accessors", 0, "componentType"), 5130, "expected one of 5120, 5121"),
        (("accessors", 0, "type"), "VEC9", "expected one of SCALAR"),
        (("accessors", 0, "type"), "VEC2", "of type VEC2; expected 3 numbers for POSITION"),
        (("accessors", 1, "componentType"), 5126, "of floats for indices; expected integers"),
        (("meshes", 0, "primitives", 0, "mode"), 7, "expected one of 0, 1, 2"),
        (("nodes", 0, "matrix"), [1, 2], r"nodes\[0\]\.matrix is \[1, 2\]; expected 16 numbers"),
        (("nodes", 0, "translation"), [0, 0, float("nan")], "expected a finite number"),
        (("nodes", 0, "children"), [7], "expected one of the 1 nodes"),
        (("scene",), 3, "scene is 3; expected one of the 1 scenes"),
        (("bufferViews", 0, "buffer"), 1, "expected one of the 1 buffers"),
        (("bufferViews", 0, "byteOffset"), 10**30, "expected a whole number"),
        (("buffers",), [{"byteLength": 9, "uri": "data:nothing"}], "a data URI with no data"),
        (("asset",), {}, "glTF version is missing"),
        (("meshes", 0, "primitives", 0, "attributes"), None, "attributes is missing"),
    ],
)
def test_properties_that_are_wrong_are_named(
    tmp_path: Path, place: tuple[Any, ...], value: Any, reason: str
) -> None:
    made = one_mesh()
    holder: Any = json.loads(made.json())
    top = holder
    for key in place[:-1]:
        holder = holder[key]
    holder[place[-1]] = value
    (tmp_path / "a.glb").write_bytes(glb(json.dumps(top).encode(), made.binary))
    with pytest.raises(BadInput, match=reason):
        read_gltf(tmp_path / "a.glb")


def test_attributes_of_other_counts_are_refused(tmp_path: Path) -> None:
    made = GltfWriter()
    uv = made.accessor(np.zeros((4, 2), np.float32))
    made.node(mesh=made.mesh(made.primitive(PYRAMID, TEXCOORD_0=uv)))
    with pytest.raises(BadInput, match="4 values of TEXCOORD_0 for 5 vertices"):
        read(made, tmp_path)
