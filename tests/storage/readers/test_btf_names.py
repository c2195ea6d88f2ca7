"""Names of BTF photographs: angles, order, completeness; no file is opened."""

from __future__ import annotations

import random
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from storage.readers import BadInput
from storage.readers.btf_names import (
    directions_of_81,
    is_beside_the_point,
    ordered_photographs,
    photograph_name,
)
from tests.storage.readers.btf_writers import EIGHTY_ONE, FIFTEEN, ubo_name, utia_name

WOOL = Path("in/wool.zip")
ANGLES = st.tuples(st.integers(0, 90), st.integers(0, 359))
SETS = st.lists(ANGLES, min_size=1, max_size=5, unique=True)


def refusal(names: list[str]) -> BadInput:
    with pytest.raises(BadInput) as caught:
        ordered_photographs(WOOL, names)
    assert re.fullmatch(r".+: .+ is .+; expected .+\.", str(caught.value))
    return caught.value


def full_set() -> list[str]:
    pairs = [(light, view) for view in EIGHTY_ONE for light in EIGHTY_ONE]
    return [ubo_name(light, view, k) for k, (light, view) in enumerate(pairs)]


@given(ANGLES, ANGLES, st.integers(0, 99999))
def test_angles_come_from_the_name_alone(
    light: tuple[int, int], view: tuple[int, int], index: int
) -> None:
    for name, separator in (
        (ubo_name(light, view, index), "blanks"),
        (utia_name(light, view), "underscores"),
        (f"tv001_pv001/{utia_name(light, view, 'EXR').split('/')[1]}", "underscores"),
    ):
        assert photograph_name(name) == (view, light, separator)


def test_decimals_and_few_digits_are_angles() -> None:
    assert photograph_name("tl7.5_pl187.5_tv0_pv015.png") == ((0, 15), (7.5, 187.5), "underscores")


@pytest.mark.parametrize(
    "name",
    [
        "tl000 pl000 tv000.jpg",
        "tl000 pl000 tv000_pv000.jpg",
        "atl000 pl000 tv000 pv000.jpg",
        "tl000 pl000 tv000 pv000",
        "tl-15_pl000_tv000_pv000.png",
        "tl0000_pl000_tv000_pv000.png",
        "tl000_pl000_tv000_pv000/index.jpg",
        "",
    ],
)
def test_other_names_have_no_angles(name: str) -> None:
    assert photograph_name(name) is None


@settings(deadline=None)
@given(SETS, SETS, st.randoms(use_true_random=False))
def test_order_is_by_view_then_light_theta_then_phi(
    views: list[tuple[int, int]], lights: list[tuple[int, int]], chance: random.Random
) -> None:
    names = [utia_name(light, view) for view in views for light in lights]
    chance.shuffle(names)
    found = ordered_photographs(WOOL, names)
    assert (found.views, found.lights_per_view) == (len(views), len(lights))
    expected = [(view, light) for view in sorted(views) for light in sorted(lights)]
    assert found.names == [utia_name(light, view) for view, light in expected]
    np.testing.assert_allclose(np.degrees(found.view), [view for view, _ in expected])
    np.testing.assert_allclose(np.degrees(found.light), [light for _, light in expected])
    assert found.light.dtype == found.view.dtype == np.float64


def test_the_81_directions() -> None:
    assert directions_of_81() == [(float(theta), float(phi)) for theta, phi in EIGHTY_ONE]
    found = ordered_photographs(WOOL, full_set())
    assert found.light.shape == (6561, 2)
    assert found.names[81 + 7].endswith("tl030 pl000 tv015 pv000.jpg")


def test_one_missing_pair_of_the_81_is_named() -> None:
    names = [name for name in full_set() if "tl015 pl060 tv030 pv090" not in name]
    error = refusal(names)
    assert str(error) == (
        "wool.zip: photograph tl=15 pl=60 tv=30 pv=90 is missing (1 missing in all); "
        "expected every one of 81 views x 81 lights."
    )
    assert error.file == str(WOOL)


def test_a_whole_missing_view_of_the_81_is_noticed() -> None:
    error = refusal([name for name in full_set() if "tv075 pv345" not in name])
    assert "tl=0 pl=0 tv=75 pv=345 is missing (81 missing in all)" in str(error)


def test_a_part_of_the_81_is_a_set_of_its_own() -> None:
    few = [(light, view) for view in EIGHTY_ONE[:7] for light in EIGHTY_ONE]
    found = ordered_photographs(WOOL, [ubo_name(*pair) for pair in few])
    assert (found.views, found.lights_per_view) == (7, 81)


def test_a_gap_in_a_set_of_its_own_is_named() -> None:
    pairs = [
        (light, view) for view in FIFTEEN for light in FIFTEEN if (light, view) != ((60, 45),) * 2
    ]
    text = str(refusal([ubo_name(*pair) for pair in pairs]))
    assert "photograph tl=60 pl=45 tv=60 pv=45 is missing (1 missing in all)" in text
    assert "15 views x 15 lights" in text


def test_many_lights_seen_once_are_refused_quickly() -> None:
    names = [utia_name((k % 91, k // 91), (k // 91, k % 91)) for k in range(3000)]
    assert "missing" in str(refusal(names))


def test_two_files_of_a_pair_are_both_named() -> None:
    names = [ubo_name((0, 0), (0, 0), index) for index in (3, 8)]
    text = str(refusal(names))
    assert "photograph tl=0 pl=0 tv=0 pv=0 is in two files" in text
    assert names[0] in text
    assert text.startswith(names[1].rsplit("/")[-1])


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        (ubo_name((95, 0), (0, 0)), "tl is 95 degrees; expected 0 to 90 degrees"),
        (ubo_name((0, 0), (91, 0)), "tv is 91 degrees"),
        (ubo_name((0, 360), (0, 0)), "pl is 360 degrees; expected 0 to below 360"),
        (utia_name((0, 0), (0, 400)), "pv is 400 degrees"),
        ("UBO2003/clip.mp4", "clip.mp4: name is without angles"),
        ("tv000_pv000/overview.png", "overview.png: name is without angles"),
        (utia_name((30, 0), (0, 0)), "name is with underscores; expected blanks, as before"),
    ],
)
def test_unexpected_files_are_named(name: str, reason: str) -> None:
    error = refusal([ubo_name((0, 0), (0, 0)), name])
    assert reason in str(error)
    assert error.file == str(WOOL / name)


def test_documents_and_litter_are_left_out() -> None:
    beside = [
        "README", "Licence", "readme.TXT", "doc/measurement.xml", "__MACOSX/._tl000 pl000.jpg",
        ".DS_Store", "tv000_pv000/.tl000_pl000_tv000_pv000.png", "tv000_pv000/Thumbs.db",
        "desktop.ini", "paper.pdf",
    ]  # fmt: skip
    assert all(map(is_beside_the_point, beside))
    found = ordered_photographs(WOOL, [*beside, utia_name((0, 0), (0, 0))])
    assert found.names == [utia_name((0, 0), (0, 0))]
    assert "content is without photographs" in str(refusal(beside))
    assert "content is without photographs" in str(refusal([]))
