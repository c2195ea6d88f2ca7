"""The fur on the stage: one mesh with all its shells, one texture, one draw call.

The photograph is uploaded once. Its alpha channel holds the depth code; a fragment of layer n is
shown or not by the layer's two numbers, which the shader computes from n (section 3.3). Nothing
is sent per layer or per frame.

A layer filled as the paper has it shows the *bands* of pixels between I(n-1) and I(n): from the
side these are thin slices that float one above the other. Filled in *columns*, the default, a
pixel also stands in every layer below its own, as a hair does, as dark as the medium makes it
down there: its colour times I(n) / I(own layer). From straight above both show the photograph.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.glsl import surface_shader
from pipelines.drawing.stage import Vector, Wrap, surface, texture
from pipelines.photo_fur.attenuation import Attenuation, Tails, code_steps, depth_code
from pipelines.photo_fur.photograph import FurPhotograph, fur_colours

Fill = Literal["columns", "bands"]
Look = Literal["full", "plain"]
"""Patches along the lie and light on hairs, or shells by texture coordinates."""
LIVE_SHADERS = ("fur_shell_vertex.glsl", "fur_shell_fragment.glsl")
"""Of vertices and fragments of shells that are lifted and lit by themselves."""


@dataclass(frozen=True)
class FurLight:
    """The light of shells that light themselves."""

    sky: float = 0.0
    """Radiance from everywhere."""
    headlight: float = 1.0
    """Radiance of the lamp along the view."""
    lamp: float = 0.0
    """Radiance of the other lamp."""
    light: Vector = (0.0, 0.0, 1.0)
    """Unit vector to it."""


def fur_texture(photograph: FurPhotograph, layers: int, *, tails: Tails) -> NDArray[np.uint8]:
    """The photograph as it is uploaded, (y, x, 4): 8-bit sRGB and the depth code in alpha."""
    code = depth_code(
        photograph.luminance,
        photograph.attenuation,
        layers,
        tails=tails,
        opaque=photograph.opaque,
    )
    return np.dstack([fur_colours(photograph), code])


def layers_with_hair(image: NDArray[np.uint8], layers: int) -> NDArray[np.int64]:
    """Numbers of the layers, from 1, down from the highest hair; image from ``fur_texture``.

    >>> image = np.full((2, 2, 4), 130, np.uint8)
    >>> layers_with_hair(image, 4).tolist()  # 63 codes a layer: 130 is in the third
    [3, 4]
    """
    highest = min(int(image[..., 3].min()) // code_steps(layers), layers - 1)
    return np.arange(highest + 1, layers + 1)


def fur_surface(
    shells: NDArray[np.float32],
    normals: NDArray[np.floating],
    triangles: NDArray[np.integer],
    uvs: NDArray[np.floating],
    image: NDArray[np.uint8],
    attenuation: Attenuation,
    *,
    fill: Fill,
    wrap: Wrap,
    interpolate: bool,
    lit: bool,
) -> Any:
    """All shells as one actor.

    shells (N, V, 3), tips first; normals (V, 3); triangles (F, 3); uvs (V, 2); image from
    ``fur_texture`` for the same N. Lambert shading where ``lit`` (section 3, results).
    """
    layers, count, _ = shells.shape
    drawn = layers_with_hair(image, layers)
    offsets = count * np.arange(len(drawn))[:, None, None]
    return surface(
        shells[drawn - 1].reshape(-1, 3),
        (triangles[None] + offsets).reshape(-1, 3),
        normals=np.tile(normals, (len(drawn), 1)),
        attributes={"uv": np.tile(uvs, (len(drawn), 1)), "layer": np.repeat(drawn, count)},
        textures={
            "photograph": texture(
                image, wrap=wrap, interpolate=interpolate, mipmap=False, srgb=True
            )
        },
        shader=surface_shader(
            "fur_vertex.glsl",
            "fur_fragment.glsl",
            CODE_STEPS=float(code_steps(layers)),
            COLUMNS=fill == "columns",
            DECAY=attenuation.coefficient / layers,
        ),
        lit=lit,
    )


def live_surface(
    skin: NDArray[np.float32],
    normals: NDArray[np.floating],
    triangles: NDArray[np.integer],
    uvs: NDArray[np.floating],
    image: NDArray[np.uint8],
    attenuation: Attenuation,
    *,
    layers: int,
    thickness: float,
    fill: Fill,
    light: FurLight,
) -> Any:
    """The fur as live views draw it, as one actor: the shader lifts the shells and lights them.

    skin (V, 3), its normals (V, 3), triangles (F, 3), uvs (V, 2); image from ``fur_texture`` for
    the same number of layers; thickness in units of the mesh.
    """
    count, drawn = len(skin), layers_with_hair(image, layers)
    offsets = count * np.arange(len(drawn))[:, None, None]
    return surface(
        np.tile(skin, (len(drawn), 1)),
        (triangles[None] + offsets).reshape(-1, 3),
        attributes={
            "uv": np.tile(uvs, (len(drawn), 1)),
            "outward": np.tile(normals, (len(drawn), 1)),
            "layer": np.repeat(drawn, count),
        },
        textures={"photograph": texture(image, wrap="mirrored", srgb=True)},
        shader=surface_shader(
            *LIVE_SHADERS,
            CODE_STEPS=float(code_steps(layers)),
            COLUMNS=fill == "columns",
            DECAY=attenuation.coefficient / layers,
            THICKNESS=float(thickness),
            LAYERS=float(layers),
            SKY=float(light.sky),
            HEADLIGHT=float(light.headlight),
            LAMP=float(light.lamp),
            LAMP_TOWARDS=light.light,
        ),
        lit=False,
    )
