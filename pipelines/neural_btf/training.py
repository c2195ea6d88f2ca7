"""Training of the neural BTF: as the paper trains it, and fast.

``paper``: plain gradient descent on batches of five ABRDFs with all their directions, through the
encoder (section 3.1; batch 5, rate 0.08). Afterwards the latents are what the encoder says.

``fast``: the latents are free variables. They start at the principal components of the ABRDFs
(or at what a briefly trained encoder says, or at random), and are trained with the decoder: its
hidden layers by Muon, the rest by Adam, in large batches in bfloat16, with a one-cycle rate. A
batch is a grid, some texels by some directions, so that the decoder's first layer is computed once
a texel and once a direction. The texels of a cluster share their latents; the squared error against
all of them is that against their mean plus a constant, so the mean is what is fitted, weighted by
the number of texels: the same gradient with less noise. At the end the encoder is fitted to the
latents, so that an ABRDF that was not there can be encoded without training.

Every step draws from a generator seeded by its number: a run that was stopped and resumed gives
what an uninterrupted one gives.
"""

from __future__ import annotations

import io
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from pipelines.neural_btf.abrdf import standardised
from pipelines.neural_btf.network import LATENTS, Decoder, Encoder, device
from pipelines.neural_btf.pool import AbrdfPool

Training = Literal["fast", "paper"]
WarmStart = Literal["pca", "encoder", "random"]
Targets = Literal["texels", "representatives"]

KEEP_SECONDS = 15.0
_CURVE_POINTS = 200
_WARM_UP = 0.05
_STEPS_A_PART = 500
_ENCODE_ROWS = 64
_ENCODER_RATE = 2e-3
_STAGE_NUMBER = {"paper": 0, "encoder": 1, "latents": 2, "distil": 3}


@dataclass(frozen=True)
class Plan:
    """How to train."""

    training: Training
    steps: int
    """Steps of gradient descent, those of the stage `distil` not counted."""
    rate: float
    """Learning rate; in `fast` the largest of the cycle."""
    batch_texels: int
    """Texels of a batch."""
    batch_images: int
    """Photographs of a batch in `fast`; `paper` takes all of them."""
    widths: tuple[int, ...]
    """Channels of the encoder's blocks."""
    warm_start: WarmStart = "pca"
    encoder_share: float = 0.0
    """Share of the steps that train latents through the encoder, for the warm start `encoder`."""
    encoder_steps: int = 0
    """Steps of fitting the encoder to the latents at the end of `fast`."""
    seed: int = 0

    def stages(self) -> list[tuple[str, int]]:
        """Names and steps of the stages, in order."""
        if self.training == "paper":
            return [("paper", self.steps)]
        through = round(self.encoder_share * self.steps) if self.warm_start == "encoder" else 0
        planned = [("encoder", through), ("latents", self.steps - through)]
        planned.append(("distil", self.encoder_steps))
        return [(name, steps) for name, steps in planned if steps > 0]


@dataclass(frozen=True)
class TrainingData:
    """What is fitted. N photographs, k latent vectors."""

    pool: AbrdfPool
    """ABRDFs that the decoder is to give: every texel's, or every cluster's mean."""
    owner: NDArray[np.int64]
    """(row,) which latent vector belongs to a row of the pool."""
    weights: NDArray[np.float64]
    """(row,) how many texels a row stands for."""
    representatives: NDArray[np.floating] | None
    """(k, N, 3) what the encoder sees of each cluster; None: the pool's own rows."""
    mean: NDArray[np.float32]
    deviation: NDArray[np.float32]
    """(N, 3) mu and sigma of Eq. 2 and 3."""
    directions: NDArray[np.float32]
    """(N, 4) the decoder's inputs."""
    alpha: float
    """Largest value (Eq. 5): the decoder gives values over alpha."""
    start: NDArray[np.float32]
    """(k, 8) the warm start `pca`."""

    @property
    def latent_count(self) -> int:
        """k, the number of latent vectors."""
        return len(self.start)


class Trained(NamedTuple):
    """What training gives."""

    encoder: Encoder
    decoder: Decoder
    latents: NDArray[np.float32]
    """(k, 8)."""
    curve_step: NDArray[np.int64]
    curve_rmse: NDArray[np.float64]
    """Root of the mean loss since the point before, at these steps; values are over alpha."""
    encoder_residual: float | None
    """RMSE of the encoder's latents against the stored ones, in their standard deviations: 0 in
    `paper`, where they are the same; None where the encoder was not trained."""


def warm_start(scores: NDArray[np.floating]) -> NDArray[np.float32]:
    """Latents (k, 8) from principal components (k, r): the first 8, each with deviation 1.

    Where there are fewer components, or one is the same everywhere, latents are 0.
    """
    latents = np.zeros((len(scores), LATENTS), np.float32)
    used = scores[:, :LATENTS].astype(np.float64)
    deviation = used.std(axis=0)
    varies = deviation > 1e-9 * max(float(deviation.max(initial=0.0)), 1e-30)
    centred = used - used.mean(axis=0)
    latents[:, : used.shape[1]] = np.where(varies, centred / np.where(varies, deviation, 1.0), 0.0)
    return latents


def train(
    data: TrainingData,
    plan: Plan,
    *,
    resume: bytes | None = None,
    keep: Callable[[bytes], None] = lambda state: None,
    progress: Callable[[float], None] = lambda fraction: None,
    stop: Callable[[Trainer], bool] = lambda trainer: False,
) -> Trained:
    """Train from the beginning, or go on from a state that ``keep`` was given earlier.

    ``keep`` gets the state every 15 seconds. ``stop`` is asked after every step and ends training
    early (benchmarks that train against the clock).
    """
    trainer = Trainer(data, plan)
    if resume is not None:
        trainer.restore(resume)
    kept = time.monotonic()
    while not trainer.finished:
        trainer.step()
        if time.monotonic() - kept > KEEP_SECONDS:
            keep(trainer.state())
            kept = time.monotonic()
        if trainer.done % 20 == 0:
            progress(trainer.done / trainer.total)
        if stop(trainer):
            break
    return trainer.result()


class Trainer:
    """One training run, step by step."""

    def __init__(self, data: TrainingData, plan: Plan) -> None:
        torch.manual_seed(plan.seed)
        self._data, self._plan = data, plan
        self._device = device()
        self.encoder = Encoder(data.pool.images, plan.widths).to(self._device)
        self.decoder = Decoder().to(self._device)
        first = data.start
        if plan.warm_start == "random":
            random = np.random.default_rng((plan.seed, 9))
            first = random.standard_normal(data.start.shape).astype(np.float32)
        self.latents = torch.from_numpy(first.copy()).to(self._device).requires_grad_()
        self._directions = torch.from_numpy(data.directions).to(self._device)
        self._mean, self._deviation = data.mean, data.deviation
        self._cumulated = np.zeros(0)
        self._part = -1
        self.stages = plan.stages()
        self.total = sum(steps for _, steps in self.stages)
        self.done = 0
        self._curve: list[tuple[int, float]] = []
        self._optimisers: list[torch.optim.Optimizer] = []
        self._loss, self._losses = torch.zeros((), device=self._device), 0
        self._stage = 0
        self._step_in_stage = 0
        self._begin_stage()

    # ---- running -----------------------------------------------------------------------------

    @property
    def finished(self) -> bool:
        """Whether all stages are done."""
        return self._stage == len(self.stages)

    def step(self) -> None:
        """One step of gradient descent."""
        name, steps = self.stages[self._stage]
        self._set_rate(name, self._step_in_stage / steps)
        seed = (self._plan.seed, _STAGE_NUMBER[name], self._step_in_stage)
        loss = self._losses_of[name](np.random.default_rng(seed))
        for optimiser in self._optimisers:
            optimiser.zero_grad(set_to_none=True)
        loss.backward()
        for optimiser in self._optimisers:
            optimiser.step()
        self.done += 1
        self._step_in_stage += 1
        if name != "distil":
            self._note(loss.detach())
        if self._step_in_stage == steps:
            self._end_stage(name)

    def result(self) -> Trained:
        """What has been learnt so far."""
        if not self.finished and self.stages[self._stage][0] in ("paper", "encoder"):
            self._encode_all()
        latents = self.latents.detach().cpu().numpy().copy()
        residual = self._encoder_residual(latents) if self._encoder_is_trained() else None
        steps = np.array([step for step, _ in self._curve], np.int64)
        values = np.array([value for _, value in self._curve], np.float64)
        return Trained(
            self.encoder.eval().cpu(),
            self.decoder.eval().cpu(),
            latents,
            steps,
            values,
            residual,
        )

    # ---- stages ------------------------------------------------------------------------------

    def _begin_stage(self) -> None:
        if self.finished:
            self._optimisers = []
            return
        name = self.stages[self._stage][0]
        self._losses_of: dict[str, Callable[[np.random.Generator], Tensor]] = {
            "paper": self._paper_loss,
            "encoder": self._encoder_loss,
            "latents": self._latents_loss,
            "distil": self._distil_loss,
        }
        encoder, decoder = list(self.encoder.parameters()), list(self.decoder.parameters())
        if name == "paper":
            self._optimisers = [torch.optim.SGD([*encoder, *decoder], lr=self._plan.rate)]
        elif name == "encoder":
            self._optimisers = [_adam([*encoder, *decoder], _ENCODER_RATE)]
        elif name == "distil":
            self._optimisers = [_adam(encoder, _ENCODER_RATE)]
        else:
            hidden = [self.decoder.second.weight, self.decoder.third.weight]
            others = [part for part in decoder if all(part is not matrix for matrix in hidden)]
            self._optimisers = [
                _adam([*others, self.latents], self._plan.rate),
                torch.optim.Muon(hidden, lr=self._plan.rate, weight_decay=0.0),
            ]
        self._rates = [optimiser.defaults["lr"] for optimiser in self._optimisers]

    def _end_stage(self, name: str) -> None:
        if name in ("paper", "encoder"):
            self._encode_all()
        self._stage += 1
        self._step_in_stage = 0
        self._part = -1
        self._begin_stage()

    def _set_rate(self, name: str, fraction: float) -> None:
        """Constant in `paper`; else a short way up, and a cosine down to zero."""
        if name == "paper":
            return
        rising = min(1.0, fraction / _WARM_UP + 0.01)
        falling = max(0.0, (fraction - _WARM_UP) / (1.0 - _WARM_UP))
        share = max(1e-3, rising * 0.5 * (1.0 + math.cos(math.pi * falling)))
        for optimiser, rate in zip(self._optimisers, self._rates, strict=True):
            for group in optimiser.param_groups:
                group["lr"] = rate * share

    def _note(self, loss: Tensor) -> None:
        """Add to the loss curve; its value is asked for only a few times (a GPU would wait)."""
        self._loss += loss
        self._losses += 1
        if self.done % max(1, self.total // _CURVE_POINTS) == 0:
            self._curve.append((self.done, math.sqrt(float(self._loss) / self._losses)))
            self._loss.zero_()
            self._losses = 0

    # ---- losses ------------------------------------------------------------------------------

    def _paper_loss(self, random: np.random.Generator) -> Tensor:
        rows, values = self._rows(random, self._plan.batch_texels)
        latents = self.encoder(self._encoder_input(rows, values))
        return self._error(self.decoder.grid(latents, self._directions), values)

    def _encoder_loss(self, random: np.random.Generator) -> Tensor:
        rows, values = self._rows(random, self._plan.batch_texels)
        images = self._images(random)
        with self._autocast():
            latents = self.encoder(self._encoder_input(rows, values))
            colours = self.decoder.grid(latents.float(), self._directions[images])
        return self._error(colours, values[:, images])

    def _latents_loss(self, random: np.random.Generator) -> Tensor:
        images = self._images(random)
        rows, values = self._rows(random, self._plan.batch_texels, images)
        owners = torch.from_numpy(self._data.owner[rows]).to(self._device)
        with self._autocast():
            colours = self.decoder.grid(self.latents[owners], self._directions[images])
        return self._error(colours, values)

    def _distil_loss(self, random: np.random.Generator) -> Tensor:
        rows, values = self._rows(random, min(_ENCODE_ROWS, self._plan.batch_texels))
        with self._autocast():
            found = self.encoder(self._encoder_input(rows, values))
        owners = torch.from_numpy(self._data.owner[rows]).to(self._device)
        wanted = self.latents.detach()
        deviation = wanted.std(dim=0, correction=0) + 1e-6
        return (((found.float() - wanted[owners]) / deviation) ** 2).mean()

    def _error(self, colours: Tensor, values: NDArray[np.floating]) -> Tensor:
        wanted = torch.from_numpy(np.ascontiguousarray(values)).to(self._device).float()
        return ((colours.float() - wanted / self._data.alpha) ** 2).mean()

    def _autocast(self) -> torch.autocast:
        return torch.autocast(self._device.type, torch.bfloat16)

    # ---- batches -----------------------------------------------------------------------------

    def _images(self, random: np.random.Generator) -> NDArray[np.int64]:
        count = len(self._data.directions)
        return random.integers(0, count, min(self._plan.batch_images, count))

    def _rows(
        self,
        random: np.random.Generator,
        count: int,
        images: NDArray[np.int64] | None = None,
    ) -> tuple[NDArray[np.int64], NDArray[np.floating]]:
        """Rows drawn by their weights: their numbers, and their ABRDFs (at some images)."""
        part = self._step_in_stage // _STEPS_A_PART
        numbers, values = self._data.pool.part(part)
        if part != self._part:
            self._cumulated = np.cumsum(self._data.weights[numbers])
            self._part = part
        drawn = np.searchsorted(
            self._cumulated, random.random(count) * self._cumulated[-1], side="right"
        )
        if images is None:
            return numbers[drawn], values[drawn]
        return numbers[drawn], values[drawn[:, None], images[None]]

    def _encoder_input(self, rows: NDArray[np.int64], values: NDArray[np.floating]) -> Tensor:
        seen = self._data.representatives
        abrdfs = values if seen is None else seen[self._data.owner[rows]]
        return self._standardised(abrdfs)

    def _standardised(self, abrdfs: NDArray[np.floating]) -> Tensor:
        return torch.from_numpy(standardised(abrdfs, self._mean, self._deviation)).to(self._device)

    # ---- the encoder's latents ---------------------------------------------------------------

    def _encoded(self) -> NDArray[np.float32]:
        """The encoder's latents of all k representatives, (k, 8)."""
        seen = self._data.representatives
        count = self._data.latent_count
        read = self._data.pool.read if seen is None else lambda a, b: seen[a:b]
        found = []
        self.encoder.eval()
        with torch.no_grad():
            for first in range(0, count, _ENCODE_ROWS):
                abrdfs = read(first, min(first + _ENCODE_ROWS, count))
                found.append(self.encoder(self._standardised(abrdfs)).cpu().numpy())
        self.encoder.train()
        return np.concatenate(found)

    def _encode_all(self) -> None:
        with torch.no_grad():
            self.latents.copy_(torch.from_numpy(self._encoded()))

    def _encoder_is_trained(self) -> bool:
        """Whether a step has trained it by now."""
        begun = self.stages[: self._stage + (self._step_in_stage > 0)]
        return any(name != "latents" for name, _ in begun)

    def _encoder_residual(self, latents: NDArray[np.float32]) -> float:
        steps = (self._encoded() - latents) / (latents.std(axis=0) + 1e-6)
        return float(np.sqrt(np.mean(steps**2)))

    # ---- stopping and resuming ---------------------------------------------------------------

    def state(self) -> bytes:
        """Everything that is needed to go on, as bytes."""
        file = io.BytesIO()
        torch.save(
            {
                "encoder": self.encoder.state_dict(),
                "decoder": self.decoder.state_dict(),
                "latents": self.latents.detach(),
                "optimisers": [optimiser.state_dict() for optimiser in self._optimisers],
                "position": [self._stage, self._step_in_stage, self.done],
                "curve": self._curve,
                "loss": [self._loss, self._losses],
            },
            file,
        )
        return file.getvalue()

    def restore(self, kept: bytes) -> None:
        """Go on from a state of the same data and plan."""
        saved = torch.load(io.BytesIO(kept), map_location=self._device, weights_only=True)
        self._stage, self._step_in_stage, self.done = saved["position"]
        self._begin_stage()
        self.encoder.load_state_dict(saved["encoder"])
        self.decoder.load_state_dict(saved["decoder"])
        with torch.no_grad():
            self.latents.copy_(saved["latents"])
        for optimiser, state in zip(self._optimisers, saved["optimisers"], strict=True):
            optimiser.load_state_dict(state)
        self._curve = [(int(step), float(value)) for step, value in saved["curve"]]
        self._loss, self._losses = saved["loss"]


def _adam(parameters: Sequence[Tensor], rate: float) -> torch.optim.Optimizer:
    return torch.optim.Adam(parameters, lr=rate, betas=(0.9, 0.99), fused=True)
