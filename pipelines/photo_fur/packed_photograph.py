"""A photograph of fur in few bytes: AVIF, from which its depths are read again.

Depth follows from brightness (Eq. 1), so nothing but the colours has to be stored.
"""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import decode_srgb, luminance, to_8bit
from pipelines.photo_fur.attenuation import Attenuation
from pipelines.photo_fur.photograph import FurPhotograph, fur_colours


def packed_photograph(photograph: FurPhotograph, quality: int) -> bytes:
    """An AVIF file of a photograph's 8-bit sRGB codes; quality: 0 to 100, as libavif has it."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(fur_colours(photograph)).save(file, "AVIF", quality=quality, speed=4)
    return file.getvalue()


def unpacked_photograph(
    content: bytes, attenuation: Attenuation, opaque: NDArray[np.bool_] | None
) -> FurPhotograph:
    """The photograph of an AVIF file, in the medium that was read from what it was made of.

    Raises ValueError for what is no AVIF file.
    """
    radiance = decode_srgb(_codes(content) / 255.0)
    return FurPhotograph(
        radiance.astype(np.float32), luminance(radiance).astype(np.float32), attenuation, opaque
    )


def photograph_psnr_db(
    content: bytes, radiance: NDArray[np.floating], opaque: NDArray[np.bool_] | None
) -> float:
    """Of an AVIF file against the photograph (y, x, 3) in linear light, in 8-bit codes, where there
    is fur. Raises ValueError for what is no AVIF file."""
    return _psnr_db(_codes(content), to_8bit(radiance), opaque)


def one_colour_psnr_db(radiance: NDArray[np.floating], opaque: NDArray[np.bool_] | None) -> float:
    """The same of the colour that is nearest to all of it: what knows nothing has so much."""
    codes = to_8bit(radiance).astype(np.float64)
    seen = codes.reshape(-1, 3) if opaque is None else codes[opaque]
    return _psnr_db(np.broadcast_to(seen.mean(axis=0), codes.shape), codes, opaque)


def _psnr_db(one: NDArray[Any], other: NDArray[Any], opaque: NDArray[np.bool_] | None) -> float:
    error = (one.astype(np.float64) - other) ** 2
    mean = float((error if opaque is None else error[opaque]).mean())
    return float(10 * np.log10(255**2 / max(mean, 1e-9)))


def _codes(content: bytes) -> NDArray[np.uint8]:
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(io.BytesIO(content), formats=["AVIF"]) as picture:
            return np.asarray(picture.convert("RGB"))
    except (UnidentifiedImageError, OSError, SyntaxError) as error:
        raise ValueError(f"photograph is {len(content)} bytes that are no AVIF file.") from error
