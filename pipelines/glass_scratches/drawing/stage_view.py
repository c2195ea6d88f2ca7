"""The same glass on the stage: a shader that looks the scratch table up (section 3.3, Eq. 5).

What a frame of a game would show, without noise: what is seen is followed through the glass, bent
at each surface; what is reflected on the way is looked up in the environment. Scratches whose walls
scatter evenly are lit by a fixed number of lights drawn from the environment by its radiance; those
whose walls keep the lean show what lies along it. Lights behind the glass are seen through one more
face, parallel to the scratched one, and what light does that cannot leave there is not followed.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import luminance
from pipelines.drawing.glsl import Value, surface_shader
from pipelines.drawing.stage import Camera, Stage, surface, texture
from pipelines.geometry.triangle_tree import TREE_WIDTH, triangle_tree
from pipelines.glass_scratches.tables.bsdf_table import BsdfTable, coarser
from pipelines.light.environment_maps import solid_angles
from pipelines.light.environment_sampling import EnvironmentSampler, sample_directions

if TYPE_CHECKING:
    from pipelines.geometry.solids import Solid

MOST_LAYERS = 8
"""Two textures of four channels."""
LIGHTS = 64
TABLE_BINS = 64
"""Bins of the table a side, at most."""
EVENTS = 8
"""Surfaces that a ray through a pixel is followed to."""
_NEAREST = 1e-4
"""Least distance to the next of them, in a solid of radius 1."""
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

    ``coverage`` (L, R, R) and ``angles`` (L,) of the layers, L <= 8; ``table`` of the scratches;
    ``tile`` in scene units. Raises ValueError for more layers.
    """

    def __init__(
        self,
        solid: Solid,
        coverage: NDArray[np.float32],
        angles: NDArray[np.floating],
        table: BsdfTable,
        *,
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
        rho = coarser(table.rho, TABLE_BINS).astype(np.float32)
        tree = triangle_tree(self._corners.reshape(-1, 3, 3), shading.reshape(-1, 3, 3))
        self._maps = {
            "coverageA": np.ascontiguousarray(packed[..., :4]),
            "coverageB": np.ascontiguousarray(packed[..., 4:]),
            "table": np.ascontiguousarray(rho.reshape(-1, rho.shape[2])[::-1, :, None]),
        }
        self._trees = {
            "tree": np.ascontiguousarray(tree.nodes[::-1]),
            "corners": np.ascontiguousarray(tree.corners[::-1]),
        }
        self._constants: dict[str, Value] = {
            "LAYERS": len(angles),
            "ANGLES": [round(float(angle), 7) for angle in angles],
            "BINS": rho.shape[2] // 2,
            "LEANS": len(table.leans),
            "LEAN_VALUES": [float(lean) for lean in table.leans],
            "KEEPS": bool(table.keeps),
            "INDEX": float(table.refractive_index),
            "TILE": float(tile),
        }

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
            name: texture(
                values, wrap="repeat", mipmap=name.startswith("coverage"), anisotropic=False
            )
            for name, values in self._maps.items()
        }
        textures |= {
            name: texture(values, interpolate=False) for name, values in self._trees.items()
        }
        textures["sky"] = texture(image, wrap="clamp")
        textures["softSky"] = texture(soft_radiance(image), wrap="clamp")
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
                **self._constants,
                LIGHTS=lights.shape[1],
                EVENTS=EVENTS,
                NEAREST=_NEAREST,
                TREE_WIDTH=TREE_WIDTH,
                EYE=[round(float(value), 7) for value in position],
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


def soft_radiance(radiance: NDArray[np.floating]) -> NDArray[np.float32]:
    """An environment (H, 2 H, 3) with at most ``TABLE_BINS`` rows, each texel the mean of its own.

    >>> soft_radiance(np.ones((512, 1024, 3))).shape
    (64, 128, 3)
    """
    import cv2

    rows = min(len(radiance), TABLE_BINS)
    soft = cv2.resize(
        np.asarray(radiance, np.float32), (2 * rows, rows), interpolation=cv2.INTER_AREA
    )
    return np.asarray(soft, np.float32)


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
