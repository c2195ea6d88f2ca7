"""Tables as JSON: a list of flat objects, one after the other, however long the file is."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from storage.readers.bad_input import BadInput
from storage.readers.opening import check_file, unreadable

LARGEST_ROWS = 8 << 30
"""Bytes of a file; a row at a time is in memory."""
LONGEST_ROW = 1 << 20
"""Characters."""

_PIECE = 1 << 20
_EXPECTED = "a JSON list of objects"


def json_rows(file: Path) -> Iterator[dict[str, Any]]:
    """The objects of a list, in its order. Raises BadInput where the file is missing, no such list
    or broken, at the row where that is noticed."""
    check_file(file, _EXPECTED, LARGEST_ROWS)
    try:
        with file.open(encoding="utf-8-sig", errors="replace") as stream:
            yield from _rows(file, stream)
    except OSError as error:
        raise unreadable(file, error, _EXPECTED) from error


def _rows(file: Path, stream: Any) -> Iterator[dict[str, Any]]:
    decoder = json.JSONDecoder()
    text, at, ended, count = "", 0, False, 0
    between = "["
    while True:
        if len(text) - at < LONGEST_ROW and not ended:
            piece = stream.read(_PIECE)
            text, at, ended = text[at:] + piece, 0, not piece
        at = _past_spaces(text, at)
        if not ended and len(text) - at < LONGEST_ROW:
            continue
        if text[at : at + 1] == "]" and between != "[":
            return
        if text[at : at + 1] != between:
            raise BadInput(file, "JSON", f"broken after {count} rows", _EXPECTED)
        at = _past_spaces(text, at + 1)
        if between == "[" and text[at : at + 1] == "]":
            return
        between = ","
        try:
            row, at = decoder.raw_decode(text, at)
        except (ValueError, RecursionError):
            raise BadInput(file, "JSON", f"broken after {count} rows", _EXPECTED) from None
        if not isinstance(row, dict):
            raise BadInput(file, f"row {count}", "no object", _EXPECTED)
        count += 1
        yield row


def _past_spaces(text: str, at: int) -> int:
    while text[at : at + 1] in (" ", "\n", "\r", "\t"):
        at += 1
    return at
