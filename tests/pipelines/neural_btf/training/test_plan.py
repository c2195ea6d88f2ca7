"""Stages of plans."""

from __future__ import annotations

import dataclasses

from pipelines.neural_btf.training.plan import TrainingPlan

FAST = TrainingPlan("fast", 30, 0.01, batch_texels=8, batch_images=16)
ENCODER_FIRST = dataclasses.replace(FAST, warm_start="encoder", encoder_share=0.4, encoder_steps=10)
PAPER = TrainingPlan("paper", 12, 0.05, batch_texels=5, batch_images=0)


def test_stages_have_the_steps_of_the_plan() -> None:
    assert PAPER.stages() == [("paper", 12)]
    assert FAST.stages() == [("latents", 30)]
    assert ENCODER_FIRST.stages() == [("encoder", 12), ("latents", 18), ("distil", 10)]
    share_without_use = dataclasses.replace(FAST, encoder_share=0.4)
    assert share_without_use.stages() == [("latents", 30)]
