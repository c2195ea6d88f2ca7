"""Photographs of the built-in city: linear radiance, depth, and which pixels show thin poles.

Matt surfaces reflect what of the sky their vertices see (``City.sky_visibility``) and a constant
share of the rest. Panes and paint add what they mirror, the sky, the houses across the street or
the road, by Schlick's approximation of Fresnel's reflectance.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import TracebackType
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.glsl import surface_shader
from pipelines.drawing.stage import Camera, Stage, surface, texture
from pipelines.virtual.city.bend import headings, straightened_points, turned_vectors
from pipelines.virtual.city.city import City
from pipelines.virtual.city.materials import city_textures
from pipelines.virtual.city.parts import MATERIALS, POSTERS
from pipelines.virtual.city.reflections import shader_values, street_elevations
from pipelines.virtual.city.sky import overcast_sky

_CHUNK = 20.0
"""Metres of road to an actor."""
_FARTHEST = 600.0
"""Metres ahead that are drawn, where the street is longer."""
_SKY = np.array([1.30, 1.37, 1.46], np.float32)
"""Light of the whole sky. It is drawn darker than that, as if exposed for the street."""
_BOUNCE = np.array([0.36, 0.345, 0.33], np.float32)
_UNSTAINED = tuple(MATERIALS.index(name) for name in (*POSTERS, "page", "interior", "shop"))
_SHARPER = -0.75
"""Bias of the level of mipmaps: isotropic ones are too blurred along the road."""


class Shot(NamedTuple):
    """What a camera sees; row 0 at the top."""

    radiance: NDArray[np.float32]
    """(h, w, 3), linear."""
    depth: NDArray[np.float32]
    """(h, w), metres along the axis at the pixel's middle, inf: sky; (0, 0) without labels."""
    pole: NDArray[np.bool_]
    """(h, w), a thin pole is at the pixel's middle; (0, 0) without labels."""


class CityStage:
    """A city on a stage, for pictures of width x height pixels; use it as a context manager.

    photographs: as for ``city_textures``. Raises NoGraphicsError, and ValueError where a photograph
    is missing.
    """

    def __init__(
        self,
        city: City,
        photographs: Mapping[str, NDArray[np.uint8]],
        width: int,
        height: int,
        supersampling: int = 2,
    ) -> None:
        self.width, self.height = width, height
        self._city = city
        images = city_textures(photographs)
        sky = overcast_sky(256)
        self._stage = Stage(width, height, background=sky, supersampling=supersampling)
        self._label_stage: Stage | None = None
        self._drawn = _Chunks(city, city.material * 2 + _glossy(city))
        textures = {name: _repeated(image) for name, image in images.items()}
        light = city.sky_visibility[:, None] * (_SKY - _BOUNCE) + _BOUNCE
        straight, turns = _straightened(city)
        elevations = street_elevations(straight, light)
        mirrored = {"elevations": texture(elevations.picture), "sky": texture(sky)}
        self._eyes: list[Any] = []
        for part in self._drawn.parts:
            material, has_gloss = divmod(part.kind, 2)
            attributes = {"uv": city.uvs, "lit": city.tint * light}
            samplers = {"picture": textures[MATERIALS[material]], "stains": textures["stains"]}
            if has_gloss:
                attributes |= {"shading": city.normals, "gloss": city.gloss}
                if city.bend.angle:
                    attributes |= {"straight": straight.vertices, "turn": turns}
                samplers |= mirrored
            actor = surface(
                city.vertices[part.vertices],
                part.triangles,
                attributes={name: values[part.vertices] for name, values in attributes.items()},
                textures=samplers,
                shader=surface_shader(
                    "city_vertex.glsl",
                    "city_fragment.glsl",
                    GLOSS=bool(has_gloss),
                    BENT=bool(city.bend.angle),
                    STAINED=material not in _UNSTAINED,
                    LEVEL_BIAS=_SHARPER,
                    **shader_values(elevations),
                ),
                lit=False,
            )
            actor.GetProperty().BackfaceCullingOn()
            part.actor = actor
            if has_gloss:
                self._eyes.append(actor.GetShaderProperty().GetFragmentCustomUniforms())
                self._eyes[-1].SetUniform3f("eye", [0.0, 0.0, 0.0])
            self._stage.add(actor)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stage.__exit__(kind, error, trace)
        if self._label_stage is not None:
            self._label_stage.__exit__(kind, error, trace)

    def shoot(
        self,
        intrinsics: NDArray[np.float64],
        to_world: NDArray[np.float64],
        *,
        labels: bool = False,
    ) -> Shot:
        """The city from a camera with intrinsics (3, 3) at to_world (4, 4) (``cameras``).

        Raises ValueError unless pixels are square and the principal point is in the middle of the
        picture.
        """
        camera = self._camera(intrinsics, to_world)
        eye = to_world[:3, 3]
        self._drawn.show_ahead(eye[0], to_world[0, 2])
        for uniforms in self._eyes:
            uniforms.SetUniform3f("eye", [float(value) for value in eye])
        self._stage.look(camera)
        radiance = self._stage.radiance()[..., :3]
        depth, pole = np.zeros((0, 0), np.float32), np.zeros((0, 0), np.bool_)
        if labels:
            if self._label_stage is None:
                self._label_stage, self._labelled = self._labels()
            self._labelled.show_ahead(eye[0], to_world[0, 2])
            self._label_stage.look(camera)
            pole = self._label_stage.radiance()[..., 0] > 0.5
            depth = self._label_stage.depth()
        return Shot(radiance, depth, pole)

    def _labels(self) -> tuple[Stage, _Chunks]:
        """The city with poles white and all else black, a sample to a pixel's middle."""
        stage = Stage(self.width, self.height)
        chunks = _Chunks(self._city, self._city.pole.astype(np.int32))
        for part in chunks.parts:
            white = float(part.kind)
            points = self._city.vertices[part.vertices]
            part.actor = surface(points, part.triangles, colour=(white, white, white), lit=False)
            part.actor.GetProperty().BackfaceCullingOn()
            stage.add(part.actor)
        return stage, chunks

    def _camera(self, intrinsics: NDArray[np.float64], to_world: NDArray[np.float64]) -> Camera:
        focal = float(intrinsics[1, 1])
        middle = [(self.width - 1) / 2, (self.height - 1) / 2]
        if not np.isclose(intrinsics[0, 0], focal) or not np.allclose(
            intrinsics[:2, 2], middle, atol=1e-3
        ):
            raise ValueError(
                f"intrinsics: found focal lengths {intrinsics[0, 0]}, {focal} and the principal "
                f"point {intrinsics[:2, 2].tolist()}; expected square pixels and {middle}."
            )
        eye = to_world[:3, 3]
        target, up = eye + to_world[:3, 2], -to_world[:3, 1]
        return Camera(
            position=(float(eye[0]), float(eye[1]), float(eye[2])),
            target=(float(target[0]), float(target[1]), float(target[2])),
            up=(float(up[0]), float(up[1]), float(up[2])),
            view_angle=math.degrees(2.0 * math.atan(self.height / (2.0 * focal))),
        )


# ---- pieces of the city ------------------------------------------------------------------------


class _Piece:
    """Triangles of one kind in one chunk of the road."""

    def __init__(
        self, first: float, kind: int, triangles: NDArray[np.int32], reach: NDArray[np.float32]
    ) -> None:
        self.first = first
        self.kind = kind
        self.vertices, corners = np.unique(triangles, return_inverse=True)
        self.triangles = corners.reshape(-1, 3)
        self.low, self.high = float(reach.min()), float(reach.max())
        self.actor: Any = None


class _Chunks:
    """The city cut along the road, and by kinds (t,) of triangles."""

    def __init__(self, city: City, kinds: NDArray[np.int32]) -> None:
        x = city.vertices[:, 0][city.triangles]
        chunk = np.floor(x.mean(axis=1) / _CHUNK).astype(np.int64)
        order = np.lexsort((kinds, chunk))
        edges = np.flatnonzero(np.diff(chunk[order]) | np.diff(kinds[order])) + 1
        self.parts = [
            _Piece(chunk[rows[0]] * _CHUNK, int(kinds[rows[0]]), city.triangles[rows], x[rows])
            for rows in np.split(order, edges)
        ]

    def show_ahead(self, x: float, forward: float) -> None:
        """Draw what a camera at x may see, whose view has ``forward`` along x, -1 to 1."""
        back = 3.0 if forward > 0.5 else _FARTHEST
        ahead = 3.0 if forward < -0.5 else _FARTHEST
        for part in self.parts:
            part.actor.SetVisibility(bool(x - back < part.high and part.low < x + ahead))


def _straightened(city: City) -> tuple[City, NDArray[np.float32]]:
    """The city before its road was bent, and the bend's turn at each vertex (v, 2), cosine and
    sine: what panes mirror is looked up in the straight street."""
    places = straightened_points(city.vertices, city.bend)
    turn = headings(places[:, 0], city.bend)
    turns = np.stack([np.cos(turn), np.sin(turn)], axis=1).astype(np.float32)
    if not city.bend.angle:
        return city, turns
    back = city.bend._replace(angle=-city.bend.angle)
    normals = turned_vectors(city.normals, places[:, 0], back).astype(np.float32)
    return city._replace(vertices=places.astype(np.float32), normals=normals), turns


def _glossy(city: City) -> NDArray[np.int32]:
    return (city.gloss[city.triangles[:, 0]] > 0).astype(np.int32)


def _repeated(image: NDArray[np.uint8]) -> Any:
    made = texture(image, wrap="repeat", mipmap=True, srgb=True)
    # VTK's 4 takes more than half of a picture's time in Mesa's llvmpipe, and 16 s where a surface
    # is seen at a very grazing angle: instead, the shader takes sharper levels (_SHARPER).
    made.SetMaximumAnisotropicFiltering(1.0)
    return made
