"""The same glass on the stage: a shader that looks the scratch table up (section 3.3, Eq. 5).

What a frame of a game would show: one reflection and one refraction looked up in the environment,
and scratches lit by a fixed number of lights drawn from the environment by its radiance. No paths:
what is seen through the glass is not what the inside of the glass does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.glsl import surface_shader
from pipelines.drawing.stage import Camera, Stage, surface, texture
from pipelines.glass_scratches.tables.fresnel import FresnelFactors
from pipelines.light.environment_sampling import EnvironmentSampler, sample_directions

if TYPE_CHECKING:
    from pipelines.geometry.solids import Solid

MOST_LAYERS = 8
"""Two textures of four channels."""
LIGHTS = 64


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
        corners = np.asarray(solid.vertices)[solid.triangles]
        facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        facing /= np.linalg.norm(facing, axis=1, keepdims=True)
        self._corners = corners.reshape(-1, 3)
        self._attributes: dict[str, NDArray[Any]] = {
            "shading": np.asarray(solid.corner_normals).reshape(-1, 3),
            "facing": np.repeat(facing, 3, axis=0),
        }
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

    def actor(self, environment: EnvironmentSampler, camera: Camera) -> Any:
        """The actor as this camera sees it in this environment."""
        lights, through = _lights(environment)
        position = np.asarray(camera.position)
        if camera.height is not None:  # far enough away to be parallel
            position = np.asarray(camera.target) + 1e4 * (position - np.asarray(camera.target))
        image = np.ascontiguousarray(environment.radiance)
        textures = {
            name: texture(values, wrap="repeat", mipmap=name.startswith("coverage"))
            for name, values in self._maps.items()
        }
        textures["sky"] = texture(image, wrap="clamp")
        textures["lights"] = texture(lights, wrap="clamp", interpolate=False)
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
                LIGHTS=LIGHTS,
                EYE=[round(float(value), 7) for value in position],
                RELATIVE_INDEX=1.0 / self._index,
                BASE_REFLECTANCE=((self._index - 1) / (self._index + 1)) ** 2,
                TILE=float(self._tile),
                THROUGH=through,
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
) -> NDArray[np.float32]:
    """Linear radiance and coverage (height, width, 4) of the object in its environment."""
    with Stage(
        width, height, background=np.asarray(environment.radiance), supersampling=supersampling
    ) as stage:
        stage.add(actor.actor(environment, camera))
        stage.look(camera)
        return stage.radiance()


def _lights(environment: EnvironmentSampler) -> tuple[NDArray[np.float32], float]:
    """Lights drawn from the environment as a picture of two rows (power; direction), row 0 on top,
    and the mean radiance all around, which stands for what comes through the glass."""
    from pipelines.light.environment_lookup import radiance_from_directions

    index = np.arange(LIGHTS)
    u = np.stack([(index + 0.5) / LIGHTS, (index * 0.6180339887498949) % 1.0], axis=-1)
    towards, density = sample_directions(environment, u)
    power = radiance_from_directions(environment.radiance, towards) / (density * LIGHTS)[:, None]
    # texelFetch counts rows from the bottom of the texture: row 1 of the picture is row 0 there.
    rows = np.stack([towards, power]).astype(np.float32)
    return np.ascontiguousarray(rows), float(power.mean(axis=1).sum() / (4 * np.pi))
