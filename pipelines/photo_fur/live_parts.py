"""The fur as live views show it: settings, reference views, poster, and the shader of shells.

Live views lift the shells in their vertex shader, so that thickness and number of layers can be
changed while they draw; the stage has them lifted before. Both show the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import to_8bit
from pipelines.drawing.glsl import shader_source
from pipelines.drawing.stage import Camera, Light, Stage, Vector
from pipelines.photo_fur.attenuation import Tails
from pipelines.photo_fur.frames import BACKGROUND, ROUND_VIEWS, View, view_cameras
from pipelines.photo_fur.photograph import FurPhotograph
from pipelines.photo_fur.shells import ShellMesh, shell_vertices
from pipelines.photo_fur.stage_view import (
    LIVE_SHADERS,
    Fill,
    FurLight,
    fur_surface,
    fur_texture,
    live_surface,
)

SUPERSAMPLING = 2
_FINE = 4
"""Of bands: whether a sample of theirs is seen hangs on the last digit of a filtered depth."""
NIGHT = (0.012, 0.013, 0.016)
"""Linear radiance behind the fur of posters."""
LAMP = (-0.48, -0.6, 0.64)
"""Where the lamp of close pictures and of the poster is: to the left of the front, above."""
_SIDES = ("front", "right", "back", "left")
_POSTER_VIEW = View(-62.0, 24.0)
_CLOSE_VIEW = View(-70.0, 30.0)
_CLOSE = 0.42
_NEAR = 0.65
"""Distances of these pictures, in distances from which all is seen."""


@dataclass(frozen=True)
class FurLook:
    """What can be set of a fur."""

    layers: int
    fill: Fill
    light: FurLight
    thickness: float = 1.0
    """In thicknesses of the mesh's own fur."""


class ReferenceView(NamedTuple):
    """A frame of the stage, and from where."""

    name: str
    look: FurLook
    camera: Camera
    supersampling: int
    """Samples along each side of a pixel."""
    frame: NDArray[np.uint8]
    """(y, x, 3), sRGB."""


class FurScene:
    """A photograph of fur on a mesh, to be drawn in any look."""

    def __init__(self, photograph: FurPhotograph, mesh: ShellMesh, tails: Tails) -> None:
        self.photograph, self.mesh, self.tails = photograph, mesh, tails

    def frame(
        self,
        look: FurLook,
        camera: Camera,
        size: tuple[int, int],
        supersampling: int = SUPERSAMPLING,
    ) -> NDArray[np.uint8]:
        """A picture of size = (height, width) pixels, 8-bit sRGB, lit by the stage: without sky."""
        skin, height, width = self.mesh.vertices[-1], *size
        shells = shell_vertices(
            skin, self.mesh.normals, look.thickness * self.mesh.thickness, look.layers
        )
        image = fur_texture(self.photograph, look.layers, tails=self.tails)
        with Stage(width, height, background=BACKGROUND, supersampling=supersampling) as stage:
            stage.add(
                fur_surface(
                    shells,
                    self.mesh.normals,
                    self.mesh.triangles,
                    self.mesh.uvs,
                    image,
                    self.photograph.attenuation,
                    fill=look.fill,
                    wrap="mirrored",
                    interpolate=True,
                    lit=True,
                )
            )
            light = look.light
            stage.light(
                Light(colour=(light.headlight,) * 3), Light(light.light, colour=(light.lamp,) * 3)
            )
            stage.look(camera)
            return stage.frame()

    def cameras(self, views: Sequence[View], aspect: float) -> list[Camera]:
        """One camera a view, which has all of the fur in its picture."""
        return view_cameras(views, self.mesh.vertices.reshape(-1, 3), aspect)

    def reference_views(self, fill: Fill, size: tuple[int, int]) -> tuple[ReferenceView, ...]:
        """The four sides, a close one under the lamp, and one whose shells are others.

        size: (height, width) of the pictures, pixels.
        """
        height, width = size
        own = FurLook(self.mesh.layers, fill, FurLight(light=LAMP))
        aspect = width / height
        taken = [
            (name, own, camera, SUPERSAMPLING)
            for name, camera in zip(_SIDES, self.cameras(ROUND_VIEWS, aspect), strict=True)
        ]
        (whole,) = self.cameras([_CLOSE_VIEW], aspect)
        lit = FurLook(self.mesh.layers, fill, FurLight(headlight=0.4, lamp=0.9, light=LAMP))
        others = FurLook(max(2, self.mesh.layers // 2), _other(fill), own.light, thickness=1.6)
        taken.append(("close", lit, _nearer(whole, _CLOSE), SUPERSAMPLING))
        taken.append(("other_shells", others, _nearer(whole, _NEAR), _FINE))
        return tuple(
            ReferenceView(name, look, camera, samples, self.frame(look, camera, size, samples))
            for name, look, camera, samples in taken
        )

    def live_frame(
        self,
        look: FurLook,
        camera: Camera,
        size: tuple[int, int],
        background: Vector = NIGHT,
    ) -> NDArray[np.uint8]:
        """A picture of size = (height, width) pixels, 8-bit sRGB, as live views draw it."""
        mesh, (height, width) = self.mesh, size
        with Stage(width, height, background=background, supersampling=SUPERSAMPLING) as stage:
            stage.add(
                live_surface(
                    mesh.vertices[-1],
                    mesh.normals,
                    mesh.triangles,
                    mesh.uvs,
                    fur_texture(self.photograph, look.layers, tails=self.tails),
                    self.photograph.attenuation,
                    layers=look.layers,
                    thickness=look.thickness * mesh.thickness,
                    fill=look.fill,
                    light=look.light,
                )
            )
            stage.look(camera)
            return stage.frame()

    def poster(self, fill: Fill, size: tuple[int, int]) -> NDArray[np.uint8]:
        """What a live view shows at first, size = (height, width) pixels."""
        (camera,) = self.cameras([_POSTER_VIEW], size[1] / size[0])
        light = FurLight(sky=0.15, headlight=0.35, lamp=0.75, light=LAMP)
        return self.live_frame(FurLook(self.mesh.layers, fill, light), camera, size)


def luminance_part(photograph: FurPhotograph) -> NDArray[np.float32]:
    """Luminance (y, x), from which codes of any number of layers follow; transparent: -1."""
    opaque = True if photograph.opaque is None else photograph.opaque
    return np.where(opaque, photograph.luminance, -1.0).astype(np.float32)


def input_picture(photograph: FurPhotograph) -> NDArray[np.uint8]:
    """The photograph (y, x, 3), 8-bit sRGB, before the stage's background."""
    opaque = True if photograph.opaque is None else photograph.opaque[..., None]
    return to_8bit(np.where(opaque, photograph.radiance, BACKGROUND))


def shell_sources() -> tuple[str, str]:
    """GLSL of the vertices and of the fragments of shells, lifted and lit by themselves.

    Names in capitals are left to whoever compiles them.
    """
    vertex, fragment = LIVE_SHADERS
    return shader_source(vertex), shader_source(fragment)


def _other(fill: Fill) -> Fill:
    return "bands" if fill == "columns" else "columns"


def _nearer(camera: Camera, share: float) -> Camera:
    """A camera at a share of its distance to what it looks at."""
    x, y, z = (
        goal + share * (place - goal)
        for place, goal in zip(camera.position, camera.target, strict=True)
    )
    return Camera((x, y, z), camera.target, camera.up, camera.view_angle, camera.height)
