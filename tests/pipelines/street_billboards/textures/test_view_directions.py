"""Places in the fan of directions around billboards."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipelines.street_billboards.textures.view_directions import (
    CIRCLE,
    DIRECTIONS,
    SPACING,
    fan_position,
)


@given(
    first=st.integers(0, CIRCLE - 1),
    place=st.floats(-14.49, 45.49),
    away=st.floats(0.1, 100),
    height=st.floats(-5, 5),
)
def test_fan_positions_of_known_azimuths(
    first: int, place: float, away: float, height: float
) -> None:
    angle = np.radians((first + place) * SPACING)
    offset = np.array([away * np.cos(angle), away * np.sin(angle), height])
    assert fan_position(offset, first) == pytest.approx(place, abs=1e-6)
    assert fan_position(offset[:2], first) == pytest.approx(place, abs=1e-6)


@given(seed=st.integers(0, 1000))
def test_what_is_outside_is_put_on_its_nearer_side(seed: int) -> None:
    rng = np.random.default_rng(seed)
    first = rng.integers(0, CIRCLE, 50)
    found = fan_position(rng.normal(size=(50, 3)), first)
    assert ((found >= -14.5) & (found <= 45.5)).all()
    before, behind = np.maximum(-found, 0), np.maximum(found - (DIRECTIONS - 1), 0)
    # The gap of the circle is 29 steps wide: nobody is farther than half of it from the fan.
    assert np.maximum(before, behind).max() <= 14.5
