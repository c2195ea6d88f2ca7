"""The fur as live views show it: settings, reference views, poster, and the shader of shells.

Live views lift the shells in their vertex shader, so that thickness and number of layers can be
changed while they draw. Of the plain look the stage has them lifted before; both show the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import to_8bit
from pipelines.drawing.glsl import shader_source
from pipelines.drawing.stage import Camera, Light, Stage, Vector
from pipelines.photo_fur.attenuation import Tails
from pipelines.photo_fur.frames import BACKGROUND, ROUND_VIEWS, View, view_cameras
from pipelines.photo_fur.laid_fur import (
    CALM,
    LAID_SHADERS,
    LaidFur,
    Wind,
    laid_surface,
    rows_of_fur,
    shells_seen,
)
from pipelines.photo_fur.photograph import FurPhotograph
from pipelines.photo_fur.shells import ShellMesh, shell_vertices
from pipelines.photo_fur.stage_view import (
    LIVE_SHADERS,
    Fill,
    FurLight,
    Look,
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
OUTDOORS = FurLight(sky=0.15, headlight=0.35, lamp=0.75, light=LAMP)
"""Light of live views at first."""
_SIDES = ("front", "right", "back", "left")
_POSTER_VIEW = View(-62.0, 24.0)
_CLOSE_VIEW = View(-70.0, 30.0)
_CLOSE = 0.42
_NEAR = 0.65
_FAR = 6.0
"""Distances of these pictures, in distances from which all is seen."""


@dataclass(frozen=True)
class FurLook:
    """What can be set of a fur."""

    layers: int
    """Of the plain look, as is the fill; of the full one there are as many shells as are seen."""
    fill: Fill
    light: FurLight
    thickness: float = 1.0
    """In thicknesses of the mesh's own fur."""
    look: Look = "plain"
    wind: Wind = CALM
    """Of the full look."""


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

    def __init__(
        self, photograph: FurPhotograph, mesh: ShellMesh, fur: LaidFur, tails: Tails
    ) -> None:
        """mesh: for the plain look; fur: the photograph laid over it, for the full one."""
        self.photograph, self.mesh, self.fur, self.tails = photograph, mesh, fur, tails

    def frame(
        self,
        look: FurLook,
        camera: Camera,
        size: tuple[int, int],
        supersampling: int = SUPERSAMPLING,
    ) -> NDArray[np.uint8]:
        """A picture of size = (height, width) pixels, 8-bit sRGB; the plain look has no sky."""
        height, width = size
        with Stage(width, height, background=BACKGROUND, supersampling=supersampling) as stage:
            if look.look == "full":
                stage.add(self._laid(look, camera, height * supersampling))
            else:
                stage.add(self._plain(look))
            light = look.light
            stage.light(
                Light(colour=(light.headlight,) * 3), Light(light.light, colour=(light.lamp,) * 3)
            )
            stage.look(camera)
            return stage.frame()

    def _plain(self, look: FurLook) -> Any:
        """The actor, lit by the stage."""
        mesh = self.mesh
        thickness = look.thickness * mesh.thickness
        return fur_surface(
            shell_vertices(mesh.vertices[-1], mesh.normals, thickness, look.layers),
            mesh.normals,
            mesh.triangles,
            mesh.uvs,
            fur_texture(self.photograph, look.layers, tails=self.tails),
            self.photograph.attenuation,
            fill=look.fill,
            wrap="mirrored",
            interpolate=True,
            lit=True,
        )

    def _laid(self, look: FurLook, camera: Camera, height: int) -> Any:
        """The actor, with as many shells as a picture of so many rows of samples shows."""
        fur = self.fur._replace(thickness=look.thickness * self.fur.thickness)
        rows = rows_of_fur(camera, self.mesh.vertices[-1], fur.thickness, height)
        return laid_surface(
            fur,
            fur_texture(self.photograph, fur.layers, tails=self.tails),
            self.photograph.attenuation,
            look.light,
            wind=look.wind,
            shells=shells_seen(rows),
        )

    def cameras(self, views: Sequence[View], aspect: float) -> list[Camera]:
        """One camera a view, which has all of the fur in its picture."""
        return view_cameras(views, self.mesh.vertices.reshape(-1, 3), aspect)

    def reference_views(
        self, look: Look, fill: Fill, size: tuple[int, int]
    ) -> tuple[ReferenceView, ...]:
        """The four sides and a close one under the lamp, then each look, in wind and from afar, and
        plain with other shells.

        size: (height, width) of the pictures, pixels.
        """
        light = FurLight(light=LAMP)
        plain = FurLook(self.mesh.layers, fill, light)
        own = replace(plain, look=look)
        lit = replace(own, light=FurLight(headlight=0.4, lamp=0.9, light=LAMP))
        full = replace(plain, look="full", light=OUTDOORS)
        others = replace(
            plain, layers=max(2, self.mesh.layers // 2), fill=_other(fill), thickness=1.6
        )
        (whole,) = self.cameras([_CLOSE_VIEW], size[1] / size[0])
        sides = self.cameras(ROUND_VIEWS, size[1] / size[0])
        close, near, far = (nearer(whole, share) for share in (_CLOSE, _NEAR, _FAR))
        taken = [
            *((name, own, camera) for name, camera in zip(_SIDES, sides, strict=True)),
            ("close", lit, close),
            ("full", full, near),
            ("wind", replace(full, wind=Wind(0.8, 1.3)), near),
            ("far", full, far),
            ("plain", plain, near),
            ("other_shells", others, near),
        ]
        return tuple(
            ReferenceView(name, each, camera, samples, self.frame(each, camera, size, samples))
            for name, each, camera in taken
            for samples in (_FINE if each.fill == "bands" else SUPERSAMPLING,)
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
            if look.look == "full":
                stage.add(self._laid(look, camera, height * SUPERSAMPLING))
            else:
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

    def poster(self, look: Look, fill: Fill, size: tuple[int, int]) -> NDArray[np.uint8]:
        """What a live view shows at first, size = (height, width) pixels."""
        (camera,) = self.cameras([_POSTER_VIEW], size[1] / size[0])
        return self.live_frame(FurLook(self.mesh.layers, fill, OUTDOORS, look=look), camera, size)


def input_picture(photograph: FurPhotograph) -> NDArray[np.uint8]:
    """The photograph (y, x, 3), 8-bit sRGB, before the stage's background."""
    opaque = True if photograph.opaque is None else photograph.opaque[..., None]
    return to_8bit(np.where(opaque, photograph.radiance, BACKGROUND))


def shell_sources(look: Look) -> tuple[str, str]:
    """GLSL of the vertices and of the fragments of shells, lifted and lit by themselves.

    Names in capitals are left to whoever compiles them.
    """
    vertex, fragment = LAID_SHADERS if look == "full" else LIVE_SHADERS
    return shader_source(vertex), shader_source(fragment)


def _other(fill: Fill) -> Fill:
    return "bands" if fill == "columns" else "columns"


def nearer(camera: Camera, share: float) -> Camera:
    """A camera at a share of its distance to what it looks at."""
    x, y, z = (
        goal + share * (place - goal)
        for place, goal in zip(camera.position, camera.target, strict=True)
    )
    return Camera((x, y, z), camera.target, camera.up, camera.view_angle, camera.height)
