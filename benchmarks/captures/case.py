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
    says: regular expressions, without regard to case. Of a refusal one names the way out.
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
    """What became of a case: ``is_as_expected``, and in words ``what``: the notes, the refusal."""

    is_as_expected: bool
    ending: str
    what: str


def outcome(case: Case, folder: Path) -> Outcome:
    """Write a case's file into a folder, where it needs to be written, and read it."""
    path = FILES / case.file
    if case.write is not None:
        path = folder / case.file
        case.write(path)
    try:
        found = case.read(path)
    except BadInput as error:
        return Outcome(
            case.ends == "refused" and _all_said(case, [str(error)]), "refused", str(error)
        )
    except Exception as error:  # the worst ending: the table says which
        return Outcome(False, "failed", f"{type(error).__name__}: {error}")
    notes = list(found.notes)
    ending = "told" if notes else "read"
    right = case.is_right is None or case.is_right(found)
    what = " ".join(notes) if right else f"wrong values; {' '.join(notes)}"
    return Outcome(ending == case.ends and right and _all_said(case, notes), ending, what)


def _all_said(case: Case, sentences: Sequence[str]) -> bool:
    return all(
        any(re.search(words, sentence, re.IGNORECASE) for sentence in sentences)
        for words in case.says
    )
