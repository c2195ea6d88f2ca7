"""What a step of training draws: rows of the target ABRDFs, and photographs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.neural_btf.abrdf import standardised
from pipelines.neural_btf.training.data import TrainingData

_STEPS_A_PART = 500
"""Steps that draw from one part of the pool before the next part is read."""
_VIEWS = 64
"""Views of a batch that looks latents up by the view, once a texel and view: with 8, as cheap, the
error ends 3 to 5 % higher, for pairs of one view are too much alike."""


class Batch(NamedTuple):
    """Target ABRDFs of a step."""

    owners: NDArray[np.int64]
    """(row,) the latent vectors that they belong to."""
    values: NDArray[np.floating]
    """(row, image, 3), of all photographs or of some."""


class Batches:
    """Draws batches of one BTF; the same generator and step give the same batch."""

    def __init__(self, data: TrainingData) -> None:
        self._data = data
        self._cumulated = np.zeros(0)
        self._part = -1
        _, view = np.unique(data.directions[:, 2:], axis=0, return_inverse=True)
        self._view = view.ravel()
        order = np.argsort(self._view, kind="stable")
        self._of_view = np.split(order, np.cumsum(np.bincount(self._view))[:-1])

    def images(self, random: np.random.Generator, count: int) -> NDArray[np.int64]:
        """Numbers of photographs; never more than there are."""
        images = len(self._data.directions)
        return random.integers(0, images, min(count, images))

    def images_by_view(
        self,
        random: np.random.Generator,
        count: int,
        among: NDArray[np.int64] | None = None,
    ) -> NDArray[np.int64]:
        """Numbers of photographs (view, light): `_VIEWS` views, drawn, and lights of each.

        ``among``: photographs of whole views that may be drawn; None: all.
        """
        known = len(self._of_view)
        allowed = np.arange(known) if among is None else np.unique(self._view[among])
        views = random.choice(allowed, min(_VIEWS, known))
        lights = max(1, min(count, len(self._data.directions)) // len(views))
        return np.stack([random.choice(self._of_view[view], lights) for view in views])

    def rows(
        self,
        random: np.random.Generator,
        step: int,
        count: int,
        images: NDArray[np.int64] | None = None,
    ) -> Batch:
        """So many rows of the targets, drawn by their weights, at all or at some photographs."""
        targets = self._data.targets
        part = step // _STEPS_A_PART
        numbers, values = targets.pool.part(part)
        if part != self._part:
            self._cumulated = np.cumsum(targets.weights[numbers])
            self._part = part
        drawn = np.searchsorted(
            self._cumulated, random.random(count) * self._cumulated[-1], side="right"
        )
        owners = targets.owner[numbers[drawn]]
        if images is None:
            return Batch(owners, values[drawn])
        return Batch(owners, values[drawn[:, None], images[None]])

    def encoder_input(self, batch: Batch) -> NDArray[np.float32]:
        """Standardised ABRDFs (row, image, 3): the clusters' representatives, or the targets."""
        seen = self._data.representatives
        return self._standardised(batch.values if seen is None else seen[batch.owners])

    def all_encoder_inputs(self, first: int, last: int) -> NDArray[np.float32]:
        """The same for latent vectors first … last - 1, each once."""
        seen = self._data.representatives
        pool = self._data.targets.pool
        return self._standardised(pool.read(first, last) if seen is None else seen[first:last])

    def _standardised(self, abrdfs: NDArray[np.floating]) -> NDArray[np.float32]:
        scale = self._data.scale
        return standardised(abrdfs, scale.mean, scale.deviation)
