"""Scenes written by hand and by trimesh, and their materials from the formats' own numbers."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from storage.readers import BadInput
from storage.readers.meshes import read_mesh
from storage.readers.scenes import Material, SceneFile, default_material, read_scene
from tests.storage.readers.test_meshes import REFUSED, glb_bytes, one_sentence, ply_text

GREY = default_material()

TWO_SQUARES = """
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 7
v 1 0 7
v 1 1 7
v 0 1 7
"""
WOOD = "newmtl wood\nKd 0.5 0.25 0.125\n"
GOLD = "newmtl gold\nKd 0 0 0\nKs 0.75 0.5 0.25\nNs 198\n"


def heights(scene: SceneFile) -> dict[str, float]:
    """The z of the triangles with each material, by its name, of scenes that lie flat."""
    z = scene.vertices[scene.triangles][..., 2]
    return {m.name: np.unique(z[scene.part == k]).item() for k, m in enumerate(scene.materials)}


def assert_as_documented(scene: SceneFile) -> None:
    assert scene.vertices.dtype == np.float64
    assert scene.triangles.dtype == np.int64
    assert scene.part.dtype == np.int32
    assert scene.part.shape == scene.triangles.shape[:1]
    np.testing.assert_array_equal(np.unique(scene.triangles), np.arange(len(scene.vertices)))
    np.testing.assert_array_equal(np.unique(scene.part), np.arange(len(scene.materials)))
    for material in scene.materials:
        assert all(0 <= value <= 1 for value in (*material.albedo, material.specular))
        assert 0 < material.roughness <= 1
    for note in scene.notes:
        assert note.endswith(".")
        assert note.isprintable()


def assert_alike(materials: tuple[Material, ...], *expected: Material) -> None:
    assert [material.name for material in materials] == [material.name for material in expected]
    for found, right in zip(materials, expected, strict=True):
        np.testing.assert_allclose(
            [*found.albedo, found.specular, found.roughness],
            [*right.albedo, right.specular, right.roughness],
        )


# --- PLY ----------------------------------------------------------------------------------------


def test_a_ply_is_one_part(tmp_path: Path) -> None:
    (tmp_path / "square.ply").write_text(ply_text(("s", "t")))
    scene = read_scene(tmp_path / "square.ply")
    assert_as_documented(scene)
    assert scene.materials == (Material("default", (0.6, 0.6, 0.6), 0.0, 0.3),)
    assert scene.notes == ()
    mesh = read_mesh(tmp_path / "square.ply")
    np.testing.assert_array_equal(scene.vertices[scene.triangles], mesh.vertices[mesh.triangles])


def test_faces_of_repeated_corners_are_left_out(tmp_path: Path) -> None:
    (tmp_path / "flat.ply").write_text(ply_text(None, "3 0 1 1\n4 0 0 0 1\n3 0 1 2\n"))
    scene = read_scene(tmp_path / "flat.ply")
    assert len(scene.triangles) == 1
    np.testing.assert_array_equal(scene.vertices[:, 2], 5)
    assert "2 faces of less than three corners left out." in scene.notes


def test_texture_coordinates_do_not_matter(tmp_path: Path) -> None:
    """Neither that they split vertices, nor that some are no numbers."""
    text = TWO_SQUARES + "vt 0 0\nvt nan 0\nf 1/1 2/1 3/2\nf 1/2 3/1 4/1\n"
    (tmp_path / "seam.obj").write_text(text)
    assert len(read_scene(tmp_path / "seam.obj").vertices) == 4


# --- OBJ ----------------------------------------------------------------------------------------


def test_obj_with_two_materials(tmp_path: Path) -> None:
    """The second one comes back after the first, and polygons of several sizes keep theirs."""
    faces = "usemtl gold\nf 5 6 7 8\nusemtl wood\nf 1 2 3\nusemtl gold\nf 5 6 7\n"
    (tmp_path / "two.obj").write_text("mtllib two.mtl\no both\n" + TWO_SQUARES + faces)
    (tmp_path / "two.mtl").write_text("# by hand\n" + WOOD + "\n" + GOLD)
    scene = read_scene(tmp_path / "two.obj")
    assert_as_documented(scene)
    assert_alike(
        scene.materials,
        Material("gold", (0.0, 0.0, 0.0), 0.5, 0.1),  # sqrt(2 / 200)
        Material("wood", (0.5, 0.25, 0.125), GREY.specular, GREY.roughness),
    )
    assert scene.part.tolist() == [0, 0, 1, 0]
    assert heights(scene) == {"gold": 7, "wood": 0}
    assert scene.notes == ()


@pytest.mark.parametrize(
    ("lines", "albedo", "specular", "roughness"),
    [
        ("", (0.6, 0.6, 0.6), 0.0, 0.3),
        ("Kd 0.25", (0.25, 0.25, 0.25), 0.0, 0.3),
        ("Ks 0.04 0.05 0.06", (0.6, 0.6, 0.6), 0.05, 0.3),
        ("Ns 0", (0.6, 0.6, 0.6), 0.0, 1.0),
        ("Ns 6 # about", (0.6, 0.6, 0.6), 0.0, 0.5),
        ("Ns 1e30", (0.6, 0.6, 0.6), 0.0, 1e-3),
        ("Pr 0.5", (0.6, 0.6, 0.6), 0.0, 0.25),
        ("Pr 0", (0.6, 0.6, 0.6), 0.0, 1e-3),
        ("Pr 0.5\nNs 6", (0.6, 0.6, 0.6), 0.0, 0.25),
        ("Ns 6\nPr 0.5", (0.6, 0.6, 0.6), 0.0, 0.25),
        ("Kd 1 1 1\nKa 9 9 9\nillum 2\nd 0.5", (1.0, 1.0, 1.0), 0.0, 0.3),
    ],
)
def test_what_an_mtl_says(
    tmp_path: Path,
    lines: str,
    albedo: tuple[float, float, float],
    specular: float,
    roughness: float,
) -> None:
    (tmp_path / "a.obj").write_text(TWO_SQUARES + "mtllib a.mtl\nusemtl a\nf 1 2 3\n")
    (tmp_path / "a.mtl").write_text(f"\ufeffnewmtl a\n{lines}\nnewmtl b\nKd 0 0 0\nKs 1 1 1\n")
    materials = read_scene(tmp_path / "a.obj").materials
    assert_alike(materials, Material("a", albedo, specular, roughness))


@settings(max_examples=50, deadline=None)
@given(st.floats(0, 1e4))
def test_the_exponent_gives_a_lobe_as_wide(exponent: float) -> None:
    """Beckmann's exp(-tan² / m²) and Phong's cos^(Ns + 2) agree in their second order."""
    from storage.readers.materials.mtl import _Statements

    statements = _Statements(Path("a.mtl"), "a")
    statements.add("ns", f"{exponent!r}")
    slope = statements.description().roughness ** 2
    angle = 1e-3 * slope
    beckmann = -((np.tan(angle) / slope) ** 2)
    phong = (exponent + 2) * np.log(np.cos(angle))
    assert beckmann == pytest.approx(phong, rel=1e-3)


@pytest.mark.parametrize(
    ("names", "parts"),
    [
        ("o pot\n{a}o lid\n{b}", {"pot": 0, "lid": 7}),
        ("o pot\ng default\n{a}o lid\ng default\n{b}", {"pot": 0, "lid": 7}),
        ("g pot\n{a}g lid and knob\n{b}", {"pot": 0, "lid and knob": 7}),
        ("{a}g lid\n{b}", {"default": 0, "lid": 7}),
        ("{a}o lid\n{b}", {"default": 0, "lid": 7}),
    ],
)
def test_objects_without_materials(tmp_path: Path, names: str, parts: dict[str, float]) -> None:
    text = TWO_SQUARES + names.format(a="f 1 2 3 4\n", b="f 5 6 7 8\n")
    (tmp_path / "pot.obj").write_text("mtllib none.mtl\n" + text)
    scene = read_scene(tmp_path / "pot.obj")
    assert_as_documented(scene)
    assert heights(scene) == parts
    assert [material._replace(name="default") for material in scene.materials] == [GREY, GREY]
    assert scene.notes == ()


def test_a_missing_library_does_not_lose_the_mesh(tmp_path: Path) -> None:
    text = "mtllib teapot.mtl\n" + TWO_SQUARES
    (tmp_path / "teapot.obj").write_text(text + "usemtl a\nf 1 2 3\nusemtl b\nf 5 6 7 8\n")
    scene = read_scene(tmp_path / "teapot.obj")
    assert_as_documented(scene)
    assert scene.materials == (default_material("a"), default_material("b"))
    assert scene.part.tolist() == [0, 1, 1]
    assert scene.notes == ("teapot.mtl is missing: its materials are the default grey.",)


def test_names_that_no_library_has(tmp_path: Path) -> None:
    faces = "f 1 2 3\nusemtl stone\nf 1 3 4\nusemtl wood\nf 5 6 7 8\n"
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n" + TWO_SQUARES + faces)
    (tmp_path / "a.mtl").write_text(WOOD)
    scene = read_scene(tmp_path / "a.obj")
    assert [material.name for material in scene.materials] == ["default", "stone", "wood"]
    assert scene.materials[2].albedo == (0.5, 0.25, 0.125)
    assert scene.notes == ("'stone' is in no material library: it is the default grey.",)


@pytest.mark.parametrize(
    ("line", "file", "name"),
    [
        ("two.mtl", "two.mtl", "wood"),
        ("missing.mtl two.mtl", "two.mtl", "wood"),
        ("my own library.mtl", "my own library.mtl", "wood"),
        ("folder/two.mtl", "folder/two.mtl", "wood"),
        ("C:\\scenes\\two.mtl", "two.mtl", "wood"),
        ("two.mtl", "two.mtl", "Material #25"),
    ],
)
def test_where_libraries_are(tmp_path: Path, line: str, file: str, name: str) -> None:
    (tmp_path / file).parent.mkdir(exist_ok=True)
    (tmp_path / file).write_text(WOOD.replace("wood", name) + "newmtl Material #26\nKd 0 0 0\n")
    text = f"mtllib {line}\n" + TWO_SQUARES + f"usemtl {name}\nf 1 2 3\n"
    (tmp_path / "a.obj").write_text(text)
    scene = read_scene(tmp_path / "a.obj")
    assert scene.materials == (GREY._replace(name=name, albedo=(0.5, 0.25, 0.125)),)
    assert scene.notes == ()


def test_names_do_not_break_lines(tmp_path: Path) -> None:
    text = "mtllib " + "x" * 300 + "\a.mtl\n" + TWO_SQUARES + "usemtl a\nf 1 2 3\n"
    (tmp_path / "a.obj").write_text(text)
    assert_as_documented(read_scene(tmp_path / "a.obj"))


# --- GLB ----------------------------------------------------------------------------------------

COPPER = {"baseColorFactor": [0.9, 0.6, 0.3, 1.0], "metallicFactor": 1.0, "roughnessFactor": 0.5}
PAINT = {"baseColorFactor": [0.5, 0.1, 0.0, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0}


def glb(materials: list[Any], *used: int | None, **extra: Any) -> bytes:
    """The square of test_meshes for each material of ``used``, at z = 5, 15, 25 and so on."""
    nodes = [{"mesh": row, "translation": [0, 0, 10 * row]} for row in range(len(used))]
    primitives = [
        {"attributes": {"POSITION": 1}, "indices": 0}
        | ({} if material is None else {"material": material})
        for material in used
    ]
    meshes = [{"primitives": [primitive]} for primitive in primitives]
    return glb_bytes(nodes, meshes=meshes, materials=materials, **extra)


def named(name: str, block: dict[str, Any]) -> dict[str, Any]:
    return {"name": name, "pbrMetallicRoughness": block}


def test_glb_with_several_materials(tmp_path: Path) -> None:
    materials = [named("copper", COPPER), {}, named("unused", {}), named("paint", PAINT)]
    (tmp_path / "a.glb").write_bytes(glb(materials, 3, None, 0, 3, 1))
    scene = read_scene(tmp_path / "a.glb")
    assert_as_documented(scene)
    assert_alike(
        scene.materials,
        Material("copper", (0.0, 0.0, 0.0), 0.6, 0.25),
        Material("material 1", (0.0, 0.0, 0.0), 1.0, 1.0),  # glTF's defaults: a rough metal
        Material("paint", (0.5, 0.1, 0.0), 0.04, 1.0),
        GREY,
    )
    z = scene.vertices[scene.triangles][:, 0, 2]
    expected = {5: 2, 15: 3, 25: 0, 35: 2, 45: 1}
    assert [expected[int(height)] for height in z] == scene.part.tolist()
    assert scene.notes == ()


def test_half_a_metal(tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(glb([named("a", COPPER | {"metallicFactor": 0.5})], 0))
    (material,) = read_scene(tmp_path / "a.glb").materials
    assert material.albedo == pytest.approx((0.45, 0.3, 0.15))
    assert material.specular == pytest.approx((0.04 + 0.6) / 2)


def test_a_glb_without_materials(tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(glb_bytes([{"mesh": 0}]))
    scene = read_scene(tmp_path / "a.glb")
    assert_as_documented(scene)
    assert scene.materials == (GREY,)


def test_textures_that_are_not_there_are_noted(tmp_path: Path) -> None:
    block = PAINT | {"baseColorTexture": {"index": 0}}
    (tmp_path / "a.glb").write_bytes(glb([named("a", block)], 0))
    scene = read_scene(tmp_path / "a.glb")
    assert scene.notes == (
        "Material 'a': its baseColorTexture is left out: the file has no such image.",
    )
    assert_alike(scene.materials, Material("a", (0.5, 0.1, 0.0), 0.04, 1.0))


def material_of_trimesh(name: str, block: dict[str, Any]) -> Any:
    return trimesh.visual.TextureVisuals(
        uv=np.zeros((8, 2)), material=trimesh.visual.material.PBRMaterial(name=name, **block)
    )


def test_glb_by_trimesh(tmp_path: Path) -> None:
    """Boxes placed by nodes, the second one mirrored: moved, whole, and not inside out."""
    scene = trimesh.Scene()
    mirror = np.diag([-2.0, 1.0, 1.0, 1.0])
    mirror[:3, 3] = [10, 0, 0]
    for name, block, matrix in (("copper", COPPER, np.eye(4)), ("paint", PAINT, mirror)):
        box = trimesh.creation.box()
        box.visual = material_of_trimesh(name, block)
        scene.add_geometry(box, geom_name=name, node_name=name, transform=matrix)
    scene.export(tmp_path / "boxes.glb")
    read = read_scene(tmp_path / "boxes.glb")
    assert_as_documented(read)
    data = (tmp_path / "boxes.glb").read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    written = {
        entry["name"]: entry["pbrMetallicRoughness"]
        for entry in json.loads(data[20 : 20 + length])["materials"]
    }
    assert {material.name for material in read.materials} == {"copper", "paint"}
    for row, material in enumerate(read.materials):
        block = written[material.name]
        metal = material.name == "copper"
        colour = np.array(block["baseColorFactor"][:3])
        np.testing.assert_allclose(material.albedo, colour * (not metal))
        assert material.specular == pytest.approx(colour.mean() if metal else 0.04)
        assert material.roughness == pytest.approx(block["roughnessFactor"] ** 2)
        corners = read.vertices[read.triangles[read.part == row]]
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        np.testing.assert_allclose((low + high) / 2, [0 if metal else 10, 0, 0], atol=1e-6)
        inside = corners - (low + high) / 2
        assert np.linalg.det(inside).sum() / 6 == pytest.approx(1 if metal else 2)


def test_colours_of_vertices(tmp_path: Path) -> None:
    """They are the albedo of what has no material."""
    box = trimesh.creation.box()
    box.visual.vertex_colors = np.full((8, 4), 200, np.uint8)
    box.export(tmp_path / "box.glb")
    scene = read_scene(tmp_path / "box.glb")
    (material,) = scene.materials
    assert scene.colours is not None
    np.testing.assert_allclose(scene.colours, 200 / 255, atol=1e-6)  # which glTF has linear
    assert material.albedo == pytest.approx((200 / 255,) * 3)
    assert material.varying is not None
    assert material.varying.base == (1, 1, 1)
    assert len(scene.triangles) == len(read_mesh(tmp_path / "box.glb").triangles) == 12


def test_obj_by_trimesh(tmp_path: Path) -> None:
    names = ("red", "green")
    boxes = [trimesh.creation.box().apply_translation([5 * row, 0, 0]) for row in range(2)]
    for box, name, colour in zip(boxes, names, ([255, 0, 0], [0, 255, 0]), strict=True):
        box.visual = trimesh.visual.TextureVisuals(
            uv=np.zeros((8, 2)),
            material=trimesh.visual.material.SimpleMaterial(name=name, diffuse=colour),
        )
    trimesh.Scene(boxes).export(tmp_path / "boxes.obj")
    scene = read_scene(tmp_path / "boxes.obj")
    assert_as_documented(scene)
    assert len(scene.triangles) == 24
    for row, material in enumerate(scene.materials):
        x = scene.vertices[scene.triangles[scene.part == row]][..., 0]
        place = names.index(material.name)
        assert (x.min(), x.max()) == (5 * place - 0.5, 5 * place + 0.5)
        assert material.albedo == ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))[place]


# --- What is refused ----------------------------------------------------------------------------

MESHES = [
    row
    for row in REFUSED
    if "degenerate" not in row[1]
    and "texture coordinate of" not in row[1]
    and "and so are" not in row[1]
]


@pytest.mark.parametrize(("name", "reason", "write"), MESHES, ids=[row[1][:40] for row in MESHES])
def test_refusals_are_those_of_meshes(
    tmp_path: Path, name: str, reason: str, write: Callable[[Path], Any]
) -> None:
    write(tmp_path / name)
    with pytest.raises(BadInput) as caught:
        read_scene(tmp_path / name)
    assert reason in one_sentence(caught.value, name)


def test_truncated_files_are_refused(tmp_path: Path) -> None:
    data = glb([named("copper", COPPER)], 0)
    for end in range(5, len(data) - 1, 7):
        (tmp_path / "a.glb").write_bytes(data[:end])
        with pytest.raises(BadInput, match="truncated"):
            read_scene(tmp_path / "a.glb")


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("Kd 0.5 red 0.5", "1 or 3 numbers from 0 to 1"),
        ("Kd 0.5 0.5", "1 or 3 numbers from 0 to 1"),
        ("Kd", "1 or 3 numbers from 0 to 1"),
        ("Ks 0 0 nan", "1 or 3 numbers from 0 to 1"),
        ("Ns inf", "a finite number of at least 0"),
        ("Ns 1 2", "a finite number of at least 0"),
        ("Pr x", "a number from 0 to 1"),
    ],
)
def test_lines_of_a_library_that_are_wrong(tmp_path: Path, line: str, expected: str) -> None:
    (tmp_path / "a.obj").write_text(TWO_SQUARES + "mtllib a.mtl\nusemtl wood\nf 1 2 3\n")
    (tmp_path / "a.mtl").write_text(f"# one\nnewmtl other\n{line}\n")
    with pytest.raises(BadInput) as caught:
        read_scene(tmp_path / "a.obj")
    assert one_sentence(caught.value, "a.mtl") == f"a.mtl: line 3 is '{line}'; expected {expected}."
    assert caught.value.file == str(tmp_path / "a.mtl")


@pytest.mark.parametrize(
    ("line", "right", "note"),
    [
        ("Kd 1.000001 0.5 -1e-7", {"albedo": (1, 0.5, 0)}, None),
        ("Kd 0.5 0.5 1.5", {"albedo": (0.5, 0.5, 1)}, "Kd of material 'wood' is 0.5 0.5 1.5: held"),
        ("Kd 255 128 0", {"albedo": (1, 128 / 255, 0)}, "its kd is read as 0 to 255"),
        ("Kd spectral oak.rfl 1", {}, "its kd is a spectrum in a file: not used"),
        ("Kd xyz 0.47523 0.5 0.5444", {"albedo": (0.5, 0.5, 0.5)}, "converted from CIE XYZ"),
        ("Ks -0.1", {"specular": 0}, "Ks of material 'wood' is -0.1 -0.1 -0.1: held"),
        ("Ns -1", {"roughness": 1}, "its Ns is -1: read as 0"),
        ("Pr 2", {"roughness": 1}, "Pr of material 'wood' is 2: held within 0 and 1."),
        ("Pm 0.5\nKd 0.5", {"albedo": (0.25,) * 3, "specular": 0.27}, None),
        ("Ks 0.5\nillum 1", {"specular": 0}, None),
        ("Ke 1 1 1", {}, "it emits light, which is not used"),
        ("d 0.25", {}, "it is transparent and drawn opaque"),
        ("Tr 1\nd 1", {}, None),
        ("illum 0", {}, "it is to be shown without light"),
        ("map_Kd missing.png", {}, "its texture missing.png is missing"),
    ],
)
def test_lines_that_are_mended(
    tmp_path: Path, line: str, right: dict[str, Any], note: str | None
) -> None:
    (tmp_path / "a.obj").write_text(TWO_SQUARES + "mtllib a.mtl\nusemtl wood\nf 1 2 3\n")
    (tmp_path / "a.mtl").write_text(f"newmtl wood\n{line}\n")
    scene = read_scene(tmp_path / "a.obj")
    (material,) = scene.materials
    for field, value in right.items():
        assert getattr(material, field) == pytest.approx(value, abs=2e-4)
    assert bool(scene.notes) == (note is not None)
    assert note is None or note in scene.notes[0]


def test_factors_outside_are_held(tmp_path: Path) -> None:
    block = {"roughnessFactor": 1.5, "metallicFactor": 0.0, "baseColorFactor": [0, 0, -1, 1]}
    (tmp_path / "a.glb").write_bytes(glb([named("a", block)], 0))
    scene = read_scene(tmp_path / "a.glb")
    assert_alike(scene.materials, Material("a", (0.0, 0.0, 0.0), 0.04, 1.0))
    assert any("roughnessFactor of material 'a' is 1.5: held" in note for note in scene.notes)


def test_a_line_before_all_materials(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(TWO_SQUARES + "mtllib a.mtl\nusemtl wood\nf 1 2 3\n")
    (tmp_path / "a.mtl").write_text("Kd 1 1 1\n" + WOOD)
    with pytest.raises(BadInput, match=re.escape("a.mtl: line 1 is 'Kd 1 1 1'; expected a line")):
        read_scene(tmp_path / "a.obj")


@pytest.mark.parametrize(
    ("materials", "used", "reason"),
    [
        ([], 0, "material of a primitive is 0; expected one of the file's 0 materials"),
        ([{}], 1, "material of a primitive is 1; expected one of the file's 1 materials"),
        ([{}], -1, "material of a primitive is -1"),
        ([{}], "oak", "material of a primitive is oak"),
        ([7], 0, "material of a primitive is 0"),
        ("oak", 0, "material of a primitive is 0"),
        (
            [{"name": "a", "pbrMetallicRoughness": 7}],
            0,
            "pbrMetallicRoughness of material 'a' is 7",
        ),
        ([named("a", {"roughnessFactor": True})], 0, "roughnessFactor of material 'a' is True"),
        ([named("a", {"metallicFactor": "1"})], 0, "metallicFactor of material 'a' is 1"),
        ([named("a", {"metallicFactor": None})], 0, "is None; expected a number from 0 to 1"),
        (
            [named("a", {"metallicFactor": float("nan")})],
            0,
            "metallicFactor of material 'a' is nan",
        ),
        ([named("a", {"baseColorFactor": [0, 0, 0]})], 0, "expected four numbers from 0 to 1"),
        ([named("a", {"baseColorFactor": 0.5})], 0, "baseColorFactor of material 'a' is 0.5"),
    ],
)
def test_materials_of_a_glb_that_are_wrong(
    tmp_path: Path, materials: Any, used: Any, reason: str
) -> None:
    (tmp_path / "a.glb").write_bytes(glb(materials, used))
    with pytest.raises(BadInput) as caught:
        read_scene(tmp_path / "a.glb")
    assert reason in one_sentence(caught.value, "a.glb")
    assert len(read_mesh(tmp_path / "a.glb").triangles) == 2  # which has no use for materials


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(0, 4), min_size=1, max_size=30))
def test_each_triangle_has_the_material_before_it(
    tmp_path_factory: pytest.TempPathFactory, used: list[int]
) -> None:
    folder: Path = tmp_path_factory.mktemp("scene")
    faces = "".join(f"usemtl m{row}\nf 1 2 {3 + place % 6}\n" for place, row in enumerate(used))
    (folder / "a.obj").write_text("mtllib a.mtl\n" + TWO_SQUARES + faces)
    (folder / "a.mtl").write_text("".join(f"newmtl m{row}\nKd 0.{row}\n" for row in range(5)))
    scene = read_scene(folder / "a.obj")
    assert_as_documented(scene)
    albedo: NDArray[np.float64] = np.array([m.albedo[0] for m in scene.materials])[scene.part]
    np.testing.assert_allclose(albedo, np.array(used) / 10)
