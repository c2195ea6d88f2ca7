"""Tables of text by the standard library's CSV, and what archives list."""

from __future__ import annotations

import csv
import re
import zipfile
from collections import Counter
from pathlib import Path

Found = dict[str, str]

_LITTER = re.compile(r"(^|/)(\.|@eadir/|__macosx/|desktop\.ini$|thumbs\.db$)")


def in_table(path: Path) -> Found:
    """Columns beyond two, and tables behind the first."""
    lines = [line for line in _text(path).splitlines() if line.strip(" ;,\t")]
    best: list[list[bool]] = []  # of each row's cells, whether they are numbers
    for delimiter in ("\t", ";", ",", " "):
        rows = csv.reader(lines, delimiter=delimiter, skipinitialspace=True)
        numbers = [[_is_number(cell) for cell in row if cell.strip()] for row in rows]
        if sum(sum(row) > 1 for row in numbers) > sum(sum(row) > 1 for row in best):
            best = numbers
    found: Found = {}
    usual = Counter(len(row) for row in best if sum(row) > 1).most_common(1)
    if usual and usual[0][0] > 2 and usual[0][1] > 2:
        found["columns"] = f"{usual[0][0]}"
    # Between tables stands a line without any number.
    marks = "".join("1" if sum(row) > 1 else "0" if any(row) else " " for row in best)
    tables = [table for table in marks.split() if table.count("1") > 2]
    if len(tables) > 1:
        found["table"] = f"{len(tables)} tables"
    return found


def in_sdf(path: Path) -> Found:
    """Profiles beyond the first."""
    match = re.search(r"NumProfiles\s*=\s*(\d+)", _text(path))
    return {"table": f"{match[1]} profiles"} if match and int(match[1]) > 1 else {}


def in_archive(path: Path) -> Found:
    """Files of a ZIP that are no photographs of a series, whose names have four angles, and not
    what operating systems leave behind."""
    with zipfile.ZipFile(path) as archive:
        names = [name for name in archive.namelist() if not name.endswith("/")]
    others = [
        name
        for name in names
        if len(re.findall(r"\d+", name)) < 4 and not _LITTER.search(name.lower())
    ]
    return {"files": ", ".join(sorted(others)[:5])} if others else {}


def _is_number(cell: str) -> bool:
    word = cell.strip().replace(",", "" if "." in cell else ".")
    word = word.replace("\u2212", "-").replace("D", "E")
    try:
        float(word)
    except ValueError:
        return False
    return True


def _text(path: Path) -> str:
    data = path.read_bytes()
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", "replace")
    if data[1:8:2].count(0) > 2:
        return data.decode("utf-16-le", "replace")
    for encoding in ("utf-8-sig", "cp932", "cp1252"):
        try:
            return data.decode(encoding).replace("\0", " ")
        except UnicodeDecodeError:
            continue
    return ""
