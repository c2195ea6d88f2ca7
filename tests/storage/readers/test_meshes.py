"""Meshes written by hand: PLY and OBJ as text or packed rows, GLB packed byte by byte."""

from __future__ import annotations

import json
import re
import struct
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from storage.readers import BadInput
from storage.readers.meshes import MeshFile, read_mesh
from storage.readers.polygons import triangulate

# A unit square in two triangles, the second one's corners numbered in another order, and where
# its corners lie on the photograph: (0, 0) at the bottom left.
POSITIONS = np.array([[0, 0, 5], [1, 0, 5], [1, 1, 5], [0, 1, 5]], float)
UVS = np.array([[0.25, 0.0], [0.75, 0.0], [0.75, 0.5], [0.25, 0.5]])


def assert_is_the_square(mesh: MeshFile, uvs: bool = True) -> None:
    corners = mesh.vertices[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(normals.sum(axis=0), [0, 0, 2])  # the whole area, not flipped
    assert (normals[:, 2] > 0).all()
    assert mesh.vertices.dtype == np.float64
    assert mesh.triangles.dtype == np.int64
    assert sorted(map(tuple, mesh.vertices)) == sorted(map(tuple, POSITIONS))
    if uvs:
        assert mesh.uvs is not None
        np.testing.assert_allclose(mesh.uvs, mesh.vertices[:, :2] * 0.5 + [0.25, 0], atol=1e-7)
    else:
        assert mesh.uvs is None


# --- PLY ----------------------------------------------------------------------------------------


def ply_text(uv_names: tuple[str, str] | None, faces: str = "4 0 1 2 3\n") -> str:
    extra = "".join(f"property float {name}\n" for name in uv_names or ())
    rows = "".join(
        " ".join(f"{x:g}" for x in (*p, *(uv if uv_names else ()))) + "\n"
        for p, uv in zip(POSITIONS, UVS, strict=True)
    )
    return (
        "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 4\n"
        f"property float x\nproperty float y\nproperty double z\n{extra}"
        f"element face {faces.count(chr(10))}\nproperty list uchar int vertex_indices\n"
        f"end_header\n{rows}{faces}"
    )


@pytest.mark.parametrize("names", [("s", "t"), ("u", "v"), ("texture_u", "texture_v")])
@pytest.mark.parametrize("faces", ["4 0 1 2 3\n", "3 0 1 2\n3 2 3 0\n"])
def test_ascii_ply(tmp_path: Path, names: tuple[str, str], faces: str) -> None:
    (tmp_path / "square.ply").write_text(ply_text(names, faces))
    assert_is_the_square(read_mesh(tmp_path / "square.ply"))


def test_ply_without_texture_coordinates(tmp_path: Path) -> None:
    (tmp_path / "square.ply").write_bytes(ply_text(None).replace("\n", "\r\n").encode())
    assert_is_the_square(read_mesh(tmp_path / "square.ply"), uvs=False)


def binary_ply(order: str, faces: list[list[int]]) -> bytes:
    name = {"<": "little", ">": "big"}[order]
    header = (
        f"ply\nformat binary_{name}_endian 1.0\nelement vertex 4\nproperty double x\n"
        "property double y\nproperty double z\nproperty uchar red\nproperty float s\n"
        "property float t\nelement face "
        f"{len(faces)}\nproperty uchar flags\nproperty list uchar uint vertex_index\nend_header\n"
    )
    rows = [
        struct.pack(order + "dddBff", *p, 200, *uv) for p, uv in zip(POSITIONS, UVS, strict=True)
    ]
    rows += [struct.pack(f"{order}BB{len(face)}I", 7, len(face), *face) for face in faces]
    return header.encode() + b"".join(rows)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("faces", [[[0, 1, 2, 3]], [[2, 0, 1], [3, 0, 2]]])
def test_binary_ply(tmp_path: Path, order: str, faces: list[list[int]]) -> None:
    (tmp_path / "square.ply").write_bytes(binary_ply(order, faces))
    assert_is_the_square(read_mesh(tmp_path / "square.ply"))


def test_binary_ply_with_polygons_of_several_sizes(tmp_path: Path) -> None:
    """Blender writes these; the hexagon's corners 4 and 5 are far away."""
    data = binary_ply("<", [[0, 1, 2], [0, 2, 3], [0, 1, 2, 3]])
    (tmp_path / "mixed.ply").write_bytes(data)
    mesh = read_mesh(tmp_path / "mixed.ply")
    assert len(mesh.triangles) == 4
    assert len(mesh.vertices) == 4


def test_ply_with_texture_coordinates_of_the_faces_corners(tmp_path: Path) -> None:
    """The two triangles lie apart on the photograph, so that their shared corners split."""
    text = ply_text(None, "3 0 1 2 6 0 0 1 0 1 1\n3 2 3 0 6 .5 .5 0 .5 0 0\n")
    text = text.replace("vertex_indices\n", "vertex_indices\nproperty list uchar float texcoord\n")
    (tmp_path / "wedges.ply").write_text(text)
    mesh = read_mesh(tmp_path / "wedges.ply")
    assert mesh.uvs is not None
    assert len(mesh.vertices) == 5  # corner 0 has (0, 0) twice, corner 2 has two
    expected = np.array([[[0, 0], [1, 0], [1, 1]], [[0.5, 0.5], [0, 0.5], [0, 0]]])
    np.testing.assert_allclose(mesh.uvs[mesh.triangles], expected)


# --- OBJ ----------------------------------------------------------------------------------------

OBJ = """# by hand
mtllib missing.mtl
o first
v 0 0 5
v 1 0 5 0.5 0.5 0.5
vt 0.25 0
vt 0.75 0 0
v 1 1 5
vt 0.75 0.5
vn 0 0 1
usemtl fur
s off
{first}
o second
v 0 1 5
v 9 9 9
vt 0.25 0.5
{second}
"""


@pytest.mark.parametrize(
    ("first", "second", "uvs"),
    [
        ("f 1/1/1 2/2/1 3/3/1", "f 3/3/1 4/4/1 1/1/1", True),
        ("f 1/1 2/2 3/3 # a comment", "f 3/3 \\\n 4/4 1/1", True),
        ("f -3/-3 -2/-2 -1/-1", "f 3/3 -2/-1 1/1", True),  # counted from the last so far
        ("", "f 1/1 2/2 3/3 4/4", True),
        ("f 1//1 2//1 3//1", "f 3 4 1", False),
        ("f 1/1 2/2 3/3", "f 3 4 1", None),  # only some corners have one
    ],
)
def test_obj(tmp_path: Path, first: str, second: str, uvs: bool | None) -> None:
    (tmp_path / "square.obj").write_text(OBJ.format(first=first, second=second))
    mesh = read_mesh(tmp_path / "square.obj")
    if uvs is None:
        assert mesh.uvs is not None
        found = np.isfinite(mesh.uvs[mesh.triangles]).all(axis=(1, 2))
        assert found.tolist() == [True, False]
        uvs = False
        _, place = np.unique(mesh.vertices, axis=0, return_inverse=True)
        mesh = MeshFile(POSITIONS[[0, 3, 1, 2]], place.reshape(-1)[mesh.triangles], None)
    assert_is_the_square(mesh, uvs)


def test_obj_corners_with_two_texture_coordinates_split(tmp_path: Path) -> None:
    text = OBJ.format(first="f 1/1 2/2 3/3", second="f 3/1 4/4 1/1")
    (tmp_path / "seam.obj").write_text(text)
    mesh = read_mesh(tmp_path / "seam.obj")
    assert len(mesh.vertices) == 5
    assert len(np.unique(mesh.vertices, axis=0)) == 4


# --- GLB ----------------------------------------------------------------------------------------


def glb_bytes(
    nodes: list[dict[str, Any]],
    with_uvs: tuple[bool, ...] = (True,),
    positions: NDArray[np.float64] = POSITIONS,
    uvs: NDArray[np.float64] = UVS,
    mode: int = 4,
    last: int = 0,
    **extra: Any,
) -> bytes:
    """The square as many times as ``with_uvs`` has entries; glTF's v counts from the top."""
    indices = struct.pack("<6H", 0, 1, 2, 2, 3, last)
    stored_uvs = np.column_stack([uvs[:, 0], 1 - uvs[:, 1]]).astype("<f4").tobytes()
    parts = [indices, positions.astype("<f4").tobytes(), stored_uvs]
    views, offset = [], 0
    for part in parts:
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(part)})
        offset += len(part)
    description = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "buffers": [{"byteLength": offset}],
        "bufferViews": views,
        "accessors": [
            {"bufferView": 0, "componentType": 5123, "count": 6, "type": "SCALAR"},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2"},
        ],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {"POSITION": 1} | ({"TEXCOORD_0": 2} if has_uvs else {}),
                        "indices": 0,
                        "mode": mode,
                    }
                ]
            }
            for has_uvs in with_uvs
        ],
    } | extra
    text = json.dumps(description).encode()
    text += b" " * (-len(text) % 4)
    body = b"".join(parts)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def test_glb(tmp_path: Path) -> None:
    (tmp_path / "square.glb").write_bytes(glb_bytes([{"mesh": 0}]))
    assert_is_the_square(read_mesh(tmp_path / "square.glb"))


def test_glb_nodes_are_placed_and_joined(tmp_path: Path) -> None:
    """One node moved, one mirrored in x: the mirror must not turn its triangles inside out."""
    nodes = [{"mesh": 0, "translation": [10, 0, 0]}, {"mesh": 1, "scale": [-2, 1, 1]}]
    (tmp_path / "two.glb").write_bytes(glb_bytes(nodes, (True, True)))
    mesh = read_mesh(tmp_path / "two.glb")
    assert mesh.vertices[:, 0].min() == -2
    assert mesh.vertices[:, 0].max() == 11
    corners = mesh.vertices[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(sorted(normals[:, 2]), [1, 1, 2, 2])
    assert mesh.uvs is not None
    x = mesh.vertices[:, 0]
    expected = np.where(x > 5, x - 10, -x / 2) * 0.5 + 0.25
    np.testing.assert_allclose(mesh.uvs[:, 0], expected, atol=1e-6)
    np.testing.assert_allclose(mesh.uvs[:, 1], mesh.vertices[:, 1] * 0.5, atol=1e-6)


def test_textures_that_a_shape_does_not_need_are_said(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl a\nmap_Kd oak.png\nmap_Ks gone.png\n")
    (tmp_path / "oak.png").write_bytes(b"picture")
    obj = tmp_path / "a.obj"
    obj.write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert read_mesh(obj).notes == ("1 texture not used: only the shape is.",)
    (tmp_path / "oak.png").unlink()
    assert read_mesh(obj).notes == ()


def test_glb_where_one_mesh_has_no_texture_coordinates(tmp_path: Path) -> None:
    nodes: list[dict[str, Any]] = [{"mesh": 0}, {"mesh": 1, "translation": [3, 0, 0]}]
    (tmp_path / "some.glb").write_bytes(glb_bytes(nodes, (True, False)))
    mesh = read_mesh(tmp_path / "some.glb")
    assert mesh.uvs is not None
    np.testing.assert_array_equal(np.isnan(mesh.uvs).any(axis=1), mesh.vertices[:, 0] > 2)
    assert len(mesh.vertices) == 8


# --- What is refused ----------------------------------------------------------------------------


def text(content: str) -> Callable[[Path], Any]:
    return lambda path: path.write_text(content)


def packed(content: bytes) -> Callable[[Path], Any]:
    return lambda path: path.write_bytes(content)


CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nvt 0 0\nvt nan 0\n"
PLY = ply_text(("s", "t"))
STL = """solid one
facet normal 0 0 1
outer loop
vertex 0 0 0
vertex 1 0 0
vertex 0 1 0
endloop
endfacet
endsolid one
"""
SPLATS = "".join(
    f"property float {name}\n" for name in ("x", "y", "z", "f_dc_0", "opacity", "scale_0", "rot_0")
)
SPLATS = f"ply\nformat ascii 1.0\nelement vertex 1\n{SPLATS}end_header\n0 0 0 1 1 1 1\n"
ACME: dict[str, Any] = {"extensionsRequired": ["ACME_geometry"]}

REFUSED: list[tuple[str, str, Callable[[Path], Any]]] = [
    ("missing.obj", "file is missing", lambda path: None),
    ("folder.glb", "file is a directory", lambda path: path.mkdir()),
    ("mesh.xyz", "format is unknown; expected a PLY, OBJ, STL or glTF mesh", text("0 0 0")),
    ("fox.fbx", "format is FBX; expected a PLY, OBJ", text("Kaydara FBX Binary  \0\x1a\0")),
    ("cut.stl", "content is truncated or damaged: 1 vertex of 1 triangles", text(STL[:60])),
    ("cut.stl", "content is truncated: 0 of 1", packed(bytes(80) + b"\1\0\0\0" + bytes(40))),
    ("word.stl", "a vertex is no three numbers", text(STL.replace("1 0 0", "1 x 0"))),
    ("empty.ply", "format is unknown (the file is empty)", text("")),
    ("points.ply", "content is 4 points without faces", text(ply_text(None, ""))),
    ("points.ply", "as by screened Poisson", text(ply_text(None, ""))),
    ("splats.ply", "content is 3D Gaussian splats", text(SPLATS)),
    ("points.obj", "content is 4 points without faces", text(CORNERS)),
    ("points.glb", "content is without triangles", packed(glb_bytes([{"mesh": 0}], mode=0))),
    ("empty.obj", "content is 0 points", text("")),
    ("pair.obj", "face 0 is of 2 corners; expected at least three", text(CORNERS + "f 1 2\n")),
    ("pair.ply", "face 0 is of 2 corners", text(ply_text(None, "2 0 1\n"))),
    ("same.obj", "face 0 is of 2 corners", text(CORNERS + "f 1 2 2\nf 1 1 1\n")),
    ("nan.obj", "vertex 1 is (1, nan, 0)", text("v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n")),
    ("inf.ply", "vertex 0 is (inf, 0, 5)", text(PLY.replace("\n0 0 5", "\ninf 0 5"))),
    (
        "nan.glb",
        "vertex 0 is (nan, ",
        packed(glb_bytes([{"mesh": 0}], positions=POSITIONS * np.nan)),
    ),
    (
        "index.obj",
        "line 7 is a reference to vertex 5; expected 1 to 4: part of the file is missing",
        text(CORNERS + "f 1 2 5\n"),
    ),
    ("zero.obj", "line 7 is 'f 0 1 2'; expected references from 1", text(CORNERS + "f 0 1 2\n")),
    ("huge.obj", "line 7 is 'f 1 2 9999", text(CORNERS + "f 1 2 99999999999999999999\n")),
    ("back.obj", "line 7 is 'f -5 1 2'", text(CORNERS + "f -5 1 2\n")),
    (
        "large.obj",
        "face 0 is of 30001 corners; expected at most 20000 corners in such",
        text(CORNERS + "f" + " 1 2 3" * 10_000 + " 4\n"),
    ),
    (
        "large.obj",
        "face 1 is one of 3 faces of more than 500 corners",
        text(CORNERS + "f 1 2 3\n" + ("f" + " 1 2 3" * 3_000 + " 4\n") * 3),
    ),
    ("word.obj", "line 1 is 'v 1 two 3'; expected 3 numbers", text("v 1 two 3\n")),
    ("short.obj", "line 2 is 'v 1 2'; expected 3 numbers", text("v 1 2 3\nv 1 2")),
    (
        "index.ply",
        "face 1 is a reference to vertex 4; expected vertices 0 to 3",
        text(ply_text(("s", "t"), "3 0 1 2\n3 0 1 4\n")),
    ),
    ("index.ply", "face 0 is a reference to vertex -1", text(ply_text(None, "3 0 1 -1\n"))),
    ("head.ply", "header is truncated", text(PLY[:60])),
    ("type.ply", "header is 'property real x'", text(PLY.replace("float x", "real x"))),
    ("format.ply", "header is without a format", text(PLY.replace("format ascii 1.0\n", ""))),
    (
        "flat.ply",
        "vertex properties is x, y, depth, s, t",
        text(PLY.replace("double z", "double depth")),
    ),
    ("word.ply", "content is truncated or damaged", text(PLY.replace("4 0 1 2 3", "4 0 1 2 x"))),
    ("old.glb", "glTF version is 1", packed(b"glTF\1\0\0\0" + glb_bytes([{"mesh": 0}])[8:])),
    ("acme.glb", "required extension is ACME_", packed(glb_bytes([{"mesh": 0}], **ACME))),
    (
        "index.glb",
        "an index of primitive 0 is 4",
        packed(glb_bytes([{"mesh": 0}], last=4)),
    ),
    ("none.glb", "nodes[0].mesh is 3", packed(glb_bytes([{"mesh": 3}]))),
    ("views.glb", "accessors[0].bufferView is 0", packed(glb_bytes([{"mesh": 0}], bufferViews=[]))),
    ("links.glb", "meshes[0] is 0", packed(glb_bytes([{"mesh": 0}], meshes=[0]))),
]


def one_sentence(error: BadInput, file: str) -> str:
    sentence = str(error)
    assert re.fullmatch(re.escape(file) + r": .+ is .+; expected .+\.", sentence)
    assert ". " not in sentence
    return sentence


@pytest.mark.parametrize(("name", "reason", "write"), REFUSED, ids=[row[1][:40] for row in REFUSED])
def test_refusals_say_why(
    tmp_path: Path, name: str, reason: str, write: Callable[[Path], Any]
) -> None:
    write(tmp_path / name)
    with pytest.raises(BadInput) as caught:
        read_mesh(tmp_path / name)
    assert reason in one_sentence(caught.value, name)


def test_truncated_files_are_refused_wherever_they_end(tmp_path: Path) -> None:
    files = {
        "ascii.ply": PLY.encode(),
        "little.ply": binary_ply("<", [[0, 1, 2, 3]]),
        "mixed.ply": binary_ply(">", [[0, 1, 2], [0, 1, 2, 3]]),
        "square.glb": glb_bytes([{"mesh": 0}]),
    }
    for name, data in files.items():
        for end in range(5, len(data.rstrip(b"\n")) - 1, 3):
            (tmp_path / name).write_bytes(data[:end])
            with pytest.raises(BadInput) as caught:
                read_mesh(tmp_path / name)
            assert "truncated" in one_sentence(caught.value, name), end


def test_a_glb_whose_end_is_missing_but_whose_length_agrees(tmp_path: Path) -> None:
    data = glb_bytes([{"mesh": 0}])[:-40]
    (tmp_path / "cut.glb").write_bytes(data[:8] + struct.pack("<I", len(data)) + data[12:])
    with pytest.raises(BadInput, match="content is"):
        read_mesh(tmp_path / "cut.glb")


# --- Cutting polygons ---------------------------------------------------------------------------


def _doubled_areas(outline: NDArray[np.float64]) -> NDArray[np.float64]:
    sizes = np.array([len(outline)])
    cut, owners = triangulate(outline, sizes, np.arange(len(outline)))
    assert cut.shape == (len(outline) - 2, 3)
    assert (owners == 0).all()
    a, b, c = np.moveaxis(outline[cut], 1, 0)
    return np.cross(b - a, c - a)[:, 2]


def _shoelace(outline: NDArray[np.float64]) -> float:
    x, y = outline[:, 0], outline[:, 1]
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(0.2, 1.0), min_size=3, max_size=14))
def test_triangles_of_a_star_shaped_polygon_cover_it_once(radii: list[float]) -> None:
    angles = np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
    around = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    outline = np.array(radii)[:, None] * around
    areas = _doubled_areas(outline)
    assert (areas > -1e-12).all()
    assert areas.sum() == pytest.approx(_shoelace(outline))


@pytest.mark.parametrize("middles", [(0,), (1, 3), (0, 1, 2), (0, 0, 0, 2), (3, 3)])
def test_corners_on_straight_sides_leave_no_triangle_without_area(
    middles: tuple[int, ...],
) -> None:
    square = POSITIONS
    rows = []
    for side in range(4):
        steps = np.linspace(0, 1, middles.count(side) + 1, endpoint=False)[:, None]
        rows.append(square[side] + steps * (square[(side + 1) % 4] - square[side]))
    areas = _doubled_areas(np.concatenate(rows))
    assert (areas > 1e-9).all()
    assert areas.sum() == pytest.approx(2)


def test_a_concave_quad_is_cut_inside() -> None:
    arrow = np.array([[0, 0, 0], [2, -1, 0], [0.5, 0, 0], [2, 1, 0]], float)
    for turn in range(4):
        assert (_doubled_areas(np.roll(arrow, turn, axis=0)) > 0).all()


def cells_outline(cells: set[tuple[int, int]]) -> list[tuple[int, int]]:
    """The corners of unit cells that touch by their sides, along the outline; [] for cells that
    touch by a corner alone or have holes."""
    following = {}
    for x, y in cells:
        for across, start, end in (
            ((x, y - 1), (x, y), (x + 1, y)),
            ((x + 1, y), (x + 1, y), (x + 1, y + 1)),
            ((x, y + 1), (x + 1, y + 1), (x, y + 1)),
            ((x - 1, y), (x, y + 1), (x, y)),
        ):
            if across not in cells and following.setdefault(start, end) != end:
                return []
    outline = [next(iter(following))]
    while following[outline[-1]] != outline[0]:
        outline.append(following[outline[-1]])
    return outline if len(outline) == len(following) else []


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 200), st.integers(0, 3)), min_size=1, max_size=40))
def test_outlines_of_cells_with_a_corner_at_every_cell(steps: list[tuple[int, int]]) -> None:
    """Most corners lie on straight sides, many diagonals run through others: the area is known."""
    cells = [(0, 0)]
    for near, way in steps:
        x, y = cells[near % len(cells)]
        cells.append((x + (1, -1, 0, 0)[way], y + (0, 0, 1, -1)[way]))
    flat = cells_outline(set(cells))
    if flat:
        areas = _doubled_areas(np.column_stack([flat, np.zeros(len(flat))]))
        assert (areas > 1e-9).all()
        assert areas.sum() == pytest.approx(2 * len(set(cells)))


def test_a_hole_joined_to_the_outline() -> None:
    """Corners that are there twice, as where a hole is joined to the outline, are all right."""
    corners = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)]
    areas = _doubled_areas(np.column_stack([np.array(corners, float), np.zeros(10)]))
    assert (areas > 1).all()
    assert areas.sum() == pytest.approx(2 * (16 - 4))


@pytest.mark.parametrize(
    "outline",
    [
        np.tile(POSITIONS, (250, 1)),  # the same four corners over and over
        np.random.default_rng(0).random((2000, 3)),
        np.outer(np.linspace(0, 1, 2000), [1, 2, 3]),
        np.zeros((2000, 3)),
        np.random.default_rng(1).choice([-1.7e308, 0, 1.6e308], (2000, 3)),
        [[np.cos(a), np.sin(a), 0] for a in np.linspace(0, 2 * np.pi, 2000, endpoint=False)],
    ],
)
def test_polygons_of_many_corners_are_cut_at_once(outline: Any) -> None:
    """Whatever the corners are, in far less than the twelve seconds that ears took; the clock is
    that of the process, which others slow by a little only."""
    triangulate(np.array(outline)[:5], np.array([5]), np.arange(5))  # loads the library
    begin = time.process_time()
    cut, _ = triangulate(np.array(outline), np.array([len(outline)]), np.arange(len(outline)))
    assert time.process_time() - begin < 4
    assert cut.shape == (len(outline) - 2, 3)
    assert (np.unique(cut) == np.arange(len(outline))).all()
