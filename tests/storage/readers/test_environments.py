"""Environments: files written by hand or by OpenEXR against the radiance put into them."""

from __future__ import annotations

import re
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray
from PIL import Image

from storage.readers import BadInput
from storage.readers.environments import read_environment
from storage.readers.pictures.radiance_values import mended

HEIGHT, WIDTH = 20, 40


def radiance(dtype: type = np.float32, height: int = HEIGHT, width: int = WIDTH) -> NDArray[Any]:
    """Noise with a bright sun, unlike itself under every turn and reflection."""
    values = np.random.default_rng(5).random((height, width, 3)) / 4
    values[1, 2] = (900, 800, 700)
    return values.astype(dtype)


def rgbe_pixels(height: int = HEIGHT, width: int = WIDTH) -> NDArray[np.uint8]:
    chance = np.random.default_rng(6)
    rgbe = chance.integers(0, 256, (height, width, 4)).astype(np.uint8)
    rgbe[..., 3] = chance.integers(100, 160, (height, width))
    rgbe[height // 2 :, : width // 2] = (7, 130, 255, 129)  # a ground that makes runs
    rgbe[0, -1] = (9, 9, 9, 0)  # black, whatever the mantissas say
    return rgbe


def light_of(rgbe: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Mantissas are 256ths of two to the exponent's excess over 128 (Ward)."""
    mantissas, exponents = rgbe[..., :3].astype(float), rgbe[..., 3:].astype(float)
    return np.where(exponents > 0, mantissas / 256 * 2 ** (exponents - 128), 0)


def run_lengths(line: NDArray[np.uint8]) -> bytes:
    """One scanline of four channels, runs from three values on, literals of at most 128."""
    coded = bytearray([2, 2, len(line) >> 8, len(line) & 255])
    for channel in line.T:
        literal = bytearray()
        for part in np.split(channel, np.flatnonzero(np.diff(channel.astype(int))) + 1):
            value, count = int(part[0]), len(part)
            if count < 3:
                literal += bytes([value] * count)
                continue
            coded += _literals(literal)
            literal = bytearray()
            while count:
                run = min(count, 127)
                coded += bytes([128 + run, value])
                count -= run
        coded += _literals(literal)
    return bytes(coded)


def _literals(values: bytearray) -> bytes:
    pieces = (values[at : at + 128] for at in range(0, len(values), 128))
    return b"".join(bytes([len(piece)]) + piece for piece in pieces)


def hdr(rgbe: NDArray[np.uint8], runs: bool, *lines: str) -> bytes:
    height, width = rgbe.shape[:2]
    head = "\n".join(
        ["#?RADIANCE", "FORMAT=32-bit_rle_rgbe", *lines, "", f"-Y {height} +X {width}"]
    )
    pixels = b"".join(map(run_lengths, rgbe)) if runs else rgbe.tobytes()
    return head.encode() + b"\n" + pixels


def exr(path: Path, channels: dict[str, NDArray[Any]], **header: Any) -> Path:
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | header
    contiguous = {name: np.ascontiguousarray(values) for name, values in channels.items()}
    with OpenEXR.File(header, contiguous) as file:
        file.write(str(path))
    return path


def plain(file: Path, height: int = HEIGHT) -> NDArray[np.float32]:
    """What is read where nothing is to be said."""
    light, notes = read_environment(file)
    assert notes == ()
    assert light.dtype == np.float32
    assert light.shape == (height, 2 * height, 3)
    assert light.flags.c_contiguous
    assert light.flags.writeable
    return light


@pytest.mark.parametrize("runs", [False, True], ids=["flat", "runs"])
@pytest.mark.parametrize("height", [8, 20, 150])
def test_radiance_pictures(tmp_path: Path, runs: bool, height: int) -> None:
    rgbe = rgbe_pixels(height, 2 * height)
    file = tmp_path / "room.hdr"
    file.write_bytes(hdr(rgbe, runs))
    light = plain(file, height)
    np.testing.assert_allclose(light, light_of(rgbe), rtol=1e-7)


def test_four_pixels_of_a_radiance_picture_by_hand(tmp_path: Path) -> None:
    rgbe = np.zeros((8, 16, 4), np.uint8)
    rgbe[0, 0] = (128, 64, 32, 129)  # top left
    rgbe[0, 15] = (128, 0, 0, 130)
    rgbe[7, 0] = (0, 128, 0, 131)
    rgbe[7, 15] = (0, 0, 128, 127)
    file = tmp_path / "room.hdr"
    file.write_bytes(hdr(rgbe, runs=True))
    light = plain(file, 8)
    assert light[0, 0].tolist() == [1, 0.5, 0.25]
    assert light[0, 15].tolist() == [2, 0, 0]
    assert light[7, 0].tolist() == [0, 4, 0]
    assert light[7, 15].tolist() == [0, 0, 0.25]
    assert light.sum() == 8


def test_a_radiance_picture_from_the_bottom_up_stands_upright(tmp_path: Path) -> None:
    rgbe = rgbe_pixels()
    file = tmp_path / "room.hdr"
    file.write_bytes(hdr(rgbe[::-1], True).replace(b"-Y 20", b"+Y 20"))
    light = plain(file)
    np.testing.assert_allclose(light, light_of(rgbe), rtol=1e-7)


def test_the_exposure_of_a_radiance_picture_is_divided_out(tmp_path: Path) -> None:
    file = tmp_path / "room.hdr"
    file.write_bytes(hdr(rgbe_pixels(), True, "EXPOSURE=4", "EXPOSURE=2"))
    np.testing.assert_allclose(plain(file), light_of(rgbe_pixels()) / 8, rtol=1e-6)


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_exr_files(tmp_path: Path, dtype: type) -> None:
    light = radiance(dtype)
    file = exr(tmp_path / "room.exr", {"RGB": light})
    np.testing.assert_array_equal(plain(file), light.astype(np.float32))
    np.testing.assert_array_equal(read_environment(str(file)).radiance, light)


@pytest.mark.parametrize(
    "header",
    [
        {"compression": OpenEXR.NO_COMPRESSION},
        {"compression": OpenEXR.PIZ_COMPRESSION},
        {"lineOrder": OpenEXR.DECREASING_Y},
        {"chromaticities": (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)},
        {
            "type": OpenEXR.tiledimage,
            "tiles": OpenEXR.TileDescription(),
        },
    ],
    ids=["raw", "piz", "bottom up", "primaries", "tiled"],
)
def test_exr_headers_that_other_programs_write(tmp_path: Path, header: dict[str, Any]) -> None:
    light = radiance()
    file = exr(tmp_path / "room.exr", {"RGB": light}, **header)
    np.testing.assert_array_equal(plain(file), light)


def test_opaque_alpha_is_passed_over_and_other_channels_are_told(tmp_path: Path) -> None:
    light = radiance(np.float16)
    alpha = np.ones((HEIGHT, WIDTH), np.float16)
    file = exr(tmp_path / "room.exr", {"RGBA": np.dstack([light, alpha])})
    np.testing.assert_array_equal(plain(file), light.astype(np.float32))
    depth = np.full((HEIGHT, WIDTH), -1, np.float32)
    found = read_environment(exr(tmp_path / "room.exr", {"RGB": light, "Z": depth}))
    np.testing.assert_array_equal(found.radiance, light.astype(np.float32))
    assert found.notes == ("Layers and channels left out: Z.",)


def test_grey_exr_files_give_three_equal_channels(tmp_path: Path) -> None:
    grey = radiance()[..., 0]
    light = plain(exr(tmp_path / "room.exr", {"Y": grey}))
    np.testing.assert_array_equal(light, np.dstack([grey, grey, grey]))


def test_what_a_file_is_called_does_not_matter(tmp_path: Path) -> None:
    file = exr(tmp_path / "room.hdr", {"RGB": radiance()})
    np.testing.assert_array_equal(plain(file), radiance())
    file.write_bytes(hdr(rgbe_pixels(), True).replace(b"#?RADIANCE", b"#?RGBE"))
    np.testing.assert_allclose(plain(file), light_of(rgbe_pixels()), rtol=1e-7)


def test_zero_and_the_smallest_values_are_radiance(tmp_path: Path) -> None:
    light = np.zeros((8, 16, 3), np.float32)
    light[3, 4, 2] = 1e-40
    light[0, 0, 0] = -0.0
    np.testing.assert_array_equal(plain(exr(tmp_path / "dim.exr", {"RGB": light}), 8), light)


# --- What is refused ----------------------------------------------------------------------------


def save_exr(light: NDArray[Any], channels: str = "RGB", **header: Any) -> Callable[[Path], Any]:
    return lambda path: exr(path, {channels: light}, **header)


def save_hdr(rgbe: NDArray[np.uint8], *lines: str) -> Callable[[Path], Any]:
    return lambda path: path.write_bytes(hdr(rgbe, True, *lines))


def save_picture(**options: Any) -> Callable[[Path], Any]:
    codes = (radiance().clip(0, 1) * 255).astype(np.uint8)
    return lambda path: Image.fromarray(codes).save(path, **options)


def with_value(
    light: NDArray[Any], row: int, column: int, channel: int | slice, value: float
) -> NDArray[Any]:
    light[row, column, channel] = value
    return light


def with_alpha(alpha: float) -> NDArray[np.float32]:
    rgba = np.dstack([radiance(), np.ones((HEIGHT, WIDTH), np.float32)])
    rgba[3, 4:6, 3] = alpha
    return rgba


def hdr_header(height: int, width: int) -> Callable[[Path], Any]:
    """A header whose pixels do not follow: its size has to be refused first."""
    return lambda path: path.write_bytes(f"#?RADIANCE\n\n-Y {height} +X {width}\n".encode())


def exr_window(height: int, width: int, *names: bytes) -> Callable[[Path], Any]:
    """An EXR that says it is of another size than its pixels."""

    def write(path: Path) -> None:
        data = exr(path, {"RGB": radiance()}).read_bytes()
        for name in names:
            at = data.index(name + b"\0box2i\0") + len(name) + 11
            window = struct.pack("<4i", 0, 0, width - 1, height - 1)
            data = data[:at] + window + data[at + 16 :]
        path.write_bytes(data)

    return write


BOTH = (b"dataWindow", b"displayWindow")
BLACK = np.zeros((8, 16, 3), np.float32)
EIGHT_BITS = "expected a Radiance .hdr or an OpenEXR .exr file: 8 bits hold no radiance of lamps"
TWICE = "expected a width of twice the height"

REFUSED: list[tuple[str, str, Callable[[Path], Any]]] = [
    ("missing.hdr", "file is missing; expected a Radiance .hdr or an", lambda path: None),
    ("folder.hdr", "file is a directory", lambda path: path.mkdir()),
    ("notes.hdr", "format is unknown; expected a Radiance", lambda path: path.write_text("none")),
    ("empty.exr", "format is unknown (the file is empty)", lambda path: path.touch()),
    ("room.png", f"format is PNG; {EIGHT_BITS}", save_picture()),
    ("room.jpg", f"format is JPEG; {EIGHT_BITS}", save_picture()),
    ("room.tif", "format is TIFF; expected a Radiance .hdr or an OpenEXR", save_picture()),
    ("png.hdr", f"format is PNG; {EIGHT_BITS}", save_picture(format="PNG")),
    ("jpeg.exr", f"format is JPEG; {EIGHT_BITS}", save_picture(format="JPEG")),
    ("square.exr", f"size is 40 x 40 pixels; {TWICE}: unfold", save_exr(radiance(height=40))),
    (
        "upright.exr",
        f"size is 20 x 40 pixels; {TWICE}",
        save_exr(radiance(height=40, width=20)),
    ),
    ("far.exr", f"size is 43 x 20 pixels; {TWICE}", save_exr(radiance(width=43))),
    ("far.hdr", f"size is 38 x 20 pixels; {TWICE}", save_hdr(rgbe_pixels(width=38))),
    (
        "small.exr",
        "size is 14 x 7 pixels; expected a width of at least 16 pixels",
        save_exr(radiance(height=7, width=14)),
    ),
    ("small.hdr", "size is 14 x 7 pixels; expected a width", save_hdr(rgbe_pixels(7, 14))),
    ("large.exr", "size is 32770 x 16385 pixels; expected at", exr_window(16385, 32770, *BOTH)),
    ("none.hdr", "size is 0 x 0 pixels; expected a width", hdr_header(0, 0)),
    ("bare.hdr", "size is 16384 x 8192 pixels (4096 MiB)", hdr_header(8192, 16384)),
    ("short.hdr", "content is truncated or damaged", hdr_header(8, 16)),
    (
        "part.exr",
        "data window is 0 0 39 19; expected more than half of the display window, 0 0 79 39",
        exr_window(40, 80, b"displayWindow"),
    ),
    (
        "nan.exr",
        "picture is no number in 20 of 800 texels; expected radiance: at most 1% of them",
        save_exr(with_value(radiance(), 5, slice(20), 1, np.nan)),
    ),
    (
        "cold.exr",
        "picture is negative in 800 of 800 texels; expected radiance: at most 50% of them",
        save_exr(-radiance()),
    ),
    ("black.exr", "picture is all black; expected an environment with light", save_exr(BLACK)),
    ("black.hdr", "picture is all black", save_hdr(np.zeros((8, 16, 4), np.uint8))),
    ("depth.exr", "channels is Z; expected R, G, B", save_exr(radiance()[..., 0], "Z")),
    (
        "codes.exr",
        "channels is unsigned integers (R, G, B); expected half or float",
        save_exr(radiance().astype(np.uint32), "RGB"),
    ),
    ("head.hdr", "content is truncated", lambda path: path.write_bytes(b"#?RADIANCE\nEXPOSURE=")),
    ("head.exr", "content is truncated", lambda path: path.write_bytes(b"\x76\x2f\x31\x01\x02\0")),
]
NEXT_TO = "filled from the texels around."

MENDED: list[tuple[str, str, Callable[[Path], Any]]] = [
    ("hole.exr", "Alpha, below 1 in 2 pixels, was left out.", save_exr(with_alpha(0.5), "RGBA")),
    ("alpha.exr", "Alpha, below 1 in 2 pixels", save_exr(with_alpha(np.nan), "RGBA")),
    (
        "nan.exr",
        f"1 texel was no number and {NEXT_TO}",
        save_exr(with_value(radiance(), 5, 7, 1, np.nan)),
    ),
    (
        "minus.exr",
        f"1 texel was no number and {NEXT_TO}",
        save_exr(with_value(radiance(), 19, 0, 0, -np.inf)),
    ),
    (
        "inf.exr",
        "1 infinite value became 65504, the half's largest.",
        save_exr(with_value(radiance(np.float16), 0, 39, 2, np.inf)),
    ),
    (
        "over.hdr",
        "1 texel was infinite and became 65504.",
        save_hdr(with_value(rgbe_pixels() // 255, 0, 0, slice(None), 255), "COLORCORR=1 1 1e-9"),
    ),
    (
        "cold.exr",
        "1 texel was negative (the least -0.25) and became 0.",
        save_exr(with_value(radiance(), 5, 7, 0, -0.25)),
    ),
    (
        "grey.exr",
        "1 texel was negative (the least -0.25) and became 0.",
        save_exr(with_value(radiance(), 5, 7, 0, -0.25)[..., 0], "Y"),
    ),
    ("odd.exr", "41 x 20 pixels were averaged to 40 x 20", save_exr(radiance(width=41))),
    ("odd.hdr", "39 x 20 pixels were averaged to 38 x 19", save_hdr(rgbe_pixels(width=39))),
]


@pytest.mark.parametrize(("name", "note", "write"), MENDED, ids=[row[0] for row in MENDED])
def test_what_is_mended_is_told(
    tmp_path: Path, name: str, note: str, write: Callable[[Path], Any]
) -> None:
    write(tmp_path / name)
    light, notes = read_environment(tmp_path / name)
    assert (np.isfinite(light) & (light >= 0)).all()
    assert light.shape[1] == 2 * light.shape[0]
    assert len(notes) == 1
    assert notes[0].startswith(note)


def test_holes_are_filled_inwards_from_their_edges() -> None:
    light = np.ones((20, 40, 3))
    light[4:7, 38:] = np.nan  # six texels at the edge that is beside the left one
    light[5, 0] = np.nan
    light[:, 20:38] = 3
    found, notes = mended(Path("room.exr"), light)
    assert notes == (f"7 texels were no number and {NEXT_TO}",)
    assert found[5, 39, 0] < 2 < found[5, 38, 0]
    np.testing.assert_array_equal(found[light == 1], 1)


def test_larger_pictures_are_averaged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("storage.readers.environments.LARGEST_WIDTH", 16)
    light, notes = read_environment(
        exr(tmp_path / "room.exr", {"RGB": radiance(height=16, width=32)})
    )
    blocks = radiance(height=16, width=32).reshape(8, 2, 16, 2, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(light, blocks, rtol=1e-5)
    assert notes[0].startswith("32 x 16 pixels were averaged to 16 x 8")


def one_sentence(error: BadInput, file: str) -> str:
    text = str(error)
    assert re.fullmatch(re.escape(file) + r": .+ is .+; expected .+\.", text)
    assert ". " not in text
    return text


@pytest.mark.parametrize(("name", "reason", "write"), REFUSED, ids=[row[0] for row in REFUSED])
def test_refusals_say_why(
    tmp_path: Path, name: str, reason: str, write: Callable[[Path], Any]
) -> None:
    write(tmp_path / name)
    with pytest.raises(BadInput) as caught:
        read_environment(tmp_path / name)
    assert one_sentence(caught.value, name).startswith(f"{name}: {reason}")


def test_a_file_that_cannot_be_opened(tmp_path: Path) -> None:
    file = exr(tmp_path / "room.exr", {"RGB": radiance()})
    with pytest.raises(BadInput) as caught:
        read_environment(file / "inner.exr")
    assert "file is unreadable (Not a directory)" in one_sentence(caught.value, "inner.exr")


def test_truncated_files_are_refused_wherever_they_end(tmp_path: Path) -> None:
    whole = [
        ("flat.hdr", hdr(rgbe_pixels(), False)),
        ("runs.hdr", hdr(rgbe_pixels(), True)),
        ("zip.exr", exr(tmp_path / "zip.exr", {"RGB": radiance(np.float16)}).read_bytes()),
    ]
    for name, data in whole:
        file = tmp_path / name
        file.write_bytes(data)
        read_environment(file)
        for end in (12, 40, len(data) // 3, len(data) // 2, len(data) - 100, len(data) - 1):
            file.write_bytes(data[:end])
            with pytest.raises(BadInput) as caught:
                read_environment(file)
            assert ": content is " in one_sentence(caught.value, name), end


def test_importing_loads_nothing_heavy() -> None:
    code = "import sys, storage.readers.environments; print(*sys.modules)"
    modules = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"cv2", "numba", "OpenEXR", "scipy", "skimage", "xarray", "zarr"} & set(modules)
