"""Fields of JSON as they have to be: the file, the field and what was found, where they are not."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened
from storage.readers.drives.recordings import shown_number
from storage.readers.opening import DEEPEST_JSON, LARGEST_JSON, parsed_json, whole_file

Layers = Sequence[tuple[str, dict[str, Any]]]
"""Objects that are asked one after the other, each with what stands before its fields' names."""


def json_file(file: Path, expected: str) -> Any:
    """A JSON file's content; raises BadInput where it is missing, broken or too large."""
    try:
        return parsed_json(whole_file(file, expected, LARGEST_JSON))
    except json.JSONDecodeError as error:
        found = f"broken in line {error.lineno}, column {error.colno}"
        raise BadInput(file, "JSON", found, "a complete JSON object") from error
    except BadInput:
        raise
    except ValueError as error:  # no text, numbers of 5000 digits, nested too deep
        expected = f"a complete JSON object, nested {DEEPEST_JSON} deep at most"
        raise BadInput(file, "JSON", "broken", expected) from error


def nearest(layers: Layers, key: str) -> tuple[str | None, Any]:
    """Where a field stands first, as a prefix of its name, and its value; None, None if nowhere."""
    return next(((where, layer[key]) for where, layer in layers if key in layer), (None, None))


def required(file: Path, layers: Layers, key: str, expected: str) -> Any:
    """A field's value, the nearest."""
    where, value = nearest(layers, key)
    if where is None:
        raise BadInput(file, f"{layers[0][0]}{key}", "missing", expected)
    return value


def json_object(file: Path, field: str, value: Any) -> dict[str, Any]:
    """An object as it is."""
    if not isinstance(value, dict):
        raise BadInput(file, field, shown_json(value), "a JSON object")
    return value


def json_text(file: Path, field: str, value: Any, expected: str = "a text") -> str:
    """A text that is not empty."""
    if not isinstance(value, str) or not value:
        raise BadInput(file, field, shown_json(value), expected)
    return value


def json_number(file: Path, field: str, value: Any) -> float:
    """A finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise BadInput(file, field, shown_json(value), "a number")
    try:
        number = float(value)
    except OverflowError:  # an integer of 400 digits
        number = math.inf
    if not math.isfinite(number):
        raise BadInput(file, field, shown_number(number), "a finite number")
    return number


def json_matrix(
    file: Path, field: str, rows: Any, shapes: Sequence[tuple[int, int]]
) -> NDArray[np.float64]:
    """A matrix of one of some shapes (rows, columns), finite."""
    told = " or ".join(f"{down} rows of {across} numbers" for down, across in shapes)
    lists = isinstance(rows, list) and all(isinstance(row, list) for row in rows)
    shape = (len(rows), len(rows[0])) if lists and rows else (0, 0)
    if shape not in shapes or any(len(row) != shape[1] for row in rows):
        sizes = " or ".join(f"{down} x {across}" for down, across in shapes)
        raise BadInput(file, field, f"not {sizes}", told)
    return np.array(
        [
            [json_number(file, f"{field}[{i}][{j}]", value) for j, value in enumerate(row)]
            for i, row in enumerate(rows)
        ]
    )


def json_vector(file: Path, field: str, values: Any, length: int) -> NDArray[np.float64]:
    """So many numbers, finite."""
    if not isinstance(values, list) or len(values) != length:
        raise BadInput(file, field, shown_json(values), f"a list of {length} numbers")
    return np.array([json_number(file, f"{field}[{i}]", value) for i, value in enumerate(values)])


def shown_json(value: Any) -> str:
    """A value as JSON, not too long."""
    return shortened(json.dumps(value, ensure_ascii=False))
