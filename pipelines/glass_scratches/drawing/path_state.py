"""What the kernels of path tracing take and fill: the glass, its light, paths, what events add."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.layers.feature_search import LayerArrays
from pipelines.glass_scratches.tables.lobe import Lobe
from pipelines.light.environment_sampling import EnvironmentSampler


class ScratchedSurface(NamedTuple):
    """What lies on a glass solid, as the kernels take it.

    ``layers`` and their ``coverage`` averaged over 1, 2, 4 … texels a side, flat, each level from
    its ``offsets`` on, ``resolution`` texels a side at first; ``tile``: scene units a tile;
    ``lobe`` of the scratches, with the index of the glass.
    """

    layers: LayerArrays
    coverage: NDArray[np.float32]
    offsets: NDArray[np.int64]
    resolution: int
    tile: float
    lobe: Lobe


class Faces(NamedTuple):
    """``normals`` (F, 3), ``corner_normals`` (F, 3, 3) of the triangles; ``flats`` (K, 3): axes
    along which at least a hundredth of the surface faces, either way."""

    normals: NDArray[np.float32]
    corner_normals: NDArray[np.float32]
    flats: NDArray[np.float64]


class TracedGlass(NamedTuple):
    """A scratched solid in its light, and how it is traced.

    ``samples``: paths of a pixel; ``offset``: how far off a face paths start again, scene units;
    ``uniform``: whether directions at scratches are drawn evenly.
    """

    faces: Faces
    surface: ScratchedSurface
    environment: EnvironmentSampler
    samples: int
    offset: float
    uniform: bool


class Paths(NamedTuple):
    """One row a path that is still on its way.

    ``number``: which path of the block it is; ``origin``, ``direction`` (n, 3) of its ray;
    ``throughput`` (n, 3): what light from there is multiplied with; ``pdf`` (n,): density of the
    last sampled direction per steradian, 0 where only that direction was possible; ``cone_width``,
    ``cone_angle`` (n,): of the cone that stands for its pixel, scene units and radians; ``seed``
    of its pixel.
    """

    number: NDArray[np.int64]
    origin: NDArray[np.float64]
    direction: NDArray[np.float64]
    throughput: NDArray[np.float64]
    pdf: NDArray[np.float64]
    cone_width: NDArray[np.float64]
    cone_angle: NDArray[np.float64]
    seed: NDArray[np.uint64]


class EventResults(NamedTuple):
    """What an event adds, to be filled.

    By the path's number: ``radiance`` (N, 3), and whether it ``met_scratch``. By its row: whether
    it is ``alive`` (goes on), and the radiance that a light would add along a shadow ray from
    ``shadow_origin`` in ``shadow_direction``, where nothing stands between.
    """

    radiance: NDArray[np.float64]
    met_scratch: NDArray[np.bool_]
    alive: NDArray[np.bool_]
    shadow_origin: NDArray[np.float64]
    shadow_direction: NDArray[np.float64]
    shadow_radiance: NDArray[np.float64]


class SurfacePoint(NamedTuple):
    """Where a path meets the glass: vectors as three numbers.

    ``face``: the triangle's normal; ``normal``: the interpolated one, or the face's where a path
    would be on the wrong side of it; ``side``: 1 where it comes from outside, -1 from inside.
    """

    position: tuple[float, float, float]
    face: tuple[float, float, float]
    normal: tuple[float, float, float]
    side: float
