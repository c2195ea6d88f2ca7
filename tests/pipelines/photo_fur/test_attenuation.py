"""The medium and its layers against closed forms, brute force and the symmetries they must have."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipelines.photo_fur.attenuation import (
    DROPPED,
    MOST_LAYERS,
    Attenuation,
    Tails,
    code_steps,
    depth_code,
    fit_attenuation,
    layer_histogram,
    layer_masks,
    layer_of,
    luminance_histogram,
    make_shell_stack,
)

TAILS: tuple[Tails, ...] = ("end layers", "dropped")


def linear_of_code(code: float) -> float:
    """Linear light of an sRGB code 0 … 255, written down a second time."""
    value = code / 255
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


LINEAR = np.array([linear_of_code(code) for code in range(256)])


def exponential_photograph(
    brightest: float, darkest: float, pixels: int = 64
) -> NDArray[np.float64]:
    """Fur whose depth grows evenly from pixel to pixel, seen through the medium of Eq. 1."""
    depth = np.linspace(0.0, 1.0, pixels * pixels)
    decay = -math.log(darkest / brightest)
    return (brightest * np.exp(-decay * depth)).reshape(pixels, pixels)


# ---- Eq. 1 to 4 ------------------------------------------------------------------------------


@settings(deadline=None)
@given(st.floats(0.05, 1.0), st.floats(0.001, 0.9))
def test_the_medium_of_an_exponential_photograph_is_found(brightest: float, ratio: float) -> None:
    darkest = brightest * ratio
    found = fit_attenuation(exponential_photograph(brightest, darkest), tail=0.0)
    assert found.brightest == pytest.approx(brightest, rel=1e-12)
    assert found.darkest == pytest.approx(darkest, rel=1e-12)
    assert found.coefficient == pytest.approx(math.log(1 / ratio), rel=1e-9)


def test_luminance_at_is_equation_1() -> None:
    medium = Attenuation(0.8, 0.05)
    depth = np.array([0.0, 0.25, 0.5, 1.0])
    expected = [0.8, 0.8 * (1 / 16) ** 0.25, 0.2, 0.05]
    np.testing.assert_allclose(medium.luminance_at(depth), expected, rtol=1e-12)


@settings(deadline=None)
@given(st.floats(0.01, 1.0), st.floats(0.001, 0.999), st.integers(1, MOST_LAYERS))
def test_boundaries_are_equation_4(brightest: float, ratio: float, layers: int) -> None:
    medium = Attenuation(brightest, brightest * ratio)
    boundaries = medium.boundaries(layers)
    assert boundaries.shape == (layers + 1,)
    # The very values of the photograph: a pixel as dark as Imin must not fall out by an ulp.
    assert (boundaries[0], boundaries[-1]) == (medium.brightest, medium.darkest)
    depth = np.arange(layers + 1) / layers
    np.testing.assert_allclose(boundaries, medium.luminance_at(depth), rtol=1e-12)
    assert (np.diff(boundaries) < 0).all()
    step = boundaries[1:] / boundaries[:-1]
    np.testing.assert_allclose(step, ratio ** (1 / layers), rtol=1e-9)


# ---- histogram and tails ---------------------------------------------------------------------


@settings(deadline=None)
@given(st.lists(st.integers(0, 255), min_size=1, max_size=300))
def test_an_8_bit_grey_photograph_fills_its_own_bins(codes: list[int]) -> None:
    histogram = luminance_histogram(LINEAR[codes])
    np.testing.assert_array_equal(histogram.counts, np.bincount(codes, minlength=256))


@pytest.mark.parametrize("beside", [-0.45, 0.45])
def test_the_bins_lie_about_their_codes(beside: float) -> None:
    codes = np.arange(1, 255)
    luminance = np.array([linear_of_code(code + beside) for code in codes])
    np.testing.assert_array_equal(luminance_histogram(luminance).counts[1:255], 1)


@settings(deadline=None)
@given(st.lists(st.floats(0.0, 1.0, width=32), min_size=1, max_size=200))
def test_the_histogram_counts_what_lies_between_its_edges(luminances: list[float]) -> None:
    counts, edges = luminance_histogram(np.array(luminances, np.float32))
    brute = [
        sum(low <= luminance < high for luminance in luminances)
        for low, high in itertools.pairwise(edges)
    ]
    np.testing.assert_array_equal(counts, brute)
    assert counts.sum() == len(luminances)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.integers(0, 255), min_size=4, max_size=120), st.floats(0.0, 0.49))
def test_a_tail_never_takes_more_than_its_share_and_as_much_as_whole_bins_allow(
    codes: list[int], tail: float
) -> None:
    luminance = LINEAR[codes]
    try:
        found = fit_attenuation(luminance, tail=tail)
    except ValueError:
        assume(False)
    allowed = tail * len(codes)
    light = luminance[luminance > 0]
    above = np.count_nonzero(luminance > found.brightest)
    below = np.count_nonzero(luminance < found.darkest)
    black = luminance.size - light.size
    assert found.darkest > 0
    assert above <= allowed
    assert below <= max(allowed, black)
    # One bin more would be too much on either side.
    assert np.count_nonzero(luminance >= found.brightest) > allowed
    assert np.count_nonzero(luminance <= found.darkest) > allowed


def test_the_share_is_kept_exactly() -> None:
    """100 pixels: 2 too bright, 3 too dark."""
    luminance = LINEAR[[250, 251, 3, 4, 5] + [100] * 40 + [50] * 30 + [200] * 25]
    assert fit_attenuation(luminance, tail=0.03) == (LINEAR[200], LINEAR[50])
    assert fit_attenuation(luminance, tail=0.02) == (LINEAR[200], LINEAR[5])
    assert fit_attenuation(luminance, tail=0.01) == (LINEAR[250], LINEAR[4])
    assert fit_attenuation(luminance, tail=0.0) == (LINEAR[251], LINEAR[3])


@pytest.mark.parametrize("tail", [0.0, 0.1])
def test_black_is_never_the_darkest(tail: float) -> None:
    luminance = LINEAR[[0] * 60 + [1] * 20 + [2] * 20 + [90] * 100]
    assert fit_attenuation(luminance, tail=tail).darkest == LINEAR[1]


def test_light_fainter_than_the_first_code_is_not_black() -> None:
    luminance = np.array([0.0, 1e-5, 0.5, 0.6])
    assert fit_attenuation(luminance, tail=0.0) == (0.6, 1e-5)


# ---- layers ----------------------------------------------------------------------------------


class Cut(NamedTuple):
    """A photograph to cut into layers."""

    luminance: NDArray[np.floating]
    medium: Attenuation
    layers: int


@st.composite
def cuts(draw: st.DrawFn) -> Cut:
    """Random media, with luminances anywhere, on the boundaries and a float beside them."""
    brightest = float(np.float32(draw(st.floats(0.05, 1.0))))
    darkest = float(np.float32(brightest * draw(st.floats(0.002, 0.95))))
    medium = Attenuation(brightest, darkest)
    layers = draw(st.integers(1, MOST_LAYERS))
    boundaries = medium.boundaries(layers)
    anywhere = draw(st.lists(st.floats(1e-6, 1.5), min_size=1, max_size=30))
    chosen = boundaries[draw(st.lists(st.integers(0, layers), min_size=1, max_size=10))]
    beside = [np.nextafter(chosen, 0.0), chosen, np.nextafter(chosen, 2.0)]
    luminance = np.concatenate([anywhere, *beside])[None]
    return Cut(luminance.astype(draw(st.sampled_from(["f4", "f8"]))), medium, layers)


def brute_force_layer(value: float, cut: Cut, tails: Tails) -> int:
    """Try every interval (section 3.2); every number is a double."""
    boundaries = [float(boundary) for boundary in cut.medium.boundaries(cut.layers)]
    if value > boundaries[0]:
        return 1 if tails == "end layers" else 0
    if value < boundaries[-1]:
        return cut.layers if tails == "end layers" else 0
    if value == boundaries[-1]:
        return cut.layers
    (layer,) = [n for n in range(1, cut.layers + 1) if boundaries[n] < value <= boundaries[n - 1]]
    return layer


@settings(max_examples=300, deadline=None)
@given(cuts(), st.sampled_from(TAILS))
def test_the_layer_is_the_interval_that_holds_the_luminance(cut: Cut, tails: Tails) -> None:
    layer = layer_of(cut.luminance, cut.medium, cut.layers, tails=tails)
    expected = [brute_force_layer(float(value), cut, tails) for value in cut.luminance.ravel()]
    assert layer.dtype == np.uint8
    np.testing.assert_array_equal(layer.ravel(), expected)


def test_the_ends_of_a_fitted_photograph_are_never_dropped() -> None:
    """Nothing lies outside when no tail is cut, however Imax and Imin are rounded."""
    rng = np.random.default_rng(3)
    for _ in range(300):
        luminance = rng.random((4, 4)).astype(np.float32)
        medium = fit_attenuation(luminance, tail=0.0)
        layers = int(rng.integers(1, MOST_LAYERS + 1))
        layer = layer_of(luminance, medium, layers, tails="dropped")
        assert layer[luminance == luminance.max()] == 1
        assert layer[luminance == luminance.min()] == layers
        assert luminance.min() >= medium.boundaries(layers)[-1]


@settings(deadline=None)
@given(cuts(), st.sampled_from(TAILS))
def test_the_masks_are_a_partition(cut: Cut, tails: Tails) -> None:
    layer = layer_of(cut.luminance, cut.medium, cut.layers, tails=tails)
    masks = layer_masks(layer, cut.layers)
    assert masks.shape == (cut.layers, *layer.shape)
    np.testing.assert_array_equal(masks.sum(axis=0), layer != 0)
    np.testing.assert_array_equal(
        (masks * np.arange(1, cut.layers + 1)[:, None, None]).sum(0), layer
    )


@settings(deadline=None)
@given(cuts(), st.sampled_from(TAILS), st.integers(0, 9))
def test_transparent_pixels_are_in_no_layer_and_others_where_they_were(
    cut: Cut, tails: Tails, seed: int
) -> None:
    opaque = np.random.default_rng(seed).random(cut.luminance.shape) < 0.6
    stack = make_shell_stack(cut.luminance, cut.medium, cut.layers, tails=tails, opaque=opaque)
    whole = make_shell_stack(cut.luminance, cut.medium, cut.layers, tails=tails)
    np.testing.assert_array_equal(stack.layer, np.where(opaque, whole.layer, 0))
    np.testing.assert_array_equal(stack.masks, whole.masks & opaque)
    code = depth_code(cut.luminance, cut.medium, cut.layers, tails=tails, opaque=opaque)
    assert (code[~opaque] == DROPPED).all()
    np.testing.assert_array_equal(
        code[opaque], depth_code(cut.luminance, cut.medium, cut.layers, tails=tails)[opaque]
    )


@settings(deadline=None)
@given(cuts(), st.sampled_from(TAILS))
def test_a_stack_holds_the_layers_and_their_masks(cut: Cut, tails: Tails) -> None:
    stack = make_shell_stack(cut.luminance, cut.medium, cut.layers, tails=tails)
    layer = layer_of(cut.luminance, cut.medium, cut.layers, tails=tails)
    np.testing.assert_array_equal(stack.layer, layer)
    np.testing.assert_array_equal(stack.masks, layer_masks(layer, cut.layers))


@settings(deadline=None)
@given(
    st.lists(st.integers(0, 255), min_size=4, max_size=120),
    st.floats(0.0, 0.4),
    st.integers(1, MOST_LAYERS),
)
def test_a_layer_histogram_counts_every_pixel_once(
    codes: list[int], tail: float, layers: int
) -> None:
    luminance = LINEAR[codes]
    try:
        medium = fit_attenuation(luminance, tail=tail)
    except ValueError:
        assume(False)
    found = layer_histogram(luminance, tail=tail, layers=layers)
    assert found.attenuation == medium
    np.testing.assert_array_equal(found.boundaries, medium.boundaries(layers))
    np.testing.assert_array_equal(found.histogram.counts, np.bincount(codes, minlength=256))
    assert found.bright_tail == sum(value > medium.brightest for value in luminance)
    assert found.dark_tail == sum(value < medium.darkest for value in luminance)
    cut = Cut(luminance, medium, layers)
    layer = [brute_force_layer(float(value), cut, "dropped") for value in luminance]
    np.testing.assert_array_equal(
        found.pixels_per_layer, [layer.count(n) for n in range(1, layers + 1)]
    )
    assert found.pixels_per_layer.dtype == np.int64


@settings(deadline=None)
@given(cuts(), st.floats(0.3, 3.0), st.sampled_from(TAILS))
def test_a_gamma_cuts_the_photograph_into_the_same_layers(
    cut: Cut, gamma: float, tails: Tails
) -> None:
    luminance = cut.luminance.astype(np.float64)
    boundaries = cut.medium.boundaries(cut.layers)
    on_a_boundary = (np.abs(luminance[..., None] / boundaries - 1) < 1e-7).any(axis=-1)
    luminance = luminance[~on_a_boundary]
    bent = Attenuation(cut.medium.brightest**gamma, cut.medium.darkest**gamma)
    np.testing.assert_array_equal(
        layer_of(luminance, cut.medium, cut.layers, tails=tails),
        layer_of(luminance**gamma, bent, cut.layers, tails=tails),
    )


# ---- depth codes -----------------------------------------------------------------------------


@pytest.mark.parametrize("tails", TAILS)
def test_a_code_says_its_layer_for_every_number_of_layers(tails: Tails) -> None:
    rng = np.random.default_rng(4)
    medium = Attenuation(0.9, 0.01)
    luminance = np.concatenate([10 ** rng.uniform(-2.5, 0.0, 400), [0.9, 0.01, 1.0, 0.0]])[None]
    for layers in range(1, MOST_LAYERS + 1):
        layer = layer_of(luminance, medium, layers, tails=tails)
        code = depth_code(luminance, medium, layers, tails=tails).astype(int)
        steps = code_steps(layers)
        assert steps * layers <= DROPPED
        np.testing.assert_array_equal(code == DROPPED, layer == 0)
        kept = layer > 0
        np.testing.assert_array_equal(code[kept] // steps + 1, layer[kept])


@settings(deadline=None)
@given(cuts(), st.sampled_from(TAILS))
def test_the_code_grows_with_the_depth(cut: Cut, tails: Tails) -> None:
    code = depth_code(cut.luminance, cut.medium, cut.layers, tails=tails).astype(int)
    kept = code != DROPPED
    order = np.argsort(-cut.luminance[kept])
    assert (np.diff(code[kept][order]) >= 0).all()
    layer = layer_of(cut.luminance, cut.medium, cut.layers, tails=tails)
    np.testing.assert_array_equal(code[kept] // code_steps(cut.layers) + 1, layer[kept])
    np.testing.assert_array_equal(kept, layer != 0)


@pytest.mark.parametrize("layers", [1, 8, 15, 100])
def test_the_code_is_the_depth_to_a_step(layers: int) -> None:
    medium = Attenuation(0.7, 0.02)
    depth = np.linspace(0.0, 1.0, 1001)[None]
    code = depth_code(medium.luminance_at(depth), medium, layers, tails="end layers")
    steps = code_steps(layers) * layers
    assert np.abs((code + 0.5) / steps - depth).max() <= 0.5 / steps + 1e-9


def test_dropped_pixels_have_their_own_code() -> None:
    medium = Attenuation(0.5, 0.1)
    code = depth_code(np.array([[0.6, 0.5, 0.1, 0.05]]), medium, 8, tails="dropped")
    assert (code == DROPPED).tolist() == [[True, False, False, True]]


# ---- refusals --------------------------------------------------------------------------------


@pytest.mark.parametrize("layers", [0, -1, MOST_LAYERS + 1])
def test_a_number_of_layers_that_cannot_be_drawn_is_refused(layers: int) -> None:
    medium, luminance = Attenuation(0.9, 0.1), np.array([[0.5]])
    message = rf"^layers is {layers}; expected 1 to {MOST_LAYERS}\.$"
    with pytest.raises(ValueError, match=message):
        medium.boundaries(layers)
    with pytest.raises(ValueError, match=message):
        layer_of(luminance, medium, layers, tails="dropped")
    with pytest.raises(ValueError, match=message):
        depth_code(luminance, medium, layers, tails="dropped")
    with pytest.raises(ValueError, match=message):
        code_steps(layers)


@pytest.mark.parametrize("tail", [-0.01, 0.5, math.nan, math.inf])
def test_a_tail_that_is_no_share_is_refused(tail: float) -> None:
    with pytest.raises(ValueError, match=rf"^tail is {tail}; expected a share in \[0, 0\.5\)\.$"):
        fit_attenuation(np.array([[0.1, 0.2]]), tail=tail)


@pytest.mark.parametrize(
    ("luminance", "tail"),
    [
        ([0.25, 0.25, 0.25], 0.0),
        ([0.0, 0.0, 0.0], 0.0),
        ([0.0, 0.5, 0.5], 0.0),  # black is no light: one luminance is left
        ([0.1, 0.5, 0.5, 0.5, 0.5, 0.9], 0.2),
    ],
)
def test_a_photograph_of_one_luminance_is_refused(luminance: list[float], tail: float) -> None:
    message = rf"^the photograph has a single luminance inside its tails of {tail:g}; expected"
    with pytest.raises(ValueError, match=message) as caught:
        fit_attenuation(np.array([luminance]), tail=tail)
    assert str(caught.value).count(". ") == 0


@pytest.mark.parametrize("ends", [(0.36, 1.04), (0.0, 0.5), (-0.2, 1.3)])
def test_a_medium_has_its_luminances_at_the_depths_that_are_given(
    ends: tuple[float, float],
) -> None:
    read = Attenuation(0.7, 0.05)
    medium = read.with_ends_at(ends)
    found = medium.luminance_at(np.array(ends))
    np.testing.assert_allclose(found, [0.7, 0.05], rtol=1e-12)
    assert medium.luminance_at(np.array(1.0)) == pytest.approx(medium.darkest, rel=1e-12)
    assert read.with_ends_at((0.0, 1.0)) == read
