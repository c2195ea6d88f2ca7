"""UBO2014's files, packed by the published layout, against the matrices put into them."""

from __future__ import annotations

import math
import os
import pickle
import re
import struct
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from storage.readers import BadInput
from storage.readers.btf import open_btf
from tests.storage.readers.btf_writers import btf_bytes, log_yuv_matrices

WIDTH, HEIGHT = 7, 5
VIEWS = np.radians([(0, 0), (11, 15), (75, 345)])
LIGHTS = np.radians([(0, 0), (11, 75), (30, 15), (52.5, 7.5), (75, 180)])
IMAGES = len(VIEWS) * len(LIGHTS)
Light = NDArray[np.float64]


def ground_truth(seed: int = 1) -> Light:
    """(image, y, x, 3): bright enough to leave [0, 1], colourful enough to leave the gamut."""
    values = np.random.default_rng(seed).random((IMAGES, HEIGHT, WIDTH, 3))
    light = values**2 * 4 + 0.02
    light[..., 2] -= 0.05
    return np.asarray(light)


def lights_of_views(views: int = len(VIEWS)) -> Light:
    return np.broadcast_to(LIGHTS, (views, *LIGHTS.shape))


def write(path: Path, light: Light | None = None, **options: Any) -> Path:
    matrices = log_yuv_matrices(ground_truth() if light is None else light)
    path.write_bytes(btf_bytes(matrices, VIEWS, lights_of_views(), (WIDTH, HEIGHT), **options)[0])
    return path


def refusal(action: Callable[[], Any]) -> str:
    with pytest.raises(BadInput) as caught:
        action()
    text = str(caught.value)
    assert re.fullmatch(r"carpet\.btf: .+ is .+; expected .+\.", text), text
    assert os.path.basename(caught.value.file) == "carpet.btf"
    return text


def rgb_of_log_yuv(matrices: list[NDArray[np.float64]]) -> Light:
    """Solved from BT.601's definitions, one pixel after the other."""
    to_yuv = np.array([[0.299, 0.587, 0.114], [0, 0, 0], [0, 0, 0]])
    to_yuv[1] = 0.436 / (1 - 0.114) * (np.array([0, 0, 1]) - to_yuv[0])
    to_yuv[2] = 0.615 / (1 - 0.299) * (np.array([1, 0, 0]) - to_yuv[0])
    y = np.exp(matrices[0]) - 1e-5
    yuv = np.stack([y, matrices[1] * (y + 1e-5), matrices[2] * (y + 1e-5)], axis=-1)
    rgb = np.linalg.solve(to_yuv, yuv[..., None])[..., 0]
    return np.asarray(rgb.reshape(len(y), HEIGHT, WIDTH, 3))


# --- What is read -------------------------------------------------------------------------------


def test_the_whole_matrix_comes_back(tmp_path: Path) -> None:
    btf = open_btf(write(tmp_path / "carpet.btf", scalar="<f4"))
    assert (btf.name, btf.layout) == ("carpet.btf", "UBO2014")
    assert (btf.views, btf.lights_per_view, btf.images) == (3, 5, 15)
    assert (btf.height, btf.width, btf.shifted_lights) == (HEIGHT, WIDTH, 0)
    np.testing.assert_allclose(btf.view, np.repeat(VIEWS, 5, axis=0), rtol=1e-6)
    np.testing.assert_allclose(btf.light, np.tile(LIGHTS, (3, 1)), rtol=1e-6)
    light = btf.read(0, 15)
    assert light.dtype == np.float32
    np.testing.assert_allclose(light, ground_truth(), rtol=1e-4, atol=1e-4)
    assert light.max() > 1
    assert light.min() < 0


def test_half_precision_factors_are_multiplied_exactly(tmp_path: Path) -> None:
    data, rounded = btf_bytes(
        log_yuv_matrices(ground_truth()), VIEWS, lights_of_views(), (WIDTH, HEIGHT)
    )
    (tmp_path / "carpet.btf").write_bytes(data)
    light = open_btf(tmp_path / "carpet.btf").read(0, IMAGES)
    np.testing.assert_allclose(light, rgb_of_log_yuv(rounded), rtol=1e-4, atol=1e-4)
    # Factors of 11 bits: log Y of a size of 4 is known to 0.01 or so.
    np.testing.assert_allclose(light, ground_truth(), rtol=0.03, atol=0.03)


@pytest.mark.parametrize("scalar", ["<f2", "<f4", "<f8"])
@pytest.mark.parametrize("version", [1, 2, 3, 4])
@pytest.mark.parametrize("rotations", [None, 0, 3])
def test_every_header(tmp_path: Path, scalar: str, version: int, rotations: int | None) -> None:
    path = write(tmp_path / "carpet.btf", scalar=scalar, version=version, rotations=rotations)
    light = open_btf(path).read(3, 6)
    expected = ground_truth()[3:6]
    if version == 1:  # without the flag, the cosine is not in the values
        expected = expected * np.cos(LIGHTS[[3, 4, 0], 0])[:, None, None, None]
    tolerance = 0.03 if scalar == "<f2" else 2e-4
    np.testing.assert_allclose(light, expected, rtol=tolerance, atol=tolerance)


@pytest.mark.parametrize("flag", [0, 1])
def test_radiance_includes_the_cosine_either_way(tmp_path: Path, flag: int) -> None:
    photographed = ground_truth()
    cosine = np.cos(np.tile(LIGHTS, (3, 1))[:, 0])[:, None, None, None]
    stored = photographed if flag else photographed / cosine
    btf = open_btf(write(tmp_path / "carpet.btf", stored, scalar="<f8", cosine_flag=flag))
    np.testing.assert_allclose(btf.read(0, IMAGES), photographed, rtol=1e-4, atol=1e-4)
    said = "are stored with the light's cosine" if flag else "are multiplied by the light's cosine"
    assert btf.colour == f"log Y, U/Y, V/Y (colour model 11) converted to linear RGB; values {said}"


def test_dark_values_are_not_lifted_by_the_logarithms_offset(tmp_path: Path) -> None:
    dark = ground_truth() * 1e-5
    light = open_btf(write(tmp_path / "carpet.btf", dark, scalar="<f8")).read(0, IMAGES)
    np.testing.assert_allclose(light, dark, atol=1e-8)


def test_plain_rgb_is_a_colour_model_too(tmp_path: Path) -> None:
    light = ground_truth()
    matrices = list(np.moveaxis(light.reshape(IMAGES, -1, 3), -1, 0))
    data, _ = btf_bytes(matrices, VIEWS, lights_of_views(), (WIDTH, HEIGHT), model=0, scalar="<f4")
    (tmp_path / "carpet.btf").write_bytes(data)
    np.testing.assert_allclose(open_btf(tmp_path / "carpet.btf").read(0, 15), light, atol=1e-4)


def test_views_with_lights_of_their_own(tmp_path: Path) -> None:
    """The pairs need not be a grid, as long as every view has as many lights."""
    lights = np.stack([LIGHTS, LIGHTS[::-1], LIGHTS + np.array([0, -0.7])])
    data, _ = btf_bytes(
        log_yuv_matrices(ground_truth()),
        VIEWS,
        lights,
        (WIDTH, HEIGHT),
        cosine_flag=0,
        scalar="<f4",
    )
    (tmp_path / "carpet.btf").write_bytes(data)
    btf = open_btf(tmp_path / "carpet.btf")
    expected = lights.reshape(-1, 2) % [10, 2 * math.pi]
    np.testing.assert_allclose(btf.light, expected, atol=1e-6)
    cosine = np.cos(lights[..., 0].ravel())[:, None, None, None]
    np.testing.assert_allclose(btf.read(0, 15), ground_truth() * cosine, rtol=1e-4, atol=1e-4)


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_blocks_and_crops(tmp_path_factory: Any, data: Any) -> None:
    path = tmp_path_factory.getbasetemp() / "cropped.btf"
    if not path.exists():
        write(path, scalar="<f4")
    first, last = sorted(data.draw(st.tuples(*[st.integers(0, IMAGES)] * 2)))
    left, top = data.draw(st.integers(0, WIDTH - 1)), data.draw(st.integers(0, HEIGHT - 1))
    width, height = data.draw(st.integers(1, WIDTH - left)), data.draw(st.integers(1, HEIGHT - top))
    btf = open_btf(path, (left, top, width, height))
    assert (btf.height, btf.width) == (height, width)
    expected = ground_truth()[first:last, top : top + height, left : left + width]
    np.testing.assert_allclose(btf.read(first, last), expected, rtol=1e-4, atol=1e-4)


def test_photographs_taller_than_a_strip(tmp_path: Path) -> None:
    """Rows are multiplied in strips of 64."""
    light = np.random.default_rng(2).random((2, 150, 3, 3)) + 0.1
    data, _ = btf_bytes(
        log_yuv_matrices(light), VIEWS[:1], LIGHTS[None, :2], (3, 150), scalar="<f4"
    )
    (tmp_path / "carpet.btf").write_bytes(data)
    np.testing.assert_allclose(open_btf(tmp_path / "carpet.btf").read(0, 2), light, rtol=1e-3)


def test_threads_and_pickled_copies_read_the_same(tmp_path: Path) -> None:
    btf = open_btf(write(tmp_path / "carpet.btf"))
    copy = pickle.loads(pickle.dumps(btf))
    expected = btf.read(0, IMAGES)
    with ThreadPoolExecutor(8) as pool:
        for k, block in enumerate(pool.map(lambda k: copy.read(k % 15, k % 15 + 1), range(90))):
            np.testing.assert_allclose(block[0], expected[k % 15], rtol=1e-5, atol=1e-6)


# --- What is refused ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    "signature", ["!FMF12FCER", "!FMF06FC", "!FMF06FCR", "!PVF06FC", "!PVF06FCR", "!BDIF06R2!"]
)
def test_other_formats_of_bonn_are_named(tmp_path: Path, signature: str) -> None:
    (tmp_path / "carpet.btf").write_bytes(signature.encode() + bytes(500))
    text = refusal(lambda: open_btf(tmp_path / "carpet.btf"))
    assert f"signature is {signature}, another of Bonn's formats; expected !DFMF08FCR" in text


def test_unknown_signatures(tmp_path: Path) -> None:
    for start in (b"!DFMF09FCR", b"!", b"!DFMF"):
        (tmp_path / "carpet.btf").write_bytes(start)
        assert "signature is unknown" in refusal(lambda: open_btf(tmp_path / "carpet.btf"))
    (tmp_path / "carpet.btf").write_bytes(b"DFMF08FCR")
    assert "format is unknown" in refusal(lambda: open_btf(tmp_path / "carpet.btf"))


def test_cut_short_anywhere(tmp_path: Path) -> None:
    path = write(tmp_path / "carpet.btf")
    data = path.read_bytes()
    needed = 0
    for end in (*range(10, 700, 23), len(data) // 2, len(data) * 3 // 4, len(data) - 1):
        path.write_bytes(data[:end])
        text = refusal(lambda: open_btf(path))
        assert f"size is {end} bytes; expected at least " in text
        needed = int(re.findall(r"at least (\d+) bytes by its header", text)[0])
        assert end < needed <= len(data)
    assert needed == len(data)
    path.write_bytes(data + b"more")
    text = refusal(lambda: open_btf(path))
    assert f"size is {len(data) + 4} bytes; expected {len(data)} bytes by its header" in text


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"version": 5}, "header version is 5; expected 1 to 4"),
        ({"version": 0}, "header version is 0"),
        ({"header_size": 99}, "header size is 99 bytes; expected 305 bytes by its content"),
        ({"channel_names": [b"450", b"550"]}, "number of channels is 2; expected 3 (RGB)"),
        ({"model": 2}, "colour model is 2 (LAB); expected one of 0 (RGB), 1 (YUV), 3 (PCA)"),
        ({"model": -1}, "colour model is -1 (unknown)"),
    ],
)
def test_headers_that_are_not_understood(
    tmp_path: Path, options: dict[str, Any], reason: str
) -> None:
    assert reason in refusal(lambda: open_btf(write(tmp_path / "carpet.btf", **options)))


@pytest.mark.parametrize(
    ("view", "light", "reason"),
    [
        ((1.6, 0), (0, 0), "view of photograph 5 is theta 1.6, phi 0; expected theta of 0 to pi"),
        ((0.1, math.nan), (0, 0), "view of photograph 5 is theta 0.1, phi nan"),
        ((0, 0), (-0.1, 1), "light of photograph 7 is theta -0.1, phi 1"),
        ((0, 0), (math.inf, 1), "light of photograph 7 is theta inf"),
    ],
)
def test_directions_off_the_hemisphere(
    tmp_path: Path, view: tuple[float, float], light: tuple[float, float], reason: str
) -> None:
    views, lights = VIEWS.copy(), lights_of_views().copy()
    views[1], lights[1, 2] = view, light
    data, _ = btf_bytes(log_yuv_matrices(ground_truth()), views, lights, (WIDTH, HEIGHT))
    (tmp_path / "carpet.btf").write_bytes(data)
    assert reason in refusal(lambda: open_btf(tmp_path / "carpet.btf"))


def patched(path: Path, at: int, value: bytes) -> Path:
    data = bytearray(path.read_bytes())
    data[at : at + len(value)] = value
    path.write_bytes(data)
    return path


def test_numbers_in_the_header_that_disagree(tmp_path: Path) -> None:
    path = tmp_path / "carpet.btf"
    header = 10 + 305  # signature and measurement
    view_size = 12 + 8 * len(LIGHTS)
    sizes = header + 4 + len(VIEWS) * view_size
    channel = sizes + 8 + 4 + 2 * 36 + 4 + 4 + 12 + 36

    def refused(at: int, *value: int, kind: str = "<I") -> str:
        return refusal(lambda: open_btf(patched(write(path), at, struct.pack(kind, *value))))

    assert "number of views is 0; expected 1 to 10000" in refused(header, 0)
    assert "number of views is 4294967295" in refused(header, 2**32 - 1)
    lights = header + 4 + view_size + 8
    assert "number of lights of view 1 is 4; expected 5 as before" in refused(lights, 4)
    assert "number of lights of view 1 is 0" in refused(lights, 0)
    assert "size is 0 x 5 pixels" in refused(sizes, 0)
    assert "size is 90000 x 90000 pixels" in refused(sizes, 90000, 90000, kind="<II")
    assert "scalar size of channel 0 is 3 bytes; expected 2, 4 or 8" in refused(
        channel, 3, kind="<B"
    )
    assert "number of components of channel 0 is 0" in refused(channel + 1, 0)
    assert "number of rows of channel 0 is 9; expected 15" in refused(channel + 5, 9)
    assert "number of columns of channel 0 is 36; expected 35" in refused(channel + 9, 36)
    assert "bytes by its header" in refused(channel + 1, 2**31)
    assert "singular values of channel 0 is not finite" in refused(channel + 13, 0x7E00, kind="<H")
    # Width and height are not the same number to a reader that swaps them.
    assert (open_btf(write(path)).width, open_btf(path).height) == (WIDTH, HEIGHT)


def test_factors_that_are_not_finite_are_refused_where_they_are_used(tmp_path: Path) -> None:
    path = write(tmp_path / "carpet.btf")
    at = 10 + 305 + 4 + 3 * (12 + 40) + 8 + 4 + 72 + 56 + 13 + 2 * 15
    u_of_image_2 = at + 2 * 2 * 15
    btf = open_btf(patched(path, u_of_image_2, struct.pack("<e", math.nan)))
    btf.read(0, 2)
    btf.read(3, 15)
    text = refusal(lambda: btf.read(1, 4))
    assert "photograph 2 is not finite in places; expected finite values" in text


def test_values_beyond_single_precision(tmp_path: Path) -> None:
    matrices = log_yuv_matrices(ground_truth())
    matrices[0] = matrices[0] + 95
    data, _ = btf_bytes(matrices, VIEWS, lights_of_views(), (WIDTH, HEIGHT), scalar="<f4")
    (tmp_path / "carpet.btf").write_bytes(data)
    assert "photograph 0 is not finite" in refusal(
        lambda: open_btf(tmp_path / "carpet.btf").read(0, 1)
    )


def test_a_file_that_became_shorter_or_went_away(tmp_path: Path) -> None:
    path = write(tmp_path / "carpet.btf")
    btf = open_btf(path)
    path.write_bytes(path.read_bytes()[:900])
    assert "size is 900 bytes; expected what it was" in refusal(lambda: btf.read(0, 1))
    path.unlink()
    assert "file is unreadable" in refusal(lambda: btf.read(0, 1))


def test_crops_outside(tmp_path: Path) -> None:
    path = write(tmp_path / "carpet.btf")
    for crop in ((0, 0, HEIGHT, WIDTH), (-1, 0, 2, 2), (0, 0, 0, 1)):
        text = refusal(lambda c=crop: open_btf(path, c))  # type: ignore[misc]
        assert f"inside the photographs' {WIDTH} x {HEIGHT} pixels" in text


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_damage_never_raises_anything_else(tmp_path_factory: Any, data: Any) -> None:
    path = tmp_path_factory.getbasetemp() / "carpet.btf"
    content = bytearray(write(path).read_bytes())
    header = data.draw(st.booleans())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, 10 + 400 if header else len(content) - 1))
        content[at] = data.draw(st.integers(0, 255))
    path.write_bytes(content)
    text = ""
    try:
        open_btf(path).read(0, IMAGES)
    except BadInput as error:
        text = str(error)
    assert not text or re.fullmatch(r".+: .+ is .+; expected .+\.", text)
