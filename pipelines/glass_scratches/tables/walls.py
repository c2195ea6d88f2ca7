"""The walls of a scratch: what a bounce does to light."""

from __future__ import annotations

import numpy as np


def check_albedo(albedo: float) -> None:
    """Raises ValueError for an albedo outside [0, 1]."""
    if not 0.0 <= albedo <= 1.0:
        raise ValueError(f"albedo is {albedo:g}; expected 0 to 1.")


def check_roughness(roughness: float) -> None:
    """Raises ValueError for a roughness outside [0, 1]."""
    if not 0.0 <= roughness <= 1.0:
        raise ValueError(f"roughness is {roughness:g}; expected 0 (mirror) to 1 (diffuse).")


def bounce_blur(roughness: float) -> float:
    """Standard deviation of the blurred sine of a bounce: 0 for a mirror, infinite for Lambert's
    law.

    Raises ValueError as :func:`check_roughness`.

    >>> bounce_blur(0.0), bounce_blur(0.5), bounce_blur(1.0)
    (0.0, 1.0, inf)
    """
    check_roughness(roughness)
    return np.inf if roughness == 1.0 else roughness / (1.0 - roughness)
