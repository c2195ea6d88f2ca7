"""Maps fitted to a BTF: found again where there are some, and no better than they can be."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pipelines.light.directions import all_pairs, hemisphere_table, unit_vectors
from pipelines.neural_btf.svbrdf_fit import Svbrdf, fit_svbrdf, svbrdf_errors, svbrdf_values
from tests.tsuya.exports.bsdf_sampling import interaction, mitsuba

PAIRS = all_pairs(hemisphere_table(41), hemisphere_table(41))
CHOSEN = np.random.default_rng(1).permutation(len(PAIRS.light))[:240]
LIGHT, VIEW = unit_vectors(PAIRS.light[CHOSEN]), unit_vectors(PAIRS.view[CHOSEN])


def known_maps(texels: int) -> Svbrdf:
    rng = np.random.default_rng(2)
    normal = np.column_stack([rng.uniform(-0.3, 0.3, (texels, 2)), np.ones(texels)])
    return Svbrdf(
        rng.uniform(0.1, 0.8, (texels, 3)).astype(np.float32),
        np.zeros(texels, np.float32),
        rng.uniform(0.3, 0.9, texels).astype(np.float32),
        (normal / np.linalg.norm(normal, axis=1, keepdims=True)).astype(np.float32),
    )


def glossy_values(maps: Svbrdf, light: NDArray[np.floating], view: NDArray[np.floating]) -> object:
    """The model by the textbook: D, G and F one by one, in double precision."""
    out = np.zeros((len(maps.normal), len(light), 3))
    for texel in range(len(maps.normal)):
        normal, a = maps.normal[texel].astype(float), float(maps.roughness[texel]) ** 2
        half = (light + view) / np.linalg.norm(light + view, axis=1, keepdims=True)
        nl, nv, nh = light @ normal, view @ normal, half @ normal
        lit = (nl > 0) & (nv > 1e-3)
        d = a**2 / (np.pi * (nh**2 * (a**2 - 1) + 1) ** 2)

        def smith(cosine: NDArray[np.floating], a: float = a) -> NDArray[np.floating]:
            tangent2 = 1 / np.maximum(cosine, 1e-9) ** 2 - 1
            return (-1 + np.sqrt(1 + a**2 * tangent2)) / 2

        g = 1 / (1 + smith(nl) + smith(nv))
        f0 = 0.04 * (1 - maps.metallic[texel]) + maps.base_colour[texel] * maps.metallic[texel]
        f = f0 + (1 - f0) * ((1 - np.sum(light * half, axis=1)) ** 5)[:, None]
        gloss = f * (d * g / (4 * np.maximum(nl, 1e-9) * np.maximum(nv, 1e-9)))[:, None]
        matt = (1 - f) * maps.base_colour[texel] * (1 - maps.metallic[texel]) / np.pi
        out[texel] = np.where(lit[:, None], np.pi * (matt + gloss) * nl[:, None], 0.0)
    return out


def test_values_are_those_of_the_textbook() -> None:
    maps = known_maps(5)._replace(metallic=np.linspace(0, 1, 5, dtype=np.float32))
    above = (VIEW @ maps.normal.T > 0.02).all(axis=1)
    expected = glossy_values(maps, LIGHT[above], VIEW[above])
    assert np.allclose(svbrdf_values(maps, LIGHT[above], VIEW[above]), expected, atol=2e-4)


def test_a_mirror_of_ggx_is_mitsubas() -> None:
    mi = mitsuba()
    rough = mi.load_dict(
        {"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": 0.25}
    )
    white = Svbrdf(
        np.ones((1, 3), np.float32),
        np.ones(1, np.float32),
        np.full(1, 0.5, np.float32),
        np.array([[0, 0, 1]], np.float32),
    )
    # From straight above, where both ways to correlate masking agree.
    above = np.tile([0.0, 0.0, 1.0], (len(LIGHT), 1))
    found = svbrdf_values(white, LIGHT, above)[0, :, 0]
    si = interaction(above[0])
    expected = [np.pi * rough.eval(mi.BSDFContext(), si, mi.Vector3f(*way))[0] for way in LIGHT]
    assert np.allclose(found, expected, rtol=2e-3, atol=1e-4)


def test_known_maps_are_found_again_whatever_a_few_outliers_say() -> None:
    maps = known_maps(24)
    values = svbrdf_values(maps, LIGHT, VIEW).copy()
    rng = np.random.default_rng(3)
    values[rng.random(values.shape[:2]) < 0.01] = 8.0
    found = fit_svbrdf(values[:, :160], LIGHT[:160], VIEW[:160])
    true = svbrdf_values(maps, LIGHT[160:], VIEW[160:])
    errors = svbrdf_errors(found, true, LIGHT[160:], VIEW[160:], 1.0)
    assert errors.rmse < 0.045
    assert errors.rmse < 0.25 * errors.flat_rmse
    angle = np.degrees(np.arccos(np.clip(np.sum(found.normal * maps.normal, axis=1), -1, 1)))
    assert np.median(angle) < 3.0
    # Its null: lights dealt at random.
    order = rng.permutation(160)
    wrong = fit_svbrdf(values[:, :160], LIGHT[:160][order], VIEW[:160])
    assert svbrdf_errors(wrong, true, LIGHT[160:], VIEW[160:], 1.0).rmse > 3 * errors.rmse


def test_one_matt_colour_has_no_error_as_its_own_null() -> None:
    flat = np.full((4, 1, 3), 0.3) * LIGHT[None, :, 2:]
    errors = svbrdf_errors(known_maps(4), flat, LIGHT, VIEW, 2.0)
    assert errors.flat_rmse == pytest.approx(0.0, abs=1e-9)
    assert errors.rmse > 0.02


def test_too_few_pairs_are_refused() -> None:
    with pytest.raises(ValueError, match="there are 3 pairs"):
        fit_svbrdf(np.ones((2, 3, 3)), LIGHT[:3], VIEW[:3])
