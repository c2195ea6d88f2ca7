"""The runtime BTF: decoder, latents and cluster numbers, and what they decode to."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipelines.light.directions import Pairs
from pipelines.neural_btf.decoder_arrays import (
    DecoderArrays,
    direction_inputs,
    direction_inputs_of_vectors,
)

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

    @property
    def texels(self) -> int:
        """M."""
        return self.height * self.width

    @property
    def payload_bytes(self) -> int:
        """Bytes of decoder, latents and cluster numbers, as table 1 counts them."""
        index = 0 if self.ids is None else self.ids.nbytes
        return sum(part.nbytes for part in self.decoder.values()) + self.latents.nbytes + index

    def latents_of(self, texels: NDArray[np.integer] | slice) -> NDArray[np.float32]:
        """Latents (n, 8) of texels, numbered row by row."""
        owners = texels if self.ids is None else self.ids[texels]
        found: NDArray[np.float32] = self.latents[owners]
        return found

    def abrdfs(self, first: int, last: int, directions: NDArray[np.float32]) -> NDArray[np.float32]:
        """Values over alpha of texels first … last - 1 in every pair, (texel, pair, 3) float32.

        ``directions`` (pair, 4) as `decoder_arrays.direction_inputs` gives them.
        """
        import torch

        result = np.empty((last - first, len(directions), 3), np.float32)
        step = max(1, _ROWS // len(directions))
        decoder, where = self._network
        inputs = torch.from_numpy(directions).to(where)
        with torch.no_grad():
            for start in range(first, last, step):
                end = min(start + step, last)
                latents = torch.from_numpy(self.latents_of(slice(start, end))).to(where)
                result[start - first : end - first] = decoder.grid(latents, inputs).cpu().numpy()
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
        """Radiance (n, 3) of texels (n,) for unit vectors (n, 3) to the light and to the view.

        Directions are in the texture's frame: x along u, y along v, z along the normal.
        """
        import torch

        inputs = direction_inputs_of_vectors(light, view)
        result = np.empty((len(texels), 3), np.float32)
        decoder, where = self._network
        with torch.no_grad():
            for start in range(0, len(texels), _ROWS):
                part = slice(start, start + _ROWS)
                latents = torch.from_numpy(self.latents_of(texels[part])).to(where)
                colours = decoder(latents, torch.from_numpy(inputs[part]).to(where))
                result[part] = colours.cpu().numpy()
        return result * np.float32(self.alpha)

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
) -> CompressedBtf:
    """What is needed at run time of latents (k, 8), for photographs of ``size`` (rows, columns).

    The cluster numbers ``ids`` (texel,) are left out where every texel has latents of its own.
    """
    return CompressedBtf(decoder, latents, ids if len(latents) < len(ids) else None, alpha, *size)
