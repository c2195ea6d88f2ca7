"""The paper's training against the clock: what is planned, what is told, that it goes on."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks import btf_paper_training
from benchmarks.btf_launching import opened_launcher
from benchmarks.btf_paper_training import Run, planned_runs

_TINY = {"texels": 8, "directions": 15, "samples": 1}


def test_every_column_and_representative_has_three_seeds() -> None:
    names = [one.name for one in planned_runs("paper")]
    assert len(set(names)) == len(names) == 1 + 3 * 7
    for kind in ("none-texels-median", "2000-texels-median", "500-representatives-medoid"):
        assert sum(name.startswith(kind) for name in names if "7200" not in name) == 3


def test_seeds_are_told_together_with_an_interval(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    results = tmp_path / "results.json"
    monkeypatch.setattr(btf_paper_training, "RESULTS", results)
    assert btf_paper_training.committed_figures()["rmse"] == {}
    runs = [Run(500, seed, 400.0, directions=41) for seed in (0, 1)]
    results.write_text(
        json.dumps(
            {
                one.name: {
                    "name": one.name,
                    "seed": one.seed,
                    "rmse": 0.05 + 0.01 * one.seed,
                    "rmse_null": 0.08,
                    "cpu_seconds": 360,
                }
                for one in runs
            }
        )
    )
    told = btf_paper_training.committed_figures()
    found = told["rmse"]["500-texels-median-400s-41"]
    assert found["mean"] == pytest.approx(0.055)
    assert found["half_interval"] == pytest.approx(12.706 * 0.005, rel=1e-3)
    assert told["rmse_null"]["500-texels-median-400s-41"]["mean"] == pytest.approx(0.08)
    assert told["cpu_hours"][runs[0].name] == pytest.approx(0.1)


@pytest.mark.slow
def test_a_run_trains_for_its_seconds_and_goes_on_where_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(btf_paper_training, "_KEEP_SECONDS", 0.5)
    with opened_launcher(tmp_path) as launcher:
        found, again = (
            btf_paper_training._made(launcher, Run(0, 0, 12.0), tmp_path, _TINY) for _ in range(2)
        )
    assert 12 <= found["cpu_seconds"] < 40
    assert found["steps"] > 100
    assert found["rmse"] < 1.3 * found["rmse_null"]
    assert found["curve"][-1][2] < found["curve"][0][2]
    assert again["curve"][:5] == found["curve"][:5]  # processor seconds are never the same twice
