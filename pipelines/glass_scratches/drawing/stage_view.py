"""The same glass on the stage: a shader that looks the scratch table up (section 3.3, Eq. 5).

What a frame of a game would show: one reflection and one refraction looked up in the environment,
and scratches lit by a fixed number of lights drawn from the environment by its radiance. No paths:
what is seen through the glass is not what the inside of the glass does.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import luminance
from pipelines.drawing.glsl import surface_shader
from pipelines.drawing.stage import Camera, Stage, surface, texture
from pipelines.glass_scratches.tables.fresnel import FresnelFactors
from pipelines.light.environment_maps import solid_angles
from pipelines.light.environment_sampling import EnvironmentSampler, sample_directions

if TYPE_CHECKING:
    from pipelines.geometry.solids import Solid

MOST_LAYERS = 8
"""Two textures of four channels."""
LIGHTS = 64
LAMP_EDGE = (math.cos(math.radians(2.5)), math.cos(math.radians(1.2)))
"""Cosines to the middle of a lamp between which its radiance rises from nothing to all."""
LAMP_COLOUR = (1.0, 0.82, 0.55)


class Lamp(NamedTuple):
    """A round lamp far away, beside the environment."""

    towards: tuple[float, float, float]
    """Unit vector from the glass to its middle."""
    strength: float
    """Its irradiance, where it falls straight, over the mean that the environment gives."""


class ScratchedActor:
    """A solid with its scratches on the stage, in one draw call.

    ``coverage`` (L, R, R) and ``angles`` (L,) of the layers, L <= 8; ``rho`` (M, M); ``lean`` and
    ``index`` of the glass; ``tile`` in scene units. Raises ValueError for more layers.
    """

    def __init__(
        self,
        solid: Solid,
        coverage: NDArray[np.float32],
        angles: NDArray[np.floating],
        rho: NDArray[np.floating],
        lean: FresnelFactors,
        *,
        index: float,
        tile: float,
    ) -> None:
        if len(coverage) > MOST_LAYERS:
            raise ValueError(
                f"there are {len(coverage)} layers; expected at most {MOST_LAYERS} on the stage."
            )
        self._corners, shading, facing = corners_apart(solid)
        self._attributes: dict[str, NDArray[Any]] = {"shading": shading, "facing": facing}
        filled = np.zeros((MOST_LAYERS, *coverage.shape[1:]), np.float32)
        filled[: len(coverage)] = coverage
        packed = np.moveaxis(filled[:, ::-1], 0, -1)  # a texture's row 0 is its top
        self._maps = {
            "coverageA": np.ascontiguousarray(packed[..., :4]),
            "coverageB": np.ascontiguousarray(packed[..., 4:]),
            "table": np.ascontiguousarray(rho.astype(np.float32)[::-1, :, None]),
            "leaning": np.stack([lean.factor[0], lean.gamma, lean.gamma], axis=-1).astype(
                np.float32
            )[None],
        }
        self._angles = [round(float(angle), 7) for angle in angles]
        self._index, self._tile = index, tile

    def actor(
        self, environment: EnvironmentSampler, camera: Camera, lamp: Lamp | None = None
    ) -> Any:
        """The actor as this camera sees it in this environment, with a lamp beside it."""
        lights, through = environment_lights(environment)
        glow = lamp_radiance(lamp, environment) if lamp else np.zeros(3)
        if lamp:
            lights = np.concatenate([lights, _lamp_light(lamp, glow)], axis=1)
        position = np.asarray(camera.position)
        if camera.height is not None:  # far enough away to be parallel
            position = np.asarray(camera.target) + 1e4 * (position - np.asarray(camera.target))
        image = np.ascontiguousarray(environment.radiance)
        textures = {
            name: texture(values, wrap="repeat", mipmap=name.startswith("coverage"))
            for name, values in self._maps.items()
        }
        textures["sky"] = texture(image, wrap="clamp")
        # A texture's rows count from the bottom: the picture's last row is row 0 there.
        rows = np.ascontiguousarray(lights[::-1])
        textures["lights"] = texture(rows, wrap="clamp", interpolate=False)
        return surface(
            self._corners,
            np.arange(len(self._corners)).reshape(-1, 3),
            attributes=self._attributes,
            textures=textures,
            shader=surface_shader(
                "scratched_glass_vertex.glsl",
                "scratched_glass_fragment.glsl",
                LAYERS=len(self._angles),
                ANGLES=self._angles,
                LIGHTS=lights.shape[1],
                EYE=[round(float(value), 7) for value in position],
                RELATIVE_INDEX=1.0 / self._index,
                BASE_REFLECTANCE=((self._index - 1) / (self._index + 1)) ** 2,
                TILE=float(self._tile),
                THROUGH=through,
                TO_SKY=np.eye(3).ravel().tolist(),
                BRIGHTNESS=1.0,
                LAMP=list(lamp.towards if lamp else (0.0, 0.0, 1.0)),
                LAMP_EDGE=list(LAMP_EDGE),
                LAMP_RADIANCE=glow.tolist(),
                COVERED_A=[1.0] * 4,
                COVERED_B=[1.0] * 4,
                STRENGTH=1.0,
            ),
            lit=False,
        )


def draw_scratched(
    actor: ScratchedActor,
    environment: EnvironmentSampler,
    camera: Camera,
    *,
    width: int,
    height: int,
    supersampling: int,
    lamp: Lamp | None = None,
) -> NDArray[np.float32]:
    """Linear radiance and coverage (height, width, 4) of the object in its environment.

    A ``lamp`` shows on and in the glass, not behind it.
    """
    with Stage(
        width, height, background=np.asarray(environment.radiance), supersampling=supersampling
    ) as stage:
        stage.add(actor.actor(environment, camera, lamp))
        stage.look(camera)
        return stage.radiance()


def corners_apart(
    solid: Solid,
) -> tuple[NDArray[np.float64], NDArray[np.float32], NDArray[np.float64]]:
    """Corners of the triangles, each for itself, (3 F, 3): places, shading normals, and normals of
    their triangles."""
    corners = np.asarray(solid.vertices)[solid.triangles]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    shading = np.asarray(solid.corner_normals).reshape(-1, 3)
    return corners.reshape(-1, 3), shading, np.repeat(facing, 3, axis=0)


def environment_lights(environment: EnvironmentSampler) -> tuple[NDArray[np.float32], float]:
    """Lights drawn from the environment, (2, LIGHTS, 3): their power, radiance times steradians,
    and unit vectors to them; and the mean radiance all around, which stands for what comes through
    the glass."""
    from pipelines.light.environment_lookup import radiance_from_directions

    index = np.arange(LIGHTS)
    u = np.stack([(index + 0.5) / LIGHTS, (index * 0.6180339887498949) % 1.0], axis=-1)
    towards, density = sample_directions(environment, u)
    power = radiance_from_directions(environment.radiance, towards) / (density * LIGHTS)[:, None]
    through = float(power.mean(axis=1).sum() / (4 * np.pi))
    return np.stack([power, towards]).astype(np.float32), through


def lamp_radiance(lamp: Lamp, environment: EnvironmentSampler) -> NDArray[np.float64]:
    """Radiance (3,) of a lamp in an environment."""
    bright = luminance(environment.radiance.astype(np.float64))
    mean = float(np.sum(bright * solid_angles(len(bright))[:, None])) / (4 * np.pi)
    colour = np.array(LAMP_COLOUR)
    return lamp.strength * np.pi * mean / _lamp_steradians() * colour / luminance(colour)


def _lamp_light(lamp: Lamp, radiance: NDArray[np.float64]) -> NDArray[np.float32]:
    """A lamp as one more light, (2, 1, 3)."""
    light = np.stack([radiance * _lamp_steradians(), np.array(lamp.towards)])
    return light[:, None].astype(np.float32)


def _lamp_steradians() -> float:
    """Those of a lamp of even radiance that gives the same light."""
    return np.pi * (2.0 - LAMP_EDGE[0] - LAMP_EDGE[1])
