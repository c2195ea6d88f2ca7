"""Committed figures of paper-size BTFs, told together."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks import btf_paper_scale


def _commit(folder: Path, material: str, seed: int, ratio: float) -> None:
    figures = dict.fromkeys(btf_paper_scale.HEADLINES, ratio)
    (folder / f"btf-file-{material}-{seed}.json").write_text(json.dumps(figures))


def test_a_headline_is_the_mean_of_materials_and_seeds_stand_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(btf_paper_scale, "RESULTS", tmp_path)
    _commit(tmp_path, "knit", 0, 0.8)
    _commit(tmp_path, "silk", 0, 1.0)
    _commit(tmp_path, "knit", 1, 5.0)
    found = btf_paper_scale.committed_figures()
    assert found["materials"] == ["knit", "silk"]
    assert found["file_rmse_ratio"] == pytest.approx(0.9)
    assert found["file_rmse_ratio_each"] == {"knit 0": 0.8, "silk 0": 1.0, "knit 1": 5.0}


def test_nothing_committed_is_said_to_be_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(btf_paper_scale, "RESULTS", tmp_path)
    found = btf_paper_scale.committed_figures()
    assert found["materials"] == []
    assert found["file_rmse_ratio"] is None
