"""Cross-sections of scratches against closed forms and a search along the polyline."""

from __future__ import annotations

import itertools
import math
from typing import get_args

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.profiles import Shape, built_in_profile, cut_profile

Floats = NDArray[np.float64]
SHAPES: tuple[Shape, ...] = get_args(Shape)

KEYHOLE = [(-1, 0), (-1, -1), (-3, -2), (-3, -4), (3, -4), (3, -2), (1, -1), (1, 0)]


def one_sentence(error: pytest.ExceptionInfo[ValueError]) -> str:
    message = str(error.value)
    assert message.endswith(".")
    assert ". " not in message
    assert "\n" not in message
    return message


# ---- built-in shapes -------------------------------------------------------------------------


def test_the_shapes_are_named() -> None:
    assert SHAPES == ("v", "u", "trapezoid", "raised")


def test_the_v_is_two_walls() -> None:
    np.testing.assert_array_equal(built_in_profile("v", 6.0, 2.5), [(-3, 0), (0, -2.5), (3, 0)])


def test_the_bottom_of_the_trapezoid_is_two_fifths_of_its_width() -> None:
    expected = [(-5, 0), (-2, -3), (2, -3), (5, 0)]
    np.testing.assert_allclose(built_in_profile("trapezoid", 10.0, 3.0), expected, atol=1e-15)


@pytest.mark.parametrize(("width", "depth"), [(10.0, 1.0), (10.0, 4.0), (8.0, 4.0)])
def test_the_points_of_the_u_lie_on_the_circle_through_its_ends_and_bottom(
    width: float, depth: float
) -> None:
    points = built_in_profile("u", width, depth)
    radius = width**2 / (8 * depth) + depth / 2  # sagitta
    distance = np.hypot(points[:, 0], points[:, 1] - (radius - depth))
    np.testing.assert_allclose(distance, radius, rtol=1e-12)
    np.testing.assert_allclose(points[[0, -1], 0], [-width / 2, width / 2], rtol=1e-12)
    assert points[:, 1].min() == pytest.approx(-depth, rel=1e-12)
    length = np.hypot(*np.diff(points, axis=0).T)
    np.testing.assert_allclose(length, length[0], rtol=1e-9)
    assert length.sum() == pytest.approx(2 * radius * math.asin(width / 2 / radius), rel=1e-3)


def test_raised_borders_widen_the_opening_up_to_their_crests() -> None:
    """Crests stand 0.35 of the width beyond the surface's opening in all, 0.3 of the depth high."""
    points = built_in_profile("raised", 10.0, 4.0)
    assert points[-1, 0] - points[0, 0] == pytest.approx(13.5, rel=1e-12)
    assert points[:, 1].min() == pytest.approx(-5.2, rel=1e-12)
    # The surface's level, where the walls end that are straight.
    for side in (-1, 1):
        corner = np.hypot(points[:, 0] - 5 * side, points[:, 1] + 1.2)
        assert corner.min() == pytest.approx(0.0, abs=1e-12)
    # Outwards it rises all the way: nothing of the far flanks is left.
    right = points[points[:, 0] >= 0]
    assert (np.diff(right[:, 1]) > 0).all()
    crest = right[right[:, 0] > 5.0]
    share = (crest[:, 0] - 5.0) / 3.5
    np.testing.assert_allclose(crest[:, 1] + 1.2, 0.6 * (1 - np.cos(2 * np.pi * share)), atol=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape_is_symmetric_and_scales(shape: Shape) -> None:
    points = built_in_profile(shape, 10.0, 4.0)
    np.testing.assert_allclose(points[::-1] * [-1, 1], points, atol=1e-12)
    np.testing.assert_array_equal(points[[0, -1], 1], 0.0)
    assert (points[1:-1, 1] < 0).all()
    np.testing.assert_allclose(built_in_profile(shape, 0.02, 0.008), points / 500, atol=1e-14)
    np.testing.assert_allclose(cut_profile(points, "again"), points, atol=1e-14)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("wrong", [0.0, -1.0, math.nan, math.inf])
def test_a_width_or_depth_that_is_not_positive_is_refused(shape: Shape, wrong: float) -> None:
    expected = rf"of the profile is {wrong:g}; expected more than 0 µm\.$"
    with pytest.raises(ValueError, match="^width " + expected) as error:
        built_in_profile(shape, wrong, 1.0)
    one_sentence(error)
    with pytest.raises(ValueError, match="^depth " + expected):
        built_in_profile(shape, 1.0, wrong)


def test_a_u_deeper_than_half_its_width_is_refused() -> None:
    assert len(built_in_profile("u", 10.0, 5.0)) > 2
    with pytest.raises(ValueError, match=r"^depth of the profile is 5\.01; expected at most 5 µm"):
        built_in_profile("u", 10.0, 5.01)
    for shape in SHAPES:
        if shape != "u":
            assert built_in_profile(shape, 10.0, 50.0)[:, 1].min() <= -50.0


# ---- the cut ---------------------------------------------------------------------------------


def test_both_sides_are_cut_at_the_lower_crest() -> None:
    """The left crest is 2 high, the right 1: the left wall passes 1 at v = -1.5."""
    points = [(-3, 0), (-2, 2), (0, -2), (1, 1), (2, 0)]
    np.testing.assert_allclose(
        cut_profile(points, "uneven"), [(-1.25, 0), (0.25, -3), (1.25, 0)], atol=1e-15
    )
    mirrored = [(-v, n) for v, n in points[::-1]]
    np.testing.assert_allclose(
        cut_profile(mirrored, "uneven"), [(-1.25, 0), (-0.25, -3), (1.25, 0)], atol=1e-15
    )


def test_what_lies_beyond_the_crests_does_not_matter() -> None:
    inside = [(-2.0, 1.0), (-1.0, -1.0), (0.0, 0.5), (1.0, -2.0), (2.0, 1.0)]
    left = [(-9.0, 0.0), (-8.0, 0.9), (-7.0, -1.5), (-3.0, 0.0)]
    right = [(3.0, -1.9), (4.0, 0.8), (5.0, 0.0)]
    whole = cut_profile([*left, *inside, *right], "bordered")
    np.testing.assert_array_equal(whole, cut_profile(inside, "alone"))
    np.testing.assert_allclose(whole, np.array(inside) - [0, 1], atol=1e-15)


def test_flat_ground_beside_the_scratch_is_cut_off() -> None:
    points = [(-4, 1), (-2, 1), (-1, 0), (2, 1), (4, 1)]
    np.testing.assert_array_equal(cut_profile(points, "flat"), [(-2, 0), (-1, -1), (2, 0)])


def test_an_overhang_inside_is_kept() -> None:
    np.testing.assert_array_equal(cut_profile(KEYHOLE, "keyhole"), KEYHOLE)


heights = st.lists(st.integers(-1000, 1000), min_size=3, max_size=14)
steps = st.lists(st.integers(1, 300), min_size=13, max_size=13)


@settings(deadline=None)
@given(heights, steps, st.integers(-5000, 5000))
def test_a_cut_is_the_valley_about_the_deepest_point(
    height: list[int], step: list[int], start: int
) -> None:
    """Against the profile's own graph: where it lies below the lower crest."""
    n = np.array(height, np.float64) / 100
    v = np.cumsum([start, *step[: len(n) - 1]]) / 100.0
    deepest = int(np.argmin(n))
    level = min(n[: deepest + 1].max(), n[deepest:].max())
    assume(level > n[deepest])
    cut = cut_profile(np.stack([v, n], axis=-1), "valley")

    np.testing.assert_array_equal(cut[[0, -1], 1], 0.0)
    assert (cut[1:-1, 1] < 0).all()
    assert cut[0, 0] == pytest.approx(-cut[-1, 0], abs=1e-12)
    assert (np.diff(cut[:, 0]) > 0).all()
    ends = []
    for way in (-1, 1):
        at = deepest
        while n[at] < level:
            at += way
        inner = at - way
        ends.append(v[inner] + (level - n[inner]) / (n[at] - n[inner]) * (v[at] - v[inner]))
    assert cut[-1, 0] - cut[0, 0] == pytest.approx(ends[1] - ends[0], rel=1e-12)
    shift = (ends[0] + ends[1]) / 2
    np.testing.assert_allclose(np.interp(cut[:, 0] + shift, v, n) - level, cut[:, 1], atol=1e-9)
    # No point of the valley is left out.
    inside = (v > ends[0] + 1e-9) & (v < ends[1] - 1e-9)
    assert inside.sum() == np.sum((cut[1:-1, 0] > cut[0, 0] + 1e-9)
                                  & (cut[1:-1, 0] < cut[-1, 0] - 1e-9))  # fmt: skip


@settings(deadline=None)
@given(st.lists(st.integers(-1000, -1), min_size=1, max_size=12), st.integers(0, 400), steps)
def test_higher_ends_keep_every_point_between_them(
    inner: list[int], higher: int, step: list[int]
) -> None:
    n = np.array([0, *inner, higher], np.float64)
    v = np.cumsum([0.0, *step[: len(n) - 1]])
    cut = cut_profile(np.stack([v, n], axis=-1), "ends")
    assert tuple(cut[[0, -1], 1]) == (0.0, 0.0)
    np.testing.assert_array_equal(cut[1:-1, 1], inner)
    np.testing.assert_allclose(cut[:-1, 0] - cut[0, 0], v[:-1], atol=1e-9)


# ---- refusals --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("points", "expected"),
    [
        ([(0.0, 0.0), (1.0, -1.0)], r"shape \(2, 2\); expected at least three finite points"),
        (np.zeros((4, 3)), r"shape \(4, 3\); expected at least three"),
        ([1.0, 2.0, 3.0], r"shape \(3,\); expected at least three"),
        ([(-1.0, 0.0), (0.0, math.nan), (1.0, 0.0)], "expected at least three finite points"),
        ([(-1.0, 0.0), (0.0, -1.0), (math.inf, 0.0)], "expected at least three finite points"),
        ([(0, -2), (1, -1), (2, 0)], "the deepest point is at an end of the profile; expected"),
        ([(0, 0), (1, -1), (2, -2)], "the deepest point is at an end of the profile; expected"),
        ([(0, 1), (1, 1), (2, 1)], "the deepest point is at an end of the profile; expected"),
        ([(-1, 0), (-2, -1), (0, -3), (2, 0)], "runs back under its left end; expected one height"),
        ([(-2, 0), (0, -3), (2, -1), (1, 0)], "runs back under its right end; expected one height"),
    ],
)
def test_what_is_no_scratch_is_refused(points: list, expected: str) -> None:
    with pytest.raises(ValueError, match=rf"^profile 7: .*{expected}") as error:
        cut_profile(points, "profile 7")
    one_sentence(error)


@pytest.mark.parametrize(
    ("points", "pieces"),
    [
        # A loop; a wall that touches the other one; one that runs back along itself.
        ([(-4, 0), (1, -2), (-1, -2), (4, 0)], (1, 3)),
        ([(-2, 0), (-1, -2), (1, -1), (-1.5, -1), (0, -3), (2, 0)], (1, 3)),
        ([(-3, 0), (-1, -1), (0, -2), (1, -2), (1, -1), (-1, -1), (-1, -3), (3, 0)], (1, 5)),
        ([(-2, 0), (0, -3), (1, -2), (0.5, -2.5), (2, 0)], (2, 3)),
    ],
)
def test_a_profile_that_crosses_or_touches_itself_is_refused(
    points: list, pieces: tuple[int, int]
) -> None:
    one, other = pieces
    expected = rf"^loop: the profile crosses itself between its pieces {one} and {other}; expected"
    with pytest.raises(ValueError, match=expected) as error:
        cut_profile(points, "loop")
    one_sentence(error)


@settings(deadline=None, max_examples=300)
@given(
    st.lists(st.tuples(st.integers(-20, 20), st.integers(-20, -1)), min_size=2, max_size=6),
)
def test_crossings_are_those_of_all_pairs_of_pieces(inner: list[tuple[int, int]]) -> None:
    """Integers, so that the brute-force search is exact."""
    points = [(-30, 0), *inner, (30, 0)]
    assume(all(a != b for a, b in itertools.pairwise(points)))
    crosses = crosses_itself([*points, points[0]])
    if crosses:
        with pytest.raises(ValueError, match="crosses itself"):
            cut_profile(points, "random")
    else:
        np.testing.assert_allclose(cut_profile(points, "random"), points, atol=1e-12)


def crosses_itself(ring: list[tuple[int, int]]) -> bool:
    """Whether two pieces of a closed polyline meet anywhere but at the end that they share."""

    def turn(a: tuple[int, int], b: tuple[int, int], c: tuple[int, int]) -> int:
        product = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        return (product > 0) - (product < 0)

    def lies_on(a: tuple[int, int], b: tuple[int, int], c: tuple[int, int]) -> bool:
        return (
            turn(a, b, c) == 0
            and min(a[0], b[0]) <= c[0] <= max(a[0], b[0])
            and min(a[1], b[1]) <= c[1] <= max(a[1], b[1])
        )

    count = len(ring) - 1
    for one in range(count):
        a, b = ring[one], ring[one + 1]
        for other in range(one + 1, count):
            c, d = ring[other], ring[other + 1]
            if other == one + 1:  # share b = c
                if lies_on(a, b, d) or lies_on(c, d, a):
                    return True
            elif one == 0 and other == count - 1:  # share a = d
                if lies_on(a, b, c) or lies_on(c, d, b):
                    return True
            elif (turn(a, b, c) != turn(a, b, d) and turn(c, d, a) != turn(c, d, b)) or any(
                (lies_on(a, b, c), lies_on(a, b, d), lies_on(c, d, a), lies_on(c, d, b))
            ):
                return True
    return False
