"""The walls of a scratch: what a bounce does to light."""

from __future__ import annotations

from typing import Literal

Method = Literal["exact", "paths"]
"""How a table is made: by a linear system, or by counting paths."""


def check_albedo(albedo: float) -> None:
    """Raises ValueError for an albedo outside [0, 1]."""
    if not 0.0 <= albedo <= 1.0:
        raise ValueError(f"albedo is {albedo:g}; expected 0 to 1.")


def check_roughness(roughness: float) -> None:
    """Raises ValueError for a roughness outside [0, 1]."""
    if not 0.0 <= roughness <= 1.0:
        raise ValueError(f"roughness is {roughness:g}; expected 0 (clear) to 1 (diffuse).")


def table_method(method: Method | None, roughness: float) -> Method:
    """The method that was asked for; by default the exact one where walls are diffuse.

    Raises ValueError for an exact table of walls that are not.

    >>> table_method(None, 1.0), table_method(None, 0.0)
    ('exact', 'paths')
    """
    if method == "exact" and roughness != 1.0:
        raise ValueError(
            f"roughness is {roughness:g} with the method exact; expected 1, or the method paths."
        )
    return method or ("exact" if roughness == 1.0 else "paths")
