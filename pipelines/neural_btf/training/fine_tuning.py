"""Training that knows its quantisation: what goes on from a trained network to the file.

Decoder and latents are rounded in every step (`quantiser`), and coarser levels of latents are
trained beside the finest against averaged ABRDFs (`mips`). The loss is the squared error plus a
price on bits. The price is no setting: it rises while the file is larger than wanted and falls
while it is smaller, so that each channel and layer gets as many bits as it is worth.
"""

from __future__ import annotations

import bisect
import io
import math
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn.utils import parametrize

from pipelines.neural_btf.decoder_arrays import STUDENT_HIDDEN
from pipelines.neural_btf.latent_texture import averaged, level_sizes
from pipelines.neural_btf.mips import AveragedAbrdfs
from pipelines.neural_btf.network import Decoder, autocast, device
from pipelines.neural_btf.training.batches import Batches
from pipelines.neural_btf.training.data import TrainingData
from pipelines.neural_btf.training.latent_lookup import latents_beside, parallax_offsets
from pipelines.neural_btf.training.latent_price import LatentPrice
from pipelines.neural_btf.training.optimisers import (
    adam,
    decoder_optimisers,
    parallax_optimiser,
    rate_share,
)
from pipelines.neural_btf.training.plan import FineTuningPlan
from pipelines.neural_btf.training.quantised_decoder import (
    quantised_decoder,
    quantised_parts,
    unrounded,
    whole_numbers,
    widened,
)
from pipelines.neural_btf.training.quantiser import Quantiser
from pipelines.neural_btf.training.trainer import KEEP_SECONDS, TrainedNetwork

_FIRST_STEPS = {"latents": 0.2, "mips": 0.3}
"""Steps of quantisation in standard deviations, times what makes the first file as large as
wanted."""
_COARSENINGS = np.geomspace(0.5, 2.0, 7)
_STEP_RATE = 0.01
_PRICE_RATE = 0.08
_FIRST_PRICE = 3e-10
_STUDENT_RATE = 0.01
"""The student begins at random, whatever the plan's rate: 0.03 ends 4 % worse."""
_MIP_WEIGHT = 0.5
"""Of a coarser level's error beside the finest's: from 1 to 0.3 the finest of a knit gains 1.4 %
and the coarser ones lose 14 %."""
_MORE_TEXELS = 0.2
_MIP_TEXELS = 32
_PRICE_EVERY = 4
"""Bits take as long to count as the error, and change slowly."""
_ASK_EVERY = 48
"""Steps between questions for the file's true bytes."""


_Levels = tuple[list[Tensor], list[Tensor | None]]


class QuantisedNetwork(NamedTuple):
    """A network in whole numbers; values are symbols times steps."""

    decoder: dict[str, tuple[NDArray[np.int32], NDArray[np.float32]]]
    """Symbols and step () of ``weight_1``, ``bias_1`` …"""
    latents: NDArray[np.int32]
    """(k, n)."""
    latent_steps: NDArray[np.float32]
    """(n,)."""
    mips: tuple[NDArray[np.int32], ...]
    """Coarser levels, each (texel, n)."""
    mip_steps: NDArray[np.float32]
    """(n,)."""
    parallax: NDArray[np.float32] | None
    """(9, 2)."""
    student: dict[str, tuple[NDArray[np.int32], NDArray[np.float32]]]
    """A smaller decoder of the same latents; empty where the plan has none."""
    curve_step: NDArray[np.int64]
    curve_rmse: NDArray[np.float64]
    """Root of the mean squared error since the point before, values over alpha."""


def fine_tune(
    data: TrainingData,
    trained: TrainedNetwork,
    more: NDArray[np.float32],
    coarse: AveragedAbrdfs,
    plan: FineTuningPlan,
    file_bytes: Callable[[QuantisedNetwork], int],
    *,
    resume: bytes | None = None,
    keep: Callable[[bytes], None] = lambda state: None,
    progress: Callable[[float], None] = lambda fraction: None,
) -> QuantisedNetwork:
    """Quantise a trained network of the same data, and train it on.

    ``more`` (k, n): where further latents start; the decoder does not heed them at first.
    ``file_bytes`` tells how large a network's file is: asked for now and then. ``keep`` gets the
    state every 15 seconds; ``resume`` is such a state.
    """
    tuning = FineTuning(data, trained, more, coarse, plan, file_bytes)
    if resume is not None:
        tuning.restore(resume)
    kept = time.monotonic()
    while tuning.steps_done < plan.steps:
        tuning.step()
        if time.monotonic() - kept > KEEP_SECONDS:
            keep(tuning.state())
            kept = time.monotonic()
        if tuning.steps_done % 20 == 0:
            progress(tuning.steps_done / plan.steps)
    return tuning.result()


class FineTuning:
    """One run, step by step."""

    def __init__(
        self,
        data: TrainingData,
        trained: TrainedNetwork,
        more: NDArray[np.float32],
        coarse: AveragedAbrdfs,
        plan: FineTuningPlan,
        file_bytes: Callable[[QuantisedNetwork], int],
    ) -> None:
        torch.manual_seed(plan.seed)
        self._data, self._coarse, self._plan, self._file_bytes = data, coarse, plan, file_bytes
        self._device = device()
        self._batches = Batches(data)
        self._directions = torch.from_numpy(data.directions).to(self._device)
        self._sizes = level_sizes(*data.size)[1:]
        self._has_parallax = trained.parallax is not None
        self.decoder = quantised_decoder(widened(trained.decoder, more.shape[1]))
        self.decoder.to(self._device).train()
        parallax = np.zeros((9, 2), np.float32) if trained.parallax is None else trained.parallax
        self.parallax = self._parameter(parallax)
        latents = np.concatenate([trained.latents, more], axis=1)
        self.latents = self._parameter(latents)
        self.mips = self._parameter(_coarse_latents(latents, data))
        self.of_latents = self._quantiser(self.latents, "latents")
        self.of_mips = self._quantiser(self.mips, "mips")
        self.student = _student(latents.shape[1]).to(self._device) if plan.student else None
        self._optimisers = [
            *decoder_optimisers(unrounded(self.decoder), [self.latents, self.mips], plan.rate),
            parallax_optimiser(self.parallax, plan.rate),
            adam(self._log_steps(), _STEP_RATE),
        ]
        if self.student is not None:
            self._optimisers += decoder_optimisers(unrounded(self.student), [], _STUDENT_RATE)
        self._rates = [optimiser.defaults["lr"] for optimiser in self._optimisers]
        self._latent_price = LatentPrice(self.latents.shape[1], 2, self._device)
        self.steps_done = 0
        self._price, self._true_share = _FIRST_PRICE, 1.0
        self._curve: list[tuple[int, float]] = []
        self._squares, self._count = 0.0, 0
        self._begin_at_the_size()

    def _begin_at_the_size(self) -> None:
        """Make latents as coarse as the file's size asks: few steps of training would not."""
        quantisers = self.of_latents, self.of_mips
        first = [quantiser.log_step.detach().clone() for quantiser in quantisers]

        def is_larger(times: float) -> bool:
            for quantiser, log_step in zip(quantisers, first, strict=True):
                quantiser.log_step.data = log_step + math.log(times)
            return self._file_bytes(self.result()) > self._plan.file_bytes

        found = bisect.bisect_left(_COARSENINGS, True, key=lambda times: not is_larger(times))
        is_larger(_COARSENINGS[min(found, len(_COARSENINGS) - 1)])

    # ---- a step ------------------------------------------------------------------------------

    def step(self) -> None:
        """One step of gradient descent, and one of the price."""
        plan = self._plan
        share = rate_share("latents", self.steps_done / plan.steps)
        for optimiser, rate in zip(self._optimisers, self._rates, strict=True):
            for group in optimiser.param_groups:
                group["lr"] = rate * share
        random = np.random.default_rng((plan.seed, 4, self.steps_done))
        with parametrize.cached():
            error, of_student = self._errors(random)
            loss = error + of_student
            if self._sizes:
                of_mip, of_far_student = self._mip_errors(random)
                loss = loss + _MIP_WEIGHT * of_mip + of_far_student
            if self.steps_done % _PRICE_EVERY == 0:
                bits = self._bits()
                loss = loss + _PRICE_EVERY * self._price * bits
            for optimiser in self._optimisers:
                optimiser.zero_grad(set_to_none=True)
            loss.backward()
        for optimiser in self._optimisers:
            optimiser.step()
        if self.steps_done % _PRICE_EVERY == 0:
            self._change_price(float(bits.detach()))
        self.steps_done += 1
        self._note(float(error.detach()))

    def _change_price(self, bits: float) -> None:
        """Dearer while the file is too large, cheaper while it is too small."""
        if self.steps_done % _ASK_EVERY == 0:
            self._true_share = self._file_bytes(self.result()) * 8 / bits
        over = bits * self._true_share / (8 * self._plan.file_bytes) - 1.0
        self._price *= math.exp(_PRICE_RATE * max(-1.0, min(1.0, 10.0 * over)))

    def _note(self, error: float) -> None:
        self._squares += error
        self._count += 1
        if self.steps_done % max(1, self._plan.steps // 100) == 0:
            self._curve.append((self.steps_done, math.sqrt(self._squares / self._count)))
            self._squares, self._count = 0.0, 0

    # ---- losses ------------------------------------------------------------------------------

    def _errors(self, random: np.random.Generator) -> tuple[Tensor, Tensor]:
        """Mean squared error of the finest level on a batch, over alpha, and the student's (0
        without one)."""
        images = self._batches.images_by_view(random, self._plan.batch_images)
        batch = self._batches.rows(random, self.steps_done, self._plan.batch_texels, images.ravel())
        owners = torch.from_numpy(batch.owners).to(self._device)
        table = self.of_latents(self.latents)
        if self._has_parallax:
            offsets = parallax_offsets(self.parallax, self._directions[images[:, 0], 2:])
            latents = latents_beside(table, self._data.size, owners, offsets)
        else:
            latents = table[owners][:, None].expand(-1, len(images), -1)
        return self._differences(latents, images, batch.values)

    def _mip_errors(self, random: np.random.Generator) -> tuple[Tensor, Tensor]:
        """The same of a coarser level, drawn: those of more texels a little more often."""
        sizes = np.array([rows * columns for rows, columns in self._sizes])
        chances = sizes**_MORE_TEXELS
        level = int(random.choice(len(sizes), p=chances / chances.sum()))
        held = self._coarse.photographs
        images = self._batches.images_by_view(random, self._plan.batch_images, among=held)
        texels = random.integers(0, sizes[level], min(_MIP_TEXELS, sizes[level]))
        first = int(sizes[:level].sum())
        table = self.of_mips(self.mips)[first : first + sizes[level]]
        offsets = parallax_offsets(self.parallax, self._directions[images[:, 0], 2:])
        rows, columns = self._sizes[level]
        scale = torch.tensor([columns / self._data.size[1], rows / self._data.size[0]])
        where = torch.from_numpy(texels).to(self._device)
        latents = latents_beside(table, (rows, columns), where, offsets * scale.to(self._device))
        numbers = np.searchsorted(held, images.ravel())
        values = self._coarse.levels[level][texels[:, None], numbers[None]]
        return self._differences(latents, images, values)

    def _differences(
        self, latents: Tensor, images: NDArray[np.int64], values: NDArray[np.floating]
    ) -> tuple[Tensor, Tensor]:
        directions = self._directions[images]
        wanted = torch.from_numpy(np.ascontiguousarray(values)).to(self._device).float()
        wanted = wanted / self._data.scale.alpha

        def error(decoder: Decoder, given: Tensor) -> Tensor:
            with autocast(self._device):
                colours = decoder.grid_by_view(given, directions)
            return ((colours.float() - wanted) ** 2).mean()

        of_decoder = error(self.decoder, latents)
        if self.student is None:
            return of_decoder, torch.zeros_like(of_decoder)
        # latents are the whole decoder's
        return of_decoder, error(self.student, latents.detach())

    def _bits(self) -> Tensor:
        """What decoders and latents take in the file."""
        total = torch.zeros((), device=self._device)
        for decoder in self._decoders():
            for quantiser, original in quantised_parts(decoder).values():
                total = total + quantiser.bits(original)
        finest, coarse = self._whole_levels()
        if not self._data.is_textured:
            total = total + self.of_latents.bits(self.latents)
        for group, (levels, parents) in enumerate((coarse, finest)):
            if levels:
                if self.steps_done % _ASK_EVERY == 0:
                    self._latent_price.fit(group, levels, parents)
                total = total + self._latent_price.bits(group, levels, parents)
        return total

    def _whole_levels(self) -> tuple[_Levels, _Levels]:
        """Whole numbers (row, column, 8) of the finest and of the coarser levels, and of what is
        over each; none where texels share latents, or where there are no coarser levels."""
        table, ends = self.of_mips.whole(self.mips), self._level_ends()
        coarse = [
            table[first:last].reshape(*size, -1)
            for size, first, last in zip(self._sizes, [0, *ends[:-1]], ends, strict=True)
        ]
        over: list[Tensor | None] = [*coarse[1:], None]
        if not self._data.is_textured:
            return ([], []), (coarse, over[: len(coarse)])
        finest = self.of_latents.whole(self.latents).reshape(*self._data.size, -1)
        return ([finest], [coarse[0] if coarse else None]), (coarse, over[: len(coarse)])

    def _level_ends(self) -> list[int]:
        return np.cumsum([rows * columns for rows, columns in self._sizes], dtype=int).tolist()

    # ---- result ------------------------------------------------------------------------------

    def result(self) -> QuantisedNetwork:
        """What has been learnt so far, in whole numbers."""
        symbols = self.of_mips.symbols(self.mips)
        return QuantisedNetwork(
            whole_numbers(self.decoder),
            self.of_latents.symbols(self.latents),
            self.of_latents.steps(),
            tuple(np.split(symbols, self._level_ends()[:-1])) if self._sizes else (),
            self.of_mips.steps(),
            self.parallax.detach().cpu().numpy().copy() if self._has_parallax else None,
            {} if self.student is None else whole_numbers(self.student),
            np.array([step for step, _ in self._curve], np.int64),
            np.array([value for _, value in self._curve], np.float64),
        )

    # ---- stopping and resuming ---------------------------------------------------------------

    def state(self) -> bytes:
        """Everything that is needed to go on, as bytes."""
        file = io.BytesIO()
        torch.save(
            {
                "trained": {name: part.detach() for name, part in self._trained().items()},
                "decoders": [decoder.state_dict() for decoder in self._decoders()],
                "optimisers": [optimiser.state_dict() for optimiser in self._optimisers],
                "coefficients": self._latent_price.coefficients,
                "position": [self.steps_done, self._count],
                "price": [self._price, self._true_share, self._squares],
                "curve": self._curve,
            },
            file,
        )
        return file.getvalue()

    def restore(self, kept: bytes) -> None:
        """Go on from a state of the same data, network and plan."""
        saved = torch.load(io.BytesIO(kept), map_location=self._device, weights_only=True)
        for decoder, state in zip(self._decoders(), saved["decoders"], strict=True):
            decoder.load_state_dict(state)
        with torch.no_grad():
            for name, part in self._trained().items():
                part.copy_(saved["trained"][name])
        for optimiser, state in zip(self._optimisers, saved["optimisers"], strict=True):
            optimiser.load_state_dict(state)
        self._latent_price.coefficients = saved["coefficients"]
        self.steps_done, self._count = saved["position"]
        self._price, self._true_share, self._squares = saved["price"]
        self._curve = [(int(step), float(value)) for step, value in saved["curve"]]

    def _trained(self) -> dict[str, Tensor]:
        return {
            "latents": self.latents,
            "mips": self.mips,
            "parallax": self.parallax,
            "latent steps": self.of_latents.log_step,
            "mip steps": self.of_mips.log_step,
        }

    # ---- making ------------------------------------------------------------------------------

    def _decoders(self) -> list[Decoder]:
        return [self.decoder] if self.student is None else [self.decoder, self.student]

    def _parameter(self, values: NDArray[np.float32]) -> Tensor:
        return torch.from_numpy(values.copy()).to(self._device).requires_grad_()

    def _quantiser(self, values: Tensor, kind: str) -> Quantiser:
        return Quantiser(values, _FIRST_STEPS[kind], by_channel=True).to(self._device)

    def _log_steps(self) -> list[nn.Parameter]:
        every = (quantised_parts(decoder).values() for decoder in self._decoders())
        parts = [quantiser for decoder in every for quantiser, _ in decoder]
        return [part.log_step for part in (*parts, self.of_latents, self.of_mips)]


def _student(latents: int) -> Decoder:
    return quantised_decoder(Decoder(STUDENT_HIDDEN, latents)).train()


def _coarse_latents(latents: NDArray[np.float32], data: TrainingData) -> NDArray[np.float32]:
    """Latents of all coarser levels in one table, each the mean of what it covers.

    A single texel has no coarser levels; it is given one row that nothing uses.
    """
    texture = latents[data.ids]
    sizes = level_sizes(*data.size)[1:] or [(1, 1)]
    return np.concatenate([averaged(texture, data.size, size) for size in sizes])
