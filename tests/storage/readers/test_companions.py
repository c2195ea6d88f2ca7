"""What an OBJ or a PLY refers to: held against what the reader of scenes makes of copies."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from storage.readers.companions import companions, travel_name
from storage.readers.scenes import read_scene

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl paint\nf 1 2 3\n"
RED = "newmtl paint\nKd 1 0 0\n"


def _write(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def _names(path: Path) -> list[str]:
    return [os.path.relpath(companion, path.parent) for companion in companions(path)]


@pytest.mark.parametrize(
    ("line", "library"),
    [
        ("mtllib hall.mtl", "hall.mtl"),
        ("mtllib ./mats/../mats/hall.mtl", "mats/hall.mtl"),
        ("  mtllib\tgreat hall.mtl", "great hall.mtl"),
        ("mtllib C:\\work\\hall.mtl", "hall.mtl"),
        ("mtllib other.mtl hall.mtl", "hall.mtl"),
        ("mtllib \\\n hall.mtl", "hall.mtl"),
        ("mtllib \\\r\n hall.mtl\r", "hall.mtl"),
        ("mtllib ../elsewhere/hall.mtl", "../elsewhere/hall.mtl"),
        ("mtllib ../nowhere/hall.mtl", "hall.mtl"),
    ],
)
def test_libraries_are_those_that_the_reader_opens(tmp_path: Path, line: str, library: str) -> None:
    obj = tmp_path / "here" / "hall.obj"
    _write(obj, TRIANGLE)
    _write(tmp_path / "here" / library, RED)
    obj.write_bytes(f"{line}\n{TRIANGLE}".encode())
    assert read_scene(obj).materials[0].albedo == (1.0, 0.0, 0.0)
    assert _names(obj) == [library]
    # A copy with its companions, where they are to lie, is read alike.
    copy = tmp_path / "far" / "away" / "hall.obj"
    for companion in companions(obj):
        _write(copy.parent / travel_name(obj, companion), companion.read_text())
    shutil.copyfile(obj, copy)
    assert read_scene(copy).materials == read_scene(obj).materials


def test_the_readers_words_that_are_no_references_are_none(tmp_path: Path) -> None:
    _write(tmp_path / "hall.mtl", RED)
    obj = _write(
        tmp_path / "hall.obj", f"# mtllib hall.mtl\no mtllib hall.mtl\nxmtllib hall.mtl\n{TRIANGLE}"
    )
    assert read_scene(obj).materials[0].albedo != (1.0, 0.0, 0.0)
    assert companions(obj) == []


def test_textures_travel_with_their_library(tmp_path: Path) -> None:
    lines = {
        "map_Kd tex/brick wall.png": "mats/tex/brick wall.png",
        "map_Bump -bm 0.5 -s 1 1 1 bump.png": "mats/bump.png",
        "norm n.png": "mats/n.png",
        'map_Kd "a b.png"': "mats/a b.png",
        "map_Ks -clamp on 'c d.png'": "mats/c d.png",
        "map_Ks missing.png": None,
        "Kd 1 0 0": None,
    }
    _write(tmp_path / "mats" / "hall.mtl", "newmtl paint\n" + "\n".join(lines))
    expected = [name for name in lines.values() if name]
    for name in expected:
        _write(tmp_path / name, "picture")
    obj = _write(tmp_path / "hall.obj", f"mtllib mats/hall.mtl\n{TRIANGLE}")
    assert _names(obj) == ["mats/hall.mtl", *expected]


def test_a_library_of_another_ending_has_textures_too(tmp_path: Path) -> None:
    _write(tmp_path / "hall.mat", f"{RED}map_Kd a.png\n")
    _write(tmp_path / "a.png", "")
    assert _names(_write(tmp_path / "h.obj", f"mtllib hall.mat\n{TRIANGLE}")) == [
        "hall.mat",
        "a.png",
    ]


def test_an_edited_file_is_read_again_and_what_is_missing_is_no_error(tmp_path: Path) -> None:
    obj = _write(tmp_path / "hall.obj", f"mtllib a.mtl\n{TRIANGLE}")
    assert companions(obj) == []
    _write(tmp_path / "a.mtl", RED)
    assert _names(obj) == ["a.mtl"]
    _write(tmp_path / "longer.mtl", RED)
    _write(obj, f"mtllib longer.mtl\n{TRIANGLE}")
    assert _names(obj) == ["longer.mtl"]
    (tmp_path / "longer.mtl").unlink()
    assert companions(obj) == []
    assert companions(tmp_path / "nobody.obj") == []
    os.mkfifo(tmp_path / "longer.mtl")
    assert companions(obj) == []


def test_a_ply_names_its_texture(tmp_path: Path) -> None:
    header = (
        "ply\nformat ascii 1.0\ncomment TextureFile my skin.png\nelement vertex 0\nend_header\n"
    )
    ply = _write(tmp_path / "thing.ply", header + "comment TextureFile b.png\n")
    for name in ("my skin.png", "b.png"):
        _write(tmp_path / name, "")
    assert _names(ply) == ["my skin.png"]


def test_a_file_is_not_its_own_companion_and_other_formats_have_none(tmp_path: Path) -> None:
    assert companions(_write(tmp_path / "a.obj", "mtllib a.obj\n")) == []
    assert companions(_write(tmp_path / "a.glb", "mtllib a.obj\n")) == []


def test_a_pipe_refers_to_nothing(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.obj")
    assert companions(tmp_path / "pipe.obj") == []
