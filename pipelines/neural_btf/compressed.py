"""The runtime BTF: decoder, latents and cluster numbers, and what they decode to."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipelines.light.directions import Pairs
from pipelines.neural_btf.decoder_arrays import (
    DecoderArrays,
    direction_inputs,
    direction_inputs_of_vectors,
)
from pipelines.neural_btf.latent_texture import between_levels, between_texels, parallax_terms

if TYPE_CHECKING:
    import torch

    from pipelines.neural_btf.network import Decoder

_ROWS = 1 << 14
"""Values decoded at a time: hidden layers that stay in the cache, three times as fast as 2^17."""


@dataclass(frozen=True)
class CompressedBtf:
    """A BTF as it is used: M texels, k latent vectors. torch is imported when it decodes.

    >>> from pipelines.light.directions import all_pairs, hemisphere_table
    >>> from pipelines.neural_btf.network import Decoder, decoder_arrays
    >>> latents, ids = np.zeros((5, 8), np.float32), np.arange(48, dtype=np.int32) % 5
    >>> btf = CompressedBtf(decoder_arrays(Decoder()), latents, ids, 1.5, height=6, width=8)
    >>> btf.texels, btf.payload_bytes == 4 * (24_383 + 5 * 8 + 48)
    (48, True)
    >>> table = hemisphere_table(15)
    >>> btf.photographs(all_pairs(table[:2], table)).shape
    (30, 6, 8, 3)
    >>> from_above = np.array([[0.0, 0.0, 1.0]])
    >>> btf.radiance_at(np.array([[0.25, 7.5]]), from_above, from_above).shape
    (1, 3)
    """

    decoder: DecoderArrays
    latents: NDArray[np.float32]
    """(k, 8)."""
    ids: NDArray[np.integer] | None
    """(M,) the latent vector of every texel; None: every texel has its own, k = M."""
    alpha: float
    """What the decoder's 1 stands for, in radiance (Eq. 5)."""
    height: int
    width: int
    mips: tuple[NDArray[np.float32], ...] = ()
    """Latents of coarser levels, each (texel, 8): of `latent_texture.level_sizes` but the first."""
    parallax: NDArray[np.float32] | None = None
    """(9, 2) texels, columns and rows, by which latents are looked up beside a place: factors of
    `latent_texture.parallax_terms` of the view. None: nowhere."""
    least: float = -math.inf
    largest: float = math.inf
    """Values over alpha are held to these: what was measured lies between them."""
    student: DecoderArrays | None = None
    """A smaller decoder of the same latents, for real time."""

    @property
    def texels(self) -> int:
        """M."""
        return self.height * self.width

    @property
    def payload_bytes(self) -> int:
        """Bytes of decoder, latents and cluster numbers as floats, as table 1 counts them."""
        index = 0 if self.ids is None else 4 * len(self.ids)
        return 4 * (sum(part.size for part in self.decoder.values()) + self.latents.size) + index

    def by_student(self) -> CompressedBtf:
        """The same, decoded by the student. Raises ValueError where there is none."""
        if self.student is None:
            raise ValueError("student is missing; expected a file with a second decoder.")
        return replace(self, decoder=self.student, student=None)

    def latents_of(self, texels: NDArray[np.integer] | slice) -> NDArray[np.float32]:
        """Latents (n, 8) of texels, numbered row by row."""
        owners = texels if self.ids is None else self.ids[texels]
        found: NDArray[np.float32] = self.latents[owners]
        return found

    def abrdfs(self, first: int, last: int, directions: NDArray[np.float32]) -> NDArray[np.float32]:
        """Values over alpha of texels first … last - 1 in every pair, (texel, pair, 3) float32.

        ``directions`` (pair, 4) as `decoder_arrays.direction_inputs` gives them.
        """
        result = np.empty((last - first, len(directions), 3), np.float32)
        if self.parallax is None:
            self._decode_grid(self.latents_of(slice(first, last)), directions, result)
            return result
        texels = np.arange(first, last)
        views, owner = np.unique(directions[:, 2:], axis=0, return_inverse=True)
        for number, view in enumerate(views):
            pairs = np.flatnonzero(owner.ravel() == number)
            latents = self._latents_from(texels, np.repeat(view[None], len(texels), axis=0))
            part = np.empty((len(texels), len(pairs), 3), np.float32)
            self._decode_grid(latents, directions[pairs], part)
            result[:, pairs] = part
        return result

    def photographs(self, pairs: Pairs) -> NDArray[np.float32]:
        """Restored photographs (pair, y, x, 3), linear radiance."""
        decoded = self.abrdfs(0, self.texels, direction_inputs(pairs))
        images = decoded.transpose(1, 0, 2).reshape(-1, self.height, self.width, 3)
        return np.ascontiguousarray(images * np.float32(self.alpha))

    def radiance(
        self,
        texels: NDArray[np.integer],
        light: NDArray[np.floating],
        view: NDArray[np.floating],
    ) -> NDArray[np.float32]:
        """Radiance (n, 3) of texels' middles (n,) for unit vectors (n, 3) to light and view.

        Directions are in the texture's frame: x along u, y along v, z along the normal.
        """
        inputs = direction_inputs_of_vectors(light, view)
        return self._decode(lambda part: self._latents_from(texels[part], inputs[part, 2:]), inputs)

    def radiance_at(
        self,
        places: NDArray[np.floating],
        light: NDArray[np.floating],
        view: NDArray[np.floating],
        footprint: NDArray[np.floating] | None = None,
    ) -> NDArray[np.float32]:
        """Radiance (n, 3) at places between texels, where the material repeats without end.

        places (n, 2): u and v in tiles, v from a tile's lower edge; light, view (n, 3) as in
        `radiance`. ``footprint`` (n,): width of what a pixel sees, in tiles: latents are taken
        between levels. None: from the finest level.
        """
        inputs = direction_inputs_of_vectors(light, view)
        columns = places[:, 0] * self.width - 0.5
        rows = (1.0 - places[:, 1]) * self.height - 0.5

        def latents(part: slice) -> NDArray[np.float32]:
            across, down = self._offsets(inputs[part, 2:])
            at = (rows[part] + down, columns[part] + across)
            if footprint is None or not self.mips:
                return between_texels(self._texture, self._size, *at)
            seen = footprint[part] * max(self._size)
            return between_levels((self._texture, *self.mips), self._size, at, seen)

        return self._decode(latents, inputs)

    # ---- looking up, decoding ----------------------------------------------------------------

    def _latents_from(
        self, texels: NDArray[np.integer], views: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Latents (n, 8) of texels' middles (n,), each from its view (n, 2)."""
        if self.parallax is None:
            return self.latents_of(texels)
        across, down = self._offsets(views)
        rows, columns = np.divmod(texels, self.width)
        return between_texels(self._texture, self._size, rows + down, columns + across)

    def _offsets(self, views: NDArray[np.float32]) -> NDArray[np.float32]:
        """By how many columns and rows (2, n) latents are looked up beside a place."""
        if self.parallax is None:
            return np.zeros((2, len(views)), np.float32)
        return (parallax_terms(views) @ self.parallax).T

    def _decode(
        self,
        latents: Callable[[slice], NDArray[np.float32]],
        inputs: NDArray[np.float32],
    ) -> NDArray[np.float32]:
        """Radiance (n, 3) of latents, asked for by parts, and of directions (n, 4)."""
        import torch

        result = np.empty((len(inputs), 3), np.float32)
        decoder, where = self._network
        with torch.no_grad():
            for start in range(0, len(inputs), _ROWS):
                part = slice(start, start + _ROWS)
                given = torch.from_numpy(latents(part)).to(where)
                colours = decoder(given, torch.from_numpy(inputs[part]).to(where))
                result[part] = colours.clamp(self.least, self.largest).cpu().numpy()
        return result * np.float32(self.alpha)

    def _decode_grid(
        self,
        latents: NDArray[np.float32],
        directions: NDArray[np.float32],
        result: NDArray[np.float32],
    ) -> None:
        """Values over alpha (n, pair, 3) of latents (n, 8) in every pair (pair, 4)."""
        import torch

        step = max(1, _ROWS // len(directions))
        decoder, where = self._network
        inputs = torch.from_numpy(np.ascontiguousarray(directions)).to(where)
        with torch.no_grad():
            for start in range(0, len(latents), step):
                part = slice(start, start + step)
                colours = decoder.grid(torch.from_numpy(latents[part]).to(where), inputs)
                result[part] = colours.clamp(self.least, self.largest).cpu().numpy()

    @property
    def _size(self) -> tuple[int, int]:
        return self.height, self.width

    @functools.cached_property
    def _texture(self) -> NDArray[np.float32]:
        """(M, 8) the finest level."""
        return self.latents if self.ids is None else self.latents[self.ids]

    @functools.cached_property
    def _network(self) -> tuple[Decoder, torch.device]:
        """The decoder in torch, and the device that it is on."""
        from pipelines.neural_btf.network import decoder_of, device

        where = device()
        return decoder_of(self.decoder).to(where), where


def compressed_btf(
    decoder: DecoderArrays,
    latents: NDArray[np.float32],
    ids: NDArray[np.integer],
    alpha: float,
    size: tuple[int, int],
    parallax: NDArray[np.float32] | None = None,
) -> CompressedBtf:
    """What is needed at run time of latents (k, 8), for photographs of ``size`` (rows, columns).

    The cluster numbers ``ids`` (texel,) are left out where every texel has latents of its own.
    """
    shared = ids if len(latents) < len(ids) else None
    return CompressedBtf(decoder, latents, shared, alpha, *size, parallax=parallax)
