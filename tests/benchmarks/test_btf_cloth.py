"""Figures of the draped cloth on materials whose differences are known."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.btf_cloth import (
    DrapedCloths,
    cloth_errors,
    crops_sheet,
    dark_and_bright_crops,
    draped_cloths,
    sampling_variance_ratio,
)
from pipelines.neural_btf.material import FlatColour


@pytest.fixture(scope="module")
def drawn() -> DrapedCloths:
    greys = {"none": 0.4, "raw": 0.5, "same": 0.4, "500": 0.3}
    materials = {name: FlatColour((grey, grey, grey)) for name, grey in greys.items()}
    return draped_cloths(materials, width=80, samples=4)


def test_errors_are_those_of_the_greys(drawn: DrapedCloths) -> None:
    """Exposed for 0.4, a quarter darker or brighter everywhere, whatever the noise."""
    errors = cloth_errors(drawn)
    assert set(errors["cloth_rmse_to_none"]) == {"raw", "same", "500"}
    to_none = errors["cloth_rmse_to_none"]
    assert max(to_none["same"].values()) == 0
    reference = drawn.pictures["none"]
    crops = dark_and_bright_crops(reference, drawn.cloth)
    for name, crop in crops.items():
        expected = 0.25 * np.sqrt(np.mean(reference[crop] ** 2))
        assert to_none["500"][name] == pytest.approx(expected, rel=0.1)  # less what is clipped
    assert to_none["500"]["dark"] < to_none["500"]["bright"]
    assert errors["cloth_rmse_to_raw"]["500"]["dark"] > errors["cloth_rmse_to_raw"]["none"]["dark"]
    assert set(errors["cloth_render_s"]) == set(drawn.pictures)
    assert min(errors["cloth_render_s"].values()) > 0


def test_crops_are_the_darkest_and_the_brightest_square_of_cloth() -> None:
    rng = np.random.default_rng(0)
    picture = rng.random((30, 40, 3))
    cloth = np.zeros((30, 40), bool)
    cloth[3:26, 5:37] = True
    picture[0:3] = 0  # darker and brighter, but no cloth
    picture[27:] = 9
    crops = dark_and_bright_crops(picture, cloth)
    means = {
        (row, column): (
            picture[row : row + 4, column : column + 4] @ [0.2126, 0.7152, 0.0722]
        ).mean()
        for row in range(27)
        for column in range(37)
        if cloth[row : row + 4, column : column + 4].all()
    }
    for name, place in (("dark", min(means, key=means.get)), ("bright", max(means, key=means.get))):  # type: ignore[arg-type]
        assert (crops[name][0].start, crops[name][1].start) == place
        assert crops[name][0].stop - crops[name][0].start == 4


def test_the_sheet_has_a_column_a_material(drawn: DrapedCloths) -> None:
    sheet = crops_sheet(drawn)
    assert sheet.dtype == np.uint8
    assert sheet.shape[1] > sheet.shape[0]
    fewer = drawn._replace(pictures={"none": drawn.pictures["none"]})
    assert crops_sheet(fewer).shape[1] == pytest.approx(sheet.shape[1] / 4, abs=2)


def test_of_a_matt_colour_the_table_gains_nothing_and_the_skys_half_much() -> None:
    ratios = sampling_variance_ratio(FlatColour((0.5, 0.5, 0.5)))
    # By the cosine, a matt colour in even light has no variance at all but what is held at 75°.
    assert ratios["even light, even table"] == pytest.approx(1.0)
    assert ratios["small sun"] == pytest.approx(ratios["small sun, even table"], rel=0.05)
    assert ratios["small sun"] > 3
