"""The paper's sizes: 81 x 81 directions, 100 x 100 texels, the bytes of its table 1."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from assets_defs.launcher import Request
from assets_defs.neural_btf.datasets import compressed_btf_of
from assets_defs.neural_btf.graph import BTF

MATERIAL = {"material": "silk"}
SHORT = {
    "steps": 300,
    "file_steps": 200,
    "latents": 8,
    "encoder_steps": 40,
    "texels": 100,
    "frames": 1,
    "samples": 2,
    "cloth_samples": 2,
}
"""Training and pictures are cut short: sizes are looked at here, not the paper's errors."""
PAYLOAD = {"none": 417_532, "500": 153_532}


@pytest.mark.slow
def test_the_paper_preset_has_the_papers_sizes_and_passes_its_checks(house: Any) -> None:
    columns = {clusters: MATERIAL | {"clusters": clusters} for clusters in PAYLOAD}
    house.launcher.launch(Request(BTF, list(columns.values()), "paper", SHORT))
    store = house.workspace.store
    for keys in columns.values():
        for plan in BTF.plans.values():
            slot = BTF.slot(plan.name, {name: keys[name] for name in plan.by})
            verdicts = store.verdicts(slot, store.current(slot))
            assert {check.name for check in plan.checks} == set(verdicts)
            assert all(verdict["passed"] for verdict in verdicts.values())
    images = store.open(BTF.slot("btf_images", MATERIAL))["images"]
    assert images.shape == (6561, 100, 100, 3)
    matrix = store.open(BTF.slot("abrdf_matrix", MATERIAL))["abrdfs"]
    assert matrix.shape == (10_000, 6561, 3)
    np.testing.assert_array_equal(matrix[:, 4321].values, images[4321].values.reshape(10_000, 3))
    for clusters, keys in columns.items():
        runtime = store.open(BTF.slot("compressed_btf", keys))
        btf = compressed_btf_of(runtime)
        assert btf.payload_bytes == PAYLOAD[clusters]
        assert (btf.ids is None) == (clusters == "none")
        assert runtime.sizes["byte"] < 0.35 * PAYLOAD[clusters]
        restored = store.open(BTF.slot("restored_images", keys))
        assert restored["restored"].shape == (2, 100, 100, 3)
        assert restored["rmse_image"].shape == (6561,)
    frames = store.open(BTF.slot("cloth_frames", columns["500"]))["orbit"]
    assert frames.shape == (1, 480, 640, 3)
