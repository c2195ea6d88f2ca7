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


def table_picture(rho: NDArray[np.float64]) -> NDArray[np.uint8]:
    """The table as an image, and figure 2: rho_m over phi_o around three incidences."""
    figure, canvas = new_figure(10.0, 4.2)
    angles = bin_centres(len(rho))
    left = figure.add_subplot(1, 2, 1)
    shown = left.imshow(
        rho,
        origin="lower",
        extent=(-90, 90, -90, 90),
        cmap="magma",
        vmin=0.0,
        vmax=float(np.quantile(rho, 0.995)),
    )
    left.set(xlabel="φi, degrees", ylabel="φo, degrees", title="ρm(φo, φi)")
    figure.colorbar(shown, ax=left)
    right = figure.add_subplot(1, 2, 2, projection="polar")
    right.set_theta_zero_location("N")
    right.set_theta_direction(-1)
    right.set_thetamin(-90)
    right.set_thetamax(90)
    half = max(1, len(rho) // 128)
    longest = 0.0
    for incidence, colour in zip(_SHOWN_INCIDENCES, ("#b8860b", "#20506a", "#8b2252"), strict=True):
        at = int(np.argmin(np.abs(angles - np.radians(incidence))))
        lobe = rho[:, max(at - half, 0) : at + half + 1].mean(axis=1)
        longest = max(longest, float(lobe.max()))
        right.plot(angles, lobe, color=colour, label=f"φi = {incidence:g}°")
        right.fill(angles, lobe, color=colour, alpha=0.12)
    right.set_ylim(0.0, 1.1 * longest)
    right.legend(loc="lower center", fontsize=8)
    return canvas_picture(canvas)


def fresnel_picture(factor: NDArray[np.float64], gamma: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Fresnel's factor over theta_o as it is interpolated, for three views phi_o."""
    figure, canvas = new_figure(5.4, 3.4)
    axis = figure.subplots()
    theta = np.linspace(0.0, np.pi / 2, 200)
    angles = bin_centres(len(gamma))
    for view in _SHOWN_INCIDENCES:
        at = int(np.argmin(np.abs(angles - np.radians(view))))
        share = (2 * theta / np.pi) ** gamma[at]
        curve = share * factor[2, at] + (1 - share) * factor[0, at]
        axis.plot(np.degrees(theta), curve, label=f"φo = {view:g}°, γ = {gamma[at]:.3g}")
        axis.plot([0, 60, 90], factor[:, at], "o", color="0.3", markersize=4)
    axis.set(xlabel="θo, degrees", ylabel="ρs / ρm", ylim=(0, 1.05))
    axis.legend(fontsize=8)
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
