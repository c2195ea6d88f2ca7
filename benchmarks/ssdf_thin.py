"""Figures of thin parts before the sky: how much of them the distances miss, and what of it the
compression keeps.

A place on a thing's middle line is hidden sky, seen from anywhere. It is *lost* where a distance
says that it is open, that is where d at some direction is more than the angle to the place: then d
at the place itself cannot be negative. *Before* is the same without the test of the outlines
(`refined.crossing_distances`), the null of `thin_lost`; that of `thin_false` are other outlines.
``python -m benchmarks.ssdf_thin`` prints them alone.
"""

from __future__ import annotations

import json
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from benchmarks.ssdf_thin_scenes import KINDS, ThinScene, poles
from pipelines.geometry.rays import occluded
from pipelines.ssdf_lighting.compression import compact
from pipelines.ssdf_lighting.compression.compact_file import to_bytes
from pipelines.ssdf_lighting.compression.decoder import Decoder
from pipelines.ssdf_lighting.compression.lookup import matrix_along
from pipelines.ssdf_lighting.compression.shared_basis import shared_basis
from pipelines.ssdf_lighting.compression.triangle_clusters import clusters_by_distance
from pipelines.ssdf_lighting.distances.octahedral import texel_directions
from pipelines.ssdf_lighting.distances.refined import (
    Occluders,
    crossing_distances,
    occluders,
    refined_distances,
)
from pipelines.ssdf_lighting.distances.visibility import (
    RayOrigins,
    ray_origins,
    visible_directions,
)
from pipelines.ssdf_lighting.light.spherical_gaussians import integral, visible_integral
from pipelines.ssdf_lighting.thin_figures import made_up_share, said_open

FloatArray = NDArray[np.float64]
Floats = NDArray[np.float32]

N, WIDTHS, FEWER = 64, (0.5, 1.0, 2.0), (0.5, 2.0)
SIDE = math.sqrt(4.0 * math.pi) / N
VERTICES, PLACES = 32, 24
EXACT_VERTICES, FINE, SPACING = 8, 384, math.radians(0.1)
LIGHT_WIDTH = 1.0
SHARPNESS, LIGHTS, SAMPLES = (10.0, 100.0, 300.0, 3000.0), 200, 1000
RMSE, SHARED_ERROR = 0.006, 0.003
"""The graph's own settings."""
VERTICES_A_CLUSTER = 67


class Seen(NamedTuple):
    """Distances of vertices: ``rows`` (P,) of the scene; ``before`` and ``after`` (P, n²), without
    and with the test of the outlines; ``visible`` (P, n²)."""

    thin: ThinScene
    around: Occluders
    rows: NDArray[np.int64]
    origins: RayOrigins
    visible: NDArray[np.bool_]
    before: Floats
    after: Floats


def thin_figures() -> dict[str, Any]:
    """All figures of this module."""
    figures: dict[str, Any] = {
        name: {kind: {} for kind in KINDS}
        for name in ("thin_lost", "thin_lost_before", "thin_lost_by_directions", "thin_false")
    }
    for kind, make in KINDS.items():
        for width in WIDTHS:
            seen = look(make(width), VERTICES)
            label = f"{width:g}"
            figures["thin_lost"][kind][label] = lost(seen, seen.after)
            figures["thin_lost_before"][kind][label] = lost(seen, seen.before)
            figures["thin_lost_by_directions"][kind][label] = between_directions(seen)
            figures["thin_false"][kind][label] = false_share(seen, seen.after)
    figures["thin_lost_most"] = max(max(one.values()) for one in figures["thin_lost"].values())
    figures["thin_false_most"] = max(max(one.values()) for one in figures["thin_false"].values())
    figures["thin_false_null"] = false_share_of_other_outlines(1.0)
    figures["thin_error"] = {f"{width:g}": error_against_points(width) for width in FEWER}
    figures["thin_compressed"] = {f"{width:g}": compressed(width) for width in FEWER}
    figures["thin_light_error"] = light_error(LIGHT_WIDTH)
    return figures


def look(thin: ThinScene, count: int | None) -> Seen:
    """Distances of ``count`` vertices of the floor, or all."""
    scene = thin.scene
    rows = np.random.default_rng(0).permutation(thin.floor)[:count] if count else thin.floor
    around = occluders(scene.vertices, scene.triangles)
    found = ray_origins(around.rays, scene.vertices, scene.triangles, scene.normals)
    origins = RayOrigins(found.points[rows], found.sealed[rows])
    visible = visible_directions(around.rays, origins, texel_directions(N))
    normals = scene.normals[rows]
    before = crossing_distances(around.rays, origins, normals, visible)
    after = refined_distances(around, origins, normals, visible)
    return Seen(thin, around, rows, origins, visible, before, after)


def places(seen: Seen, row: int) -> FloatArray:
    """Unit vectors from a vertex to places of the things' middle lines (things, places, 3)."""
    share = np.linspace(0.03, 0.97, PLACES)[:, None]
    begin, end = seen.thin.axes[:, 0], seen.thin.axes[:, 1]
    ways = begin[:, None] + (end - begin)[:, None] * share - seen.origins.points[row]
    unit: FloatArray = ways / np.linalg.norm(ways, axis=2, keepdims=True)
    return unit


def lost(seen: Seen, distances: Floats) -> float:
    """Share of the places that a distance says are open."""
    found = [said_open(own, places(seen, row).reshape(-1, 3)) for row, own in enumerate(distances)]
    return float(np.concatenate(found).mean())


def between_directions(seen: Seen) -> float:
    """Share of the places beside which, along half a texel, no direction meets the thing."""
    texels, missed = texel_directions(N), []
    for row, visible in enumerate(seen.visible):
        hidden = cKDTree(texels[~visible])
        ways = places(seen, row)
        away = np.linalg.norm(
            seen.thin.axes.mean(axis=1) - seen.origins.points[row], axis=1, keepdims=True
        )
        reach = np.hypot(SIDE / 2.0, seen.thin.width[:, None] / away / 2.0)
        missed.append(hidden.query(ways)[0] > reach)
    return float(np.mean(missed))


def false_share(seen: Seen, distances: Floats) -> float:
    """Share of the open directions that the outlines changed around which there is nothing."""
    changed = np.where(distances < seen.before - 1e-4, distances, np.float32(math.pi))
    scene = seen.thin.scene
    return made_up_share(changed, seen.origins.points, scene.vertices, scene.triangles)


def false_share_of_other_outlines(width: float) -> float:
    """The null: poles where others are."""
    seen = look(poles(width), VERTICES)
    turned = seen.around.outlines.ends @ np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1.0]])
    scene = seen.thin.scene
    middle = seen.around.outlines.middle @ np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1.0]])
    bare = seen.around.outlines._replace(
        ends=turned,
        middle=middle,
        normals=0 * turned,
        spread=np.full(len(middle), math.pi),
    )
    others = seen.around._replace(outlines=bare)
    wrong = refined_distances(others, seen.origins, scene.normals[seen.rows], seen.visible)
    return false_share(seen, wrong)


def error_against_points(width: float) -> dict[str, float]:
    """RMS error of d in open directions (radians), before and after, against all hidden ones of
    384 x 384 and points all over the poles, a tenth of a degree apart."""
    seen = look(poles(width), EXACT_VERTICES)
    fine, texels = texel_directions(FINE), texel_directions(N)
    points = _points_of_poles(seen.thin)
    squares = []
    for row, origin in enumerate(seen.origins.points):
        one = RayOrigins(origin[None], np.zeros(1, bool))
        hidden = fine[~visible_directions(seen.around.rays, one, fine)[0]]
        ways = points - origin
        ways /= np.linalg.norm(ways, axis=1, keepdims=True)
        open_ones = seen.visible[row]
        chords = cKDTree(np.concatenate([hidden, ways])).query(texels[open_ones])[0]
        exact = 2.0 * np.arcsin(np.minimum(chords / 2.0, 1.0))
        squares.append(
            [((d[row][open_ones] - exact) ** 2).mean() for d in (seen.before, seen.after)]
        )
    before, after = np.sqrt(np.mean(squares, axis=0))
    return {"before": float(before), "after": float(after), "ratio": float(after / before)}


def _points_of_poles(thin: ThinScene) -> FloatArray:
    """Points (K, 3) of the triangles of the poles."""
    scene = thin.scene
    a, b, c = scene.vertices[scene.triangles[scene.part == 1]].transpose(1, 0, 2)
    away = float(np.linalg.norm(thin.axes.mean(axis=1), axis=1).mean())
    found = []
    for corners in zip(a, b, c, strict=True):
        sides = [np.linalg.norm(corners[k] - corners[k - 1]) for k in range(3)]
        steps = min(2000, 2 + math.ceil(max(sides) / (SPACING * away)))
        across = 2 + math.ceil(min(sides) / (SPACING * away))
        # The two longest sides meet at one corner: lines from there to the short side.
        apex = int(np.argmin(sides)) + 1
        tip, one, other = (corners[(apex + k) % 3] for k in range(3))
        along, aside = np.meshgrid(np.linspace(0, 1, steps), np.linspace(0, 1, across))
        ends = one + (other - one) * aside.reshape(-1, 1)
        found.append(tip + (ends - tip) * along.reshape(-1, 1))
    return np.concatenate(found)


def compressed(width: float) -> dict[str, float]:
    """Poles after the compression at the graph's own error, and what the same costs without them.

    lost: as `thin_lost`; kept: of what the poles change in d at their places, by interpolation as
    it is drawn, the mean share that is left.
    """
    seen = look(poles(width), None)
    index = np.full(len(seen.thin.scene.vertices), -1)
    index[seen.rows] = np.arange(len(seen.rows))
    triangles = index[seen.thin.scene.triangles[seen.thin.scene.part == 0]]
    decoded, size = _compressed(seen.after, triangles)
    _, size_before = _compressed(seen.before, triangles)
    some = np.random.default_rng(0).permutation(len(seen.rows))[:VERTICES]
    sample = seen._replace(rows=seen.rows[some], origins=_rows(seen.origins, some))
    numbers = np.arange(len(some))
    ways = np.stack([places(sample, row).reshape(-1, 3) for row in range(len(some))])
    bare = _without_poles(seen, some)
    without, exact, found = (
        matrix_along(np.ascontiguousarray(d), numbers, ways.astype(np.float32))
        for d in (bare, seen.after[some], decoded[some])
    )
    change = without - exact
    clear = change > SIDE
    return {
        "lost_not_compressed": lost(sample, seen.after[some]),
        "lost": lost(sample, decoded[some]),
        "lost_by_half_a_texel": lost(sample, decoded[some] - np.float32(SIDE / 2.0)),
        "kept": float(((without - found)[clear] / change[clear]).mean()),
        "least_kept": float(np.percentile((without - found)[clear] / change[clear], 1)),
        "file_bytes": size,
        "file_bytes_before": size_before,
    }


def _compressed(matrix: Floats, triangles: NDArray[np.int64]) -> tuple[Floats, int]:
    basis = shared_basis(lambda: iter([matrix]), matrix.shape, SHARED_ERROR)
    count = max(1, len(matrix) // VERTICES_A_CLUSTER)
    labels = clusters_by_distance(basis.coordinates, triangles, count, 0).vertex
    dense = np.unique(labels, return_inverse=True)[1].astype(np.int32)
    file = to_bytes(compact.quantise_to_rmse(basis, dense, RMSE))
    return Decoder.of_file(file).distances(np.arange(len(matrix))), len(file)


def _rows(origins: RayOrigins, some: NDArray[np.int64]) -> RayOrigins:
    return RayOrigins(origins.points[some], origins.sealed[some])


def _without_poles(seen: Seen, some: NDArray[np.int64]) -> Floats:
    """Distances of the same vertices where the floor is alone."""
    scene = seen.thin.scene
    alone = occluders(scene.vertices, scene.triangles[scene.part == 0])
    origins = _rows(seen.origins, some)
    visible = visible_directions(alone.rays, origins, texel_directions(N))
    return refined_distances(alone, origins, scene.normals[seen.rows[some]], visible)


def light_error(width: float) -> dict[str, dict[str, float]]:
    """How far off the visible share of a light is, on average, whose axis is within two of its own
    widths, 1 / sqrt(sharpness), of a pole: by d at its axis, before and after, against rays."""
    random = np.random.default_rng(0)
    seen = look(poles(width), VERTICES)
    found: dict[str, dict[str, float]] = {}
    for sharpness in SHARPNESS:
        errors = []
        for _ in range(LIGHTS):
            row = int(random.integers(len(seen.rows)))
            pole = random.integers(len(seen.thin.axes))
            axis = places(seen, row)[pole, random.integers(PLACES // 4, PLACES)]
            axis = axis + random.normal(size=3) / math.sqrt(sharpness)
            axis /= np.linalg.norm(axis)
            ways = drawn_directions(random, axis, sharpness)
            true = 1.0 - occluded(seen.around.rays, seen.origins.points[row], ways).mean()
            row_only, ask = np.array([row]), axis.astype(np.float32)[None, None]
            d = [float(matrix_along(one, row_only, ask)[0, 0]) for one in (seen.before, seen.after)]
            shares = visible_integral(d, sharpness) / integral(sharpness)
            errors.append([*np.abs(shares - true), 1.0 - true])
        before, after, hidden = np.mean(errors, axis=0)
        found[f"{sharpness:g}"] = {
            "before": float(before),
            "after": float(after),
            "none": float(hidden),
        }
    return found


def drawn_directions(random: np.random.Generator, axis: FloatArray, sharpness: float) -> FloatArray:
    """Directions (samples, 3) drawn from a spherical Gaussian."""
    uniform = random.random((SAMPLES, 1))
    cosine = 1.0 + np.log(uniform + (1.0 - uniform) * math.exp(-2.0 * sharpness)) / sharpness
    across = np.cross(axis, random.normal(size=(SAMPLES, 3)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    ways: FloatArray = cosine * axis + np.sqrt(np.maximum(1.0 - cosine**2, 0.0)) * across
    return ways


if __name__ == "__main__":
    print(json.dumps(thin_figures()))
