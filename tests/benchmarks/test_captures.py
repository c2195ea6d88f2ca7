"""Each file that people have ends as its case says."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.captures.case import Case, outcome
from benchmarks.captures.cases import CASES


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.file)
def test_a_file_ends_as_it_is_right(case: Case, tmp_path: Path) -> None:
    found = outcome(case, tmp_path)
    assert found.is_as_expected, f"{found.ending}: {found.what}"
