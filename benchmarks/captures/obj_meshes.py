"""Meshes as OBJ files, written line by line: what programs write and what readers accept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image

from benchmarks.captures.case import FILES, Case, Ending
from benchmarks.captures.mesh_truth import (
    SIDES,
    SOLID,
    UVS,
    encloses,
    has_triangles,
    obj_faces,
    obj_uvs,
    obj_vertices,
    read_for_fur,
    read_for_glass,
    text,
)
from storage.readers.meshes import read_mesh

_SOLID = has_triangles(SOLID, SIDES)
_V, _F = obj_vertices(), obj_faces()


def _case(
    name: str,
    kind: str,
    content: str | Callable[[Path], object] | None,
    ends: Ending = "read",
    says: Sequence[str] = (),
    is_right: Callable[[Any], bool] | None = _SOLID,
    read: Callable[[Path], Any] = read_mesh,
) -> Case:
    write = text(content) if isinstance(content, str) else content
    return Case(
        f"obj_{name}.obj", kind, read, ends, says, is_right if ends != "refused" else None, write
    )


def _is_the_egg(found: Any) -> bool:
    """As its lines have it, which face outwards."""
    lines = [line.split() for line in (FILES / "obj_egg_closed.obj").read_text().splitlines()]
    vertices = np.array([line[1:] for line in lines if line[:1] == ["v"]], float)
    faces = np.array([line[1:] for line in lines if line[:1] == ["f"]], int)
    return bool(has_triangles(vertices, faces - 1)(found))


def _is_a_ball(squash: tuple[float, float, float] = (1, 1, 1)) -> Callable[[Any], bool]:
    """Points at equal distances, triangles facing away from the middle."""

    def is_right(found: Any) -> bool:
        points = found.vertices / np.array(squash)
        corners = points[found.triangles]
        outwards = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        away = np.einsum("fi,fi->f", outwards, corners.sum(axis=1))
        radius = np.linalg.norm(points, axis=1)
        return bool(np.allclose(radius, 1, atol=1e-6) and (away >= 0).all() and len(away) >= 900)

    return is_right


def _uvs_are_those_of_the_front(found: Any) -> bool:
    """The bottom's texture coordinates are as written; the others are there, to their scale."""
    points = found.vertices[found.triangles]
    bottom = ((points[:, :, 2] == 0) & (points[:, :, 1] >= 0)).all(axis=1)
    corners = found.uvs[found.triangles[bottom]]
    right = np.isclose(corners, SOLID[SIDES[:2]][..., :2] / [2, 1]) & np.isclose(
        points[bottom], SOLID[SIDES[:2]]
    ).all(axis=2, keepdims=True)
    return bool(right.all() and np.isfinite(found.uvs).all() and bottom.sum() == 2)


_BALL = trimesh.creation.icosphere(2)
_FAR = np.array([4.5e6, 5.2e6, 300])
_VOLUME = trimesh.Trimesh(SOLID, SIDES).volume
_L = np.array([[0, 0, 1], [3, 0, 1], [3, 1, 1], [1, 1, 1], [1, 2, 1], [0, 2, 1]], float)


def _covers(area: float) -> Callable[[Any], bool]:
    def is_right(found: Any) -> bool:
        a, b, c = np.moveaxis(found.vertices[found.triangles], 1, 0)
        facing = np.cross(b - a, c - a)[:, 2]
        return bool(np.isclose(facing.sum() / 2, area) and (facing > 0).all())

    return is_right


def _split(gap: float) -> str:
    corners = SOLID[SIDES].reshape(-1, 3)
    moved = corners + np.random.default_rng(0).uniform(-gap, gap, corners.shape)
    return obj_vertices(moved) + obj_faces(np.arange(30).reshape(-1, 3))


def _with_library(line: str) -> Callable[[Path], object]:
    """A material with a line, and a picture beside it."""

    def write(path: Path) -> None:
        path.write_text(f"mtllib house.mtl\n{_V}usemtl wall\n{_F}")
        path.with_name("house.mtl").write_text(f"newmtl wall\n{line}")
        Image.new("RGB", (2, 2)).save(path.with_name("brick.png"))

    return write


_CASES_OF_FILES = (
    _case("egg_closed", "a plain mesh", None, is_right=_is_the_egg),
    _case(
        "inside_out_closed",
        "inside out",
        None,
        "told",
        ["960 triangles of closed pieces turned over"],
        _is_the_egg,
        read_for_fur,
    ),
    _case(
        "one_degenerate_face",
        "faces without area",
        None,
        "told",
        ["left out"],
        _is_a_ball((1, 2, 1)),
        read_for_fur,
    ),
    _case(
        "closed_plus_one_degenerate",
        "faces without area",
        None,
        "told",
        ["left out"],
        _is_a_ball(),
        read_for_glass,
    ),
    _case(
        "face_of_1000_repeated_corners",
        "repeated corners",
        None,
        "told",
        ["996 repeated corners of faces left out"],
        encloses(1.0),
        read_for_glass,
    ),
    _case(
        "uv_all_one_point",
        "texture coordinates without area",
        None,
        "told",
        ["no area: unwrapped anew"],
        lambda found: _is_a_ball((1, 2, 1))(found) and float(np.ptp(found.uvs)) > 1,
        read_for_fur,
    ),
    _case("forward_references", "references forward", None, is_right=_is_a_ball((1, 2, 1))),
    _case("utf16", "text encodings", None, is_right=_is_a_ball((1, 2, 1))),
)

_CASES_OF_TEXT = (
    _case("with_library", "materials without textures", _with_library("Kd 1 0 0\n")),
    _case(
        "with_texture",
        "textures where none are used",
        _with_library("map_Kd brick.png\n"),
        "told",
        ["1 texture not used"],
    ),
    _case("negative", "references backwards", _V + "vn 0 0 1\n" + obj_faces(SIDES - 8)),
    _case("cr", "line ends", (_V + _F).replace("\n", "\r")),
    _case("tabs_bom", "text encodings", "\ufeff" + (_V + _F).replace(" ", "\t")),
    _case("utf16_be", "text encodings", text("\ufeff" + _V + _F, "utf-16-be")),
    _case("latin1", "text encodings", text(f"{_V}g Gr\xfcner B\xe4r\n{_F}", "latin-1")),
    _case("joined", "continued lines", (_V + _F).replace(" ", " \\\n ")),
    _case("smooth", "statements without effect", f"{_V}s 1\ng a b\ns off\nlod 3\n{_F}"),
    _case("comments", "comments", (_V + _F).replace("\n", " # 1 2 3\n") + "#\n# f 1 2 3\n"),
    _case("fo", "obsolete faces", (_V + _F).replace("f ", "fo ")),
    _case(
        "given_normals", "normals of the file", _V + "vn 0 0 1\n" * 6 + obj_faces(form="{0}//{0}")
    ),
    _case("weights", "weights of vertices", obj_vertices(after=["1.0"] * 7) + _F),
    _case("qnan", "numbers that are none", f"{_V}v 1.#QNAN -1.#IND 1.#INF\nvt nan\n{_F}"),
    _case(
        "lines",
        "elements that are no faces",
        f"{_V}{_F}l 1 2 3\np 1\np 2\n",
        "told",
        ["1 line and 2 points not read"],
    ),
    _case(
        "surface",
        "elements that are no faces",
        f"{_V}cstype bezier\ndeg 1 1\nsurf 0 1 0 1 1 2 5 4\nparm u 0 1\nend\n{_F}",
        "told",
        ["1 free-form surface not read"],
    ),
    _case(
        "only_surface",
        "elements that are no faces",
        f"{_V}cstype bezier\ndeg 1 1\nsurf 0 1 0 1 1 2 5 4\nend\n",
        "refused",
        ["1 free-form surface", "convert"],
    ),
    _case(
        "two_corners",
        "faces of less than three corners",
        f"{_V}f 1 2\nf 3\n{_F}",
        "told",
        ["2 faces of less than three corners left out"],
    ),
    _case(
        "quads_that_are_triangles",
        "repeated corners",
        _V + obj_faces(SIDES[:, [0, 1, 2, 2]]),
        "told",
        ["10 repeated corners"],
    ),
    _case(
        "concave",
        "faces of many corners",
        obj_vertices(_L) + "f 1 2 3 4 5 6\n",
        "read",
        (),
        _covers(4.0),
    ),
    _case(
        "decimal_commas",
        "decimal commas",
        _V.replace(".", ",") + _F,
        "told",
        ["Decimal commas of 7 lines"],
    ),
    _case(
        "lost_uvs",
        "texture coordinates that are missing",
        _V + obj_uvs(UVS[:2]) + obj_faces(form="{0}/{0}"),
        "told",
        ["Texture coordinates of 22 corners left out"],
    ),
    _case(
        "some_uvs",
        "texture coordinates that are missing",
        _V + obj_uvs() + obj_faces(SIDES[:2], "{0}/{0}") + obj_faces(SIDES[2:]),
        "told",
        ["unwrapped anew"],
        _SOLID,
        read_for_fur,
    ),
    _case(
        "one_side_without_uvs",
        "texture coordinates that are missing",
        _V
        + obj_uvs(SOLID[:, :2] / [2, 1])
        + obj_faces(SIDES[:2], "{0}/{0}")
        + obj_vertices(SOLID[[0, 1]] - [0, 0.1, 0])
        + "f 8 9 1\n",
        "told",
        ["1 triangle without area on the texture unwrapped anew"],
        _uvs_are_those_of_the_front,
        read_for_fur,
    ),
    _case(
        "nan_uvs",
        "texture coordinates without area",
        _V + obj_uvs(UVS).replace("vt 0.25 0.5", "vt nan nan") + obj_faces(form="{0}/{0}"),
        "told",
        ["without area on the texture unwrapped anew|unwrapped anew"],
        lambda found: _SOLID(found) and bool(np.isfinite(found.uvs).all()),
        read_for_fur,
    ),
    _case(
        "stretched",
        "texture coordinates that stretch",
        _V + obj_uvs(SOLID[:, :2] * [1, 1e-4]) + obj_faces(form="{0}/{0}"),
        "told",
        ["stretch a photograph .* times: unwrapped anew"],
        lambda found: _SOLID(found) and float(np.ptp(found.uvs[:, 1])) > 0.1,
        read_for_fur,
    ),
    _case(
        "georeferenced",
        "places and units",
        obj_vertices(SOLID + _FAR) + _F,
        is_right=has_triangles(SOLID + _FAR, SIDES),
        read=read_for_glass,
    ),
    _case(
        "georeferenced_for_fur",
        "places and units",
        obj_vertices(SOLID + _FAR) + _F,
        "told",
        [r"moved by \(-4500001, -5200001, -301.5\)"],
        has_triangles(SOLID - [1, 1, 1.5], SIDES),
        read_for_fur,
    ),
    _case(
        "nanometres",
        "places and units",
        obj_vertices(SOLID * 1e-9) + _F,
        is_right=has_triangles(SOLID * 1e-9, SIDES, 1e-15),
        read=read_for_glass,
    ),
    _case(
        "two_bodies",
        "inside out",
        _V + obj_vertices(SOLID + 5) + _F + obj_faces(SIDES[:, ::-1] + 7),
        "told",
        ["10 triangles of closed pieces turned over"],
        has_triangles(np.concatenate([SOLID, SOLID + 5]), np.concatenate([SIDES, SIDES + 7])),
        read_for_fur,
    ),
    _case(
        "scan_with_a_hole",
        "inside out",
        obj_vertices(_BALL.vertices) + obj_faces(_BALL.faces[2:, ::-1]),
        "told",
        ["318 triangles of open pieces turned over: they were seen"],
        has_triangles(_BALL.vertices, _BALL.faces[2:]),
        read_for_fur,
    ),
    _case(
        "scan_for_glass",
        "small holes",
        obj_vertices(_BALL.vertices) + obj_faces(_BALL.faces[1:]),
        "told",
        ["1 hole closed by lids"],
        encloses(_BALL.volume),
        read_for_glass,
    ),
    _case(
        "some_turned",
        "faces that disagree",
        _V + obj_faces([side[::-1] if n % 3 == 1 else side for n, side in enumerate(SIDES)]),
        "told",
        ["3 triangles turned over"],
        _SOLID,
        read_for_glass,
    ),
    _case(
        "twice",
        "repeated faces",
        _V + _F + _F,
        "told",
        ["10 triangles dropped: the same corners"],
        _SOLID,
        read_for_glass,
    ),
    _case(
        "gaps",
        "gaps between corners",
        _split(1e-9),
        "told",
        ["23 vertices merged"],
        has_triangles(SOLID, SIDES, 1e-4),
        read_for_glass,
    ),
    _case(
        "hollow",
        "cavities",
        _V + obj_vertices(SOLID / 2 + [0.5, 0.25, 0.2]) + _F + obj_faces(SIDES[:, ::-1] + 7),
        is_right=encloses(_VOLUME * 7 / 8),
        read=read_for_glass,
    ),
    _case(
        "open_cup",
        "open for glass",
        _V + obj_faces(SIDES[1:]),
        "refused",
        ["open along 3 border edges", "fill its holes"],
        read=read_for_glass,
    ),
    _case(
        "sheet",
        "open for glass",
        _V + "f 1 2 4 5\n",
        "refused",
        ["open along 4", "give a sheet some thickness"],
        read=read_for_glass,
    ),
    _case(
        "truncated",
        "missing vertices",
        obj_vertices(SOLID[:6]) + _F,
        "refused",
        ["line 12 is a reference to vertex 7", "export it again"],
    ),
    _case("from_zero", "references from 0", _V + "f 0 1 2\n", "refused", ["references from 1 on"]),
    _case("points", "points without faces", _V, "refused", ["7 points without faces", "Poisson"]),
)

CASES = (*_CASES_OF_FILES, *_CASES_OF_TEXT)
