"""The paper's tables of one small material."""

from __future__ import annotations

from pathlib import Path

import pytest

from assets_defs.launcher import Request
from assets_defs.neural_btf.graph import BTF
from benchmarks import btf_columns
from benchmarks.btf_launching import opened_launcher

_DECODER = 4 * 24_383


@pytest.mark.slow
def test_more_clusters_are_nearer_to_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(btf_columns, "COLUMNS", ("40", "100"))
    monkeypatch.setattr(btf_columns, "_WIDTH", 64)
    monkeypatch.setattr(btf_columns, "_SAMPLES", 4)
    with opened_launcher(tmp_path) as launcher:
        none = [{"material": "knit", "clusters": "none"}]
        launcher.launch(Request(BTF, none, "test"))
        some = [{"material": "knit", "clusters": column} for column in ("40", "100")]
        launcher.launch(Request(BTF, some, "test", {"form": "float32"}))
        found = btf_columns.column_figures(launcher.workspace.store, "knit")
    assert found["rmse"]["none"] < found["rmse"]["100"] < found["rmse"]["40"]
    texels = found["texels"]
    assert found["bytes"]["none"] == _DECODER + 32 * texels
    assert found["bytes"]["40"] == _DECODER + 32 * 40 + 4 * texels
    assert 0 < found["bytes"]["file"] < found["bytes"]["40"]
    errors = found["cloth_rmse_to_none"]
    assert set(errors) == {"raw", "40", "100", "file"}
    assert errors["100"]["whole"] < errors["40"]["whole"]
