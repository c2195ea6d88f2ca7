"""Photographs of a factored BTF, multiplied out a block at a time.

A channel's matrix of images x pixels is U (S V)^T; both factors stay on the disk and are mapped.
Pixels run along x first, the top row first (btflib's ``decode_dfmf_texture.m``). Colours: btflib's
``undecorrelate.m``; its YUV is that of BT.601 with the coefficients below.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.btf_measured import Crop

PLAIN_RGB, LOG_YUV = 0, 11
COLOUR_MODELS = (PLAIN_RGB, LOG_YUV)
"""btflib's numbers of the models that are understood; UBO2014 has 11."""

_OFFSET = np.float32(1e-5)  # what was added to Y before the logarithm
_ROWS_AT_ONCE = 64  # of pixels: bounds the single-precision copy of S V


class ChannelFactors(NamedTuple):
    """Where a channel's factors lie in the file: ``scalar``, a NumPy type; U, images x components,
    at ``u_at``; S V, pixels x components, at ``sxv_at``.
    """

    scalar: str
    components: int
    u_at: int
    sxv_at: int


@dataclass(frozen=True, eq=False)
class FactoredPhotographs:
    """``size``: height and width before the crop. ``cosines``: (image,) float32 of the light, to
    multiply by; None where they are in the values already.
    """

    path: Path
    channels: tuple[ChannelFactors, ...]
    model: int
    size: tuple[int, int]
    crop: Crop
    cosines: NDArray[np.float32] | None

    def read(self, first: int, last: int) -> NDArray[np.float32]:
        """Photographs first ... last - 1: (image, y, x, 3) float32 linear RGB, not clamped.

        Raises BadInput where factors are not finite or the file has become shorter.
        """
        block = np.empty((last - first, self.crop.height, self.crop.width, 3), np.float32)
        for index, factors in enumerate(self.channels):
            self._multiply_into(block[..., index], factors, first, last)
        for image, light in enumerate(block, start=first):
            if self.model == LOG_YUV:
                _rgb_of_log_yuv(light)
            if self.cosines is not None:
                light *= self.cosines[image]
            if not np.isfinite(light).all():
                raise BadInput(
                    self.path, f"photograph {image}", "not finite in places", "finite values"
                )
        return block

    def _multiply_into(
        self, values: NDArray[np.float32], factors: ChannelFactors, first: int, last: int
    ) -> None:
        """``values``: (image, y, x)."""
        height, width = self.size
        k = factors.components
        row_bytes = np.dtype(factors.scalar).itemsize * k
        u = self._mapped(factors, factors.u_at + first * row_bytes, (last - first, k))
        sxv = self._mapped(factors, factors.sxv_at, (height, width, k))[self.crop.box]
        with np.errstate(over="ignore", invalid="ignore"):  # refused when all is together
            u_single = u.astype(np.float32)
            for top in range(0, self.crop.height, _ROWS_AT_ONCE):
                rows = sxv[top : top + _ROWS_AT_ONCE].astype(np.float32)
                product = u_single @ rows.reshape(-1, k).T
                values[:, top : top + len(rows)] = product.reshape(len(values), *rows.shape[:2])

    def _mapped(
        self, factors: ChannelFactors, at: int, shape: tuple[int, ...]
    ) -> NDArray[np.floating]:
        if 0 in shape:
            return np.empty(shape, factors.scalar)
        try:
            return np.memmap(self.path, factors.scalar, mode="r", offset=at, shape=shape)
        except OSError as error:
            raise BadInput(
                self.path, "file", f"unreadable ({error.strerror})", "a .btf file"
            ) from error
        except ValueError:
            raise BadInput(
                self.path, "size", f"{self.path.stat().st_size} bytes", "what it was when opened"
            ) from None


def _rgb_of_log_yuv(light: NDArray[np.float32]) -> None:
    """(y, x, 3) log(Y + 1e-5), U / (Y + 1e-5), V / (Y + 1e-5) to RGB, in place."""
    with np.errstate(over="ignore", invalid="ignore"):
        y_offset = np.exp(light[..., 0])
        y = y_offset - _OFFSET
        u = light[..., 1] * y_offset
        v = light[..., 2] * y_offset
        light[..., 0] = y + np.float32(1.13983) * v
        light[..., 1] = y - np.float32(0.39465) * u - np.float32(0.5806) * v
        light[..., 2] = y + np.float32(2.03211) * u
