"""What our readers would drop without a word is found by other libraries."""

from __future__ import annotations

import json
import struct
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from benchmarks.captures.second_readers import SAID, found_in, silent


def _png_with_alpha(path: Path) -> None:
    from PIL import Image

    Image.new("RGBA", (4, 4), (9, 9, 9, 100)).save(path)


def _gif_of_two(path: Path) -> None:
    from PIL import Image

    pictures = [Image.new("RGB", (4, 4), colour) for colour in ("red", "blue")]
    pictures[0].save(path, save_all=True, append_images=pictures[1:])


def _tiff_of_two(path: Path) -> None:
    import tifffile

    tifffile.imwrite(path, np.zeros((2, 4, 4, 3), np.uint8), photometric="rgb")


def _tiff_with_a_mask(path: Path) -> None:
    import tifffile

    picture = np.zeros((4, 4, 4), np.uint8)
    tifffile.imwrite(path, picture, photometric="rgb", extrasamples=["unspecified"])


def _exr(path: Path, *channels: str) -> None:
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    pixels = {name: np.full((2, 2), 0.5, np.float32) for name in channels}
    with OpenEXR.File(header, pixels) as file:
        file.write(str(path))


def _glb(path: Path, document: dict[str, object]) -> None:
    text = json.dumps({"asset": {"version": "2.0"}} | document).encode()
    text += b" " * (-len(text) % 4)
    header = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text), len(text), b"JSON")
    path.write_bytes(header + text)


def _obj(path: Path) -> None:
    (path.parent / "a.mtl").write_text("newmtl a\nKe 1 1 1\nmap_Kd oak.png\n")
    path.write_text("mtllib a.mtl\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\nl 1 2\n")


def _ply(path: Path) -> None:
    path.write_text(
        "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 1\nproperty float x\n"
        "property float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
        "property uchar blue\nproperty float quality\nelement edge 1\nproperty int vertex1\n"
        "end_header\n0 0 0 9 9 9 1\n0\n"
    )


def _zip(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("cloth/00001 tl15 pl0 tv0 pv0.jpg", "")
        archive.writestr("cloth/preview.jpg", "")


PLANTED: list[tuple[str, str, Callable[[Path], object], Sequence[str]]] = [
    ("photographs", "a.png", _png_with_alpha, ["alpha"]),
    ("photographs", "a.gif", _gif_of_two, ["pages"]),
    ("photographs", "a.tif", _tiff_of_two, ["pages"]),
    ("photographs", "mask.tif", _tiff_with_a_mask, ["channels"]),
    ("light_probes", "a.exr", lambda path: _exr(path, "R", "G", "B", "A", "Z"),
     ["channels", "alpha"]),
    ("light_probes", "layers.exr", lambda path: _exr(path, "a.R", "a.G", "a.B", "b.R", "b.G",
                                                     "b.B"), ["channels"]),
    ("gltf", "a.glb", lambda path: _glb(path, {
        "scene": 0, "scenes": [{"nodes": [0]}, {"nodes": []}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"mode": 1, "attributes": {"COLOR_0": 0, "_HEAT": 1}}]},
                   {"primitives": []}],
        "animations": [{}], "cameras": [{}], "extensionsUsed": ["ACME_glow"]}),
     ["animation", "attribute", "camera", "colours", "extension", "lines", "mesh", "scene"]),
    ("meshes", "a.obj", _obj, ["colours", "emission", "lines", "texture"]),
    ("meshes", "a.ply", _ply, ["attribute", "colours", "element", "texture"]),
    ("materials", "scene.ply", _ply, ["attribute", "element"]),
    ("profiles", "a.csv", lambda path: path.write_text("x,z,i\n0,1,2\n1,2,3\n2,1,3\n"),
     ["columns"]),
    ("profiles", "two.txt", lambda path: path.write_text("x z\n0 1\n1 2\n2 1\nx z\n" * 2),
     ["table"]),
    ("btf", "a.zip", _zip, ["files"]),
]  # fmt: skip


SENTENCES = {
    "attribute": "Attributes of vertices that are not read: a.",
    "channels": "Layers and channels left out: Z.",
    "columns": "The column 'i' was not used.",
    "element": "Its 'edge' (1 row) not read.",
    "emission": "It emits light.",
    "files": "2 files were passed over.",
    "lines": "1 line is left out.",
    "mesh": "1 mesh is not in the scene and left out.",
    "pages": "The first of 2 pages was read.",
    "table": "The first table was read.",
}


@pytest.mark.parametrize(
    ("group", "name", "write", "things"), PLANTED, ids=[name for _, name, _, _ in PLANTED]
)
def test_what_is_dropped_in_silence_is_found(
    tmp_path: Path, group: str, name: str, write: Callable[[Path], object], things: Sequence[str]
) -> None:
    path = tmp_path / name
    write(path)
    assert sorted(line.partition(":")[0] for line in silent(path, group, [])) == sorted(things)
    notes = [SENTENCES.get(thing, f"Its {thing} is not used.") for thing in things]
    assert silent(path, group, notes) == []
    assert silent(path, group, ["Nothing to the purpose."]) == silent(path, group, [])


def test_what_a_reading_has_is_not_dropped(tmp_path: Path) -> None:
    class Reading:
        corner_colours = np.ones((3, 4))

    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\n")
    assert silent(path, "meshes", []) == ["colours: of vertices"]
    assert silent(path, "meshes", [], Reading()) == []


def test_plain_files_hold_nothing_else(tmp_path: Path) -> None:
    from PIL import Image

    Image.new("RGB", (4, 4)).save(tmp_path / "a.png")
    _exr(tmp_path / "a.exr", "R", "G", "B")
    (tmp_path / "a.csv").write_text("x;z\n0;0,5\n1;-1,5\n2;0,5\n")
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1 2 3\n")
    (tmp_path / "a.xyz").write_text("0 0 0\n")
    for path in tmp_path.iterdir():
        assert found_in(path) == {}, path.name


def test_every_thing_has_words() -> None:
    assert all(SAID.values())
    assert not [thing for *_, things in PLANTED for thing in things if thing not in SAID]
