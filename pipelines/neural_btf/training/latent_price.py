"""What a texture of rounded latents takes in a file that predicts each from those around it.

The file codes what is left of a latent when its neighbours to the left and above and the one over
it in the next coarser level are known (docs/btf_file.md). So that training pays for what the file
pays for, and finds smooth latents cheap, the same prediction is made here, without tiles.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor

from pipelines.neural_btf.training.quantiser import normal_bits

_AROUND = 5
_RIDGE = 1e-3
_ROUNDING = 1.0 / 12.0
"""Variance of what rounding a prediction adds."""


class LatentPrice:
    """Prices levels of latents; coefficients are fitted when asked, and constant in between."""

    def __init__(self, channels: int, groups: int, device: torch.device) -> None:
        """``groups`` of levels have coefficients of their own."""
        self.coefficients = torch.zeros(groups, channels, _AROUND, device=device)

    @torch.no_grad()
    def fit(self, group: int, levels: Sequence[Tensor], parents: Sequence[Tensor | None]) -> None:
        """Least squares coefficients of a group of levels (rows, columns, channel)."""
        pairs = zip(levels, parents, strict=True)
        around = torch.cat([_around(one, over).flatten(0, 1) for one, over in pairs])
        wanted = torch.cat([one.flatten(0, 1) for one in levels])
        products = torch.einsum("nci,ncj->cij", around, around)
        ridge = (_RIDGE * len(wanted)) * torch.eye(_AROUND, device=wanted.device)
        products = products + ridge
        right = torch.einsum("nci,nc->ci", around, wanted)
        fitted = self.coefficients.clone()  # the old ones may belong to a graph
        fitted[group] = torch.linalg.solve(products, right[..., None])[..., 0]
        self.coefficients = fitted

    def bits(
        self, group: int, levels: Sequence[Tensor], parents: Sequence[Tensor | None]
    ) -> Tensor:
        """Bits of all whole numbers of a group of levels together."""
        factors = self.coefficients[group]
        left = [
            one - (_around(one, over) * factors).sum(dim=-1)
            for one, over in zip(levels, parents, strict=True)
        ]
        return normal_bits(torch.cat([part.flatten(0, 1) for part in left]), _ROUNDING)


def _around(level: Tensor, parent: Tensor | None) -> Tensor:
    """Left, above, above left, above right, parent (rows, columns, channel, 5).

    The texture is taken to repeat: in the file the edges of tiles have fewer neighbours.
    """
    left, above = level.roll(1, dims=1), level.roll(1, dims=0)
    corners = above.roll(1, dims=1), above.roll(-1, dims=1)
    over = torch.zeros_like(level)
    if parent is not None:
        rows, columns = (torch.arange(n, device=level.device) // 2 for n in level.shape[:2])
        over = parent[rows][:, columns]
    return torch.stack([left, above, *corners, over], dim=-1)
