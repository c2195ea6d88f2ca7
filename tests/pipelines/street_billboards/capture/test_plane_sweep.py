"""Census, semi-global matching and plane sweep against brute force and a street of exact depth."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.street_billboards.capture.census import MOST_BITS, bits_set, census
from pipelines.street_billboards.capture.plane_sweep import Photograph, sweep_depth
from pipelines.street_billboards.capture.semi_global import _LARGE, _SMALL, semi_global_labels
from tests.pipelines.street_billboards.stereo_street import frame_at


def _counted(values: NDArray[np.uint64]) -> NDArray[np.int64]:
    from numba import njit

    @njit
    def count(some):  # type: ignore[no-untyped-def]
        return [bits_set(one) for one in some]

    return np.array(count(values), np.int64)


def test_census_is_which_of_its_neighbours_are_darker() -> None:
    picture = np.random.default_rng(1).integers(0, 255, (12, 15), np.uint8)
    padded = np.pad(picture, ((3, 3), (4, 4)), mode="edge")
    found = census(picture)
    for y, x in ((0, 0), (5, 7), (11, 14)):
        window = padded[y : y + 7, x : x + 9]
        darker = int((window < picture[y, x]).sum())
        assert _counted(found[y, x : x + 1])[0] == darker
    assert MOST_BITS == 62


def test_bits_are_counted() -> None:
    values = np.array([0, 1, 2**63, 2**64 - 1, 0b1011], np.uint64)
    np.testing.assert_array_equal(_counted(values), [0, 1, 1, 64, 3])


def test_semi_global_costs_are_those_of_paths_walked_one_by_one() -> None:
    """Without edges, the sum over eight paths of Hirschmüller's recursion, pixel by pixel."""
    random = np.random.default_rng(2)
    costs = random.integers(0, 60, (6, 7, 8), np.uint8)
    costs[..., 0] = costs[..., -1] = 250  # never the best: these have no label
    total = np.zeros(costs.shape)
    for dy, dx in itertools.product((-1, 0, 1), repeat=2):
        if (dy, dx) != (0, 0):
            total += _path(costs.astype(np.float64), dy, dx)
    found = semi_global_labels(costs, np.full((6, 7), 90, np.uint8))
    best = total.argmin(axis=-1)
    np.testing.assert_array_equal(np.rint(found.value), best)
    second = np.where(np.abs(np.arange(8) - best[..., None]) > 2, total, np.inf).min(axis=-1)
    least = total.min(axis=-1)
    np.testing.assert_allclose(found.margin, (second - least) / least, rtol=1e-4)


def _path(costs: NDArray[np.float64], dy: int, dx: int) -> NDArray[np.float64]:
    height, width, labels = costs.shape
    small, jump = float(_SMALL), max(float(_LARGE), 1.5 * float(_SMALL))
    found = np.zeros_like(costs)
    rows = range(height) if dy >= 0 else range(height - 1, -1, -1)
    columns = range(width) if dx >= 0 else range(width - 1, -1, -1)
    for y in rows:
        for x in columns:
            found[y, x] = costs[y, x]
            v, u = y - dy, x - dx
            if not (0 <= v < height and 0 <= u < width):
                continue
            before = found[v, u]
            for d in range(labels):
                ways = [before[d], before.min() + jump]
                ways += [before[e] + small for e in (d - 1, d + 1) if 0 <= e < labels]
                found[y, x, d] += min(ways) - before.min()
    return found


# ---- the sweep -------------------------------------------------------------------------------


def _taken(place: float, exposure: float = 1.0) -> Photograph:
    frame = frame_at(place)
    pixels = np.clip(frame.photographs[1] * exposure, 0, 255).astype(np.uint8)
    return Photograph(pixels, frame.intrinsics[1], frame.poses[1])


def test_depth_along_the_road_whatever_the_exposure() -> None:
    truth = frame_at(3.0).depth[1]
    others = [_taken(place, 0.8 + 0.05 * place) for place in (0.0, 1.0, 2.0, 4.0, 5.0, 6.0)]
    found = sweep_depth(_taken(3.0), others)
    near = truth < 20
    off = np.abs(found.depth - truth)[near]
    assert (off < 0.05 * truth[near]).mean() > 0.7
    known = np.isfinite(found.depth)
    assert ((found.depth[known] >= 2) & (found.depth[known] <= 40)).all()
    assert np.isfinite(found.deviation[known]).all()
    assert np.isnan(found.deviation[~known]).all()


def test_where_the_way_leads_nothing_or_little_is_told() -> None:
    """Around the epipole, in the middle of the picture, pixels hardly move."""
    found = sweep_depth(_taken(3.0), [_taken(place) for place in (1.0, 2.0, 4.0, 5.0)])
    middle, side = np.s_[95:105, 155:165], np.s_[95:105, 20:60]
    assert np.isfinite(found.depth[middle]).mean() < 0.2
    assert np.isfinite(found.depth[side]).mean() > 0.6
    told = found.deviation / found.depth
    ring = np.hypot(np.arange(320) - 159.5, (np.arange(200) - 99.5)[:, None])
    inner, outer = (ring > 15) & (ring < 50), ring > 100
    assert np.nanmedian(told[inner]) > 1.5 * np.nanmedian(told[outer])


def test_a_shorter_way_leaves_wider_deviations() -> None:
    long = sweep_depth(_taken(3.0), [_taken(2.0), _taken(4.0)])
    short = sweep_depth(_taken(3.0), [_taken(2.7), _taken(3.3)])
    both = np.isfinite(long.depth) & np.isfinite(short.depth)
    ratio = np.median(short.deviation[both] / long.deviation[both])
    assert 1.5 < ratio < 6.0  # a third of the way


def test_no_other_photograph_is_refused() -> None:
    with pytest.raises(ValueError, match="found no photograph"):
        sweep_depth(_taken(0.0), [])
