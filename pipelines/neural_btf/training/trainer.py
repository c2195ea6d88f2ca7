"""One training run, stage by stage and step by step; it can be stopped and resumed."""

from __future__ import annotations

import io
import math
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from pipelines.neural_btf.latent_texture import MONOMIALS
from pipelines.neural_btf.network import Decoder, Encoder, autocast, default_widths, device
from pipelines.neural_btf.training.batches import Batch, Batches
from pipelines.neural_btf.training.data import TrainingData
from pipelines.neural_btf.training.latent_lookup import latents_beside, parallax_offsets
from pipelines.neural_btf.training.optimisers import rate_share, stage_optimisers
from pipelines.neural_btf.training.plan import StageName, TrainingPlan

KEEP_SECONDS = 15.0
_CURVE_POINTS = 200
_ENCODE_ROWS = 64
_STAGE_NUMBER: dict[StageName, int] = {"paper": 0, "encoder": 1, "latents": 2, "distil": 3}


class TrainedNetwork(NamedTuple):
    """What training gives."""

    encoder: Encoder
    decoder: Decoder
    latents: NDArray[np.float32]
    """(k, 8)."""
    parallax: NDArray[np.float32] | None
    """(9, 2) as `compressed.CompressedBtf` has it; None where latents are no texture."""
    curve_step: NDArray[np.int64]
    curve_rmse: NDArray[np.float64]
    """Root of the mean loss since the point before, at these steps; values are over alpha."""
    encoder_residual: float | None
    """RMSE of the encoder's latents against the stored ones, in their standard deviations: 0 in
    `paper`, where they are the same; None where the encoder was not trained."""


def train(
    data: TrainingData,
    plan: TrainingPlan,
    *,
    resume: bytes | None = None,
    keep: Callable[[bytes], None] = lambda state: None,
    progress: Callable[[float], None] = lambda fraction: None,
    stop: Callable[[Trainer], bool] = lambda trainer: False,
) -> TrainedNetwork:
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
        if trainer.steps_done % 20 == 0:
            progress(trainer.steps_done / trainer.steps_planned)
        if stop(trainer):
            break
    return trainer.result()


class Trainer:
    """One training run, step by step."""

    def __init__(self, data: TrainingData, plan: TrainingPlan) -> None:
        torch.manual_seed(plan.seed)
        self._data, self._plan = data, plan
        self._device = device()
        images = len(data.directions)
        self.encoder = Encoder(images, plan.widths or default_widths(images)).to(self._device)
        self.decoder = Decoder().to(self._device)
        first = data.start
        if plan.warm_start == "random":
            random = np.random.default_rng((plan.seed, 9))
            first = random.standard_normal(data.start.shape).astype(np.float32)
        self.latents = torch.from_numpy(first.copy()).to(self._device).requires_grad_()
        self.parallax = torch.zeros(MONOMIALS, 2, device=self._device, requires_grad=True)
        self._textured = plan.training == "fast" and plan.parallax and data.is_textured
        self._directions = torch.from_numpy(data.directions).to(self._device)
        self._batches = Batches(data)
        self.stages = plan.stages()
        self.steps_planned = sum(stage.steps for stage in self.stages)
        self.steps_done = 0
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

    def step(self) -> Tensor:
        """One step of gradient descent; returns the loss before it."""
        name, steps = self.stages[self._stage]
        self._set_rate(name, self._step_in_stage / steps)
        seed = (self._plan.seed, _STAGE_NUMBER[name], self._step_in_stage)
        loss = self._losses_of[name](np.random.default_rng(seed))
        for optimiser in self._optimisers:
            optimiser.zero_grad(set_to_none=True)
        loss.backward()
        for optimiser in self._optimisers:
            optimiser.step()
        self.steps_done += 1
        self._step_in_stage += 1
        if name != "distil":
            self._note(loss.detach())
        if self._step_in_stage == steps:
            self._end_stage(name)
        return loss.detach()

    def result(self) -> TrainedNetwork:
        """What has been learnt so far."""
        if not self.finished and self.stages[self._stage].name in ("paper", "encoder"):
            self._encode_all()
        latents = self.latents.detach().cpu().numpy().copy()
        residual = self._encoder_residual(latents) if self._encoder_is_trained() else None
        steps = np.array([step for step, _ in self._curve], np.int64)
        values = np.array([value for _, value in self._curve], np.float64)
        return TrainedNetwork(
            self.encoder.eval().cpu(),
            self.decoder.eval().cpu(),
            latents,
            self.parallax.detach().cpu().numpy().copy() if self._textured else None,
            steps,
            values,
            residual,
        )

    # ---- stages ------------------------------------------------------------------------------

    def _begin_stage(self) -> None:
        if self.finished:
            self._optimisers = []
            return
        self._losses_of: dict[StageName, Callable[[np.random.Generator], Tensor]] = {
            "paper": self._paper_loss,
            "encoder": self._encoder_loss,
            "latents": self._texture_loss if self._textured else self._latents_loss,
            "distil": self._distil_loss,
        }
        self._optimisers = stage_optimisers(
            self.stages[self._stage].name,
            self.encoder,
            self.decoder,
            (self.latents, self.parallax),
            self._plan.rate,
        )
        self._rates = [optimiser.defaults["lr"] for optimiser in self._optimisers]

    def _end_stage(self, name: StageName) -> None:
        if name in ("paper", "encoder"):
            self._encode_all()
        self._stage += 1
        self._step_in_stage = 0
        self._begin_stage()

    def _set_rate(self, name: StageName, fraction: float) -> None:
        share = rate_share(name, fraction)
        for optimiser, rate in zip(self._optimisers, self._rates, strict=True):
            for group in optimiser.param_groups:
                group["lr"] = rate * share

    def _note(self, loss: Tensor) -> None:
        """Add to the loss curve; its value is asked for only a few times (a GPU would wait)."""
        self._loss += loss
        self._losses += 1
        if self.steps_done % max(1, self.steps_planned // _CURVE_POINTS) == 0:
            self._curve.append((self.steps_done, math.sqrt(float(self._loss) / self._losses)))
            self._loss.zero_()
            self._losses = 0

    # ---- losses ------------------------------------------------------------------------------

    def _paper_loss(self, random: np.random.Generator) -> Tensor:
        batch = self._rows(random, self._plan.batch_texels)
        latents = self.encoder(self._encoder_input(batch))
        return self._error(self.decoder.grid(latents, self._directions), batch.values)

    def _encoder_loss(self, random: np.random.Generator) -> Tensor:
        batch = self._rows(random, self._plan.batch_texels)
        images = self._batches.images(random, self._plan.batch_images)
        with autocast(self._device):
            latents = self.encoder(self._encoder_input(batch))
            colours = self.decoder.grid(latents.float(), self._directions[images])
        return self._error(colours, batch.values[:, images])

    def _latents_loss(self, random: np.random.Generator) -> Tensor:
        images = self._batches.images(random, self._plan.batch_images)
        batch = self._rows(random, self._plan.batch_texels, images)
        owners = torch.from_numpy(batch.owners).to(self._device)
        with autocast(self._device):
            colours = self.decoder.grid(self.latents[owners], self._directions[images])
        return self._error(colours, batch.values)

    def _texture_loss(self, random: np.random.Generator) -> Tensor:
        images = self._batches.images_by_view(random, self._plan.batch_images)
        batch = self._rows(random, self._plan.batch_texels, images.ravel())
        texels = torch.from_numpy(batch.owners).to(self._device)
        views = self._directions[images[:, 0], 2:]
        offsets = parallax_offsets(self.parallax, views)
        latents = latents_beside(self.latents, self._data.size, texels, offsets)
        with autocast(self._device):
            colours = self.decoder.grid_by_view(latents, self._directions[images])
        return self._error(colours, batch.values)

    def _distil_loss(self, random: np.random.Generator) -> Tensor:
        batch = self._rows(random, min(_ENCODE_ROWS, self._plan.batch_texels))
        with autocast(self._device):
            found = self.encoder(self._encoder_input(batch))
        owners = torch.from_numpy(batch.owners).to(self._device)
        wanted = self.latents.detach()
        deviation = wanted.std(dim=0, correction=0) + 1e-6
        return (((found.float() - wanted[owners]) / deviation) ** 2).mean()

    def _error(self, colours: Tensor, values: NDArray[np.floating]) -> Tensor:
        wanted = torch.from_numpy(np.ascontiguousarray(values)).to(self._device).float()
        return ((colours.float() - wanted / self._data.scale.alpha) ** 2).mean()

    def _rows(
        self, random: np.random.Generator, count: int, images: NDArray[np.int64] | None = None
    ) -> Batch:
        return self._batches.rows(random, self._step_in_stage, count, images)

    def _encoder_input(self, batch: Batch) -> Tensor:
        return torch.from_numpy(self._batches.encoder_input(batch)).to(self._device)

    # ---- the encoder's latents ---------------------------------------------------------------

    def _encoded(self) -> NDArray[np.float32]:
        """The encoder's latents of all k representatives, (k, 8)."""
        count = self._data.latent_count
        found = []
        self.encoder.eval()
        with torch.no_grad():
            for first in range(0, count, _ENCODE_ROWS):
                seen = self._batches.all_encoder_inputs(first, min(first + _ENCODE_ROWS, count))
                found.append(self.encoder(torch.from_numpy(seen).to(self._device)).cpu().numpy())
        self.encoder.train()
        return np.concatenate(found)

    def _encode_all(self) -> None:
        with torch.no_grad():
            self.latents.copy_(torch.from_numpy(self._encoded()))

    def _encoder_is_trained(self) -> bool:
        """Whether a step has trained it by now."""
        begun = self.stages[: self._stage + (self._step_in_stage > 0)]
        return any(stage.name != "latents" for stage in begun)

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
                "parallax": self.parallax.detach(),
                "optimisers": [optimiser.state_dict() for optimiser in self._optimisers],
                "position": [self._stage, self._step_in_stage, self.steps_done],
                "curve": self._curve,
                "loss": [self._loss, self._losses],
            },
            file,
        )
        return file.getvalue()

    def restore(self, kept: bytes) -> None:
        """Go on from a state of the same data and plan."""
        saved = torch.load(io.BytesIO(kept), map_location=self._device, weights_only=True)
        self._stage, self._step_in_stage, self.steps_done = saved["position"]
        self._begin_stage()
        self.encoder.load_state_dict(saved["encoder"])
        self.decoder.load_state_dict(saved["decoder"])
        with torch.no_grad():
            self.latents.copy_(saved["latents"])
            self.parallax.copy_(saved["parallax"])
        for optimiser, state in zip(self._optimisers, saved["optimisers"], strict=True):
            optimiser.load_state_dict(state)
        self._curve = [(int(step), float(value)) for step, value in saved["curve"]]
        self._loss, self._losses = saved["loss"]
