"""One file and what is right: how it ends, what is said, which values are read."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

from storage.readers.bad_input import BadInput

FILES = Path(__file__).parent / "files"
"""Of the cases that are files of this checkout."""

Ending = Literal["read", "told", "refused"]


@dataclass(frozen=True)
class Case:
    """A file, and what a user of other tools expects of it.

    file: its name; written by ``write`` to the path that it is given, or there in ``FILES``.
    kind: what it stands for, a few words; cases of one kind share them.
    read: opens a path as the product does; what it gives has ``notes``, sentences.
    ends: "read", and nothing is said; "told": read, and each of ``says`` is in a note; "refused":
    BadInput, and each of ``says`` is in its sentence.
    says: regular expressions, without regard to case. Of a refusal one is in what is expected: the
    way out.
    is_right: of what was read, whether the values are right: computed apart from the readers.
    """

    file: str
    kind: str
    read: Callable[[Path], Any]
    ends: Ending
    says: Sequence[str] = ()
    is_right: Callable[[Any], bool] | None = None
    write: Callable[[Path], object] | None = None


class Outcome(NamedTuple):
    """What became of a case.

    ending: how it ended, or "failed" for an error that no reader should raise. what: the notes, the
    refusal, the error. found: what was read, or None. has_way_out: whether a refusal names one.
    """

    is_as_expected: bool
    ending: Ending | Literal["failed"]
    what: str
    found: Any = None
    has_way_out: bool = True


def write_file(case: Case, folder: Path) -> Path:
    """A case's file, written into a folder where it is not one of the checkout's."""
    if case.write is None:
        return FILES / case.file
    path = folder / case.file
    case.write(path)
    return path


def outcome(case: Case, path: Path) -> Outcome:
    """Read a case's file."""
    try:
        found = case.read(path)
    except BadInput as error:
        expected = case.ends == "refused" and _all_said(case, [str(error)])
        has_way_out = any(_is_said(words, [error.expected]) for words in case.says)
        return Outcome(expected, "refused", str(error), None, has_way_out)
    except Exception as error:  # the worst ending: the table says which
        return Outcome(False, "failed", f"{type(error).__name__}: {error}")
    notes = list(found.notes)
    ending: Ending = "told" if notes else "read"
    right = case.is_right is None or case.is_right(found)
    what = " ".join(notes) if right else f"wrong values; {' '.join(notes)}"
    expected = ending == case.ends and right and _all_said(case, notes)
    return Outcome(expected, ending, what, found)


def _all_said(case: Case, sentences: Sequence[str]) -> bool:
    return all(_is_said(words, sentences) for words in case.says)


def _is_said(words: str, sentences: Sequence[str]) -> bool:
    return any(re.search(words, sentence, re.IGNORECASE) for sentence in sentences)
