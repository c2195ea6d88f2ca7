"""Pictures of profiles and tables (figures 1 and 2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.plots import canvas_picture, new_figure
from pipelines.glass_scratches.tables.bins import bin_centres

_SHOWN_INCIDENCES = (0.0, 30.0, 60.0)


def profile_picture(points: NDArray[np.float64]) -> NDArray[np.uint8]:
    """The cross-section, glass below it."""
    figure, canvas = new_figure(6.0, 3.0)
    axis = figure.subplots()
    margin = 0.25 * np.ptp(points[:, 0])
    low = points[:, 1].min() - margin
    v = np.concatenate([[points[0, 0] - margin], points[:, 0], [points[-1, 0] + margin]])
    n = np.concatenate([[0.0], points[:, 1], [0.0]])
    axis.fill(np.concatenate([v, v[[-1, 0]]]), np.concatenate([n, [low, low]]), color="#9fc5d8")
    axis.plot(points[:, 0], points[:, 1], color="#20506a")
    axis.set(xlabel="v, µm", ylabel="n, µm", aspect="equal")
    return canvas_picture(canvas)


def table_picture(rho: NDArray[np.float64], both_sides: bool) -> NDArray[np.uint8]:
    """A table as an image, and figure 2: rho_m over phi_o around three incidences.

    ``both_sides``: bins outside, then inside the glass, which are drawn below the surface.
    """
    figure, canvas = new_figure(10.0, 4.2)
    bins = len(rho) // 2 if both_sides else len(rho)
    angles = bin_centres(bins)
    left = figure.add_subplot(1, 2, 1)
    shown = left.imshow(rho, origin="lower", cmap="magma", vmax=float(np.quantile(rho, 0.995)))
    ticks = np.arange(0, len(rho) + 1, bins // 2) - 0.5
    names = ["-90", "0", "90 | -90", "0", "90"] if both_sides else ["-90", "0", "90"]
    left.set_xticks(ticks, names)
    left.set_yticks(ticks, names)
    left.set(xlabel="φi, degrees", ylabel="φo, degrees", title="ρm(φo, φi)")
    figure.colorbar(shown, ax=left)
    right = figure.add_subplot(1, 2, 2, projection="polar")
    right.set_theta_zero_location("N")
    right.set_theta_direction(-1)
    around = np.concatenate([angles, np.pi - angles[::-1]]) if both_sides else angles
    if not both_sides:
        right.set_thetamin(-90)
        right.set_thetamax(90)
    half = max(1, bins // 128)
    longest = 0.0
    for incidence, colour in zip(_SHOWN_INCIDENCES, ("#b8860b", "#20506a", "#8b2252"), strict=True):
        at = int(np.argmin(np.abs(angles - np.radians(incidence))))
        lobe = rho[:, max(at - half, 0) : at + half + 1].mean(axis=1)
        lobe = np.concatenate([lobe[:bins], lobe[bins:][::-1]])
        longest = max(longest, float(np.quantile(lobe, 0.98)))
        right.plot(around, lobe, color=colour, label=f"φi = {incidence:g}°")
        right.fill(around, lobe, color=colour, alpha=0.12)
    right.set_ylim(0.0, 1.1 * longest)
    right.legend(loc="lower center", fontsize=8)
    return canvas_picture(canvas)


def leans_picture(rho: NDArray[np.float32], leans: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Tables (S, 2 M view, 2 M light) of their leans, outside and inside: what becomes of a
    view."""
    figure, canvas = new_figure(2.2 * len(leans) + 0.4, 2.6)
    top = float(np.quantile(rho, 0.99))
    for number, (table, lean) in enumerate(zip(rho, leans, strict=True)):
        axis = figure.add_subplot(1, len(leans), number + 1)
        axis.imshow(table, origin="lower", cmap="magma", vmin=0.0, vmax=top)
        axis.set_title(f"lean {lean:g}", fontsize=9)
        axis.set_axis_off()
    return canvas_picture(canvas)


def furnace_picture(radiance: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Radiance (y, x) in an environment of 1, blue below and red above it, by up to 10 %."""
    figure, canvas = new_figure(5.0, 4.2)
    axis = figure.subplots()
    shown = axis.imshow(radiance, cmap="coolwarm", vmin=0.9, vmax=1.1, interpolation="nearest")
    axis.set_title("in an environment of radiance 1", fontsize=9)
    axis.set_axis_off()
    figure.colorbar(shown, ax=axis)
    return canvas_picture(canvas)
