"""Users' files on their way in: what they are, how large, and how much memory they may take.

A pipe, a socket or a device would block for ever or never end, so that a file is looked at before
it is opened; a folder, a link and a file behind a link are followed as usual.
"""

from __future__ import annotations

import json
import math
import os
import re
import stat
from os import PathLike
from pathlib import Path
from typing import Any

from storage.readers.bad_input import BadInput

LARGEST_FILE = 1 << 30
"""Bytes of a file that is read as a whole."""
LARGEST_JSON = 16 << 20
"""Bytes of JSON, which takes up to thirty times as many in memory."""
DEEPEST_JSON = 64
"""Lists and objects inside each other."""
LONGEST_NUMBER = 1000
"""Characters."""
LARGEST_MEMORY = 1 << 30
"""Bytes that any file may take in memory; large ones may take more, by their own size."""

_INFINITE = re.compile(r"[-+]?1\.#INF0*")
_NO_NUMBER = re.compile(r"[-+]?(1\.#(IND|QNAN|SNAN)0*|s?nan\(\w*\))", re.IGNORECASE)

_LFS_POINTER = b"version https://git-lfs"
_KINDS = (
    (stat.S_ISDIR, "a directory"),
    (stat.S_ISFIFO, "a named pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


def check_file(
    path: str | PathLike[str],
    expected: str,
    largest: int | None = LARGEST_FILE,
    field: str = "file",
) -> int:
    """The bytes of a file. Raises BadInput where it is missing, unreadable, larger than
    ``largest`` (None: never) or no regular file but a directory, a pipe, a socket or a device."""
    try:
        found = os.stat(path)
    except FileNotFoundError:
        raise BadInput(path, field, "missing", expected) from None
    except OSError as error:
        raise unreadable(path, error, expected) from error
    except ValueError:  # a NUL in the name
        raise BadInput(path, field, "not a possible name", expected) from None
    for is_one, kind in _KINDS:
        if is_one(found.st_mode):
            raise BadInput(path, field, kind, expected)
    if largest is not None and found.st_size > largest:
        raise BadInput(path, "size", f"{found.st_size} bytes", f"at most {largest} bytes")
    return found.st_size


def first_bytes(
    path: str | PathLike[str],
    count: int,
    expected: str,
    largest: int | None = LARGEST_FILE,
    field: str = "file",
) -> bytes:
    """How a file begins; raises BadInput as :func:`check_file`, and for what Git leaves in the
    place of a large file that was not loaded."""
    check_file(path, expected, largest, field)
    try:
        with open(path, "rb") as stream:
            start = stream.read(count)
    except OSError as error:
        raise unreadable(path, error, expected) from error
    if start.startswith(_LFS_POINTER):
        raise BadInput(path, field, "a pointer of Git LFS", "the file itself: run git lfs pull")
    return start


def whole_file(path: str | PathLike[str], expected: str, largest: int = LARGEST_FILE) -> bytes:
    """A file's content; raises BadInput as :func:`check_file`."""
    return first_bytes(path, largest, expected, largest)


def unreadable(path: str | PathLike[str], error: OSError, expected: str) -> BadInput:
    """What to raise where the system refuses to open or to read a file."""
    return BadInput(path, "file", f"unreadable ({error.strerror or 'damaged'})", expected)


def check_memory(
    file: Path, field: str, found: str, needed: int, file_bytes: int, per_byte: int
) -> None:
    """Raise BadInput where what a file announces takes more than a GiB, unless its own size
    stands for it: ``needed`` and ``file_bytes`` are bytes, ``per_byte`` how many may be taken for
    each byte of the file. So large files pass and small ones that unfold do not."""
    if needed > max(LARGEST_MEMORY, per_byte * file_bytes):
        expected = (
            f"what takes at most {LARGEST_MEMORY >> 20} MiB from a file of {file_bytes} bytes"
        )
        raise BadInput(file, field, f"{found} ({needed >> 20} MiB)", expected)


def number(word: str | bytes) -> float:
    """A number in text, also what is none as C libraries write it ("1.#QNAN", "-nan(ind)");
    raises ValueError for other words and for a number written with thousands of characters, which
    Python would take minutes for."""
    if len(word) > LONGEST_NUMBER:
        raise ValueError(f"a number of at most {LONGEST_NUMBER} characters")
    try:
        return float(word)
    except ValueError:
        text = word if isinstance(word, str) else word.decode("ascii", "replace")
        if _INFINITE.fullmatch(text):
            return -math.inf if text.startswith("-") else math.inf
        if _NO_NUMBER.fullmatch(text):
            return math.nan
        raise


def parsed_json(text: bytes) -> Any:
    """JSON as Python's objects: UTF-8, -16 or -32. Raises ValueError (JSONDecodeError with the
    place, where there is one) for text that is broken, too long or nested too deep."""
    if len(text) > LARGEST_JSON:
        raise ValueError(f"longer than {LARGEST_JSON} bytes")
    try:
        value = json.loads(text)
    except RecursionError:
        raise ValueError(f"nested deeper than {DEEPEST_JSON}") from None
    level = [value] if isinstance(value, dict | list) else []
    for _ in range(DEEPEST_JSON):
        held = (outer.values() if isinstance(outer, dict) else outer for outer in level)
        level = [value for values in held for value in values if isinstance(value, dict | list)]
    if level:
        raise ValueError(f"nested deeper than {DEEPEST_JSON}")
    return value
