"""The scratch BRDF in space: evaluate, sample, pdf, in the scratch's frame (u, v, n).

Directions are unit vectors (along u, across v, normal n) that point away from the surface. The
3-D BRDF (Fresnel's factor apart) is

    f = (2 / pi²) rho_m(phi_o, phi_i) k(theta_o, theta_i)

and f cos dω splits into [rho_m cos phi dphi / pi] [(2 / pi) k cos² theta dtheta]. Diffuse walls
forget theta, how far light leans along the scratch: k = 1. A mirror turns it over. In between its
quantile c(theta), uniform under cos², is blurred and folded like the bounces of the 2-D paths, so k
is symmetric and its mean is one for every roughness.

The view's phi is taken at the nearest bin; inside the light's bin the sine of phi is uniform. So
evaluate, sample and pdf agree exactly.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from pipelines.glass_scratches.tables.lobe import Direction


@njit(cache=True, nogil=True, inline="always")
def phi_bin(v, n, bins):  # type: ignore[no-untyped-def]
    """The bin of a direction's phi."""
    angle = np.arctan2(v, max(n, 0.0))
    return min(max(int((angle / np.pi + 0.5) * bins), 0), bins - 1)


@njit(cache=True, nogil=True)
def theta_quantile(u):  # type: ignore[no-untyped-def]
    """Share of cos² theta below the theta whose sine is u."""
    s = min(max(u, -1.0), 1.0)
    return 0.5 + (np.arcsin(s) + s * np.sqrt(1.0 - s * s)) / np.pi


@njit(cache=True, nogil=True)
def sine_of_quantile(c):  # type: ignore[no-untyped-def]
    """The sine whose quantile is c: Newton's method on the angle, held inside by bisection."""
    low, high = -np.pi / 2, np.pi / 2
    theta = np.pi * (c - 0.5) / 2
    for _ in range(60):
        excess = theta + np.sin(theta) * np.cos(theta) - np.pi * (c - 0.5)
        if abs(excess) < 1e-13:
            break
        if excess > 0:
            high = theta
        else:
            low = theta
        slope = 2.0 * np.cos(theta) ** 2
        step = theta - excess / slope if slope > 1e-12 else low
        theta = step if low < step < high else (low + high) / 2
    return np.sin(theta)


@njit(cache=True, nogil=True)
def theta_kernel(c_view, c_light, blur):  # type: ignore[no-untyped-def]
    """k as a density over the light's quantile, for the view's."""
    if np.isinf(blur):
        return 1.0
    mirrored = 1.0 - c_view
    total = 0.0
    if blur > 0.4:  # the heat kernel by its cosines …
        total = 1.0
        for k in range(1, 12):
            term = np.exp(-0.5 * (np.pi * k * blur) ** 2)
            total += 2.0 * term * np.cos(np.pi * k * mirrored) * np.cos(np.pi * k * c_light)
            if term < 1e-17:
                break
        return total
    for fold in range(-2, 3):  # … or by images
        for sign in (-1.0, 1.0):
            z = (sign * c_light + 2.0 * fold - mirrored) / blur
            total += np.exp(-0.5 * z * z)
    return total / (blur * np.sqrt(2.0 * np.pi))


@njit(cache=True, nogil=True)
def evaluate(lobe, place, view, light):  # type: ignore[no-untyped-def]
    """f of a view and a light (:class:`Direction`), 1/sr; 0 below the surface."""
    ou, ov, on = view
    iu, iv, i_n = light
    if on <= 0.0 or i_n <= 0.0:
        return 0.0
    bins = lobe.rho.shape[1]
    table = lobe.rho[place, phi_bin(ov, on, bins), phi_bin(iv, i_n, bins)]
    return 2.0 / np.pi**2 * table * theta_kernel(theta_quantile(ou), theta_quantile(iu), lobe.blur)


@njit(cache=True, nogil=True)
def pdf(lobe, place, view, light):  # type: ignore[no-untyped-def]
    """Density per steradian with which :func:`sample` returns the light."""
    _, ov, on = view
    _, _, i_n = light
    if on <= 0.0 or i_n <= 0.0:
        return 0.0
    kept = lobe.share[place, phi_bin(ov, on, lobe.rho.shape[1])]
    if kept <= 0.0:
        return 0.0
    return evaluate(lobe, place, view, light) * i_n / kept


@njit(cache=True, nogil=True)
def sample(lobe, place, view, u1, u2, u3):  # type: ignore[no-untyped-def]
    """A light for the view, from numbers u1, u2, u3 in [0, 1), u3 only where k = 1.

    Its weight f cos / pdf is ``share``: by Eq. 5 all that is left to look up is the light.
    """
    ou, ov, on = view
    bins = lobe.cdf.shape[1]
    row = lobe.cdf[place, phi_bin(ov, on, bins)]
    low, high = 0, bins
    while high - low > 1:
        middle = (low + high) // 2
        if row[middle] <= u1:
            low = middle
        else:
            high = middle
    width = row[low + 1] - row[low]
    inside = min(max((u1 - row[low]) / width, 0.0), 1.0) if width > 0 else 0.5
    sine = lobe.sines[low] + inside * (lobe.sines[low + 1] - lobe.sines[low])
    along = _sampled_theta_sine(ou, lobe.blur, u2, u3)
    rest = np.sqrt(max(1.0 - along * along, 0.0))
    return Direction(along, rest * sine, rest * np.sqrt(max(1.0 - sine * sine, 0.0)))


@njit(cache=True, nogil=True)
def _sampled_theta_sine(view_sine, blur, u2, u3):  # type: ignore[no-untyped-def]
    """The sine of a light's theta, drawn for that of a view."""
    if np.isinf(blur):
        return np.sqrt(u2) * np.cos(2.0 * np.pi * u3)  # the semicircle's law
    normal = np.sqrt(-2.0 * np.log(1.0 - u2)) * np.cos(2.0 * np.pi * u3)
    c = 1.0 - theta_quantile(view_sine) + blur * normal
    c = np.fmod(c, 2.0)
    if c < 0.0:
        c += 2.0
    return sine_of_quantile(2.0 - c if c > 1.0 else c)
