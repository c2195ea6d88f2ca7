"""Files as people really have them, and what is to become of each: read, told, or refused.

A module a kind of file (``light_probes``, ``photographs`` …) lists ``CASES``; ``files/`` holds
those that were met as files and are kept as they are. ``python -m benchmarks captures``.
"""

from __future__ import annotations

import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from benchmarks.captures.case import Case, Outcome


class Ended(NamedTuple):
    """A case, what became of it, and what it holds that was ``dropped`` without a word; what would
    be, ``unsaid``, had the reader no notes."""

    group: str
    case: Case
    outcome: Outcome
    dropped: list[str]
    unsaid: list[str]
    seconds: float


def run() -> dict[str, Any]:
    """All figures; ``files`` says of each case what became of it."""
    from benchmarks.captures.orientations import orientation_right

    ended = read_all()
    return case_figures(ended) | orientation_right() | {"files": [_row(each) for each in ended]}


def read_all() -> list[Ended]:
    """Write and read every case."""
    from benchmarks.captures.case import outcome, write_file
    from benchmarks.captures.cases import CASES
    from benchmarks.captures.second_readers import silent

    ended = []
    with tempfile.TemporaryDirectory() as folder:
        cases = [(group, case) for group, its in CASES.items() for case in its]
        for number, (group, case) in enumerate(cases):
            place = Path(folder) / f"{number}"  # of its own: companions may have equal names
            place.mkdir()
            path = write_file(case, place)
            started = time.perf_counter()
            found = outcome(case, path)
            seconds = time.perf_counter() - started
            reading = found.found
            dropped, unsaid = (
                [] if reading is None else silent(path, group, notes, reading)
                for notes in (() if reading is None else reading.notes, ())
            )
            ended.append(Ended(group, case, found, dropped, unsaid, seconds))
    return ended


def case_figures(ended: Sequence[Ended]) -> dict[str, Any]:
    """The figures of the cases.

    ``null_*``: the share of those cases whose values are compared that would still be right if
    every array that was read were halved, or turned along its first axis. ``null_silent``: what
    would be dropped in silence were there no notes.
    """
    from benchmarks.captures.wrong_readings import halved, upside_down

    compared = [each for each in ended if each.case.is_right and each.outcome.found is not None]
    refused = [each.outcome for each in ended if each.outcome.ending == "refused"]
    dropped = [f"{each.case.file}: {what}" for each in ended for what in each.dropped]
    wrong = [each.case.file for each in ended if not each.outcome.is_as_expected]
    return {
        "cases": len(ended),
        "cases_right": 1 - len(wrong) / len(ended),
        "cases_wrong": wrong,
        "kinds": len({each.case.kind for each in ended}),
        "endings": dict(Counter(each.outcome.ending for each in ended)),
        "values_compared": len(compared),
        "null_halved_right": _share_right(compared, halved),
        "null_upside_down_right": _share_right(compared, upside_down),
        "silent": len(dropped),
        "null_silent": sum(len(each.unsaid) for each in ended),
        "dropped_in_silence": dropped,
        "refused_without_way_out": sum(not outcome.has_way_out for outcome in refused),
        "slowest_s": round(max(each.seconds for each in ended), 2),
    }


def _share_right(compared: Sequence[Ended], change: Any) -> float:
    return sum(_still_right(each, change) for each in compared) / len(compared)


def _still_right(each: Ended, change: Any) -> bool:
    try:
        return bool(each.case.is_right and each.case.is_right(change(each.outcome.found)))
    except Exception:  # shapes that no longer fit are wrong, too
        return False


def _row(each: Ended) -> dict[str, str]:
    ending = each.outcome.ending if each.outcome.is_as_expected else "wrong"
    return {
        "group": each.group,
        "file": each.case.file,
        "kind": each.case.kind,
        "ending": ending,
        "what": each.outcome.what,
    }
