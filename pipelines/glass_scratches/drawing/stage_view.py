"""The same glass on the stage: a shader that looks the scratch table up (section 3.3, Eq. 5).

What a frame of a game would show: one reflection and one refraction looked up in the environment,
and scratches lit by a fixed number of lights drawn from the environment by its radiance. No paths:
what is seen through the glass is not what the inside of the glass does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.stage import Camera, Shader, Stage, surface, texture
from pipelines.glass_scratches.tables.scratch_table import Lean
from pipelines.light.environment_sampling import EnvironmentSampler, sample_directions

if TYPE_CHECKING:
    from pipelines.geometry.solids import Solid

MOST_LAYERS = 8
"""Two textures of four channels."""
LIGHTS = 64

_VERTEX = {
    "Normal::Dec": "in vec3 shading; in vec3 facing; out vec3 shadingOut; flat out vec3 facingOut;"
    " out vec3 placeOut;",
    "Normal::Impl": "shadingOut = shading; facingOut = facing; placeOut = vertexMC.xyz;",
}


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
        lean: Lean,
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
        self._angles = [float(angle) for angle in angles]
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
            shader=Shader(_VERTEX, self._fragment(position, through)),
            lit=False,
        )

    def _fragment(self, position: NDArray[np.float64], through: float) -> dict[str, str]:
        count = len(self._angles)
        angles = ", ".join(f"{angle:.7f}" for angle in self._angles)
        place = ", ".join(f"{value:.7f}" for value in position)
        return {
            "Normal::Dec": f"""
in vec3 shadingOut; flat in vec3 facingOut; in vec3 placeOut;
const float PI = 3.14159265;
const float directions[{count}] = float[{count}]({angles});
// A macro: the textures are declared further down.
#define SKY_AT(d) \\
  textureLod(sky, vec2(0.5 - atan((d).y, (d).x) / (2.0 * PI), 0.5 + asin((d).z) / PI), 0.0).rgb
float angleOf(vec3 d, vec3 across, vec3 up) {{
  return atan(dot(d, across), max(dot(d, up), 0.0)) / PI + 0.5;
}}
""",
            "Color::Impl": f"""//VTK::Color::Impl
  vec3 view = normalize(vec3({place}) - placeOut);
  vec3 normal = normalize(shadingOut);
  if (dot(normal, view) * dot(facingOut, view) < 0.0) normal = facingOut;
  float side = dot(normal, view) > 0.0 ? 1.0 : -1.0;
  normal *= side;
  float cosine = clamp(dot(normal, view), 0.0, 1.0);
  float base = {((self._index - 1) / (self._index + 1)) ** 2!r};
  float mirrored = base + (1.0 - base) * pow(1.0 - cosine, 5.0);
  vec3 bent = refract(-view, normal, {1.0 / self._index!r});
  vec3 straight = normalize(mix(bent, -view, 0.5));
  vec3 back = reflect(-view, normal);
  vec3 seen = mix(SKY_AT(straight), SKY_AT(back), mirrored);

  vec3 share = pow(abs(facingOut), vec3(4.0));
  share /= share.x + share.y + share.z;
  vec3 scattered = vec3(0.0);
  float covered = 0.0, uncovered = 1.0;
  for (int axis = 0; axis < 3; axis++) {{
    if (share[axis] < 0.01) continue;
    int one = (axis + 1) % 3, two = (axis + 2) % 3;
    float up = facingOut[axis] > 0.0 ? 1.0 : 0.0;
    vec2 uv = vec2(placeOut[one] / {self._tile!r} + 0.37 * float(axis) + 0.11 * up,
                   placeOut[two] / {self._tile!r} + 0.61 * float(axis) + 0.23 * up);
    vec4 here[2] = vec4[2](texture(coverageA, uv), texture(coverageB, uv));
    for (int layer = 0; layer < {count}; layer++) {{
      float part = here[layer / 4][layer % 4] * share[axis];
      if (part < 0.002) continue;
      vec3 along = vec3(0.0);
      along[one] = cos(directions[layer]);
      along[two] = sin(directions[layer]);
      along = normalize(along - dot(along, normal) * normal);
      vec3 across = cross(normal, along);
      float row = angleOf(view, across, normal);
      vec2 leant = texture(leaning, vec2(row, 0.5)).rg;
      float theta = asin(clamp(abs(dot(view, along)), 0.0, 1.0));
      float lean = pow(2.0 * theta / PI, leant.g);
      float factor = lean + (1.0 - lean) * leant.r;
      vec3 lit = vec3(0.0);
      for (int n = 0; n < {LIGHTS}; n++) {{
        vec3 towards = texelFetch(lights, ivec2(n, 1), 0).xyz;
        float falling = dot(towards, normal);
        if (falling <= 0.0) continue;
        vec3 power = texelFetch(lights, ivec2(n, 0), 0).rgb;
        float rho = texture(table, vec2(angleOf(towards, across, normal), row)).r;
        lit += power * rho * falling;
      }}
      lit *= 2.0 / (PI * PI) * factor;
      scattered += part * (lit + (1.0 - factor) * vec3({through!r}));
      covered += part;
      uncovered *= 1.0 - part;
    }}
  }}
  if (covered > 0.0) seen = uncovered * seen + (1.0 - uncovered) * scattered / covered;
  ambientColor = seen;
  diffuseColor = vec3(0.0);
""",
        }


def draw(
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
