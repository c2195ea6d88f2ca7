"""A groove as a solid thing in space, path-traced by Mitsuba: a reference for the scratch's BRDF.

Nothing here knows the two dimensions of the table. Long walls with a diffuse material stand in
space, u along the groove, v across and n upwards; a directional light shines on them, and what is
seen through the opening from another direction, averaged over it, is measured. Divided by the light
that the opening receives, that is the BRDF f = 2 rho_m / pi² which
:mod:`pipelines.glass_scratches.tables.radiosity` promises for all leans.

Directions are pairs (theta, phi), radians: phi from n towards v in the cross-section, theta from
there towards u. A pair of directions is ``[light, view]``.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.glass_scratches.tables.bins import bin_centres
from pipelines.glass_scratches.tables.profiles import built_in_profile
from pipelines.glass_scratches.tables.radiosity import solve_radiosity, view_factors

WIDTH, DEPTH, ALBEDO = 10.0, 4.0, 0.8
WIDEST = np.radians(75.0)
REACH = 50.0
"""Length of the walls to each side of the measured patch, in widths of the opening."""
_BATCH = 4096
"""Paths a render. Mitsuba adds them up in float32: many more, and equal values round alike."""


def direction_pairs(count: int, seed: int) -> NDArray[np.float64]:
    """Random pairs (count, 2, 2), both angles of both directions even within 75 degrees."""
    return np.random.default_rng(seed).uniform(-WIDEST, WIDEST, (count, 2, 2))


def unit_vectors(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vectors (..., 3) in (u, v, n) of directions (..., 2)."""
    theta, phi = angles[..., 0], angles[..., 1]
    return np.stack(
        [np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)], axis=-1
    )


def table_brdf(
    profile: NDArray[np.float64],
    albedo: float,
    pairs: NDArray[np.float64],
    *,
    bins: int = 1024,
    facets: int = 256,
) -> NDArray[np.float64]:
    """f (N,) of the exact table for pairs (N, 2, 2), linear between the middles of the bins.

    Finer bins than the paper's 256: with those, f is up to 1.5 % off where a wall comes into view.
    """
    from scipy.interpolate import RegularGridInterpolator

    rho = solve_radiosity(view_factors(profile, bins, facets), albedo).rho
    middles = bin_centres(bins)
    # Rows are the view's bins, columns the light's.
    between = RegularGridInterpolator((middles, middles), rho)
    f: NDArray[np.float64] = 2 / np.pi**2 * between(pairs[:, ::-1, 1])
    return f


def traced_brdf(
    profile: NDArray[np.float64],
    albedo: float,
    pairs: NDArray[np.float64],
    *,
    precision: float = 0.005,
    seed: int = 0,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """f (N,) by path tracing and its standard error (N,), for pairs (N, 2, 2), albedo above 0.

    A first batch of paths says how many it takes for a relative standard error of about
    ``precision``; f and its error come from other paths, which did not choose their own number.
    """
    f, error = np.empty(len(pairs)), np.empty(len(pairs))
    seeds = np.random.SeedSequence(seed).spawn(len(pairs))
    for number, (light, view) in enumerate(unit_vectors(pairs)):
        sun = {
            "type": "directional",
            "direction": (-light).tolist(),
            "irradiance": {"type": "rgb", "value": 1.0},
        }
        scene = _scene(profile, albedo, view, {"sun": sun})
        pilot, fresh = seeds[number].spawn(2)
        mean, variance = _measure(scene, 1, pilot)
        # A tenth more: the first batch knows the variance only so well.
        paths = 1.1 * variance / (precision * mean) ** 2
        batches = max(1, int(np.ceil(paths / _BATCH)))
        mean, variance = _measure(scene, batches, fresh)
        f[number] = mean / light[2]
        error[number] = np.sqrt(variance / (batches * _BATCH)) / light[2]
    return f, error


def seen_of_the_ends(
    profile: NDArray[np.float64], albedo: float, view: NDArray[np.float64], *, seed: int = 0
) -> float:
    """Mean radiance over the opening if nothing but the groove's two open ends glowed, with 1.

    What the real groove's length takes from the picture of an endless one is at most this share
    of the brightest wall.
    """
    width, depth = float(np.ptp(profile[:, 0])), float(np.ptp(profile[:, 1]))
    glow = {"type": "area", "radiance": {"type": "rgb", "value": 1.0}}
    ends = {
        f"end {side}": _rectangle(
            [side * REACH * width, 0.0, -depth / 2],
            [0.0, side * width / 2, 0.0],
            [0.0, 0.0, -depth / 2],
            {"light": glow},
        )
        for side in (-1, 1)
    }
    scene = _scene(profile, albedo, unit_vectors(view), ends)
    return _measure(scene, 16, np.random.SeedSequence(seed))[0]


def reference_figures(count: int = 320, seed: int = 0) -> dict[str, float]:
    """The table's f of a V groove against path tracing: z = (traced - table) / standard error.

    ``reference_worst_se`` is the largest relative standard error of all pairs.
    """
    profile = built_in_profile("v", WIDTH, DEPTH)
    pairs = direction_pairs(count, seed)
    traced, error = traced_brdf(profile, ALBEDO, pairs, seed=seed)
    z = (traced - table_brdf(profile, ALBEDO, pairs)) / error
    return {
        "reference_z_rms": float(np.sqrt(np.mean(z**2))),
        "reference_pairs": count,
        "reference_worst_se": float((error / traced).max()),
    }


def _mitsuba() -> Any:
    """The module, set to plain float32 kernels: for a handful of walls faster than compiled ones,
    and without LLVM."""
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    return mitsuba


def _scene(
    profile: NDArray[np.float64], albedo: float, view: NDArray[np.float64], lights: dict[str, Any]
) -> Any:
    """Walls, lights, and a sensor of one pixel that sees the opening from direction ``view``."""
    half = float(np.ptp(profile[:, 0])) / 2
    wall = {
        "type": "twosided",
        "sides": {"type": "diffuse", "reflectance": {"type": "rgb", "value": albedo}},
    }
    walls = {
        f"wall {number}": _rectangle(
            [0.0, *(start + end) / 2],
            [2 * REACH * half, 0.0, 0.0],
            [0.0, *(end - start) / 2],
            {"material": wall},
        )
        for number, (start, end) in enumerate(itertools.pairwise(profile))
    }
    sensor = {
        "type": "distant",
        "direction": (-view).tolist(),
        # The groove is the same all along: how much of its length is looked at does not matter.
        "target": _rectangle([0.0, 0.0, 0.0], [half, 0.0, 0.0], [0.0, half, 0.0], {}),
        "film": {
            "type": "hdrfilm",
            "width": 1,
            "height": 1,
            "rfilter": {"type": "box"},
            "pixel_format": "luminance",
            "component_format": "float32",
        },
        "sampler": {"type": "independent", "sample_count": _BATCH},
    }
    # Not optimised: Mitsuba 3.9.1 joins the walls to one mesh and loses its bounding box.
    return _mitsuba().load_dict(
        {
            "type": "scene",
            "integrator": {"type": "moment", "paths": {"type": "path", "max_depth": -1}},
            "sensor": sensor,
            **walls,
            **lights,
        },
        optimize=False,
    )


def _rectangle(
    middle: list[float], right: list[float], up: list[float], parts: dict[str, Any]
) -> dict[str, Any]:
    """A rectangle by its middle and half its sides, seen from where up is left of right."""
    normal = np.cross(right, up)
    frame = np.eye(4)
    frame[:3] = np.stack([right, up, normal / np.linalg.norm(normal), middle], axis=1)
    return {"type": "rectangle", "to_world": _mitsuba().ScalarTransform4f(frame), **parts}


def _measure(scene: Any, batches: int, seed: np.random.SeedSequence) -> tuple[float, float]:
    """Mean and variance of the radiance along one path."""
    channels = ["luminance", *scene.integrator().aov_names()]
    of_interest = [channels.index(name) for name in ("paths.Y", "m2_paths.Y")]
    moments = np.zeros(2)
    for batch_seed in seed.generate_state(batches):
        pixel = np.array(_mitsuba().render(scene, spp=_BATCH, seed=int(batch_seed)), np.float64)
        moments += pixel.ravel()[of_interest] / batches
    return float(moments[0]), float(moments[1] - moments[0] ** 2)
