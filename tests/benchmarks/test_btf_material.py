"""Every figure of one small material, as the benchmark of BTFs takes them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.btf_launching import opened_launcher
from benchmarks.btf_material import NULLS, MaterialPlan, MaterialRun, made, material_figures
from benchmarks.btf_paper_scale import HEADLINES, all_photographs
from pipelines.neural_btf.restoration import restoration_errors
from storage.btf_file import write_btf_file

PLAN = MaterialPlan(
    preset="test",
    given={"texels": 24, "file_steps": 200, "share": 0.25, "width": 32, "cloth_samples": 2},
    small={"share": 0.2},
    rival_steps=100,
    cloth=(64, 4),
)


@pytest.mark.slow
def test_rows_belong_to_their_forms_and_beat_what_knows_nothing(tmp_path: Path) -> None:
    with opened_launcher(tmp_path) as launcher:
        run = made(launcher, "knit", PLAN)
        found = material_figures(run, PLAN)
        found |= all_photographs(launcher.workspace.store, "knit")
    assert set(HEADLINES) - set(found) == {"none_rmse_gain"}
    json.dumps(found, allow_nan=False)
    assert found["null_rmse_ratio"] > 1.5
    assert found["null_flip_ratio"] > 1.2
    assert found["mip_error_ratio"] < 0.8 * found["mip_error_ratio_null"]
    assert found["shader_vs_numpy_rmse"] < 1 / 255 < found["shader_vs_numpy_null_rmse"]
    for form in ("file", "small"):
        assert found["forms"][form]["bytes"] == len(write_btf_file(run.forms[form]))
        assert found["forms"][form]["rmse"] == pytest.approx(_rmse(run, form), rel=1e-3)
    assert found["small_file_bytes"] < found["file_bytes"]
    for name, rival in found["rivals"].items():
        if name not in NULLS:
            assert rival["bytes"] <= found["file_bytes"]
    errors = found["cloth_rmse_to_none"]
    assert errors["file"]["whole"] < 0.95 * errors["flat"]["whole"]  # few texels, seen from far


def _rmse(run: MaterialRun, form: str) -> float:
    values = run.judge.abrdfs
    return restoration_errors(
        run.btf(form), lambda a, b: np.asarray(values[a:b]), run.judge.pairs, block=200
    ).rmse
