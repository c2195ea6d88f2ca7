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

RGB, YUV, PCA, YCOCG, LOG_Y_UV, LOG_YUV, LOG_Y_RATIOS, LOG_RGB = 0, 1, 3, 4, 9, 10, 11, 12
COLOUR_MODELS = (RGB, YUV, PCA, YCOCG, LOG_Y_UV, LOG_YUV, LOG_Y_RATIOS, LOG_RGB)
"""btflib's numbers of the models that are understood; UBO2014 has 11."""

_OFFSET = np.float32(1e-5)  # what was added before a logarithm
_RGB_OF_YUV = np.array([[1, 0, 1.13983], [1, -0.39465, -0.5806], [1, 2.03211, 0]], np.float32)
_RGB_OF_YCOCG = np.array([[1, 1, -1], [1, 0, 1], [1, -1, -1]], np.float32)
_MATRICES = {
    YUV: _RGB_OF_YUV, YCOCG: _RGB_OF_YCOCG, LOG_Y_UV: _RGB_OF_YUV, LOG_YUV: _RGB_OF_YUV,
    LOG_Y_RATIOS: _RGB_OF_YUV,
}  # fmt: skip
_ROWS_AT_ONCE = 64  # of pixels: bounds the single-precision copy of S V


class ChannelFactors(NamedTuple):
    """Where a channel's factors lie in the file: ``scalar``, a NumPy type; what belongs to the
    images, images x components, at ``u_at``; to the pixels, pixels x components, at ``sxv_at``.
    """

    scalar: str
    components: int
    u_at: int
    sxv_at: int


@dataclass(frozen=True, eq=False)
class ColourModel:
    """``number``: btflib's. ``mean`` (3,), ``matrix`` (3, 3): of principal components, as rows."""

    number: int
    mean: NDArray[np.float32]
    matrix: NDArray[np.float32]

    def to_rgb(self, light: NDArray[np.float32]) -> None:
        """(y, x, 3) of the model to RGB, in place; what is not finite is for the caller to see."""
        with np.errstate(over="ignore", invalid="ignore"):
            if self.number == LOG_RGB:
                light[:] = np.exp(light) - _OFFSET
            if self.number in (LOG_Y_UV, LOG_YUV, LOG_Y_RATIOS):
                light[..., 0] = np.exp(light[..., 0]) - _OFFSET
            if self.number == LOG_Y_RATIOS:
                light[..., 1:] *= light[..., :1] + _OFFSET
            if self.number == LOG_YUV:
                chroma = light[..., 1:]
                chroma[:] = np.sign(chroma) * np.exp(np.abs(chroma)) * _OFFSET
            if self.number == PCA:
                light[:] = light @ self.matrix + self.mean
            elif self.number in _MATRICES:
                light[:] = light @ _MATRICES[self.number].T


@dataclass(frozen=True, eq=False)
class FactoredPhotographs:
    """``size``: height and width before the crop. ``cosines``: (image,) float32 of the light, to
    multiply by; None where they are in the values already.
    """

    path: Path
    channels: tuple[ChannelFactors, ...]
    model: ColourModel
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
            self.model.to_rgb(light)
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
