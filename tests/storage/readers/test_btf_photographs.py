"""UBO2003, ATRIUM and UTIA: archives written by hand against the values put into them."""

from __future__ import annotations

import io
import os
import pickle
import re
import struct
import zipfile
import zlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image

from storage.readers import BadInput
from storage.readers.btf import MeasuredBTF, open_btf
from tests.storage.readers.btf_writers import (
    EIGHTY_ONE,
    FIFTEEN,
    exr_bytes,
    hdr_bytes,
    jpeg_bytes,
    light_of_codes,
    light_of_rgbe,
    png_bytes,
    rgbe_of,
    ubo_name,
    utia_name,
    write_folder,
    write_ubo2003_zip,
    write_zip,
    xyz_of_linear_rgb,
)

HEIGHT, WIDTH = 8, 9
LIGHTS = [(0, 0), (30, 120), (60, 45)]
VIEWS = [(0, 0), (60, 45)]
PAIRS = [(light, view) for view in VIEWS for light in LIGHTS]
Files = dict[str, bytes]


def codes(seed: int = 5) -> NDArray[np.uint8]:
    shape = (len(PAIRS), HEIGHT, WIDTH, 3)
    return np.random.default_rng(seed).integers(0, 256, shape).astype(np.uint8)


def smooth_codes(images: int) -> NDArray[np.uint8]:
    """What JPEG keeps well: slow gradients, another colour in every image."""
    y, x = np.mgrid[:HEIGHT, :WIDTH] * 4.0
    base = np.stack([x + 60, y + 90, x + y + 40], axis=-1)
    return np.stack([base + 100 * (k % 15) / 15 for k in range(images)]).astype(np.uint8)


def hdr_light(seed: int = 6) -> NDArray[np.float64]:
    values = np.random.default_rng(seed).random((len(PAIRS), HEIGHT, WIDTH, 3))
    return np.asarray(values**3 * 40 + 0.01)


def png_files(images: NDArray[np.uint8] | None = None) -> Files:
    pictures = codes() if images is None else images
    return {utia_name(*pair): png_bytes(image) for pair, image in zip(PAIRS, pictures, strict=True)}


def exr_files(images: NDArray[Any], names: str = "XYZ", **header: Any) -> Files:
    return {
        utia_name(*pair, suffix="exr"): exr_bytes(
            dict(zip(names, np.moveaxis(image, -1, 0), strict=True)), **header
        )
        for pair, image in zip(PAIRS, images, strict=True)
    }


def whole(btf: MeasuredBTF) -> NDArray[np.float32]:
    block = btf.read(0, btf.images)
    assert block.dtype == np.float32
    assert block.shape == (btf.images, btf.height, btf.width, 3)
    return block


def refusal(action: Callable[[], Any], file: str) -> str:
    with pytest.raises(BadInput) as caught:
        action()
    text = str(caught.value)
    assert re.fullmatch(re.escape(file) + r": .+ is .+; expected .+\.", text), text
    assert ". " not in text
    return text


# --- What is read -------------------------------------------------------------------------------


def test_png_is_exact_and_in_order_in_zip_and_folder(tmp_path: Path) -> None:
    files = dict(reversed(png_files().items())) | {"readme.txt": b"UTIA"}
    archive = write_zip(tmp_path / "wood.zip", files | {"tv000_pv000/": b""})
    folder = write_folder(tmp_path / "wood", files)
    for path in (archive, folder, str(archive)):
        btf = open_btf(path)
        assert (btf.layout, btf.colour) == ("UTIA (PNG)", "8-bit sRGB decoded to linear RGB")
        assert btf.name == Path(path).name
        assert (btf.views, btf.lights_per_view, btf.images) == (2, 3, 6)
        assert (btf.height, btf.width) == (HEIGHT, WIDTH)
        assert btf.shifted_lights == 2  # (0, 0) and (60, 45) are both a light and a view
        np.testing.assert_allclose(np.degrees(btf.light), [light for light, _ in PAIRS])
        np.testing.assert_allclose(np.degrees(btf.view), [view for _, view in PAIRS])
        np.testing.assert_allclose(whole(btf), light_of_codes(codes()), rtol=1e-6)


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_members_may_be_stored_or_deflated(tmp_path: Path, method: int) -> None:
    btf = open_btf(write_zip(tmp_path / "wood.zip", png_files(), method))
    np.testing.assert_allclose(btf.read(4, 6), light_of_codes(codes()[4:]), rtol=1e-6)


def test_jpeg_of_fifteen_directions(tmp_path: Path) -> None:
    images = smooth_codes(15 * 15)
    btf = open_btf(write_ubo2003_zip(tmp_path / "wool.zip", images, FIFTEEN, FIFTEEN))
    assert btf.layout == "UBO2003 / ATRIUM (JPEG)"
    assert (btf.views, btf.lights_per_view, btf.shifted_lights) == (15, 15, 0)
    np.testing.assert_allclose(np.degrees(btf.light[15:30]), FIFTEEN)
    np.testing.assert_allclose(np.degrees(btf.view[15 * 3]), FIFTEEN[3])
    # JPEG is not exact: compare with Pillow's decoding, and that with what was encoded.
    block = btf.read(30, 45)
    for image, light in zip(images[30:45], block, strict=True):
        decoded = np.asarray(Image.open(io.BytesIO(jpeg_bytes(image))))
        assert np.abs(decoded.astype(int) - image).max() < 8
        assert np.abs(light - light_of_codes(decoded)).max() < 0.01
        np.testing.assert_allclose(light, light_of_codes(image), atol=0.05)


def test_channels_of_a_jpeg_are_red_green_blue(tmp_path: Path) -> None:
    images = np.zeros((1, 8, 16, 3), np.uint8) + np.array([230, 120, 20], np.uint8)
    btf = open_btf(write_ubo2003_zip(tmp_path / "wool.zip", images, [(0, 0)], [(15, 0)]))
    np.testing.assert_allclose(whole(btf), light_of_codes(images), atol=0.01)


def test_long_headers(tmp_path: Path) -> None:
    image = smooth_codes(1)[0]
    for data in (jpeg_bytes(image, comment=b"wool" * 5000), jpeg_bytes(image, progressive=True)):
        btf = open_btf(write_zip(tmp_path / "wool.zip", {ubo_name((0, 0), (0, 0)): data}))
        np.testing.assert_allclose(whole(btf)[0], light_of_codes(image), atol=0.05)


def test_orientation_tags_are_not_followed(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x0112] = 6
    image = smooth_codes(1)[0]
    data = jpeg_bytes(image, exif=exif)
    btf = open_btf(write_zip(tmp_path / "wool.zip", {ubo_name((0, 0), (0, 0)): data}))
    assert (btf.height, btf.width) == (HEIGHT, WIDTH)
    np.testing.assert_allclose(whole(btf)[0], light_of_codes(image), atol=0.05)


@pytest.mark.parametrize(
    ("dtype", "name"), [(np.float16, "half float"), (np.float32, "32-bit float")]
)
def test_exr_in_cie_xyz_becomes_linear_rgb(tmp_path: Path, dtype: type, name: str) -> None:
    stored: NDArray[Any] = (hdr_light() @ xyz_of_linear_rgb().T).astype(dtype)
    expected = stored.astype(np.float64) @ np.linalg.inv(xyz_of_linear_rgb()).T
    btf = open_btf(write_zip(tmp_path / "wood.zip", exr_files(stored)))
    assert btf.layout == "UTIA (EXR)"
    assert btf.colour == f"{name} CIE XYZ (D65) converted to linear sRGB"
    light = whole(btf)
    np.testing.assert_allclose(light, expected, rtol=1e-5, atol=1e-5)
    assert light.max() > 1


def test_colours_outside_the_gamut_keep_their_negative_values(tmp_path: Path) -> None:
    stored = np.zeros((6, HEIGHT, WIDTH, 3), np.float16) + np.array([0.1, 0.5, 0.2], np.float16)
    light = whole(open_btf(write_zip(tmp_path / "wood.zip", exr_files(stored))))
    assert light[..., 0].max() < -0.5


@pytest.mark.parametrize("xyz", [False, True])
def test_exr_in_rgb_is_as_stored_unless_its_chromaticities_are_those_of_xyz(
    tmp_path: Path, xyz: bool
) -> None:
    stored = hdr_light().astype(np.float16)
    third = 1 / 3
    primaries = (
        (1, 0, 0, 1, 0, 0, third, third)
        if xyz
        else (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)
    )
    btf = open_btf(
        write_folder(tmp_path / "wood", exr_files(stored, "RGB", chromaticities=primaries))
    )
    if xyz:
        assert btf.colour == "half float CIE XYZ (D65) converted to linear sRGB"
        expected = stored.astype(np.float64) @ np.linalg.inv(xyz_of_linear_rgb()).T
        np.testing.assert_allclose(whole(btf), expected, rtol=1e-5, atol=1e-4)
    else:
        assert btf.colour == "half float linear RGB as stored"
        np.testing.assert_array_equal(whole(btf), stored.astype(np.float32))


def test_radiance_pictures_keep_what_is_above_one(tmp_path: Path) -> None:
    rgbe = [rgbe_of(light) for light in hdr_light()]
    files = {
        ubo_name(*pair, index=k, suffix="hdr"): hdr_bytes(image, "+X -Y")
        for k, (pair, image) in enumerate(zip(PAIRS, rgbe, strict=True))
    }
    btf = open_btf(write_zip(tmp_path / "ceiling.zip", files))
    assert btf.layout == "ATRIUM HDR"
    assert btf.colour == "Radiance RGBE, exposure divided out, taken as linear sRGB"
    light = whole(btf)
    np.testing.assert_allclose(light, np.stack([light_of_rgbe(image) for image in rgbe]), rtol=1e-6)
    np.testing.assert_allclose(light, hdr_light(), atol=0.4)
    assert light.max() > 30


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_crop_is_left_top_width_height(tmp_path_factory: Any, data: Any) -> None:
    path = tmp_path_factory.getbasetemp() / "cropped.zip"
    if not path.exists():
        write_zip(path, png_files())
    left, top = data.draw(st.integers(-1, WIDTH)), data.draw(st.integers(-1, HEIGHT))
    width, height = data.draw(st.integers(-1, WIDTH + 1)), data.draw(st.integers(-1, HEIGHT + 1))
    rows, columns = (
        range(HEIGHT)[max(top, 0) : top + height],
        range(WIDTH)[max(left, 0) : left + width],
    )
    if len(rows) != height or len(columns) != width or min(left, top) < 0 or min(width, height) < 1:
        text = refusal(lambda: open_btf(path, (left, top, width, height)), "cropped.zip")
        assert f"crop is left {left}, top {top}, {width} x {height} pixels" in text
        assert f"inside the photographs' {WIDTH} x {HEIGHT} pixels" in text
        return
    btf = open_btf(path, (left, top, width, height))
    assert (btf.height, btf.width) == (height, width)
    expected = light_of_codes(codes()[2:3, top : top + height, left : left + width])
    np.testing.assert_allclose(btf.read(2, 3), expected, rtol=1e-6)


def test_a_block_reads_its_own_files_only(tmp_path: Path) -> None:
    files = png_files()
    names = list(files)
    files[names[4]] = files[names[4]][:-20]
    btf = open_btf(write_folder(tmp_path / "wood", files))  # headers are all there
    (tmp_path / "wood" / names[0]).unlink()
    np.testing.assert_allclose(btf.read(1, 4), light_of_codes(codes()[1:4]), rtol=1e-6)
    assert btf.read(2, 2).shape == (0, HEIGHT, WIDTH, 3)
    text = refusal(lambda: btf.read(3, 6), os.path.basename(names[4]))
    assert "content is truncated or damaged; expected a complete PNG file" in text
    assert "file is missing" in refusal(lambda: btf.read(0, 1), os.path.basename(names[0]))


def test_photographs_that_do_not_exist(tmp_path: Path) -> None:
    btf = open_btf(write_zip(tmp_path / "wood.zip", png_files()))
    for first, last in ((-1, 2), (0, 7), (3, 2)):
        with pytest.raises(IndexError, match=f"photographs {first} to {last} of 6 in wood.zip"):
            btf.read(first, last)


def test_threads_and_pickled_copies_read_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_zip(tmp_path / "wood.zip", png_files())
    monkeypatch.chdir(tmp_path)
    btf = open_btf("wood.zip")
    monkeypatch.chdir("/")
    copy = pickle.loads(pickle.dumps(btf))
    expected = whole(btf)
    with ThreadPoolExecutor(8) as pool:
        for k, block in enumerate(pool.map(lambda k: copy.read(k % 6, k % 6 + 1), range(96))):
            np.testing.assert_array_equal(block[0], expected[k % 6])


def test_all_6561_headers_are_read(tmp_path: Path) -> None:
    image = png_bytes(codes()[0])
    files = {utia_name(light, view): image for view in EIGHTY_ONE for light in EIGHTY_ONE}
    btf = open_btf(write_zip(tmp_path / "wood.zip", files))
    assert (btf.views, btf.lights_per_view, btf.shifted_lights) == (81, 81, 81)
    np.testing.assert_allclose(btf.read(6560, 6561)[0], light_of_codes(codes()[0]), rtol=1e-6)
    odd = list(files)[4321]
    files[odd] = png_bytes(codes()[0][:, :-1])
    write_zip(tmp_path / "wood.zip", files)
    text = refusal(lambda: open_btf(tmp_path / "wood.zip"), os.path.basename(odd))
    assert "size is 8 x 8 pixels; expected 9 x 8 pixels as in the other files" in text


def test_a_database_may_be_in_parts(tmp_path: Path) -> None:
    files = list(png_files().items())
    (tmp_path / "wood" / "more").mkdir(parents=True)
    write_zip(tmp_path / "wood" / "one.zip", dict(files[:2]))
    write_zip(tmp_path / "wood" / "more" / "two.ZIP", dict(files[2:]) | {"readme.txt": b"UTIA"})
    (tmp_path / "wood" / "overview.jpg").write_bytes(b"no picture")
    btf = open_btf(tmp_path / "wood")
    np.testing.assert_allclose(whole(pickle.loads(pickle.dumps(btf))), light_of_codes(codes()))
    (note,) = btf.notes
    assert note == "1 file (readme.txt) was left out: no photographs of a pair."


def test_links_to_folders_are_followed_but_not_round_in_circles(tmp_path: Path) -> None:
    write_folder(tmp_path / "store", png_files())
    (tmp_path / "wood").mkdir()
    (tmp_path / "wood" / "link").symlink_to(tmp_path / "store")
    (tmp_path / "wood" / "link again").symlink_to(tmp_path / "store")
    (tmp_path / "store" / "back").symlink_to(tmp_path / "wood")
    btf = open_btf(tmp_path / "wood")
    assert btf.notes == ()
    np.testing.assert_allclose(whole(btf), light_of_codes(codes()), rtol=1e-6)


def test_any_photograph_that_is_transparent_is_refused_when_it_is_read(tmp_path: Path) -> None:
    alpha = np.full((*codes().shape[:3], 1), 255, np.uint8)
    alpha[4, 2, 3] = 254
    stored = np.concatenate([codes(), alpha], axis=-1)
    files = {
        utia_name(*pair): png_bytes(image, 6) for pair, image in zip(PAIRS, stored, strict=True)
    }
    path = write_zip(tmp_path / "wood.zip", files)
    btf = open_btf(path)
    assert btf.notes == ("6 photographs have an opaque alpha channel, which was left out.",)
    np.testing.assert_allclose(btf.read(0, 4), light_of_codes(codes()[:4]), rtol=1e-6)
    text = refusal(lambda: btf.read(4, 5), os.path.basename(utia_name(*PAIRS[4])))
    assert "alpha channel is not opaque at 1.4%" in text
    open_btf(path, (4, 0, 5, HEIGHT)).read(0, 6)  # beside it


@pytest.mark.parametrize("utia", [True, False])
def test_what_exr_do_not_say_is_told_with_the_setting(tmp_path: Path, utia: bool) -> None:
    stored = (hdr_light() @ xyz_of_linear_rgb().T).astype(np.float16)
    files = exr_files(stored, "RGB")
    if not utia:
        files = {f"wood/{name.split('/')[1]}".replace("_", "-"): d for name, d in files.items()}
    btf = open_btf(write_folder(tmp_path / "wood", files))
    (note,) = btf.notes
    taken, other = ("CIE XYZ", "rgb") if utia else ("linear sRGB", "xyz")
    assert f"taken as {taken}" in note
    assert note.endswith(f"set exr_colours to {other}.")
    set_by_hand = open_btf(tmp_path / "wood", exr_colours="xyz")
    assert set_by_hand.notes == ()
    np.testing.assert_allclose(whole(set_by_hand), hdr_light(), atol=0.05)


# --- What is refused before any work ------------------------------------------------------------

XYZ = hdr_light().astype(np.float16)[0]
RGBE = rgbe_of(hdr_light()[0])


def exr(planes: NDArray[Any], names: str = "XYZ", **header: Any) -> bytes:
    return exr_bytes(dict(zip(names, np.moveaxis(planes, -1, 0), strict=True)), **header)


def jpeg_of_mode(mode: str) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(codes()[0]).convert(mode).save(stream, "JPEG")
    return stream.getvalue()


ALPHA = np.dstack([codes()[0], codes()[0][..., :1]])
NOT_A_DATABASE: list[tuple[str, bytes, str]] = [
    ("png", png_bytes(ALPHA, 6), "alpha channel is not opaque at 100.0% of the pixels"),
    ("jpg", jpeg_of_mode("CMYK"), "pixel format is 8-bit CMYK; expected 8-bit grey or RGB"),
    ("png", b"GIF89a" + bytes(60), "format is unknown; expected a JPEG, PNG, EXR or Radiance"),
    ("png", b"", "format is unknown (the file is empty)"),
    ("png", png_bytes(codes()[0])[:20], "content is truncated or damaged"),
    ("png", png_bytes(codes()[0][:0]), "size is 9 x 0 pixels; expected 1 pixel to 64 megapixels"),
    ("jpg", jpeg_bytes(codes()[0])[:100], "content is truncated or damaged"),
    ("jpg", b"\xff\xd8\xff\xd9" + bytes(60), "content is truncated or damaged"),
    ("exr", exr(XYZ)[:200], "content is truncated or damaged"),
    ("exr", exr(XYZ, "XYA"), "channels is A, X, Y; expected R, G, B or X, Y, Z"),
    ("exr", exr(XYZ.astype(np.uint32)), "unsigned; expected half or float channels"),
    ("exr", exr(XYZ, "RGB", chromaticities=(0.7, 0.3, 0.7, 0.3, 0, 0, 0.3, 0.3)), "exr_colours"),
    ("hdr", hdr_bytes(RGBE, lines=["FORMAT=32-bit_rle_luv"]), "FORMAT is 32-bit_rle_luv"),
    ("hdr", b"#?RADIANCE\n\n-Y 6 -Y 9\n", "resolution line is '-Y 6 -Y 9'"),
    ("hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n", "content is truncated or damaged"),
]  # fmt: skip


@pytest.mark.parametrize(("suffix", "data", "reason"), NOT_A_DATABASE)
def test_formats_that_no_database_has(
    tmp_path: Path, suffix: str, data: bytes, reason: str
) -> None:
    name = utia_name((0, 0), (0, 0), suffix)
    path = write_zip(tmp_path / "wood.zip", {name: data})
    assert reason in refusal(lambda: open_btf(path), os.path.basename(name))
    folder = write_folder(tmp_path / "wood", {name: data})
    assert reason in refusal(lambda: open_btf(folder), os.path.basename(name))


def test_an_image_of_far_too_many_pixels(tmp_path: Path) -> None:
    data = bytearray(png_bytes(codes()[0]))
    data[16:24] = struct.pack(">II", 90000, 90000)
    path = write_zip(tmp_path / "wood.zip", {utia_name((0, 0), (0, 0)): bytes(data)})
    text = refusal(lambda: open_btf(path), "tl000_pl000_tv000_pv000.png")
    assert "size is 90000 x 90000 pixels; expected 1 pixel to 64 megapixels" in text


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (png_bytes(codes()[0][:-1]), "size is 9 x 7 pixels; expected 9 x 8 pixels as in"),
        (jpeg_bytes(codes()[0]), "format is JPEG; expected PNG as in the other files"),
    ],
)
def test_the_file_that_differs_is_named(tmp_path: Path, data: bytes, reason: str) -> None:
    files = png_files()
    first = next(iter(files))  # most files decide what is expected, not the first one
    path = write_zip(tmp_path / "wood.zip", files | {first: data})
    assert reason in refusal(lambda: open_btf(path), os.path.basename(first))


def test_half_and_float_may_mix(tmp_path: Path) -> None:
    files = exr_files(hdr_light().astype(np.float16))
    name = list(files)[3]
    path = write_zip(tmp_path / "wood.zip", files | {name: exr(XYZ.astype(np.float32))})
    light = whole(open_btf(path))
    np.testing.assert_allclose(light[3], light[0], rtol=1e-5, atol=1e-5)


def test_files_in_cie_xyz_and_in_rgb_do_not_mix(tmp_path: Path) -> None:
    files = exr_files(hdr_light().astype(np.float16))
    name = list(files)[3]
    path = write_zip(tmp_path / "wood.zip", files | {name: exr(XYZ, "RGB")})
    text = refusal(lambda: open_btf(path), os.path.basename(name))
    assert "colour is R, G, B; expected X, Y, Z" in text


def test_paths_that_are_no_database(tmp_path: Path) -> None:
    assert "file is missing" in refusal(lambda: open_btf(tmp_path / "no.zip"), "no.zip")
    (tmp_path / "empty.zip").touch()
    assert "the file is empty" in refusal(lambda: open_btf(tmp_path / "empty.zip"), "empty.zip")
    (tmp_path / "text.zip").write_text("no zip")
    assert "format is unknown" in refusal(lambda: open_btf(tmp_path / "text.zip"), "text.zip")
    write_zip(tmp_path / "none.zip", {})
    assert "without photographs" in refusal(lambda: open_btf(tmp_path / "none.zip"), "none.zip")
    write_zip(tmp_path / "doc.zip", {"readme.txt": b"hello", ".DS_Store": b""})
    assert "without photographs" in refusal(lambda: open_btf(tmp_path / "doc.zip"), "doc.zip")
    (tmp_path / "bare").mkdir()
    assert "without photographs" in refusal(lambda: open_btf(tmp_path / "bare"), "bare")
    (tmp_path / "wool.rar").write_bytes(b"Rar!\x1a\x07\x00" + bytes(50))
    text = refusal(lambda: open_btf(tmp_path / "wool.rar"), "wool.rar")
    assert "format is a RAR archive" in text
    assert "unpack it to a folder" in text


def test_truncated_zips_are_refused_wherever_they_end(tmp_path: Path) -> None:
    data = write_zip(tmp_path / "wood.zip", png_files()).read_bytes()
    for end in (5, 100, len(data) // 2, len(data) - 30, len(data) - 1):
        (tmp_path / "cut.zip").write_bytes(data[:end])
        text = refusal(lambda: open_btf(tmp_path / "cut.zip"), "cut.zip")
        assert "content is truncated or damaged; expected a complete zip" in text


def test_encrypted_and_oddly_compressed_members(tmp_path: Path) -> None:
    name = utia_name((0, 0), (0, 0))
    path = write_zip(tmp_path / "wood.zip", {name: png_bytes(codes()[0])})
    data = bytearray(path.read_bytes())
    data[data.rindex(b"PK\1\2") + 8] |= 1  # the directory's flags
    path.write_bytes(data)
    assert "content is encrypted" in refusal(lambda: open_btf(path), os.path.basename(name))
    write_zip(path, {name: png_bytes(codes()[0])}, zipfile.ZIP_LZMA)
    assert "zip compression is method 14" in refusal(lambda: open_btf(path), os.path.basename(name))


def test_members_that_unpack_to_too_much(tmp_path: Path) -> None:
    name = utia_name((0, 0), (0, 0))
    path = write_zip(tmp_path / "wood.zip", {name: png_bytes(codes()[0]) + bytes(64_000_001)})
    text = refusal(lambda: open_btf(path), os.path.basename(name))
    assert "bytes; expected at most 64 MB a photograph" in text
    # And one whose directory lies about it.
    write_zip(path, {name: png_bytes(codes()[0]) + bytes(1_000_000)})
    data = bytearray(path.read_bytes())
    at = data.rindex(b"PK\1\2") + 24
    data[at : at + 4] = struct.pack("<I", 500)
    path.write_bytes(data)
    text = refusal(lambda: open_btf(path).read(0, 1), os.path.basename(name))
    assert "content is damaged inside the zip" in text


# --- What is refused while reading --------------------------------------------------------------


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_a_byte_that_has_changed_inside_a_zip(tmp_path: Path, method: int) -> None:
    files = {ubo_name((0, 0), (0, 0)): jpeg_bytes(codes()[0])}
    path = write_zip(tmp_path / "wool.zip", files, method)
    data = bytearray(path.read_bytes())
    data[data.index(b"PK\1\2") - 40] ^= 4
    path.write_bytes(data)
    btf = open_btf(path)
    text = refusal(lambda: btf.read(0, 1), "00000 tl000 pl000 tv000 pv000.jpg")
    assert f"content is damaged inside the zip {path.name}; expected a complete member" in text


def complete_pictures() -> dict[str, bytes]:
    image = smooth_codes(1)[0].repeat(8, axis=0).repeat(8, axis=1)
    light = hdr_light()[0]
    return {
        "a.jpg": jpeg_bytes(image),
        "progressive.jpg": jpeg_bytes(image, progressive=True),
        "a.png": png_bytes(image),
        "a.exr": exr(light.astype(np.float16)),
        "flat.hdr": hdr_bytes(rgbe_of(light), runs=False),
        "runs.hdr": hdr_bytes(rgbe_of(light), "+X -Y"),
    }


@pytest.mark.parametrize("kind", complete_pictures())
def test_truncated_pictures_are_refused_wherever_they_end(tmp_path: Path, kind: str) -> None:
    data = complete_pictures()[kind]
    name = utia_name((0, 0), (0, 0), kind.split(".")[1])
    folder = write_folder(tmp_path / "wood", {name: data})
    btf = open_btf(folder)
    btf.read(0, 1)
    for end in (0, 10, len(data) // 3, len(data) // 2, len(data) * 9 // 10, len(data) - 1):
        (folder / name).write_bytes(data[:end])
        text = refusal(lambda: btf.read(0, 1), os.path.basename(name))
        assert re.search(r"content is (truncated or damaged|\d+ bytes of pixels);", text), end
        with pytest.raises(BadInput):
            open_btf(folder).read(0, 1)


def test_a_jpeg_with_bytes_behind_its_end(tmp_path: Path) -> None:
    data = jpeg_bytes(smooth_codes(1)[0]) + b"maker's notes" * 10
    btf = open_btf(write_folder(tmp_path / "wool", {ubo_name((0, 0), (0, 0)): data}))
    np.testing.assert_allclose(whole(btf)[0], light_of_codes(smooth_codes(1)[0]), atol=0.05)


@pytest.mark.parametrize(
    ("names", "value", "expected"),
    [
        ("XYZ", np.nan, "nan; expected a finite value"),
        ("RGB", -np.inf, "-inf; expected a finite value"),
    ],
)
def test_values_that_no_light_has(tmp_path: Path, names: str, value: float, expected: str) -> None:
    images = hdr_light().astype(np.float16)
    images[4, 3, 7, 1] = value
    path = write_zip(tmp_path / "wood.zip", exr_files(images, names))
    file = os.path.basename(utia_name(*PAIRS[4], suffix="exr"))
    for crop in (None, (2, 1, 6, 4)):
        text = refusal(lambda c=crop: open_btf(path, c).read(0, 6), file)  # type: ignore[misc]
        assert f"pixel value at column 7, row 3 is {expected}" in text
    open_btf(path, (0, 0, 7, 6)).read(0, 6)  # beside it


def test_negative_rgb_is_kept(tmp_path: Path) -> None:
    images = hdr_light().astype(np.float16)
    images[0, 0, 0, 0] = -0.25
    path = write_zip(tmp_path / "wood.zip", exr_files(images, "RGB"))
    light = whole(open_btf(path, exr_colours="rgb"))
    assert light[0, 0, 0, 0] == -0.25


def test_a_picture_that_has_changed_its_size(tmp_path: Path) -> None:
    name = utia_name((0, 0), (0, 0))
    folder = write_folder(tmp_path / "wood", {name: png_bytes(codes()[0])})
    btf = open_btf(folder)
    (folder / name).write_bytes(png_bytes(codes()[0][:, :-1]))
    assert "truncated or damaged" in refusal(lambda: btf.read(0, 1), os.path.basename(name))


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_damage_never_raises_anything_else(tmp_path_factory: Any, data: Any) -> None:
    """Bytes changed anywhere in a zip: it is read, or refused in a sentence."""
    base = tmp_path_factory.getbasetemp()
    kind = data.draw(st.sampled_from(sorted(complete_pictures())))
    name = utia_name((0, 0), (0, 0), kind.split(".")[1])
    method = data.draw(st.sampled_from([zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED]))
    content = bytearray(
        write_zip(base / "damaged.zip", {name: complete_pictures()[kind]}, method).read_bytes()
    )
    if data.draw(st.booleans()):  # inside the picture, with a checksum that agrees
        picture = bytearray(complete_pictures()[kind])
        for _ in range(data.draw(st.integers(1, 4))):
            picture[data.draw(st.integers(0, len(picture) - 1))] = data.draw(st.integers(0, 255))
        write_zip(base / "damaged.zip", {name: bytes(picture)}, method)
    else:
        for _ in range(data.draw(st.integers(1, 4))):
            content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
        (base / "damaged.zip").write_bytes(content)
    text = ""
    try:
        open_btf(base / "damaged.zip").read(0, 1)
    except BadInput as error:
        text = str(error)
    assert not text or re.fullmatch(r".+: .+ is .+; expected .+\.", text)


def test_checksums_agree_with_zlib() -> None:
    """The writers' PNG is a PNG to another reader."""
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(png_bytes(codes()[0])))), codes()[0])
    assert zlib.crc32(b"IEND") == 0xAE426082
