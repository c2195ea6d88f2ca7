"""What the stages train, and by which rate."""

from __future__ import annotations

import pytest
import torch

from pipelines.neural_btf.network import Decoder, Encoder
from pipelines.neural_btf.training.muon import Muon
from pipelines.neural_btf.training.optimisers import rate_share, stage_optimisers
from pipelines.neural_btf.training.plan import StageName


@pytest.mark.parametrize(
    ("stage", "trained", "rates"),
    [
        ("paper", {"encoder", "decoder"}, {0.125}),
        ("encoder", {"encoder", "decoder"}, {0.002}),
        ("latents", {"latents", "parallax", "decoder"}, {0.125, 0.375}),
        ("distil", {"encoder"}, {0.002}),
    ],
)
def test_a_stage_trains_its_parts_each_parameter_once(
    stage: StageName, trained: set[str], rates: set[float]
) -> None:
    encoder, decoder = Encoder(81, (4, 6)), Decoder()
    latents = torch.zeros(5, 8, requires_grad=True)
    parallax = torch.zeros(9, 2, requires_grad=True)
    parts = {
        "encoder": list(encoder.parameters()),
        "decoder": list(decoder.parameters()),
        "latents": [latents],
        "parallax": [parallax],
    }
    found = stage_optimisers(stage, encoder, decoder, (latents, parallax), 0.125)
    held = [part for one in found for group in one.param_groups for part in group["params"]]
    expected = [part for name in trained for part in parts[name]]
    assert sorted(map(id, held)) == sorted(map(id, expected))
    assert {group["lr"] for one in found for group in one.param_groups} == rates
    muon = [one for one in found if isinstance(one, Muon)]
    hidden = [decoder.second.weight, decoder.third.weight]
    assert [part for one in muon for part in one.param_groups[0]["params"]] == (
        hidden if stage == "latents" else []
    )


def test_the_rate_goes_up_for_a_twentieth_and_down_to_a_thousandth() -> None:
    shares = [rate_share("latents", step / 1000) for step in range(1001)]
    assert shares[0] == pytest.approx(0.01)
    assert shares.index(max(shares)) in (49, 50)
    assert max(shares) == pytest.approx(1.0, abs=0.02)
    falling = shares[50:]
    assert sorted(falling, reverse=True) == falling
    assert shares[525] == pytest.approx(0.5)
    assert shares[-1] == 1e-3


def test_the_papers_rate_is_constant() -> None:
    assert {rate_share("paper", step / 10) for step in range(11)} == {1.0}
