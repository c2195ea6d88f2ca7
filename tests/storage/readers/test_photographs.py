"""Photographs: files written by hand or by other encoders against the values put into them."""

from __future__ import annotations

import pickle
import re
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
import tifffile
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image

from storage.readers import BadInput
from storage.readers.photographs import (
    BUILTIN_PHOTOGRAPHS,
    builtin_photograph,
    read_photograph,
)

HEIGHT, WIDTH = 66, 70


def picture(dtype: type, channels: int = 3, seed: int = 3) -> NDArray[Any]:
    values = np.random.default_rng(seed).random((HEIGHT, WIDTH, channels))
    if np.issubdtype(dtype, np.floating):
        return (4 * values).astype(dtype)
    return (values * (np.iinfo(dtype).max + 1)).astype(dtype)


def light_of(codes: NDArray[Any]) -> NDArray[np.float64]:
    """IEC 61966-2-1 one value at a time, from the text of the standard."""

    def decode(code: float) -> float:
        encoded = code / np.iinfo(codes.dtype).max
        return encoded / 12.92 if encoded <= 0.04045 else ((encoded + 0.055) / 1.055) ** 2.4

    return np.array(np.vectorize(decode, otypes=[float])(codes))


def png_bytes(pixels: NDArray[Any], colour_type: int, *chunks: tuple[bytes, bytes]) -> bytes:
    """A PNG by hand: one IDAT, no filters."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        )

    height, width = pixels.shape[:2]
    depth = 8 * pixels.dtype.itemsize
    rows = b"".join(b"\0" + row.astype(pixels.dtype.newbyteorder(">")).tobytes() for row in pixels)
    header = struct.pack(">IIBBBBB", width, height, depth, colour_type, 0, 0, 0)
    parts = [chunk(b"IHDR", header), *(chunk(*c) for c in chunks)]
    parts += [chunk(b"IDAT", zlib.compress(rows)), chunk(b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def exr_file(path: Path, channels: dict[str, NDArray[Any]], **header: Any) -> Path:
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | header
    contiguous = {name: np.ascontiguousarray(values) for name, values in channels.items()}
    with OpenEXR.File(header, contiguous) as file:
        file.write(str(path))
    return path


def rgb_profile(primaries: NDArray[np.float64], description: str) -> bytes:
    """A version 4 matrix profile by hand (ICC.1:2022): D50 colorants, the sRGB curve."""

    def s15_fixed16(*values: float) -> bytes:
        return b"".join(struct.pack(">i", round(value * 65536)) for value in values)

    text = description.encode("utf-16-be")
    curve = b"para" + bytes(4) + struct.pack(">HH", 3, 0)
    curve += s15_fixed16(2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)
    tags = {
        b"desc": b"mluc"
        + bytes(4)
        + struct.pack(">II2s2sII", 1, 12, b"en", b"US", len(text), 28)
        + text,
        b"wtpt": b"XYZ " + bytes(4) + s15_fixed16(0.9642, 1.0, 0.8249),
        **{
            name: b"XYZ " + bytes(4) + s15_fixed16(*primaries[:, column])
            for column, name in enumerate((b"rXYZ", b"gXYZ", b"bXYZ"))
        },
        **dict.fromkeys((b"rTRC", b"gTRC", b"bTRC"), curve),
    }
    table, body = struct.pack(">I", len(tags)), b""
    for name, data in tags.items():
        table += name + struct.pack(">II", 128 + 4 + 12 * len(tags) + len(body), len(data))
        body += data + bytes(-len(data) % 4)
    header = struct.pack(
        ">I4xI4s4s4s", 128 + len(table + body), 0x04300000, b"mntr", b"RGB ", b"XYZ "
    )
    header += bytes(12) + b"acsp" + bytes(28) + s15_fixed16(0.9642, 1.0, 0.8249)
    return header.ljust(128, b"\0") + table + body


def adapted_primaries(red: tuple[float, float], green: tuple[float, float]) -> NDArray[np.float64]:
    """Linear RGB to XYZ under D50 of a space with sRGB's blue and white, by Bradford's method."""
    xy = np.array([red, green, (0.15, 0.06)])
    unscaled = np.stack([xy[:, 0] / xy[:, 1], np.ones(3), (1 - xy.sum(1)) / xy[:, 1]])
    d65 = np.array([0.3127 / 0.3290, 1, (1 - 0.3127 - 0.3290) / 0.3290])
    to_xyz = unscaled * np.linalg.solve(unscaled, d65)
    cone = np.array(
        [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
    )
    scale = np.diag(cone @ [0.9642, 1, 0.8249] / (cone @ d65))
    return np.array(np.linalg.inv(cone) @ scale @ cone @ to_xyz)


DISPLAY_P3 = adapted_primaries((0.68, 0.32), (0.265, 0.69))
SRGB = adapted_primaries((0.64, 0.33), (0.30, 0.60))

# --- What is read -------------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_png_written_by_hand_is_read_at_full_precision(tmp_path: Path, dtype: type) -> None:
    file = tmp_path / "fur.png"
    for channels, colour_type in ((3, 2), (1, 0)):
        codes = picture(dtype, channels)
        file.write_bytes(png_bytes(codes, colour_type))
        light = read_photograph(file).radiance
        assert light.dtype == np.float32
        assert light.shape == (HEIGHT, WIDTH, 3)
        np.testing.assert_allclose(light, np.broadcast_to(light_of(codes), light.shape), rtol=3e-7)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 65534))
def test_neighbouring_16_bit_codes_stay_apart(tmp_path_factory: Any, code: int) -> None:
    codes = np.full((64, 64, 3), code, np.uint16)
    codes[0] += 1
    file = tmp_path_factory.mktemp("codes") / "fur.png"
    file.write_bytes(png_bytes(codes, 2))
    light = read_photograph(file).radiance
    assert (light[0] > light[1]).all()


@pytest.mark.parametrize("compression", [None, "zlib"])
@pytest.mark.parametrize("byteorder", ["<", ">"])
def test_16_bit_tiff(tmp_path: Path, compression: str | None, byteorder: Any) -> None:
    codes = picture(np.uint16)
    file = tmp_path / "fur.tif"
    tifffile.imwrite(file, codes, photometric="rgb", compression=compression, byteorder=byteorder)
    np.testing.assert_allclose(read_photograph(file).radiance, light_of(codes), rtol=3e-7)


def test_lzw_tiff_of_either_depth(tmp_path: Path) -> None:
    codes = picture(np.uint8)
    Image.fromarray(codes).save(tmp_path / "fur.tif", compression="tiff_lzw")
    np.testing.assert_allclose(
        read_photograph(tmp_path / "fur.tif").radiance, light_of(codes), rtol=3e-7
    )
    grey = picture(np.uint16, 1)
    Image.fromarray(grey[..., 0]).save(tmp_path / "grey.tif", compression="tiff_lzw")
    expected = np.broadcast_to(light_of(grey), (HEIGHT, WIDTH, 3))
    np.testing.assert_allclose(read_photograph(tmp_path / "grey.tif").radiance, expected, rtol=3e-7)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_tiff_in_which_white_is_zero(tmp_path: Path, dtype: type) -> None:
    codes = picture(dtype, 1)
    file = tmp_path / "negative.tif"
    tifffile.imwrite(file, codes[..., 0], photometric="miniswhite")
    expected = light_of(np.iinfo(dtype).max - codes)
    np.testing.assert_allclose(read_photograph(file).radiance[..., :1], expected, rtol=3e-7)


def test_tiff_with_a_channel_that_is_not_alpha(tmp_path: Path) -> None:
    for dtype in (np.uint8, np.uint16):
        codes = picture(dtype, 4)
        file = tmp_path / f"{np.dtype(dtype)}.tif"
        tifffile.imwrite(file, codes, photometric="rgb", extrasamples=["unspecified"])
        np.testing.assert_allclose(
            read_photograph(file).radiance, light_of(codes[..., :3]), rtol=3e-7
        )


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_float_tiff_is_linear(tmp_path: Path, dtype: type) -> None:
    light = picture(dtype)
    tifffile.imwrite(tmp_path / "fur.tif", light, photometric="rgb")
    np.testing.assert_allclose(read_photograph(tmp_path / "fur.tif").radiance, light, rtol=1e-7)


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_exr_is_linear_and_unbounded(tmp_path: Path, dtype: type) -> None:
    light = picture(dtype)
    file = exr_file(tmp_path / "fur.exr", {"RGB": light})
    np.testing.assert_array_equal(read_photograph(file).radiance, light.astype(np.float32))
    assert read_photograph(file).radiance.max() > 1
    file = exr_file(tmp_path / "grey.exr", {"Y": light[..., 0]})
    np.testing.assert_array_equal(
        read_photograph(file).radiance[..., 2], light[..., 0].astype(np.float32)
    )
    opaque = exr_file(tmp_path / "a.exr", {"RGBA": np.dstack([light, np.ones_like(light[..., 0])])})
    np.testing.assert_array_equal(read_photograph(opaque).radiance, light.astype(np.float32))


def test_jpeg_is_close_to_what_was_encoded(tmp_path: Path) -> None:
    across, down = np.meshgrid(np.linspace(20, 230, WIDTH), np.linspace(20, 230, HEIGHT))
    codes = np.dstack([across, down, (across + down) / 2]).astype(np.uint8)
    Image.fromarray(codes).save(tmp_path / "fur.jpg", quality=98, subsampling=0)
    assert np.abs(read_photograph(tmp_path / "fur.jpg").radiance - light_of(codes)).max() < 0.03


def test_palette_and_opaque_alpha_are_converted(tmp_path: Path) -> None:
    codes = picture(np.uint8) // 128 * 255
    Image.fromarray(codes).quantize(8).save(tmp_path / "palette.png")
    np.testing.assert_allclose(read_photograph(tmp_path / "palette.png").radiance, codes / 255)
    codes = picture(np.uint16, 4)
    codes[..., 3] = 65535
    (tmp_path / "rgba.png").write_bytes(png_bytes(codes, 6))
    expected = light_of(codes[..., :3])
    np.testing.assert_allclose(read_photograph(tmp_path / "rgba.png").radiance, expected, rtol=3e-7)
    (tmp_path / "la.png").write_bytes(png_bytes(codes[..., [0, 3]], 4))
    np.testing.assert_allclose(
        read_photograph(tmp_path / "la.png").radiance[..., 1], expected[..., 0]
    )


def test_crop_is_left_top_width_height(tmp_path: Path) -> None:
    codes = picture(np.uint8)
    (tmp_path / "fur.png").write_bytes(png_bytes(codes, 2))
    light = read_photograph(tmp_path / "fur.png", crop=(5, 1, 64, 65)).radiance
    np.testing.assert_allclose(light, light_of(codes[1:66, 5:69]), rtol=3e-7)


def _eight_orientations(upright: NDArray[Any]) -> dict[int, NDArray[Any]]:
    """How an upright picture is stored, by the words of EXIF 2.32: 'the 0th row is at the
    visual top/bottom/left/right of the picture, the 0th column at the ...'."""
    across = np.transpose(upright, (1, 0, 2))
    return {
        1: upright,  # row: top, column: left
        2: np.fliplr(upright),  # top, right
        3: np.flipud(np.fliplr(upright)),  # bottom, right
        4: np.flipud(upright),  # bottom, left
        5: across,  # left, top
        6: np.flipud(across),  # right, top
        7: np.flipud(np.fliplr(across)),  # right, bottom
        8: np.fliplr(across),  # left, bottom
    }


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_orientation_is_honoured(tmp_path: Path, orientation: int, dtype: type) -> None:
    upright = picture(dtype)
    stored = _eight_orientations(upright)[orientation]
    tag = [(274, "H", 1, orientation, True)]
    tifffile.imwrite(tmp_path / "fur.tif", stored, photometric="rgb", extratags=tag)
    np.testing.assert_allclose(
        read_photograph(tmp_path / "fur.tif").radiance, light_of(upright), rtol=3e-7
    )
    exif = b"MM\0*\0\0\0\x08" + struct.pack(">HHHIHHI", 1, 274, 3, 1, orientation, 0, 0)
    (tmp_path / "fur.png").write_bytes(png_bytes(stored, 2, (b"eXIf", exif)))
    np.testing.assert_allclose(
        read_photograph(tmp_path / "fur.png").radiance, light_of(upright), rtol=3e-7
    )


def _smooth() -> NDArray[np.uint8]:
    across, down = np.meshgrid(np.linspace(20, 230, WIDTH), np.linspace(60, 160, HEIGHT))
    return np.dstack([across, down, (across + down) / 2]).astype(np.uint8)


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("name", ["fur.jpg", "fur.webp", "fur.avif"])
def test_orientation_of_lossy_formats(tmp_path: Path, name: str, orientation: int) -> None:
    exif = Image.Exif()
    exif[0x0112] = orientation
    stored = Image.fromarray(np.ascontiguousarray(_eight_orientations(_smooth())[orientation]))
    options: dict[str, Any] = {"lossless": True} if name == "fur.webp" else {"quality": 97}
    stored.save(tmp_path / name, exif=exif, **options)
    found = read_photograph(tmp_path / name)
    assert found.notes == ()
    assert found.radiance.shape == (HEIGHT, WIDTH, 3)
    assert np.abs(found.radiance - light_of(_smooth())).max() < 0.04


@pytest.mark.parametrize("orientation", range(1, 9))
def test_orientation_turns_alpha_and_planes_too(tmp_path: Path, orientation: int) -> None:
    upright = picture(np.uint16, 4)
    stored = _eight_orientations(upright)[orientation]
    tifffile.imwrite(
        tmp_path / "fur.tif",
        np.moveaxis(stored, -1, 0),
        photometric="rgb",
        planarconfig="separate",
        extrasamples=["unassalpha"],
        extratags=[(274, "H", 1, orientation, True)],
    )
    found = read_photograph(tmp_path / "fur.tif")
    opaque = upright[..., 3] / 65535 >= 0.5
    assert found.opaque is not None
    np.testing.assert_array_equal(found.opaque, opaque)
    expected = np.where(opaque[..., None], light_of(upright[..., :3]), 0)
    np.testing.assert_allclose(found.radiance, expected, rtol=3e-7)


def test_display_p3_is_converted_like_the_closed_form(tmp_path: Path) -> None:
    codes = picture(np.uint8) // 3 + 80  # not so colourful that sRGB would have to clip
    expected = light_of(codes) @ (np.linalg.inv(SRGB) @ DISPLAY_P3).T
    assert 0 < expected.min() < expected.max() < 1
    profile = rgb_profile(DISPLAY_P3, "Display P3")
    for name in ("fur.png", "fur.tif"):
        Image.fromarray(codes).save(tmp_path / name, icc_profile=profile)
        light = read_photograph(tmp_path / name).radiance
        assert np.abs(light - expected).max() < 0.01  # a step of 255 is 0.009 in the lights
        assert np.abs(light - light_of(codes)).max() > 0.03


@pytest.mark.parametrize("dtype", [np.uint16, np.float32])
def test_deep_files_are_converted_by_their_profile(tmp_path: Path, dtype: type) -> None:
    codes = picture(np.uint16) // 3 + 20000  # not so colourful that sRGB would have to clip
    values = codes if dtype == np.uint16 else (codes / 65535).astype(np.float32)
    expected = light_of(codes) @ (np.linalg.inv(SRGB) @ DISPLAY_P3).T
    profile = rgb_profile(DISPLAY_P3, "Display P3")
    tags = [(34675, 7, None, profile, True)]
    tifffile.imwrite(tmp_path / "fur.tif", values, photometric="rgb", extratags=tags)
    found = read_photograph(tmp_path / "fur.tif")
    assert np.abs(found.radiance - expected).max() < 1e-4  # the profile's numbers have 16 bits
    assert found.notes == ("The colours were converted to sRGB from the ICC profile 'Display P3'.",)


def test_an_srgb_profile_changes_nothing(tmp_path: Path) -> None:
    profile = rgb_profile(SRGB, "Some maker's sRGB")
    for dtype in (np.uint8, np.uint16):
        codes = picture(dtype)
        chunk = (b"iCCP", b"any\0\0" + zlib.compress(profile))
        (tmp_path / "fur.png").write_bytes(png_bytes(codes, 2, chunk))
        expected = light_of(codes)
        np.testing.assert_allclose(
            read_photograph(tmp_path / "fur.png").radiance, expected, rtol=3e-7
        )


@pytest.mark.parametrize("name", BUILTIN_PHOTOGRAPHS)
def test_builtin_photographs_ship_with_scikit_image(name: str) -> None:
    light = builtin_photograph(name).radiance
    width, height = BUILTIN_PHOTOGRAPHS[name].crop[2:]
    assert light.shape == (height, width, 3)
    assert light.std() > 0.02


# --- What is refused ----------------------------------------------------------------------------


def save_png(pixels: NDArray[Any], colour_type: int = 2, *chunks: tuple[bytes, bytes]) -> Any:
    return lambda path: path.write_bytes(png_bytes(pixels, colour_type, *chunks))


def save_tiff(pixels: NDArray[Any], **options: Any) -> Any:
    return lambda path: tifffile.imwrite(path, pixels, **options)


def save_exr(pixels: NDArray[Any], channels: str = "RGB", **header: Any) -> Any:
    return lambda path: exr_file(path, {channels: pixels}, **header)


def _through(pixels: NDArray[Any], most: float) -> NDArray[Any]:
    """With an alpha of at most so much."""
    pixels[..., 3] = np.minimum(pixels[..., 3], most)
    return pixels


def _save_nan_row(path: Path) -> None:
    light = picture(np.float32)
    light[7] = np.nan
    tifffile.imwrite(path, light, photometric="rgb")


def _huge_png(path: Path) -> None:
    data = bytearray(png_bytes(picture(np.uint8), 2))
    data[16:24] = struct.pack(">II", 30000, 20000)
    data[29:33] = struct.pack(">I", zlib.crc32(bytes(data[12:29])))
    path.write_bytes(data)


TRUNCATED_EXR_HEADER = b"\x76\x2f\x31\x01\x02\0\0\0channels\0chlist\0"

REFUSED: list[tuple[str, str, Callable[[Path], Any]]] = [
    ("missing.png", "file is missing", lambda path: None),
    ("folder.png", "file is a directory", lambda path: path.mkdir()),
    ("notes.png", "format is unknown", lambda path: path.write_text("no picture")),
    ("empty.jpg", "format is unknown (the file is empty)", lambda path: path.touch()),
    (
        "live.jpg",
        "format is HEIC",
        lambda path: path.write_bytes(b"\0\0\0\x28ftypheic" + bytes(90)),
    ),
    ("constant.png", "picture is all of one colour", save_png(np.full((64, 64, 3), 9, np.uint8))),
    ("black.png", "picture is all black", save_png(np.zeros((64, 64, 3), np.uint16))),
    ("thin.png", "width is 1 pixel; expected at least 64", save_png(picture(np.uint8)[:, :1])),
    ("low.exr", "height is 63 pixels", save_exr(picture(np.float16)[:63])),
    ("bomb.png", "size is 30000 x 20000 pixels; expected at most 400", _huge_png),
    ("no.png", "alpha is transparent in 100 %", save_png(_through(picture(np.uint8, 4), 127), 6)),
    ("dim.exr", "alpha is transparent in", save_exr(_through(picture(np.float32, 4), 0.4), "RGBA")),
    ("nan.tif", "in 1.52 % of the pixels is not finite, first at column 0, row 7", _save_nan_row),
    ("cold.tif", "light is negative in", save_tiff(picture(np.float32) - 2, photometric="rgb")),
    ("depth.exr", "channels is Z", save_exr(picture(np.float32, 1)[..., 0], "Z")),
    ("head.exr", "content is truncated", lambda path: path.write_bytes(TRUNCATED_EXR_HEADER)),
    ("signed.tif", "sample type is int16", save_tiff(picture(np.int16), photometric="rgb")),
    (
        "curve.png",
        "colour code points is primaries 9, transfer 200",
        save_png(picture(np.uint8), 2, (b"cICP", bytes((9, 200, 0, 1)))),
    ),
    (
        "flat.png",
        "cHRM chunk is",
        save_png(
            picture(np.uint8),
            2,
            (b"gAMA", struct.pack(">I", 100000)),
            (b"cHRM", struct.pack(">8I", *[31270, 32900] * 4)),
        ),
    ),
]


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
        read_photograph(tmp_path / name)
    assert reason in one_sentence(caught.value, name)


@pytest.mark.parametrize(
    ("crop", "reason"),
    [
        ((-1, 0, 64, 64), "crop is left -1"),
        ((8, 0, 64, 64), "crop is left 8"),
        ((0, 0, 64, 67), "inside the picture's 70 x 66 pixels"),
        ((0, 0, 64, 10), "crop's height is 10 pixels"),
        ((0, 0, -5, 64), "crop's width is -5 pixels"),
    ],
)
def test_crops_outside_or_too_small(
    tmp_path: Path, crop: tuple[int, int, int, int], reason: str
) -> None:
    (tmp_path / "fur.png").write_bytes(png_bytes(picture(np.uint8), 2))
    with pytest.raises(BadInput) as caught:
        read_photograph(tmp_path / "fur.png", crop)
    assert reason in one_sentence(caught.value, "fur.png")


def _complete_files(folder: Path) -> list[Path]:
    codes = picture(np.uint8)
    (folder / "8.png").write_bytes(png_bytes(codes, 2))
    (folder / "16.png").write_bytes(png_bytes(picture(np.uint16), 2))
    Image.fromarray(codes).save(folder / "8.jpg")
    Image.fromarray(codes).save(folder / "progressive.jpg", progressive=True)
    Image.fromarray(codes).save(folder / "lzw.tif", compression="tiff_lzw")
    tifffile.imwrite(folder / "16.tif", picture(np.uint16), photometric="rgb", compression="zlib")
    tifffile.imwrite(folder / "float.tif", picture(np.float32), photometric="rgb")
    exr_file(folder / "zip.exr", {"RGB": picture(np.float16)})
    exr_file(folder / "raw.exr", {"RGB": picture(np.float32)}, compression=OpenEXR.NO_COMPRESSION)
    return sorted(folder.iterdir())


def test_truncated_files_are_refused_wherever_they_end(tmp_path: Path) -> None:
    whole = tmp_path / "whole"
    whole.mkdir()
    for file in _complete_files(whole):
        read_photograph(file)
        data = file.read_bytes()
        for end in (10, 40, len(data) // 3, len(data) // 2, len(data) - 300, len(data) - 1):
            cut = tmp_path / f"cut{file.suffix}"
            cut.write_bytes(data[:end])
            with pytest.raises(BadInput) as caught:
                read_photograph(cut)
            assert "content is truncated or damaged" in one_sentence(caught.value, cut.name), end


def test_an_unknown_builtin_photograph() -> None:
    with pytest.raises(BadInput, match="built-in photograph is unknown; expected grass, chelsea"):
        builtin_photograph("dog")


def test_the_error_travels_between_processes_and_keeps_its_parts() -> None:
    error = pickle.loads(pickle.dumps(BadInput("in/fur\n.png", "width", "1 pixel", "64 pixels")))
    assert (error.file, error.field) == ("in/fur\n.png", "width")
    assert (error.found, error.expected) == ("1 pixel", "64 pixels")
    assert str(error) == "fur?.png: width is 1 pixel; expected 64 pixels."
