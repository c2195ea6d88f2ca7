"""The page of figures says what is committed."""

from __future__ import annotations

import json

from benchmarks.btf_paper_scale import RUNS, result_path
from docs.btf_figures import PAGE, figures_page


def test_the_page_is_made_of_the_committed_figures() -> None:
    assert PAGE.read_text() == figures_page()


def test_errors_and_bytes_of_a_run_are_on_the_page() -> None:
    text = PAGE.read_text()
    for run in (run for run in RUNS if result_path(*run).exists()):
        found = json.loads(result_path(*run).read_text())
        for row in (*found["forms"].values(), *found["rivals"].values()):
            assert f"{row['bytes'] % 1000:03d}" in text or row["bytes"] < 1000
            assert f"{row['rmse']:.4f}" in text
