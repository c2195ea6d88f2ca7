"""The Utah teapot's control points: 32 bicubic Bezier patches.

Measured by Martin Newell, 1975 (University of Utah), in the usual form, a quarter lower than the
pot itself; the bottom's four patches are Frank Crow's ("The origins of the teapot", IEEE Computer
Graphics and Applications 7(1), 1987). z is up, the spout points along +x, y = 0 is a plane of
symmetry, the pot stands on z = 0 and is 3.15 high.

Body, lid and bottom are swept by quarter circles: a row of a patch's control points at radius r
and height z is (r, 0), (r, -o), (o, -r), (0, -r), with o = 0.56 r as published (0.45 at the
knob's 0.8). Handle and spout are given by their halves with y <= 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
