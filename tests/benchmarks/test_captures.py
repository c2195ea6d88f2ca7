"""Each file that people have ends as its case says; what is wrong is not called right."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.captures.case import Case, outcome, write_file
from benchmarks.captures.cases import CASES
from benchmarks.captures.second_readers import silent
from benchmarks.captures.wrong_readings import halved, upside_down

ALL = [case for cases in CASES.values() for case in cases]
GROUPS = [group for group, cases in CASES.items() for _ in cases]


@pytest.mark.parametrize(
    ("group", "case"), list(zip(GROUPS, ALL, strict=True)), ids=[case.file for case in ALL]
)
def test_a_file_ends_as_it_is_right(group: str, case: Case, tmp_path: Path) -> None:
    path = write_file(case, tmp_path)
    found = outcome(case, path)
    assert found.is_as_expected, f"{found.ending}: {found.what}"
    assert found.has_way_out, found.what
    if found.found is not None:
        assert silent(path, group, found.found.notes, found.found) == []


def test_every_file_that_was_met_is_a_case() -> None:
    folder = Path(__file__).parents[2] / "benchmarks" / "captures" / "files"
    there = {path.name for path in folder.iterdir()} - {
        "obj_kd_black_map.mtl",
        "obj_kd_over_one.mtl",
    }
    assert there <= {case.file for case in ALL}


def test_names_of_cases_are_unique() -> None:
    names = [case.file for case in ALL]
    assert len(names) == len(set(names))


def test_wrong_readings_are_wrong() -> None:
    class Reading:
        notes = ()

    reading = Reading()
    reading.radiance = np.arange(6.0).reshape(3, 2)  # type: ignore[attr-defined]
    assert np.array_equal(halved(reading).radiance, reading.radiance / 2)  # type: ignore[attr-defined]
    assert np.array_equal(upside_down(reading).radiance, reading.radiance[::-1])  # type: ignore[attr-defined]
