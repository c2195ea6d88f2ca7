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
from storage.readers.radiance_files import radiance_header, radiance_pixels
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
        (["FORMAT=32-bit_rle_xyze"], "FORMAT is 32-bit_rle_xyze; expected 32-bit_rle_rgbe"),
        (["EXPOSURE=0"], "EXPOSURE is '0'; expected a positive number"),
        (["EXPOSURE=bright"], "EXPOSURE is 'bright'"),
        (["EXPOSURE=1 2"], "EXPOSURE is '1 2'"),
        (["COLORCORR=1 2 -3"], "COLORCORR is '1 2 -3'; expected 3 positive numbers"),
        (["PRIMARIES=0.7 0.3 0 1 0 0 0.3 0.3"], "PRIMARIES is '0.7"),
        (["PRIMARIES=sRGB"], "PRIMARIES is 'sRGB'; expected those of sRGB"),
    ],
)
def test_header_lines_that_cannot_be_followed(lines: list[str], reason: str) -> None:
    with pytest.raises(BadInput) as caught:
        radiance_pixels(FILE, hdr_bytes(picture(9, 14), lines=lines))
    assert str(caught.value).startswith(f"tl000 pl000 tv000 pv000.hdr: {reason}")


@pytest.mark.parametrize(
    "line", ["-Y 9", "-Y 9 +X", "Y 9 X 14", "-X 9 +X 14", "-Y 9 +X 14 +Z 3", "-Y 12345678 +X 1", ""]
)
def test_resolution_lines_that_say_nothing(line: str) -> None:
    with pytest.raises(BadInput, match=r"resolution line is '.*'; expected one like -Y 256"):
        radiance_header(FILE, f"#?RADIANCE\n\n{line}\n".encode())


def test_truncated_pictures_and_the_code_before_1991() -> None:
    for runs in (False, True):
        data = hdr_bytes(picture(9, 14), runs=runs)
        for end in (5, 30, len(data) // 2, len(data) - 1):
            with pytest.raises(BadInput, match=r"content is .*; expected .*"):
                radiance_pixels(FILE, data[:end])
    old = b"#?RADIANCE\n\n-Y 9 +X 14\n" + bytes([5, 6, 7, 128, 1, 1, 1, 125])
    with pytest.raises(BadInput, match="8 bytes of pixels; expected 504 bytes, or scanlines"):
        radiance_pixels(FILE, old)
