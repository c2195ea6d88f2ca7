"""ABRDFs and their preprocessing against Eq. 1-4 written out."""

from __future__ import annotations

import math
from collections.abc import Iterator

import dask.array as da
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numpy.typing import NDArray

from pipelines.neural_btf.abrdf import (
    LARGEST_HALF,
    AbrdfSpace,
    PhotographBlocks,
    abrdf_columns,
    check_values,
    image_statistics,
    log_values,
    standardised,
    transposed,
    transposed_view,
)

shapes = st.tuples(st.integers(1, 5), st.integers(1, 4), st.integers(1, 4), st.integers(1, 3))


@pytest.fixture(scope="module")
def photographs() -> NDArray[np.float16]:
    """Seven photographs of 5 x 4 texels, HDR and with a little below 0."""
    random = np.random.default_rng(0)
    return (random.gamma(0.5, 2.0, (7, 5, 4, 3)) - 0.05).astype(np.float16)


def x2_of(images: NDArray[np.floating]) -> NDArray[np.float64]:
    return np.array([math.log(value + 1) for value in images.ravel().tolist()]).reshape(
        images.shape
    )


def test_x2_is_equation_1(photographs: NDArray[np.float16]) -> None:
    found = log_values(photographs)
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, x2_of(photographs), rtol=1e-6, atol=1e-8)


def test_statistics_are_equations_2_and_3_over_the_texels(
    photographs: NDArray[np.float16],
) -> None:
    found, x2 = image_statistics(photographs), x2_of(photographs)
    texels = 5 * 4
    for image in range(7):
        for channel in range(3):
            values = x2[image, :, :, channel].ravel()
            mu = math.fsum(values) / texels
            sigma = math.sqrt(math.fsum((values - mu) ** 2) / texels)
            assert found.mean[image, channel] == pytest.approx(mu, rel=1e-6)
            assert found.deviation[image, channel] == pytest.approx(sigma, rel=1e-6)
        assert found.largest[image] == photographs[image].max()


def test_x3_is_equation_4_and_has_mean_0_and_deviation_1(
    photographs: NDArray[np.float16],
) -> None:
    found = image_statistics(photographs)
    x3 = standardised(transposed(photographs), found.mean, found.deviation)
    assert x3.dtype == np.float32
    x2 = x2_of(photographs)
    expected = (x2 - x2.mean(axis=(1, 2), keepdims=True)) / x2.std(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(x3, transposed(expected), atol=1e-5)
    np.testing.assert_allclose(x3.mean(axis=0), 0, atol=1e-6)
    np.testing.assert_allclose(x3.std(axis=0), 1, atol=1e-6)


@pytest.mark.parametrize("value", [0.0, 0.3, 1234.0, -0.25])
def test_a_photograph_of_one_value_gives_x3_0(value: float) -> None:
    images = np.full((2, 9, 7, 3), value, np.float16)
    found = image_statistics(images)
    assert (found.deviation > 0).all()
    x3 = standardised(transposed(images), found.mean, found.deviation)
    np.testing.assert_array_equal(x3, 0)
    np.testing.assert_array_equal(abrdf_columns(images, "standardised"), 0)


@settings(deadline=None)
@given(shapes)
def test_transposition_takes_every_value_to_its_texel(shape: tuple[int, int, int, int]) -> None:
    count, height, width, channels = shape
    images = np.arange(math.prod(shape), dtype=np.float32).reshape(shape)
    abrdfs = transposed(images)
    assert abrdfs.shape == (height * width, count, channels)
    assert abrdfs.flags.c_contiguous
    for image, y, x, channel in np.ndindex(*shape):
        assert abrdfs[y * width + x, image, channel] == images[image, y, x, channel]


def test_the_transposed_view_is_of_the_same_values_and_lazy_where_they_are() -> None:
    images = np.arange(2 * 3 * 4 * 3, dtype=np.float16).reshape(2, 3, 4, 3)
    np.testing.assert_array_equal(transposed_view(images), transposed(images))
    lazy = transposed_view(da.from_array(images, chunks=(1, 2, 4, 3)))
    assert isinstance(lazy, da.Array)
    np.testing.assert_array_equal(lazy.compute(), transposed(images))


def test_blocks_are_read_as_often_as_they_are_wanted(photographs: NDArray[np.float16]) -> None:
    passes: list[int] = []

    def read() -> Iterator[NDArray[np.float16]]:
        passes.append(len(passes))
        yield from (photographs[:3], photographs[3:])

    blocks = PhotographBlocks(7, read)
    for _ in range(2):
        np.testing.assert_array_equal(np.concatenate(list(blocks)), photographs)
    assert passes == [0, 1]
    (whole,) = PhotographBlocks.of_array(photographs)
    assert whole is photographs


def test_columns_are_the_abrdfs_in_the_three_spaces(photographs: NDArray[np.float16]) -> None:
    x2 = x2_of(photographs)
    mu, sigma = x2.mean(axis=(1, 2), keepdims=True), x2.std(axis=(1, 2), keepdims=True)
    expected: dict[AbrdfSpace, NDArray[np.floating]] = {
        "linear": photographs.astype(np.float64), "log": x2, "standardised": (x2 - mu) / sigma,
    }  # fmt: skip
    for space, values in expected.items():
        found = abrdf_columns(photographs, space)
        assert (found.shape, found.dtype) == ((20, 21), np.float32)
        for y, x in np.ndindex(5, 4):
            np.testing.assert_allclose(found[y * 4 + x], values[:, y, x].ravel(), atol=1e-5)


def test_columns_of_some_photographs_are_some_of_the_columns(
    photographs: NDArray[np.float16],
) -> None:
    """So a BTF can be read by blocks of photographs, in all spaces."""
    for space in ("linear", "log", "standardised"):
        parts = [abrdf_columns(photographs[:3], space), abrdf_columns(photographs[3:], space)]
        np.testing.assert_array_equal(np.hstack(parts), abrdf_columns(photographs, space))


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_values_that_are_not_finite_are_refused(bad: float) -> None:
    values = np.ones((2, 3, 3), np.float32)
    values[1, 2, 0] = bad
    with pytest.raises(ValueError, match=r"^BTF: a value is not finite; expected finite radiance"):
        check_values(values)


@pytest.mark.parametrize(
    ("bad", "range_"), [(-1.0, "-1 to 1"), (-7.5, r"-7\.5 to 1"), (65536.0, "1 to 65536")]
)
def test_values_without_a_logarithm_or_a_half_float_are_refused(bad: float, range_: str) -> None:
    values = np.ones((2, 3, 3), np.float32)
    values[0, 0, 2] = bad
    message = rf"^BTF: values are {range_}; expected more than -1 and at most 65504\.$"
    with pytest.raises(ValueError, match=message):
        check_values(values)


@settings(deadline=None)
@given(
    arrays.arrays(
        np.float32, (2, 3), elements=st.floats(np.float32(-0.999), LARGEST_HALF, width=32)
    )
)
def test_accepted_values_survive_half_floats_and_the_logarithm(values: NDArray[np.float32]) -> None:
    check_values(values)
    assert np.isfinite(values.astype(np.float16)).all()
    assert np.isfinite(log_values(values)).all()


def test_the_largest_half_float_is_numpys() -> None:
    assert float(np.finfo(np.float16).max) == LARGEST_HALF
