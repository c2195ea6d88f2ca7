"""The runtime BTF: decoder, latents and cluster numbers, and what they restore."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from pipelines.light.directions import Pairs, stereographic_of_vectors
from pipelines.neural_btf.network import Decoder, device, direction_inputs
from pipelines.neural_btf.pool import Read

Progress = Callable[[float], None]

_ROWS = 1 << 14
"""Values decoded at a time: hidden layers that stay in the cache, three times as fast as 2^17."""


@dataclass(frozen=True)
class CompressedBtf:
    """A BTF as it is used: M texels, k latent vectors."""

    decoder: Decoder
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

    def latents_of(self, texels: NDArray[np.integer] | slice) -> NDArray[np.float32]:
        """Latents (n, 8) of texels, numbered row by row."""
        owners = texels if self.ids is None else self.ids[texels]
        found: NDArray[np.float32] = self.latents[owners]
        return found

    def abrdfs(self, first: int, last: int, directions: NDArray[np.float32]) -> NDArray[np.float32]:
        """Values over alpha of texels first … last - 1 in every pair, (texel, pair, 3) float32.

        ``directions`` (pair, 4) as `network.direction_inputs` gives them.
        """
        result = np.empty((last - first, len(directions), 3), np.float32)
        step = max(1, _ROWS // len(directions))
        where = device()
        decoder = self.decoder.to(where)
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
        inputs = np.concatenate(
            [stereographic_of_vectors(light), stereographic_of_vectors(view)], axis=1
        ).astype(np.float32)
        result = np.empty((len(texels), 3), np.float32)
        where = device()
        decoder = self.decoder.to(where)
        with torch.no_grad():
            for start in range(0, len(texels), _ROWS):
                part = slice(start, start + _ROWS)
                latents = torch.from_numpy(self.latents_of(texels[part])).to(where)
                colours = decoder(latents, torch.from_numpy(inputs[part]).to(where))
                result[part] = colours.cpu().numpy()
        return result * np.float32(self.alpha)


class RestorationErrors(NamedTuple):
    """Root of the mean squared error of values over alpha (Eq. 10), over the three channels."""

    rmse: float
    """Over all images and texels."""
    of_image: NDArray[np.float64]
    """(image,)."""
    of_texel: NDArray[np.float64]
    """(texel,)."""


def restoration_errors(
    compressed: CompressedBtf, read: Read, pairs: Pairs, *, block: int, progress: Progress
) -> RestorationErrors:
    """Compare all of a BTF with what is restored, ``block`` texels at a time.

    ``read`` gives measured ABRDFs (texel, image, 3).
    """
    directions = direction_inputs(pairs)
    of_image = np.zeros(len(directions))
    of_texel = np.zeros(compressed.texels)
    for first in range(0, compressed.texels, block):
        last = min(first + block, compressed.texels)
        step = compressed.abrdfs(first, last, directions)
        step -= read(first, last).astype(np.float32) / np.float32(compressed.alpha)
        squares = np.einsum("tic,tic->ti", step, step).astype(np.float64) / 3
        of_image += squares.sum(axis=0)
        of_texel[first:last] = squares.mean(axis=1)
        progress(last / compressed.texels)
    return RestorationErrors(
        float(np.sqrt(of_texel.mean())),
        np.sqrt(of_image / compressed.texels),
        np.sqrt(of_texel),
    )
