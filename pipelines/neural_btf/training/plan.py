"""How to train: settings of one run, and the stages that follow from them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

Training = Literal["fast", "paper"]
WarmStart = Literal["pca", "encoder", "random"]
Targets = Literal["texels", "representatives"]
StageName = Literal["paper", "encoder", "latents", "distil"]


class Stage(NamedTuple):
    """Steps of one kind.

    `paper` and `encoder` train encoder and decoder together, `latents` the latents with the
    decoder, `distil` the encoder alone, on the latents.
    """

    name: StageName
    steps: int


@dataclass(frozen=True)
class TrainingPlan:
    """How to train.

    >>> for stage in TrainingPlan(steps=200, warm_start="encoder", encoder_share=0.25).stages():
    ...     print(stage)
    Stage(name='encoder', steps=50)
    Stage(name='latents', steps=150)
    """

    training: Training = "fast"
    steps: int = 250
    """Steps of gradient descent, those of the stage `distil` not counted."""
    rate: float = 0.01
    """Learning rate; in `fast` the largest of the cycle."""
    batch_texels: int = 64
    """Texels of a batch."""
    batch_images: int = 128
    """Photographs of a batch in `fast`; `paper` takes all of them."""
    widths: tuple[int, ...] = ()
    """Channels of the encoder's blocks; empty: `network.default_widths`."""
    warm_start: WarmStart = "pca"
    encoder_share: float = 0.0
    """Share of the steps that train latents through the encoder, for the warm start `encoder`."""
    encoder_steps: int = 0
    """Steps of fitting the encoder to the latents at the end of `fast`."""
    parallax: bool = True
    """Whether `fast` looks latents up beside a texel, by the view, where each texel has its own."""
    targets: Targets = "texels"
    """What `paper` fits: every texel, or its cluster's representative (unsaid)."""
    seed: int = 0

    def stages(self) -> list[Stage]:
        """The stages that have steps, in order."""
        if self.training == "paper":
            return [Stage("paper", self.steps)]
        through = round(self.encoder_share * self.steps) if self.warm_start == "encoder" else 0
        planned = [
            Stage("encoder", through),
            Stage("latents", self.steps - through),
            Stage("distil", self.encoder_steps),
        ]
        return [stage for stage in planned if stage.steps > 0]


@dataclass(frozen=True)
class FineTuningPlan:
    """How a trained network is trained on, knowing that it is rounded (`fine_tuning`)."""

    file_bytes: float
    """How large the file is to be."""
    steps: int = 250
    rate: float = 0.003
    """Largest learning rate of the cycle."""
    batch_texels: int = 64
    batch_images: int = 128
    student: bool = True
    """Whether a second, smaller decoder of the same latents is trained, for the file to hold."""
    seed: int = 0
