"""The Utah teapot: the control points of its 32 bicubic Bezier patches, and grids of positions.

Measured by Martin Newell, 1975 (University of Utah), in the usual form, a quarter lower than the
pot itself; the bottom's four patches are Frank Crow's ("The origins of the teapot", IEEE Computer
Graphics and Applications 7(1), 1987). z is up, the spout points along +x, y = 0 is a plane of
symmetry, the pot stands on z = 0 and is 3.15 high.

Body, lid and bottom are swept by quarter circles: a row of a patch's control points at radius r
and height z is (r, 0), (r, -o), (o, -r), (0, -r), with o = 0.56 r as published (0.45 at the
knob's 0.8). Handle and spout are given by their halves with y <= 0.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

# The middle of the box around Newell's teapot, and the radius of the sphere around that.
_NEWELL_CENTRE = np.array([0.21703756, 0.0, 1.575])
_NEWELL_RADIUS = 3.34029113

TEAPOT_CENTRE = _NEWELL_CENTRE / _NEWELL_RADIUS
"""(3,): the middle of the teapot's box, in the coordinates of its grids (see `swept_grid`)."""

Profile = tuple[tuple[float, float, float], ...]
"""Four rows (r, o, z) of one swept patch."""

# The body from its rim down and on to the middle of the bottom.
RIM: Profile = (
    (1.4, 0.784, 2.4),
    (1.3375, 0.749, 2.53125),
    (1.4375, 0.805, 2.53125),
    (1.5, 0.84, 2.4),
)
UPPER_BODY: Profile = ((1.5, 0.84, 2.4), (1.75, 0.98, 1.875), (2.0, 1.12, 1.35), (2.0, 1.12, 0.9))
LOWER_BODY: Profile = ((2.0, 1.12, 0.9), (2.0, 1.12, 0.45), (1.5, 0.84, 0.225), (1.5, 0.84, 0.15))
BOTTOM: Profile = ((1.5, 0.84, 0.15), (1.5, 0.84, 0.075), (1.425, 0.798, 0.0), (0.0, 0.0, 0.0))

# The lid from the top of its knob down.
KNOB: Profile = ((0.0, 0.0, 3.15), (0.8, 0.45, 3.15), (0.0, 0.0, 2.85), (0.2, 0.112, 2.7))
LID: Profile = ((0.2, 0.112, 2.7), (0.4, 0.224, 2.55), (1.3, 0.728, 2.55), (1.3, 0.728, 2.4))

_Rows = tuple[tuple[tuple[float, float, float], ...], ...]

# From the body's top outwards and back to its flank; columns from the inner to the outer side.
_UPPER_HANDLE: _Rows = (
    ((-1.6, 0, 2.025), (-1.6, -0.3, 2.025), (-1.5, -0.3, 2.25), (-1.5, 0, 2.25)),
    ((-2.3, 0, 2.025), (-2.3, -0.3, 2.025), (-2.5, -0.3, 2.25), (-2.5, 0, 2.25)),
    ((-2.7, 0, 2.025), (-2.7, -0.3, 2.025), (-3.0, -0.3, 2.25), (-3.0, 0, 2.25)),
    ((-2.7, 0, 1.8), (-2.7, -0.3, 1.8), (-3.0, -0.3, 1.8), (-3.0, 0, 1.8)),
)
_LOWER_HANDLE: _Rows = (
    ((-2.7, 0, 1.8), (-2.7, -0.3, 1.8), (-3.0, -0.3, 1.8), (-3.0, 0, 1.8)),
    ((-2.7, 0, 1.575), (-2.7, -0.3, 1.575), (-3.0, -0.3, 1.35), (-3.0, 0, 1.35)),
    ((-2.5, 0, 1.125), (-2.5, -0.3, 1.125), (-2.65, -0.3, 0.9375), (-2.65, 0, 0.9375)),
    ((-2.0, 0, 0.9), (-2.0, -0.3, 0.9), (-1.9, -0.3, 0.6), (-1.9, 0, 0.6)),
)

# From the body's flank outwards to the lip and into it; columns from the upper to the lower side.
_LOWER_SPOUT: _Rows = (
    ((1.7, 0, 1.425), (1.7, -0.66, 1.425), (1.7, -0.66, 0.6), (1.7, 0, 0.6)),
    ((2.6, 0, 1.425), (2.6, -0.66, 1.425), (3.1, -0.66, 0.825), (3.1, 0, 0.825)),
    ((2.3, 0, 2.1), (2.3, -0.25, 2.1), (2.4, -0.25, 2.025), (2.4, 0, 2.025)),
    ((2.7, 0, 2.4), (2.7, -0.25, 2.4), (3.3, -0.25, 2.4), (3.3, 0, 2.4)),
)
_UPPER_SPOUT: _Rows = (
    ((2.7, 0, 2.4), (2.7, -0.25, 2.4), (3.3, -0.25, 2.4), (3.3, 0, 2.4)),
    ((2.8, 0, 2.475), (2.8, -0.25, 2.475), (3.525, -0.25, 2.49375), (3.525, 0, 2.49375)),
    ((2.9, 0, 2.475), (2.9, -0.15, 2.475), (3.45, -0.15, 2.5125), (3.45, 0, 2.5125)),
    ((2.8, 0, 2.4), (2.8, -0.15, 2.4), (3.2, -0.15, 2.4), (3.2, 0, 2.4)),
)

HANDLE = np.array([_UPPER_HANDLE, _LOWER_HANDLE])
"""(2, 4, 4, 3): the handle's half with y <= 0; rows along it, columns around it."""

SPOUT = np.array([_LOWER_SPOUT, _UPPER_SPOUT])
"""(2, 4, 4, 3): the spout's half with y <= 0; rows along it, columns around it."""


def swept_quarter(profile: Profile) -> NDArray[np.float64]:
    """The (4, 4, 3) control points of a swept patch's quarter from +x to -y; rows along the
    profile, columns around the axis."""
    rows = [((r, 0, z), (r, -o, z), (o, -r, z), (0, -r, z)) for r, o, z in profile]
    return np.array(rows, np.float64)


# --- Grids, as in `grid_charts` -----------------------------------------------------------------


def _bezier(control: NDArray[np.float64], segments: int) -> NDArray[np.float64]:
    """Points (segments + 1, segments + 1, 3) of a bicubic patch's control points (4, 4, 3).

    Summed term by term, in one order for all points: patches meet to the last bit.
    """
    t = np.linspace(0.0, 1.0, segments + 1)
    weights = ((1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3)
    rows = np.zeros((4, segments + 1, 3))
    points = np.zeros((segments + 1, segments + 1, 3))
    for column, weight in enumerate(weights):
        rows += weight[:, None] * control[:, None, column]
    for row, weight in enumerate(weights):
        points += weight[:, None, None] * rows[row]
    return points


def _rows_joined(patches: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.concatenate([patches[0], *(patch[1:] for patch in patches[1:])])


def swept_grid(profiles: Sequence[Profile], segments: int) -> NDArray[np.float64]:
    """Swept patches of the teapot, one below the other, all around, clockwise from -x.

    As a grid; z up, in units of the sphere around the teapot, which stands on z = 0.
    """
    controls = [swept_quarter(profile) / _NEWELL_RADIUS for profile in profiles]
    quarter = _rows_joined([_bezier(control, segments) for control in controls])
    quarter[..., 2] = quarter[:, :1, 2]  # without rounding errors: a pole is one position
    x, y, z = np.moveaxis(quarter, -1, 0)
    turned = [(-x, -y), (-y, x), (x, y), (y, -x)]  # turns by quarters are exact
    sides = [np.stack([*xy, z], axis=-1) for xy in turned]
    return np.concatenate([sides[0], *(side[:, 1:] for side in sides[1:])], axis=1)


def tube_grid(halves: NDArray[np.float64], segments: int, first_column: int) -> NDArray[np.float64]:
    """A tube of the teapot, from the patches of its one half and their mirror image in y.

    As a grid in the coordinates of `swept_grid`, of 2 ``segments`` + 1 rows and columns; the
    halves' column ``first_column`` comes first.
    """
    half = _rows_joined([_bezier(control / _NEWELL_RADIUS, segments) for control in halves])
    other = half[:, -2:0:-1] * [1, -1, 1]
    ring = np.roll(np.concatenate([half, other], axis=1), -first_column, axis=1)
    return np.concatenate([ring, ring[:, :1]], axis=1)
