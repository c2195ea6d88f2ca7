"""Radiance pictures written by hand in all eight orders, flat and in runs."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from storage.readers import BadInput
from storage.readers.pictures.radiance_files import radiance_header, radiance_pixels
from tests.storage.readers.btf_writers import hdr_bytes, light_of_rgbe

FILE = Path("in/tl000 pl000 tv000 pv000.hdr")
ORDERS = [f"{a}{x} {b}{y}" for a, b in product("+-", "+-") for x, y in ("XY", "YX")]
RGBE = "FORMAT=32-bit_rle_rgbe"


def picture(height: int, width: int, seed: int = 3) -> np.ndarray[Any, Any]:
    chance = np.random.default_rng(seed)
    rgbe = chance.integers(0, 256, (height, width, 4)).astype(np.uint8)
    rgbe[..., 3] = chance.integers(120, 140, (height, width))
    rgbe[:, : width // 2] = rgbe[:1, :1]  # something that makes runs
    rgbe[-1, -1] = (9, 9, 9, 0)  # black, whatever the mantissas say
    return rgbe


@pytest.mark.parametrize("runs", [False, True])
@pytest.mark.parametrize("order", ORDERS)
def test_all_orders_stand_upright(order: str, runs: bool) -> None:
    rgbe = picture(9, 14)
    light = radiance_pixels(FILE, hdr_bytes(rgbe, order, runs))
    assert light.dtype == np.float32
    np.testing.assert_allclose(light, light_of_rgbe(rgbe), rtol=1e-7)


@settings(deadline=None)
@given(st.integers(1, 40), st.integers(1, 40), st.sampled_from(ORDERS), st.booleans())
def test_sizes_with_and_without_runs(height: int, width: int, order: str, runs: bool) -> None:
    rgbe = picture(height, width, height)
    line = height if order[1] == "X" else width
    data = hdr_bytes(rgbe, order, runs and line >= 8)  # shorter lines have no runs, by the format
    header = radiance_header(FILE, data)
    assert (header.height, header.width) == (height, width)
    np.testing.assert_allclose(radiance_pixels(FILE, data), light_of_rgbe(rgbe), rtol=1e-7)


def test_the_line_of_atrium_is_column_after_column_from_the_top() -> None:
    """Byte by byte: +X 2 -Y 3 holds the left column first, its top pixel first."""
    pixels = bytes([128, 0, 0, 129, 0, 128, 0, 129, 0, 0, 128, 129] + [64, 64, 64, 129] * 3)
    data = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n+X 2 -Y 3\n" + pixels
    grey = [0.5, 0.5, 0.5]
    expected = [[[1, 0, 0], grey], [[0, 1, 0], grey], [[0, 0, 1], grey]]
    np.testing.assert_array_equal(radiance_pixels(FILE, data), expected)


def test_exposures_are_divided_out_together() -> None:
    rgbe = picture(9, 14)
    lines = ["# made by hand", RGBE, "EXPOSURE=4", "EXPOSURE= 0.5", "COLORCORR= 1 2 0.25"]
    light = radiance_pixels(FILE, hdr_bytes(rgbe, lines=lines))
    np.testing.assert_allclose(light, light_of_rgbe(rgbe) / [2, 4, 0.5], rtol=1e-6)


def test_headers_that_other_programs_write() -> None:
    rgbe = picture(9, 14)
    for lines, signature in (
        ([], "#?RGBE"),
        ([RGBE, "PRIMARIES=0.64 0.33 0.30 0.60 0.15 0.06 0.3127 0.3290"], "#?RADIANCE"),
        (["VIEW= -vtv", "\tpfilt -1", RGBE], "#?RADIANCE"),
    ):
        data = hdr_bytes(rgbe, lines=lines, signature=signature)
        np.testing.assert_allclose(radiance_pixels(FILE, data), light_of_rgbe(rgbe), rtol=1e-7)


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (["FORMAT=32-bit_float"], "FORMAT is 32-bit_float; expected 32-bit_rle_rgbe or 32-bit"),
        (["PRIMARIES=0.3 0.3 0 1"], "PRIMARIES is '0.3 0.3 0 1'; expected red, green, blue and"),
        (["PRIMARIES=of the camera"], "PRIMARIES is 'of the camera'; expected red, green, blue"),
    ],
)
def test_header_lines_that_cannot_be_followed(lines: list[str], reason: str) -> None:
    with pytest.raises(BadInput) as caught:
        radiance_pixels(FILE, hdr_bytes(picture(9, 14), lines=lines))
    assert str(caught.value).startswith(f"tl000 pl000 tv000 pv000.hdr: {reason}")


@pytest.mark.parametrize(
    "line", ["EXPOSURE=0", "EXPOSURE=bright", "EXPOSURE=1 2", "COLORCORR=1 2 -3", "EXPOSURE=nan"]
)
def test_exposures_that_are_none_are_told(line: str) -> None:
    rgbe = picture(9, 14)
    data = hdr_bytes(rgbe, lines=[RGBE, line])
    key, _, value = line.partition("=")
    assert radiance_header(FILE, data).notes == (
        f"{key}={value!r} is nothing to divide by: left out.",
    )
    np.testing.assert_allclose(radiance_pixels(FILE, data), light_of_rgbe(rgbe), rtol=1e-7)


def test_a_space_by_its_name_and_xyz() -> None:
    rgbe = picture(9, 14)
    data = hdr_bytes(rgbe, lines=[RGBE, "PRIMARIES=sRGB"])
    assert radiance_header(FILE, data).notes == ()
    data = hdr_bytes(rgbe, lines=["FORMAT=32-bit_rle_xyze"])
    assert "CIE XYZ" in radiance_header(FILE, data).notes[0]
    light = light_of_rgbe(rgbe)
    red = light @ np.array([3.2409699, -1.5373832, -0.4986108])
    np.testing.assert_allclose(radiance_pixels(FILE, data)[..., 0], red, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize(
    "line", ["-Y 9", "-Y 9 +X", "Y 9 X 14", "-X 9 +X 14", "-Y 9 +X 14 +Z 3", "-Y 12345678 +X 1"]
)
def test_resolution_lines_that_say_nothing(line: str) -> None:
    with pytest.raises(BadInput, match=r"resolution line is '.*'; expected one like -Y 256"):
        radiance_header(FILE, f"#?RADIANCE\n\n{line}\n".encode())


def test_truncated_pictures() -> None:
    for runs in (False, True):
        data = hdr_bytes(picture(9, 14), runs=runs)
        for end in (5, 30, len(data) // 2, len(data) - 1):
            with pytest.raises(BadInput, match=r"content is .*; expected .*"):
                radiance_pixels(FILE, data[:end])


def test_the_code_before_1991() -> None:
    """A pixel, 125 of it, and 256 and one more; the next line begins with another."""
    size = b"#?RADIANCE\n\n-Y 2 +X 384\n"
    one, other = [128, 64, 32, 129], [32, 64, 128, 129]
    line = bytes([*one, 1, 1, 1, 125, *other, *other, 1, 1, 1, 255, *one])
    more = bytes([*one, 1, 1, 1, 127, 1, 1, 1, 1])
    light = radiance_pixels(FILE, size + line + more)
    assert light[0, 125].tolist() == [1, 0.5, 0.25]
    assert light[0, 126].tolist() == [0.25, 0.5, 1]
    assert light[0, 383].tolist() == [1, 0.5, 0.25]
    np.testing.assert_array_equal(light[1], np.broadcast_to([1, 0.5, 0.25], (384, 3)))


@pytest.mark.parametrize(
    "pixels",
    [
        [1, 1, 1, 3],  # nothing to repeat
        [9, 9, 9, 129, 1, 1, 1, 16],  # beyond the line's end
        [9, 9, 9, 129] + [1, 1, 1, 0] * 5,  # more than four bytes of a count
        [2, 2, 0, 16, 150, 7],  # a run beyond the end
        [2, 2, 0, 16, 17, *range(17)],  # a literal beyond the end
    ],
)
def test_run_lengths_that_are_wrong(pixels: list[int]) -> None:
    with pytest.raises(BadInput, match="content is truncated or damaged"):
        radiance_pixels(FILE, b"#?RADIANCE\n\n-Y 1 +X 16\n" + bytes(pixels + [0] * 200))
