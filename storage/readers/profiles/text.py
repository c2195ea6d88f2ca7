"""The lines of a text file that an instrument or a spreadsheet has written, in any encoding."""

from __future__ import annotations

import codecs
import re
from pathlib import Path

from storage.readers.bad_input import BadInput
from storage.readers.opening import whole_file

EXPECTED = "a text file of points, a line each: across the scratch, and height"

_LARGEST = 64 << 20  # bytes: 600 a point
_LONGEST_LINE = 100_000
_MOST_LINES = 500_000  # comments and blank lines among them

_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
# Words of Japanese instruments' headers: they tell Shift-JIS from Windows' Western code page.
_JAPANESE = tuple(
    word.encode("cp932") for word in ("\u03bcm", "高さ", "距離", "位置", "深さ", "単位")
)
_FIRST = 4096  # bytes that tell an encoding without a mark
_CONTROLS = re.compile("[\0-\x08\x0e-\x19\x1b-\x1f\x7f-\x84\x86-\x9f\ufffe\uffff]")
_ARCHIVE = b"PK\x03\x04"


def text_of(file: Path) -> str:
    """A file's text: UTF-8, UTF-16, Shift-JIS or Windows' Western code page.

    Raises BadInput for a file that is missing, a directory, too large, an archive or not text.
    """
    data = whole_file(file, EXPECTED, _LARGEST)
    if data.startswith(_ARCHIVE):
        raise BadInput(file, "content", "a zip archive (X3P, XLSX)", f"{EXPECTED}: export as text")
    try:
        return data[_mark_length(data) :].decode(_encoding(data))
    except UnicodeDecodeError:
        raise BadInput(file, "content", "not text", EXPECTED) from None


def lines_of(file: Path, text: str) -> list[tuple[int, str]]:
    """The lines that are not blank, with their numbers from 1.

    Raises BadInput for what is binary or empty, and for too many or too long lines.
    """
    lines = re.split(r"\r\n|\r|\n|\x1a", text)
    if len(lines) > _MOST_LINES:
        raise BadInput(file, "number of lines", f"{len(lines)}", f"at most {_MOST_LINES}")
    kept = [(number, line) for number, line in enumerate(lines, start=1) if line.strip()]
    if not kept:
        raise BadInput(file, "content", "empty", EXPECTED)
    for number, line in kept:
        if _CONTROLS.search(line):
            raise BadInput(file, "content", "not text", f"{EXPECTED}: export as text")
        if len(line) > _LONGEST_LINE:
            found, expected = f"{len(line)} characters", f"at most {_LONGEST_LINE}"
            raise BadInput(file, f"length of line {number}", found, expected)
    return kept


def _mark_length(data: bytes) -> int:
    return next((len(mark) for mark, _ in _MARKS if data.startswith(mark)), 0)


def _encoding(data: bytes) -> str:
    for mark, name in _MARKS:
        if data.startswith(mark):
            return name
    first = data[:_FIRST]
    # Numbers in UTF-16 have a NUL in every second byte.
    for name, odd in (("utf-16-le", 1), ("utf-16-be", 0)):
        if len(first) > 3 and not any(first[odd::2]) and all(first[1 - odd :: 2]):
            return name
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return "cp932" if any(word in data for word in _JAPANESE) else "cp1252"
    return "utf-8"
