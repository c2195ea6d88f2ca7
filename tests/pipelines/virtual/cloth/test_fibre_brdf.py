"""The fibre BRDF against the textbook, brute force and the laws it must keep."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipelines.virtual.cloth.fibre_brdf import fibre_brdf

COLUMNS = {"albedo": (0.5, 0.3, 0.1), "specular": (0.05, 0.1, 0.3), "roughness": (0.2, 0.6)}


def directions(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    s = np.sin(theta)
    return np.stack([s * np.cos(phi), s * np.sin(phi), np.cos(theta)], axis=-1)


def some_directions(count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return directions(np.arccos(rng.random(count)), 2 * np.pi * rng.random(count))


def hemisphere(rings: int, spokes: int) -> tuple[np.ndarray, float]:
    """Directions with equal shares of the cosine-weighted hemisphere: (N, 3), weight of each."""
    sine = np.sqrt((np.arange(rings) + 0.5) / rings)[:, None]
    phi = 2 * np.pi * (np.arange(spokes) + 0.5) / spokes
    theta = np.broadcast_to(np.arcsin(sine), (rings, spokes))
    return directions(theta, np.broadcast_to(phi, theta.shape)).reshape(-1, 3), np.pi / (
        rings * spokes
    )


def test_without_gloss_it_is_lamberts() -> None:
    light, view = some_directions(50, 0), some_directions(50, 1)
    values = fibre_brdf(light, view, albedo=(1.0, 0.5, 0.0), specular=0 * light, roughness=(1, 1))
    np.testing.assert_allclose(values, np.tile([1 / np.pi, 0.5 / np.pi, 0], (50, 1)), rtol=1e-12)


def test_gloss_is_the_textbooks() -> None:
    """Heitz 2014 written down as printed, with tangents and Lambda."""
    light, view = some_directions(200, 2), some_directions(200, 3)
    f0, (ax, ay) = 0.04, (0.15, 0.5)
    half = light + view
    half /= np.linalg.norm(half, axis=-1, keepdims=True)

    def masking(v: np.ndarray) -> np.ndarray:
        theta, phi = np.arccos(v[:, 2]), np.arctan2(v[:, 1], v[:, 0])
        alpha = np.sqrt((np.cos(phi) * ax) ** 2 + (np.sin(phi) * ay) ** 2)
        return (-1 + np.sqrt(1 + (alpha * np.tan(theta)) ** 2)) / 2

    theta, phi = np.arccos(half[:, 2]), np.arctan2(half[:, 1], half[:, 0])
    slope = np.tan(theta) ** 2 * ((np.cos(phi) / ax) ** 2 + (np.sin(phi) / ay) ** 2)
    d = 1 / (np.pi * ax * ay * np.cos(theta) ** 4 * (1 + slope) ** 2)
    g = 1 / (1 + masking(light) + masking(view))
    fresnel = f0 + (1 - f0) * (1 - (light * half).sum(-1)) ** 5
    expected = fresnel * d * g / (4 * light[:, 2] * view[:, 2])
    values = fibre_brdf(light, view, albedo=(0, 0, 0), specular=(f0,) * 3, roughness=(ax, ay))
    np.testing.assert_allclose(values[:, 0], expected, rtol=1e-9)


def test_diffuse_lobe_is_ashikhmin_and_shirleys() -> None:
    light, view = some_directions(100, 4), some_directions(100, 5)
    f0 = 0.3
    parts = [
        fibre_brdf(light, view, albedo=(a,) * 3, specular=(f0,) * 3, roughness=(0.3, 0.6))
        for a in (0.0, 0.8)
    ]
    expected = (
        28 * 0.8 / (23 * np.pi) * (1 - f0)
        * (1 - (1 - light[:, 2] / 2) ** 5) * (1 - (1 - view[:, 2] / 2) ** 5)
    )  # fmt: skip
    np.testing.assert_allclose((parts[1] - parts[0])[:, 0], expected, rtol=1e-9)


unit = st.floats(0.0, 1.0)
alpha = st.floats(0.12, 1.0)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 1000),
    unit,
    st.floats(0.0, 0.99),
    st.floats(0.02, 1.0),
    st.floats(0.02, 1.0),
)
def test_reciprocal(seed: int, albedo: float, f0: float, along: float, across: float) -> None:
    light, view = some_directions(20, seed), some_directions(20, seed + 1)
    given_ = {"albedo": (albedo,) * 3, "specular": (f0,) * 3, "roughness": (along, across)}
    there, back = fibre_brdf(light, view, **given_), fibre_brdf(view, light, **given_)
    np.testing.assert_allclose(there, back, rtol=1e-12, atol=1e-300)


@settings(max_examples=40, deadline=None)
@given(unit, st.floats(0.0, 0.99), alpha, alpha, st.floats(0.0, 1.55), st.floats(0.0, 6.3))
def test_reflects_no_more_than_comes_in(
    albedo: float, f0: float, along: float, across: float, theta: float, phi: float
) -> None:
    light, weight = hemisphere(120, 240)
    view = directions(np.array(theta), np.array(phi))
    values = fibre_brdf(
        light, view, albedo=(albedo,) * 3, specular=(f0,) * 3, roughness=(along, across)
    )
    assert (values >= 0).all()
    total = values.sum(axis=0)[0] * weight
    assert total <= 1 + 2e-3  # of the quadrature


def test_fibre_direction_turns_the_gloss() -> None:
    light, view = some_directions(30, 6), some_directions(30, 7)
    turned = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    one = fibre_brdf(light, view, **COLUMNS)
    swapped = {**COLUMNS, "roughness": COLUMNS["roughness"][::-1]}
    np.testing.assert_allclose(fibre_brdf(light @ turned, view @ turned, **swapped), one)
    assert abs(fibre_brdf(light, view, **swapped) / one - 1).max() > 0.5


def test_nothing_from_below() -> None:
    below = np.array([0.6, 0.0, -0.8])
    assert not fibre_brdf(below, (0, 0, 1), **COLUMNS).any()
    assert not fibre_brdf((0, 0, 1), below, **COLUMNS).any()


@pytest.mark.parametrize(
    ("name", "value"),
    [("albedo", (1.1, 0, 0)), ("specular", (1.0, 0, 0)), ("roughness", (0.0, 0.5))],
)
def test_says_what_is_out_of_range(name: str, value: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match=name):
        fibre_brdf((0, 0, 1), (0, 0, 1), **{**COLUMNS, name: value})
