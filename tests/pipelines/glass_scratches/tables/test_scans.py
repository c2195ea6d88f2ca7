"""Scratches in measured scans, against the closed forms that were put into them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.profiles import cut_profile
from pipelines.glass_scratches.tables.scans import (
    land_line,
    measured_profile,
    surroundings,
    thinned,
)

Floats = NDArray[np.float64]
NO_GAPS = np.zeros((0, 2))


def scan(
    points: int = 4001,
    length: float = 2000.0,
    *,
    depth: float = 6.0,
    noise: float = 0.05,
    tilt: float = 0.0,
    border: float = 0.0,
    at: float = 700.0,
) -> Floats:
    """A V of 20 µm with borders beside it."""
    v = np.linspace(0.0, length, points)
    beside = np.abs(v - at)
    n = -depth * np.maximum(1 - beside / 10, 0) + border * np.exp(-(((beside - 14) / 2) ** 2))
    n += noise * np.random.default_rng(3).standard_normal(points) + tilt * v
    return np.stack([v, n], axis=-1)


def test_the_groove_is_cut_at_the_land() -> None:
    made = measured_profile(scan(), NO_GAPS, "a")
    assert made.points[-1, 0] - made.points[0, 0] == pytest.approx(20.0, abs=0.6)
    assert made.points[:, 1].min() == pytest.approx(-6.0, abs=0.2)
    (note,) = made.notes
    assert note.startswith("The largest groove was taken, from v = 690 to 71")
    assert note.endswith("of a scan of 2000 µm.")


def test_roughness_stays() -> None:
    rough = measured_profile(scan(noise=0.1), NO_GAPS, "a").points
    assert np.abs(np.diff(rough[:, 1], n=2)).mean() > 0.1


def test_the_groove_is_cut_at_crests_that_rise_over_the_roughness() -> None:
    made = measured_profile(scan(border=1.0), NO_GAPS, "a")
    assert made.points[-1, 0] - made.points[0, 0] == pytest.approx(28.0, abs=1.5)
    assert made.points[:, 1].min() == pytest.approx(-7.0, abs=0.2)


def test_a_tilt_is_removed_on_request() -> None:
    tilted = scan(tilt=0.1)
    told = measured_profile(tilted, NO_GAPS, "a").notes[-1]
    assert told.startswith("The land rises by 2")
    assert told.endswith("the setting level removes such a tilt.")
    made = measured_profile(tilted, NO_GAPS, "a", level=True)
    flat = measured_profile(scan(), NO_GAPS, "a")
    assert made.points.shape == pytest.approx(flat.points.shape, abs=3)
    assert made.points[:, 1].min() == pytest.approx(flat.points[:, 1].min(), abs=0.1)


@pytest.mark.parametrize("tilt", [-0.3, 0.0, 0.02])
def test_the_land_is_a_line_that_the_scratch_does_not_bend(tilt: float) -> None:
    line = land_line(scan(tilt=tilt, border=2.0))
    np.testing.assert_allclose(line, tilt * np.linspace(0, 2000.0, 4001), atol=0.02)


def test_the_largest_groove_is_no_lone_dropout() -> None:
    points = scan()
    points[3000, 1] = -30.0
    made = measured_profile(points, NO_GAPS, "a")
    assert made.points[:, 1].min() == pytest.approx(-6.0, abs=0.2)


def test_a_scan_from_right_to_left_is_the_same() -> None:
    there, back = (measured_profile(s, NO_GAPS, "a").points for s in (scan(), scan()[::-1]))
    np.testing.assert_allclose(there, back, atol=1e-12)


@pytest.mark.parametrize(
    "drawn",
    [
        [(-5.0, 0.0), (0.0, -4.0), (5.0, 0.0)],
        [(-4.0, 0.0), (-2.0, -3.0), (0.0, -0.8), (1.5, -2.2), (4.0, 0.0)],
        [(-9, 0), (-6, 0), (-4, 1), (-1, -3), (0, -3.5), (2, -2), (4, 1.5), (7, 0), (9, 0)],
        [(-1, 0), (-1, -1), (-3, -2), (-3, -4), (3, -4), (3, -2), (1, -1), (1, 0)],
    ],
)
def test_a_profile_without_much_beside_it_stays_whole(drawn: list[tuple[float, float]]) -> None:
    points = np.array(drawn, np.float64)
    assert surroundings(points) == (0, len(points) - 1)
    made = measured_profile(points, NO_GAPS, "a")
    np.testing.assert_array_equal(made.points, cut_profile(points, "a"))
    assert made.notes == ()


def test_heights_missing_across_the_scratch_are_refused() -> None:
    points = scan()
    made = measured_profile(points, np.array([[100.0, 400.0]]), "a")
    assert len(made.points) > 20
    with pytest.raises(ValueError, match=r"^a: heights are missing across 4 of the scratch's 2"):
        measured_profile(points, np.array([[703.0, 707.0]]), "a")


@pytest.mark.parametrize("scale", [(1.0, 1000.0), (1e-3, 1.0), (1.0, 1e-3), (1000.0, 1.0)])
def test_a_depth_that_is_no_scratchs_is_refused(scale: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match=r"µm deep; expected .*: name the units in the header"):
        measured_profile(scan(noise=0.0) * scale, NO_GAPS, "a")


def test_thinned_points_draw_the_others() -> None:
    v = np.linspace(0.0, 20.0, 5001)
    points = np.stack([v, -4 * np.sin(np.pi * v / 20)], axis=-1)
    kept, tolerance = thinned(points, 100)
    assert len(kept) == 100
    assert np.isin(kept[:, 0], v).all()
    np.testing.assert_array_equal(kept[[0, -1]], points[[0, -1]])
    off = np.abs(np.interp(v, *kept.T) - points[:, 1]).max()
    assert 0 < tolerance <= off < 1.3 * tolerance < 0.005
    same, nothing = thinned(points[:100], 100)
    np.testing.assert_array_equal(same, points[:100])
    assert nothing == 0.0


def test_many_points_take_no_time_and_are_told() -> None:
    made = measured_profile(scan(90_001, 60.0, at=30.0), NO_GAPS, "a")
    assert len(made.points) <= 1024
    assert "points 1024 were kept, which draw the others to within 0.1" in made.notes[-1]
