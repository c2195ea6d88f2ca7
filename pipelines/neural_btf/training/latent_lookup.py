"""Latents of a texture looked up beside texels, so that gradients flow to them and to parallax.

The same as `latent_texture.between_texels` and `parallax_terms`, in torch.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn.functional import embedding


def parallax_offsets(parallax: Tensor, views: Tensor) -> Tensor:
    """By how many columns and rows, (n, 2), latents are looked up for views (n, 2)."""
    x, y = views[:, 0], views[:, 1]
    terms = torch.stack([x, y, x * x, x * y, y * y, x**3, x * x * y, x * y * y, y**3], dim=1)
    return terms @ parallax


def latents_beside(table: Tensor, size: tuple[int, int], texels: Tensor, offsets: Tensor) -> Tensor:
    """Latents (texel, view, 8) of a table (h * w, 8) at texels (texel,) moved by offsets (view, 2).

    ``size`` (h, w). A texture repeats.
    """
    height, width = size
    # What lies between four texels is the same for all texels: offsets alone are fractions.
    whole = torch.floor(offsets.detach())
    right, down = (offsets - whole)[:, :1], (offsets - whole)[:, 1:]
    row = torch.div(texels, width, rounding_mode="floor")[:, None] + whole[:, 1].long()
    column = (texels % width)[:, None] + whole[:, 0].long()

    def at(rows: Tensor, columns: Tensor) -> Tensor:
        return embedding((rows % height) * width + columns % width, table)

    upper = at(row, column) * (1 - right) + at(row, column + 1) * right
    lower = at(row + 1, column) * (1 - right) + at(row + 1, column + 1) * right
    found: Tensor = upper * (1 - down) + lower * down
    return found
