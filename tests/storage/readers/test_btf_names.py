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
    NamedPhotographs,
    directions_of_81,
    is_litter,
    ordered_photographs,
    photograph_name,
)
from tests.storage.readers.btf_writers import EIGHTY_ONE, FIFTEEN, ubo_name, utia_name

WOOL = Path("in/wool.zip")
ANGLES = st.tuples(st.integers(0, 90), st.integers(0, 359))
SETS = st.lists(ANGLES, min_size=1, max_size=5, unique=True)


def ordered(names: list[str]) -> NamedPhotographs:
    return ordered_photographs(WOOL, names, lambda one, other: False)


def refusal(names: list[str]) -> BadInput:
    with pytest.raises(BadInput) as caught:
        ordered(names)
    assert re.fullmatch(r".+: .+ is .+; expected .+\.", str(caught.value))
    return caught.value


def full_set() -> list[str]:
    pairs = [(light, view) for view in EIGHTY_ONE for light in EIGHTY_ONE]
    return [ubo_name(light, view, k) for k, (light, view) in enumerate(pairs)]


@given(ANGLES, ANGLES, st.integers(0, 99999))
def test_angles_come_from_the_name_alone(
    light: tuple[int, int], view: tuple[int, int], index: int
) -> None:
    for name, style in (
        (ubo_name(light, view, index), "UBO2003 / ATRIUM"),
        (utia_name(light, view), "UTIA"),
        (f"tv001_pv001/{utia_name(light, view, 'EXR').split('/')[1]}", "UTIA"),
    ):
        assert photograph_name(name) == (view, light, style)


@pytest.mark.parametrize(
    "name",
    [
        "img_tv30_pv60_tl7.5_pl187.5.jpg",
        "tl7.5_pl187.5_tv30_pv060.png",
        "TL007.5-PL187.5-TV030-PV060.PNG",
        "tl-7.5_pl-187.5_tv-30_pv-60.png",  # every one with a hyphen: none is a sign
        "tl_7.5_pl_187.5_tv_30_pv_60.hdr",
        "tl=7.5 pl=187.5 tv=30 pv=60.exr",
        "tl7.5.pl187.5.tv30.pv60.exr",
        "tl7,5 pl187,5 tv30 pv60.jpg",
        "tv030_pv060/tl7.5_pl187.5.jpg",
        "tv030_pv060/tl7.5_pl187.5_hdr.png",
        "tl7.5pl187.5tv30pv60.jpg",
        "tv30_pv60_tl7.5_pl-172.5.png",
        "tv30_pv420_tl7.5_pl547.5.png",
        "tv30_pv60_tl-7.5_pl7.5.png",  # beyond the zenith
        "theta_i=7.5 phi_i=187.5 theta_o=30 phi_o=60.png",
        "ti7.5_pi187.5_to30_po60.jpg",
        "thetaL7.5_phiL187.5_thetaV30_phiV60.exr",
        "tl7.5_pl187.5_tv30_pv60/image.jpg",
        "wool_0001_tl7.5_pl187.5_tv30_pv60_crop.jpeg",
    ],
)
def test_angles_in_any_order_and_dress(name: str) -> None:
    assert photograph_name(name) == ((30, 60), (7.5, 187.5), "photographs")


@pytest.mark.parametrize(
    "name",
    [
        "tl000 pl000 tv000.jpg",
        "atl000 pl000 tv000 pv000.jpg",
        "tl000_tl015_pl000_tv000_pv000.png",
        "tv000_pv000/overview.png",
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
    found = ordered(names)
    assert (found.views, found.lights_per_view) == (len(views), len(lights))
    expected = [(view, light) for view in sorted(views) for light in sorted(lights)]
    assert found.names == [utia_name(light, view) for view, light in expected]
    np.testing.assert_allclose(np.degrees(found.view), [view for view, _ in expected])
    np.testing.assert_allclose(np.degrees(found.light), [light for _, light in expected])
    assert found.light.dtype == found.view.dtype == np.float64


def test_the_81_directions() -> None:
    assert directions_of_81() == [(float(theta), float(phi)) for theta, phi in EIGHTY_ONE]
    found = ordered(full_set())
    assert found.light.shape == (6561, 2)
    assert found.names[81 + 7].endswith("tl030 pl000 tv015 pv000.jpg")


def test_one_missing_pair_of_the_81_is_named() -> None:
    names = [name for name in full_set() if "tl015 pl060 tv030 pv090" not in name]
    error = refusal(names)
    assert str(error) == (
        "wool.zip: photograph tl=15 pl=60 tv=30 pv=90 is missing (1 missing in all); "
        "expected every one of 81 views x 81 lights: unpack the database again, or leave only "
        "views that have all lights."
    )
    assert error.file == str(WOOL)


def test_a_whole_missing_view_of_the_81_is_noticed() -> None:
    error = refusal([name for name in full_set() if "tv075 pv345" not in name])
    assert "tl=0 pl=0 tv=75 pv=345 is missing (81 missing in all)" in str(error)


def test_a_part_of_the_81_is_a_set_of_its_own() -> None:
    few = [(light, view) for view in EIGHTY_ONE[:7] for light in EIGHTY_ONE]
    found = ordered([ubo_name(*pair) for pair in few])
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
    assert "photograph tl=0 pl=0 tv=0 pv=0 is in two files that differ" in text
    assert f"move this or {names[0]} out of the database" in text
    assert text.startswith(names[1].rsplit("/")[-1])


def test_of_two_equal_files_of_a_pair_the_first_is_taken_and_it_is_said() -> None:
    names = [ubo_name((0, 0), (0, 0), index) for index in (3, 8)]
    found = ordered_photographs(WOOL, names, lambda one, other: (one, other) == tuple(names))
    assert found.names == names[:1]
    (note,) = found.notes
    assert "1 file (00008 tl000 pl000 tv000 pv000.jpg) was left out: copies" in note


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        (ubo_name((95, 0), (0, 0)), "tl is 95 degrees; expected 0 to 90 degrees"),
        (ubo_name((0, 0), (91, 0)), "tv is 91 degrees"),
    ],
)
def test_angles_below_the_surface(name: str, reason: str) -> None:
    error = refusal([ubo_name((0, 0), (0, 0)), name])
    assert reason in str(error)
    assert error.file == str(WOOL / name)


def test_photographs_of_other_dress_may_mix() -> None:
    found = ordered([ubo_name((0, 0), (0, 0)), utia_name((30, 0), (0, 0))])
    assert (found.lights_per_view, found.style, found.notes) == (2, "photographs", ())


def test_what_is_no_photograph_of_a_pair_is_left_out_and_said() -> None:
    beside = [
        "README", "Licence", "readme.TXT", "doc/measurement.xml", "paper.pdf", "clip.mp4",
        "tv000_pv000/overview.png", "directions.xlsx", "mask.png", "preview/tl0_pl0_tv0_pv0.png",
        "tl000_pl000_tv000_pv000.txt", "tl000_pl000_tv000_pv000",
    ]  # fmt: skip
    litter = [
        "__MACOSX/._tl000_pl000_tv000_pv000.jpg", ".DS_Store", "tv000_pv000/Thumbs.db",
        "tv000_pv000/.tl000_pl000_tv000_pv000.png", "desktop.ini", "@eaDir/x.jpg",
    ]  # fmt: skip
    assert all(map(is_litter, litter))
    assert not any(map(is_litter, beside))
    photograph = utia_name((0, 0), (0, 0))
    found = ordered([*beside, photograph, *litter])
    assert found.names == [photograph]
    (note,) = found.notes
    assert note == (
        "12 files (README, Licence, readme.TXT and 9 more) were left out: no photographs of a pair."
    )
    assert ordered([*litter, photograph]).notes == ()
    assert "content is without photographs" in str(refusal(beside))
    assert "found README, Licence" in str(refusal(beside))
    assert "content is without photographs" in str(refusal([]))


def test_a_missing_pair_names_what_was_left_out() -> None:
    names = [utia_name(light, (0, 0)) for light in FIFTEEN]
    more = [utia_name(light, (30, 0)) for light in FIFTEEN[1:]]
    text = str(refusal([*names, *more, "tv030_pv000/tl000_p000_tv030_pv000.png"]))
    assert "tl=0 pl=0 tv=30 pv=0 is missing" in text
    assert "tl000_p000_tv030_pv000.png had no angles" in text
