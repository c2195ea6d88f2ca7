"""Light between surfaces: what vertices get from what else is lit, as few numbers a vertex.

Surfaces are cut into patches. F[v, p], the form factor, is the share of the irradiance of vertex v
that patch p sends if it glows evenly (Goral, Torrance, Greenberg and Battaile, "Modeling the
interaction of light between diffuse surfaces", 1984). Rows of near vertices are alike, so F is
stored as a product of R numbers a vertex and R numbers a patch. None of it depends on the light:
when that turns, patches take what their sampled vertices get directly, through the signed
distances, send it to each other, and the vertices gather it.

Radiosities here are over pi: radiance of what is matt. Direct light is what albedo 1 would show.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.geometry.rays import build_scene, first_hits
from pipelines.ssdf_lighting.distances.octahedral import solid_angles, texel_directions
from pipelines.ssdf_lighting.distances.visibility import RayOrigins
from pipelines.ssdf_lighting.scene import Scene

Floats = NDArray[np.float32]

RANK = 24
_SAMPLES = 12  # vertices whose light stands for a patch's
_SIDE = 32  # rays are cast in so many squared directions
_BENT = 0.35  # scene radii that a turn of the normal by a radian counts as
_ORDERS = 5  # of reflection: paths of six edges
_AT_ONCE = 1024  # vertices whose rays are in memory together
_MOST_CODE = 127


class BounceFactors(NamedTuple):
    """F of V vertices and P patches, nearly: ``codes`` times ``steps`` times ``vectors``.

    codes: (V, R) int8. steps: (R,) float32. vectors: (R, P) float32.
    between: (P, R) float32, the mean of the vertices' codes times steps in each patch: times
        ``vectors`` it is F from patch to patch.
    albedo: (P, 3) float32. samples: (P, S) int32, vertices that tell how a patch is lit.
    """

    codes: NDArray[np.int8]
    steps: Floats
    vectors: Floats
    between: Floats
    albedo: Floats
    samples: NDArray[np.int32]

    @property
    def nbytes(self) -> int:
        """Bytes of all of it."""
        return sum(part.nbytes for part in self)


def bounce_factors(
    scene: Scene,
    origins: RayOrigins,
    patches: int,
    progress: Callable[[float], None] = lambda fraction: None,
) -> BounceFactors:
    """Cast rays from the vertices (``origins``, as of their visibility) to about so many patches.

    They are fewer where there are few triangles, and a little more, as each is of one material. A
    surface that is seen from behind shines as its front does, as it is drawn.
    """
    patch = _patches(scene, patches)
    count = int(patch.max()) + 1
    factors = _form_factors(scene, origins, patch, count, progress)
    vectors, weights = _low_rank(factors)
    steps = np.abs(weights).max(axis=0) / _MOST_CODE
    steps = np.where(steps > 0, steps, 1.0)
    codes = np.rint(weights / steps).astype(np.int8)
    areas = _areas(scene)
    of_corner, share = np.repeat(patch, 3), np.repeat(areas / 3.0, 3)
    rows = codes[scene.triangles.ravel()] * steps
    whole = np.bincount(patch, areas, count)[:, None]
    between = _summed(of_corner, rows * share[:, None], count) / whole
    colour = scene.materials.albedo[scene.part] * areas[:, None]
    return BounceFactors(
        codes,
        steps.astype(np.float32),
        vectors.astype(np.float32),
        between.astype(np.float32),
        (_summed(patch, colour, count) / whole).astype(np.float32),
        _sampled_vertices(scene, patch, areas, count),
    )


def bounced(factors: BounceFactors, direct: NDArray[np.floating]) -> Floats:
    """What light that was reflected once to five times adds at the vertices, (V, 3) float32.

    direct: (P, S, 3), what albedo 1 would show of direct light at ``factors.samples``. The result
    is the same of reflected light: times the albedo it is radiance.
    """
    light = np.asarray(direct, np.float64).mean(axis=1)
    sent = factors.albedo * light
    gathered = factors.vectors @ sent
    for _ in range(_ORDERS - 1):
        sent = factors.albedo * (light + factors.between @ gathered)
        gathered = factors.vectors @ sent
    found = factors.codes @ (factors.steps[:, None] * gathered).astype(np.float32)
    return np.maximum(found, 0.0).astype(np.float32)


def factor_sums(factors: BounceFactors) -> Floats:
    """The share (V,) of each vertex's hemisphere, weighted by the cosine, that patches fill."""
    sums: Floats = factors.codes @ (factors.steps * factors.vectors.sum(axis=1))
    return sums


# ---- making them -------------------------------------------------------------------------------


def _areas(scene: Scene) -> NDArray[np.float64]:
    a, b, c = np.moveaxis(scene.vertices[scene.triangles], 1, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2.0


def _patches(scene: Scene, most: int) -> NDArray[np.int64]:
    """(F,): patch of each triangle; triangles that lie and look alike, of one material."""
    from scipy.cluster.vq import kmeans2

    corners = scene.vertices[scene.triangles]
    facing = scene.normals[scene.triangles].mean(axis=1)
    places = np.concatenate([corners.mean(axis=1), _BENT * facing], axis=1)
    # A mean of so many triangles at least, or there would be patches of nothing.
    wanted = max(1, min(most, len(places) // 8))
    _, label = kmeans2(places, wanted, minit="++", seed=0, iter=12)
    both = label.astype(np.int64) * (int(scene.part.max()) + 1) + scene.part
    return np.unique(both, return_inverse=True)[1].reshape(-1)


def _form_factors(
    scene: Scene,
    origins: RayOrigins,
    patch: NDArray[np.int64],
    count: int,
    progress: Callable[[float], None],
) -> NDArray[np.float64]:
    rays = build_scene(scene.vertices, scene.triangles)
    ways, omega = texel_directions(_SIDE), solid_angles(_SIDE)
    factors = np.zeros((len(scene.vertices), count))
    for first in range(0, len(factors), _AT_ONCE):
        block = np.arange(first, min(first + _AT_ONCE, len(factors)))
        falling = np.maximum(scene.normals[block] @ ways.T, 0.0) * omega
        falling *= ~origins.sealed[block, None] / falling.sum(axis=1, keepdims=True)
        row, way = np.nonzero(falling)
        hit = first_hits(rays, origins.points[block[row]], ways[way].astype(np.float32)).triangle
        met = hit >= 0
        at = row[met] * count + patch[hit[met]]
        found = np.bincount(at, falling[row[met], way[met]], len(block) * count)
        factors[block] = found.reshape(len(block), count)
        progress((first + len(block)) / len(factors))
    return factors


def _low_rank(factors: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """vectors (R, P) and weights (V, R) whose product is nearest, among those that keep the sum of
    each row: what a closed room of one colour gets is exact."""
    even = np.full((1, factors.shape[1]), factors.shape[1] ** -0.5)
    rest = factors - (factors @ even.T) @ even
    _, axes = np.linalg.eigh(rest.T @ rest)
    vectors = np.concatenate([even, axes[:, ::-1][:, : RANK - 1].T])
    return vectors, factors @ vectors.T


def _summed(
    label: NDArray[np.int64], rows: NDArray[np.floating], count: int
) -> NDArray[np.float64]:
    columns = [np.bincount(label, column, count) for column in rows.T]
    return np.stack(columns, axis=1)


def _sampled_vertices(
    scene: Scene, patch: NDArray[np.int64], areas: NDArray[np.float64], count: int
) -> NDArray[np.int32]:
    """(P, S) vertices of the patches' triangles, large ones more often."""
    random = np.random.default_rng(0)
    order = np.argsort(patch, kind="stable")
    sums = np.cumsum(areas[order])
    ends = np.searchsorted(patch[order], np.arange(count), side="right") - 1
    last = sums[ends]
    start = np.concatenate([[0.0], last[:-1]])
    places = (np.arange(_SAMPLES) + random.random((count, _SAMPLES))) / _SAMPLES
    at = np.searchsorted(sums, start[:, None] + places * (last - start)[:, None])
    chosen = order[np.minimum(at, ends[:, None])]
    corner = random.integers(3, size=chosen.shape)
    return scene.triangles[chosen, corner].astype(np.int32)
