"""The page of figures says what is committed."""

from __future__ import annotations

import json

from benchmarks.btf_paper_scale import RUNS, result_path
from docs.btf_figures import PAGE, figures_page


def test_the_page_is_made_of_the_committed_figures() -> None:
    assert PAGE.read_text() == figures_page()


def test_bytes_and_error_of_a_form_stand_in_one_row() -> None:
    rows = PAGE.read_text().splitlines()
    for run in (run for run in RUNS if result_path(*run).exists()):
        found = json.loads(result_path(*run).read_text())
        for form in (*found["forms"].values(), *found["rivals"].values()):
            wanted = f"| {form['bytes']:,} |".replace(",", " "), f"| {form['rmse']:.4f} |"
            assert any(all(part in row for part in wanted) for row in rows), wanted
