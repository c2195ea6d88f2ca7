"""What a textured square must look like: its picture's colours, looked up by hand.

The picture has four quarters of one colour each, so that what is read is known wherever one looks:
upper left red, upper right green, lower left blue, lower right grey. Far from their borders nothing
depends on how texels are mixed.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Place = tuple[float, float]

QUARTERS = np.array([[[200, 30, 20], [40, 180, 60]], [[25, 45, 210], [128, 128, 128]]], np.uint8)
"""sRGB codes (2, 2, 3), the upper row first."""
RED, GREEN, BLUE, GREY = QUARTERS.reshape(4, 3)
CORNERS: Mapping[Place, NDArray[np.uint8]] = {
    (0.25, 0.75): RED,
    (0.75, 0.75): GREEN,
    (0.25, 0.25): BLUE,
    (0.75, 0.25): GREY,
}
"""What a square [0, 1] x [0, 1] shows whose texture coordinates are its positions."""
MIDDLE = (128, 128, 255)
"""Codes of the normal that does not bend."""


def picture(side: int = 16, quarters: NDArray[np.uint8] = QUARTERS) -> Image.Image:
    """The four quarters."""
    return Image.fromarray(quarters.repeat(side // 2, axis=0).repeat(side // 2, axis=1))


def plain(colour: Any, side: int = 8) -> Image.Image:
    """A picture of one colour."""
    return Image.fromarray(np.full((side, side, 3), colour, np.uint8))


def encoded(image: Image.Image, form: str = "PNG", **options: Any) -> bytes:
    """A picture file's bytes."""
    stream = io.BytesIO()
    image.save(stream, form, **options)
    return stream.getvalue()


def linear(codes: Any) -> NDArray[np.float64]:
    """Of sRGB codes (IEC 61966-2-1)."""
    shares = np.asarray(codes, np.float64) / 255
    found: NDArray[np.float64] = np.where(
        shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4
    )
    return found


class Seen:
    """What is at one place of a scene that was read and that lies in the plane z = 0."""

    def __init__(self, scene: Any, place: Place) -> None:
        for row, corners in enumerate(scene.vertices[scene.triangles][..., :2]):
            weights = np.linalg.solve(np.vstack([corners.T, np.ones(3)]), [*place, 1.0])
            if weights.min() >= -1e-6:
                self._row, self._weights = row, weights
                break
        self._scene = scene
        self.material = scene.materials[scene.part[self._row]]

    def codes(self, kind: str) -> NDArray[np.uint8] | None:
        """Of a texture: "colour", "surface" or "normal"; None where there is none."""
        texture = getattr(self.material.varying, kind, None)
        if texture is None:
            return None
        uv = self._weights @ self._scene.uvs[self._row, :, texture.mapping]
        height, width = texture.texels.shape[:2]
        column, row = (
            _wrapped(int(np.floor(share * count)), count, wrap)
            for share, count, wrap in zip(
                (uv[0], 1 - uv[1]), (width, height), texture.wrap, strict=True
            )
        )
        found: NDArray[np.uint8] = texture.texels[row, column]
        return found

    def base(self) -> NDArray[np.float64]:
        """The base colour, linear."""
        made = self.material.varying
        if made is None:
            return np.array(self.material.albedo)
        codes = self.codes("colour")
        colours = self._weights @ self._scene.colours[self._row]
        return np.array(made.base) * colours * (1.0 if codes is None else linear(codes))

    def share(self, channel: int) -> float:
        """Of the surface's texture: 0 specular, 1 roughness, 2 metal; 1 where there is none."""
        codes = self.codes("surface")
        return 1.0 if codes is None else float(codes[channel]) / 255


def _wrapped(number: int, count: int, wrap: str) -> int:
    if wrap == "clamp":
        return min(max(number, 0), count - 1)
    if wrap == "repeat":
        return number % count
    number %= 2 * count
    return number if number < count else 2 * count - 1 - number


def shows(
    expected: Mapping[Place, Any] = CORNERS, times: Any = 1.0, within: float = 0.01
) -> Callable[[Any], bool]:
    """Whether a scene has these colours, sRGB codes, at these places, times a factor."""

    def is_right(scene: Any) -> bool:
        return all(
            np.allclose(Seen(scene, place).base(), linear(codes) * times, atol=within)
            for place, codes in expected.items()
        )

    return is_right


def is_everywhere(colour: Any, within: float = 0.01) -> Callable[[Any], bool]:
    """Whether a scene has a linear base colour at all corners of the square."""

    def is_right(scene: Any) -> bool:
        return all(np.allclose(Seen(scene, at).base(), colour, atol=within) for at in CORNERS)

    return is_right


def has(**fields: Any) -> Callable[[Any], bool]:
    """Whether the first material has these values: fields of it or of what varies on it."""

    def is_right(scene: Any) -> bool:
        material = scene.materials[0]
        return all(
            np.allclose(
                getattr(material, name)
                if hasattr(material, name)
                else getattr(material.varying, name),
                value,
                atol=1e-3,
            )
            for name, value in fields.items()
        )

    return is_right


def both(*checks: Callable[[Any], bool]) -> Callable[[Any], bool]:
    """All of some."""
    return lambda scene: all(check(scene) for check in checks)
