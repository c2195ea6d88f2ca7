"""Block compression of view textures, as a graphics card would hold them.

BC1 by quicktex, BC7 by etcpak, both at their best; decoded by imagecodecs.
"""

from __future__ import annotations

import etcpak
import imagecodecs
import numpy as np
from numpy.typing import NDArray
from quicktex import RawTexture  # type: ignore[attr-defined]
from quicktex.s3tc.bc1 import BC1Encoder  # type: ignore[attr-defined]

_STACK = 256
"""Views a call: one picture of 32 x 32 n texels."""


def blocks_coded(
    name: str, colours: NDArray[np.uint8], seen: NDArray[np.bool_]
) -> tuple[NDArray[np.uint8], int]:
    """Views (v, 32, 32, 3) coded and decoded again, and the bytes of all of them.

    name: "bc1" or "bc7". What was not seen takes the view's mean colour: it costs a block nothing
    and is not counted; alpha is kept apart, as it is for eigen-textures.
    """
    weight = seen.sum(axis=(1, 2), keepdims=True)[..., None]
    mean = (colours * seen[..., None]).sum(axis=(1, 2), keepdims=True) / np.maximum(weight, 1)
    filled = np.where(seen[..., None], colours, np.rint(mean)).astype(np.uint8)
    made, size = np.empty_like(colours), 0
    for first in range(0, len(colours), _STACK):
        views = filled[first : first + _STACK]
        shape = (32 * len(views), 32, 4)
        picture = np.full(shape, 255, np.uint8)
        picture[..., :3] = views.reshape(*shape[:2], 3)
        packed = _packed(name, picture)
        size += len(packed)
        decoded = np.asarray(imagecodecs.bcn_decode(packed, int(name[-1]), shape=shape))
        made[first : first + _STACK] = decoded[..., :3].reshape(views.shape)
    return made, size


def _packed(name: str, picture: NDArray[np.uint8]) -> bytes:
    """Blocks of an opaque picture (y, x, 4), at the encoders' best."""
    height, width, _ = picture.shape
    if name == "bc1":
        encoder = BC1Encoder(level=18, color_mode=BC1Encoder.ColorMode.FourColor)
        texture = RawTexture.frombytes(picture.tobytes(), width, height)
        return bytes(encoder.encode(texture).tobytes())
    asked = etcpak.BC7CompressBlockParams()
    asked.init_linear_weights()
    asked.m_uber_level, asked.m_max_partitions = 4, 64
    return etcpak.compress_bc7(picture.tobytes(), width, height, asked)
