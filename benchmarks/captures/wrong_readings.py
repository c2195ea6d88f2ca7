"""Readings that are wrong on purpose: the nulls of the cases' right values."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

_Change = Callable[[NDArray[np.floating]], NDArray[np.floating]]


def halved(reading: Any) -> Any:
    """Every array of fractions times a half: units, exposures, scales that are not read."""
    return _changed(reading, lambda array: array / 2)


def upside_down(reading: Any) -> Any:
    """Every array of fractions turned along its first axis: rows, vertices, photographs."""
    return _changed(reading, lambda array: array[::-1])


def _changed(reading: Any, change: _Change) -> Any:
    """A copy, tuples of names, dictionaries and objects with fields looked into."""
    if isinstance(reading, np.ndarray):
        return change(reading) if reading.dtype.kind == "f" and reading.ndim else reading
    if isinstance(reading, tuple) and hasattr(reading, "_fields"):
        return type(reading)(*(_changed(value, change) for value in reading))
    if isinstance(reading, list | tuple):
        return type(reading)(_changed(value, change) for value in reading)
    if isinstance(reading, dict):
        return {name: _changed(value, change) for name, value in reading.items()}
    if hasattr(reading, "__dict__") and not callable(reading):
        other = copy.copy(reading)
        for name, value in vars(reading).items():
            object.__setattr__(other, name, _changed(value, change))  # frozen ones, too
        return other
    return reading
