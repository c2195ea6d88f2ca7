"""ICC profiles: the colours of a picture with one, as linear RGB with the primaries of sRGB.

Little CMS converts, in floats. Most profiles of photographs are a curve for each channel and a
matrix: there the light of a pixel is the sum of its channels' light, which tables hold, many times
faster and as exact.
"""

from __future__ import annotations

import functools
import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from storage.readers.pictures.srgb_curve import srgb_of_light

_SPACES = {b"GRAY": ("gray", 1), b"RGB ": ("rgb", 3), b"CMYK": ("cmyk", 4)}
_NO_USE = (
    "The ICC profile is damaged or for another kind of picture and was left out: "
    "the colours were taken as {space}."
)
_INTENT = 1  # relative colorimetric: what both can show stays as it is
_BLOCK = 1 << 20  # pixels that are converted at a time


def without_profile(
    values: NDArray[Any], profile: bytes | None
) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Colours by their profile, and what is to be said.

    values: (height, width, 1, 3 or 4), grey, RGB or CMYK, unsigned integers or floats. What comes
    back are (height, width, 3) float32, linear, in [0, 1] for integers, 0 and more for floats; the
    values as they are where there is no profile, where it cannot be used, and where it says no more
    than is taken for granted: integers are codes of sRGB, floats are linear.
    """
    if not profile:
        return values, ()
    space, channels = _SPACES.get(profile[16:20], ("", 0))
    stored = values
    if channels == 3 and values.shape[2] == 1:  # grey with a profile for RGB
        stored = np.broadcast_to(values, (*values.shape[:2], 3))
    try:
        if stored.shape[2] != channels:
            raise ValueError("a profile for another number of channels")
        if channels < 4 and _says_nothing_new(profile, space, channels, values.dtype):
            return values, ()
        light = _light(stored, profile, space)
        name = _description(profile)
    except Exception:  # CmsError and others, by what is broken
        taken = "linear" if values.dtype.kind == "f" else "sRGB's"
        return values, (_NO_USE.format(space="inks" if values.shape[2] == 4 else taken),)
    most = np.inf if values.dtype.kind == "f" else 1
    outside = ((light < -0.002) | (light > most + 0.002)).any(axis=2)
    note = f"The colours were converted to sRGB from the ICC profile '{name}'"
    if outside.any():
        note += f"; {100 * outside.mean():.2g} % of the pixels lie outside of it and were clipped"
    return np.clip(light, 0, most, out=light), (f"{note}.",)


def _says_nothing_new(profile: bytes, space: str, channels: int, dtype: np.dtype[Any]) -> bool:
    """Whether codes stay what they are to two steps of 255.

    Asked of the profile's behaviour, as dozens of profiles with as many names are sRGB.
    """
    steps = np.linspace(0, 1, 18, dtype=np.float32)
    probe = np.stack(np.meshgrid(*[steps] * channels), axis=-1).reshape(18, -1, channels)
    found = srgb_of_light(_transformed(probe, profile, space))
    expected = srgb_of_light(probe) if dtype.kind == "f" else probe
    return bool(np.abs(found - expected).max() <= 2 / 255)


def _light(values: NDArray[Any], profile: bytes, space: str) -> NDArray[np.float32]:
    """(height, width, 3), not clipped."""
    if values.dtype.kind == "u" and values.dtype.itemsize <= 2 and values.shape[2] < 4:
        tables = _tables(profile, space, values.shape[2], values.dtype)
        if tables is not None:
            light = tables[0][values[..., 0]]
            for channel in range(1, values.shape[2]):
                light += tables[channel][values[..., channel]]
            return light
    light = np.empty((*values.shape[:2], 3), np.float32)
    rows = max(1, _BLOCK // values.shape[1])
    for top in range(0, values.shape[0], rows):
        block = slice(top, top + rows)
        light[block] = _transformed(np.ascontiguousarray(values[block]), profile, space)
    return light


def _tables(
    profile: bytes, space: str, channels: int, dtype: np.dtype[Any]
) -> NDArray[np.float32] | None:
    """(channels, codes, 3): the light of each channel's codes, where a pixel's is their sum; None
    where it is not."""
    codes = np.linspace(0, 1, np.iinfo(dtype).max + 1, dtype=np.float32)
    alone = np.zeros((channels, len(codes), channels), np.float32)
    for channel in range(channels):
        alone[channel, :, channel] = codes
    tables = _transformed(alone, profile, space)
    black = tables[0, 0].copy()
    tables[1:] -= black
    steps = np.linspace(0, len(codes) - 1, 6).astype(np.int64)
    places = np.stack(np.meshgrid(*[steps] * channels), axis=-1).reshape(1, -1, channels)
    together = _transformed(codes[places], profile, space)
    added = sum(tables[channel][places[..., channel]] for channel in range(channels))
    return tables if np.abs(added - together).max() < 1e-4 else None


def _transformed(values: NDArray[Any], profile: bytes, space: str) -> NDArray[np.float32]:
    """Linear RGB of (height, width, channels) by Little CMS."""
    import imagecodecs

    light = imagecodecs.cms_transform(
        values,
        profile,
        _linear_srgb(),
        colorspace=space,
        outcolorspace="rgb",
        outdtype="float32",
        intent=_INTENT,
    )
    return np.asarray(light, np.float32).reshape(*values.shape[:2], 3)


@functools.cache
def _linear_srgb() -> bytes:
    import imagecodecs

    profile: bytes = imagecodecs.cms_profile(
        "rgb",
        whitepoint=[0.3127, 0.3290, 1.0],
        primaries=[0.64, 0.33, 1.0, 0.30, 0.60, 1.0, 0.15, 0.06, 1.0],
        gamma=1.0,
    )
    return profile


def _description(profile: bytes) -> str:
    from PIL import ImageCms

    opened = ImageCms.ImageCmsProfile(io.BytesIO(profile))
    return " ".join(ImageCms.getProfileDescription(opened).split())[:60] or "without a name"
