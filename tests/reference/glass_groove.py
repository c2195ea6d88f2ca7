"""Grooves of glass as solid things in space, path-traced by Mitsuba: a reference for the table.

Nothing here knows the two dimensions of the table. Walls of Mitsuba's own smooth dielectric stand
in space, groove beside groove, u along them, v across and n upwards; below them all is glass. They
are looked at from directions of one bin, from above or from inside the glass, in an environment
that glows in a band of phi alone. What is seen, over n² inside, is the part of the bin's beam that
leaves into the band.
"""

from __future__ import annotations

import functools
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.bins import bin_edges
from pipelines.glass_scratches.tables.bsdf_table import side_ratio, side_weights
from pipelines.glass_scratches.tables.glass_paths import shoot_glass_paths
from pipelines.glass_scratches.tables.glass_table import table_of_glass_paths
from pipelines.glass_scratches.tables.groove_walls import GrooveWalls, groove_points, groove_walls
from pipelines.glass_scratches.tables.profiles import built_in_profile

BINS, INDEX = 64, 1.5
LEANS = (0.0, 0.55, 0.82)
BAND = 4
"""Bins of a band of light."""
LEAST = 0.05
"""Part of a beam that a band gets at least, to be compared."""
_SHARP = 0.2
"""Part of a band's light in the bins at its borders, at most, of clear walls: a beam that the
border of a band cuts is measured badly. Ground walls have no beams so narrow."""
PATHS = 1 << 17
_PARTS = 128
"""Of a view's bin, which is looked at from a direction drawn at random in each of them."""
_BESIDE = 60
"""Grooves to each side of those that are looked at: grazing paths cross many of them."""
_REACH = 400.0
"""Length of the walls to each side, in widths of a groove."""
_TEXELS = 16
"""Of the environment a bin: it is linear between them."""
_RAYS = 400_000


class Pair(NamedTuple):
    """A lean, the bin of a view, the first bin of a band of light; bins from ``BINS`` on are
    inside."""

    lean: float
    view: int
    light: int


class Compared(NamedTuple):
    """Parts of the view's beam in the band by Mitsuba and by the table, and their standard
    errors."""

    pair: Pair
    traced: float
    traced_error: float
    table: float
    table_error: float


def compare(profile: NDArray[np.float64], slope: float, count: int, seed: int) -> list[Compared]:
    """``count`` pairs of each of outside and inside light, for walls of this slope (0: clear).

    Which bins are compared is drawn at random, among those whose band gets
    ``LEAST`` or more.
    """
    rng = np.random.default_rng(seed)
    walls = groove_walls(profile, slope, seed)
    found: list[Compared] = []
    solid = _solid(walls)
    tables = {lean: _beams(walls, lean, seed) for lean in LEANS}
    wanted = {False: count, True: count}
    while any(left > 0 for left in wanted.values()):
        lean = float(rng.choice(LEANS))
        view = int(rng.integers(2 * BINS))
        beams, errors = tables[lean]
        bands = [
            first
            for side in (0, BINS)
            for first in range(side, side + BINS - BAND + 1)
            if _can_be_compared(beams[:, view], first, _SHARP if slope == 0 else 1.0)
            and wanted[side > 0] > 0
        ]
        chosen = _apart(rng.permutation(bands).tolist())
        if not chosen:
            continue
        pairs = [Pair(lean, view, int(first)) for first in chosen]
        for pair, (traced, error) in zip(
            pairs, _traced(solid, len(walls.x), pairs, rng), strict=True
        ):
            wanted[pair.light >= BINS] -= 1
            rows = slice(pair.light, pair.light + BAND)
            own = float(np.sqrt((errors[rows, view] ** 2).sum()))
            part = float(beams[rows, view].sum())
            found.append(Compared(pair, traced, error, part, own))
    return found


def _can_be_compared(beam: NDArray[np.float64], first: int, at_borders: float) -> bool:
    band = beam[first : first + BAND]
    return bool(LEAST <= band.sum() <= 0.98 and band[0] + band[-1] <= at_borders * band.sum())


def _apart(bands: list[int]) -> list[int]:
    """Up to three bands, as many as a picture has colours, that do not overlap."""
    kept: list[int] = []
    for first in bands:
        if len(kept) < 3 and all(abs(first - other) >= BAND for other in kept):
            kept.append(first)
    return kept


def reference_figures(count: int = 160, seed: int = 0) -> dict[str, float]:
    """Clear and ground walls of a V, ``count`` pairs each to either side."""
    profile = built_in_profile("v", 10.0, 4.0)
    pairs = [*compare(profile, 0.0, count, seed), *compare(profile, 0.3, count, seed + 1)]
    return {
        "dielectric_reference_z_rms": z_rms(pairs),
        "dielectric_pairs_outside": sum(one.pair.light < BINS for one in pairs),
        "dielectric_pairs_inside": sum(one.pair.light >= BINS for one in pairs),
        "dielectric_worst_se": max(one.traced_error / one.traced for one in pairs),
        "dielectric_null_z_rms": z_rms(
            [one._replace(table=_same_everywhere(one, pairs)) for one in pairs]
        ),
    }


def z_rms(pairs: list[Compared]) -> float:
    """RMS of (traced - table) / standard error of both."""
    z = [(one.traced - one.table) / np.hypot(one.traced_error, one.table_error) for one in pairs]
    return float(np.sqrt(np.mean(np.square(z))))


def _same_everywhere(one: Compared, pairs: list[Compared]) -> float:
    """A table that knows nothing: the mean of what all bands get on that side."""
    same = [other.table for other in pairs if (other.pair.light < BINS) == (one.pair.light < BINS)]
    return float(np.mean(same))


def _beams(
    walls: GrooveWalls, lean: float, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Parts of beams (2 M out, 2 M in) by the table of a lean, and their standard errors."""
    ratio = side_ratio(lean, INDEX, keeps=True)
    paths = shoot_glass_paths(walls, lean, bins=BINS, index=INDEX, rays=_RAYS, seed=seed)
    rho, error, _, _ = table_of_glass_paths(paths, ratio)
    weights = side_weights(BINS, ratio)[:, None]
    return rho * weights, error * weights


@functools.cache
def _mitsuba() -> Any:
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    return mitsuba


def _solid(walls: GrooveWalls) -> Any:
    """Walls in space: all grooves once, and more of them to both sides, one mesh of Mitsuba's."""
    points = groove_points(walls)
    grooves = len(points)
    corners = np.concatenate(
        [points[n % grooves] + [n, 0.0] for n in range(-_BESIDE, grooves + _BESIDE)]
    )
    starts = np.arange(len(corners) - 1)
    starts = starts[(starts + 1) % points.shape[1] != 0]  # a groove's end is the next one's start
    flat = np.zeros((2 * len(corners), 3))
    flat[:, 1:] = np.repeat(corners, 2, axis=0)
    flat[0::2, 0], flat[1::2, 0] = -_REACH, _REACH
    one, other = 2 * starts, 2 * (starts + 1)
    # Counter-clockwise as seen from the air, which is on the left of the way along v.
    faces = np.concatenate(
        [
            np.stack([one, one + 1, other], axis=1),
            np.stack([one + 1, other + 1, other], axis=1),
        ]
    )
    mi = _mitsuba()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "grooves.ply"
        trimesh.Trimesh(flat, faces, process=False).export(path)
        return mi.load_dict(
            {
                "type": "ply",
                "filename": str(path),
                "face_normals": True,
                "material": {"type": "dielectric", "int_ior": INDEX, "ext_ior": 1.0},
            }
        )


def _traced(
    solid: Any, grooves: int, pairs: list[Pair], rng: np.random.Generator
) -> list[tuple[float, float]]:
    """Parts of the view's beam that Mitsuba's paths take into the bands, and their standard errors.

    The pairs have one lean and view; each band has a colour of its own.
    """
    mi = _mitsuba()
    lean, view = pairs[0][:2]
    inside = view >= BINS
    edges = np.sin(bin_edges(BINS))
    low, high = edges[view % BINS : view % BINS + 2]
    sines = low + (high - low) * (np.arange(_PARTS) + rng.random(_PARTS)) / _PARTS
    u = lean / (INDEX if inside else 1.0)
    across = np.sqrt(1.0 - u * u)
    up = across * np.sqrt(1.0 - sines * sines) * (-1.0 if inside else 1.0)
    views = np.stack([np.full(_PARTS, u), across * sines, up], axis=-1)
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": -1, "rr_depth": 1 << 20},
            "light": _bands([pair.light for pair in pairs]),
            **{f"sensor {number}": _sensor(way, grooves) for number, way in enumerate(views)},
            "grooves": solid,
        },
        optimize=False,
    )
    seeds = rng.integers(1 << 31, size=_PARTS)
    seen = np.array(
        [
            np.array(mi.render(scene, sensor=number, seed=int(seed))).reshape(3)
            for number, seed in enumerate(seeds)
        ],
        np.float64,
    )
    # Mitsuba counts radiance, which is n² times as large inside.
    seen /= INDEX**2 if inside else 1.0
    # Neighbouring parts differ by their paths, by where in them was looked from, and a little by
    # what is different there.
    errors = np.sqrt(np.square(np.diff(seen, axis=0)).sum(axis=0) / 2.0) / _PARTS
    scales = [INDEX**2 if pair.light >= BINS else 1.0 for pair in pairs]
    return [
        (float(mean * scale), float(error * scale))
        for mean, error, scale in zip(seen.mean(axis=0), errors, scales, strict=False)
    ]


def _sensor(view: NDArray[np.float64], grooves: int) -> dict[str, Any]:
    mi = _mitsuba()
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1] = [0.5, 0.0, 0.0], [0.0, grooves / 2, 0.0]
    frame[:3, 3] = [0.0, grooves / 2, 0.0]
    return {
        "type": "distant",
        "direction": (-view).tolist(),
        "target": {"type": "rectangle", "to_world": mi.ScalarTransform4f(frame)},
        "film": {
            "type": "hdrfilm",
            "width": 1,
            "height": 1,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
            "component_format": "float32",
        },
        "sampler": {"type": "independent", "sample_count": PATHS // _PARTS},
    }


def _bands(bands: list[int]) -> dict[str, Any]:
    """An environment of radiance 1 in ``BAND`` bins, whatever the lean, for each colour."""
    mi = _mitsuba()
    columns = np.zeros((2 * BINS * _TEXELS, 3), np.float32)
    # Once around u, from the normal over v: phi outside, then phi inside from the other horizon.
    phi = (np.arange(len(columns)) + 0.5) / len(columns) * 2 * np.pi - np.pi / 2
    outside = phi < np.pi / 2
    bins = np.where(
        outside, (phi / np.pi + 0.5) * BINS, BINS + ((np.pi - phi) / np.pi + 0.5) * BINS
    )
    for colour, first in enumerate(bands):
        columns[(bins >= first) & (bins < first + BAND), colour] = 1.0
    image = np.repeat(columns[None], 4, axis=0)
    # Mitsuba's map turns about its own y, from -z, where it begins, over x: from -v over n, about
    # u.
    turn = np.eye(4)
    turn[:3, 1], turn[:3, 2], turn[:3, 0] = [1, 0, 0], [0, 1, 0], [0, 0, 1]
    return {
        "type": "envmap",
        "bitmap": mi.Bitmap(image),
        "to_world": mi.ScalarTransform4f(turn),
    }
