"""The scratch graph at its smallest, planted regressions, users' files, bad input."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image

from assets_defs.glass_scratches.graph import SCRATCHES
from assets_defs.glass_scratches.layers import LayerSettings, layer_spec
from assets_defs.glass_scratches.photograph_files import load_scratches
from assets_defs.launcher import Request
from assets_defs.sources import Source
from pipelines.drawing import colour
from pipelines.drawing.colour import to_8bit
from pipelines.geometry import solid_shapes
from pipelines.glass_scratches.drawing import frames, live_parts, stage_view
from pipelines.glass_scratches.layers import coverage, features, scratch_layers
from pipelines.glass_scratches.photograph import photograph_layers
from pipelines.glass_scratches.tables import fresnel, glass_table, profiles, scratch_table
from pipelines.glass_scratches.tables import lobe as lobes
from pipelines.glass_scratches.tables.radiosity import equation_1
from storage.packages import encoding
from tests.assets_defs.regressions import Regression, assert_check_finds
from tests.pipelines.glass_scratches.photographs import SPEC, photograph

SETTING = {"setting": "setting-2"}
PAPER = {"setting": "setting-1"}
"""With the paper's walls."""
PHOTO = {"setting": "pane-png"}
"""A photograph."""
PLATE = {"object": "plate"}
KEYS = SETTING | PLATE
TINY = {"size": 32, "samples": 2, "lights": 1, "moving_size": 32}


@pytest.fixture(scope="module")
def good(house: Any) -> Any:
    """The house with a diffuse and a clear setting made once, and one with the paper's walls."""
    house.launcher.launch(Request(SCRATCHES, [KEYS, {"setting": "clear"}], preset="test"))
    house.launcher.launch(Request(SCRATCHES, [PAPER], preset="test", given={"walls": "paper"}))
    _, light = photograph(SPEC, 1)
    inbox = house.workspace.inbox(SCRATCHES.name)
    inbox.mkdir(parents=True, exist_ok=True)
    Image.fromarray(to_8bit(2 * np.repeat(light[..., None], 3, axis=2))).save(inbox / "pane.png")
    house.launcher.launch(Request(SCRATCHES, [PHOTO], preset="test", given={"resolution": 256}))
    return house


def _open(house: Any, asset: str, keys: dict[str, str]) -> Any:
    return house.workspace.store.open(SCRATCHES.slot(asset, keys))


def test_every_asset_is_current_and_has_passed_every_check(good: Any) -> None:
    store = good.workspace.store
    for plan in SCRATCHES.plans.values():
        slot = SCRATCHES.slot(plan.name, {name: KEYS[name] for name in plan.by})
        verdicts = store.verdicts(slot, store.current(slot))
        assert set(verdicts) == {check.name for check in plan.checks}
        assert all(verdict["passed"] for verdict in verdicts.values())


def test_the_papers_table_is_the_papers_up_to_its_normalisation(good: Any) -> None:
    """Eq. 1 counts rays: M / (N cos phi_o) each. All N that enter leave again."""
    rho = _open(good, "scratch_table_2d", PAPER)["rho"].values[0]
    bins = len(rho)
    centres = (np.arange(bins) + 0.5) * np.pi / bins - np.pi / 2
    counted = equation_1(rho) * np.cos(centres)[:, None] / bins
    assert np.allclose(counted.sum(axis=0), 1.0, atol=1e-10)


def test_leans_are_those_of_the_paper(good: Any) -> None:
    """At theta_o = 0 and pi / 2 by Eq. 2; between them by Eq. 3 and 4, gamma = 8.5476."""
    table = _open(good, "scratch_table", PAPER)
    rho = _open(good, "scratch_table_2d", PAPER)["rho"].values[0]
    bins = len(rho)
    reflected, leans = table["rho"].values[:, :bins, :bins], table["lean"].values
    assert np.allclose(reflected[0], 0.04 * rho, rtol=1e-6)
    assert np.allclose(reflected[-1], rho, rtol=1e-6)  # F(pi / 2) = 1
    between = (2 * np.arcsin(leans[3]) / np.pi) ** 8.5476
    assert np.allclose(reflected[3], (between + (1 - between) * 0.04) * rho, rtol=1e-4)


def test_clear_walls_lose_nothing_and_keep_the_lean(good: Any) -> None:
    table = _open(good, "scratch_table_2d", {"setting": "clear"})
    assert table.attrs["keeps_lean"]
    assert table.attrs["walls"] == "glass"
    assert (table["standard_error"].values > 0).any()
    solved = _open(good, "scratch_table_2d", SETTING)
    assert not solved.attrs["keeps_lean"]
    assert (solved["standard_error"].values == 0).all()


def test_frames_show_scratches_and_stay_below_a_uniform_environment(good: Any) -> None:
    shown = _open(good, "glass_frames", KEYS)
    assert 0.02 < shown["scratched"].values[1].mean() < 0.9
    assert abs(shown["furnace"].values.mean() - 1) < 0.02
    assert shown["moving"].shape == (2, 48, 48, 3)


@pytest.mark.slow
def test_the_overview_lays_settings_side_by_side(good: Any) -> None:
    store = good.workspace.store
    good.launcher.launch(Request(SCRATCHES, [{"setting": "clear"} | PLATE], "test", TINY))
    good.launcher.launch(Request(SCRATCHES, [KEYS], "test", TINY))
    assert SCRATCHES.overview is not None
    pictures = SCRATCHES.overview(store, list(store.slots()))
    assert set(pictures) == {
        "plate-far",
        "plate-close",
        "plate-diffuse-to-clear",
        "plate-moving-light",
    }
    assert pictures["plate-far"].shape == (32, 64, 3)
    good.launcher.launch(Request(SCRATCHES, [KEYS], "test"))


def test_the_papers_settings_are_the_papers_and_worn_glass_varies(good: Any) -> None:
    """Table 1 to the letter, every scratch like the next; and as years leave them: the widest of
    twenty is many times as wide as the narrowest, the weakest a fraction as strong."""
    for name, length, width in (("setting-1", 0.3, 0.001), ("setting-2", 0.6, 0.01)):
        spec = layer_spec(LayerSettings.preset("demo", {"setting": name}))
        assert (spec.length, spec.width, spec.threshold) == (length, width, 0.1)
        assert (spec.coverage, spec.spread, spec.fading, spec.breaks, spec.digs) == (
            None,
            0,
            0,
            0,
            0,
        )
        if name == "setting-2":
            same = scratch_layers.make_layers(spec, 3).features
            assert np.ptp(same.half_width) == np.ptp(same.half_length) == 0
            assert (same.strength == 1).all()
    worn = layer_spec(LayerSettings.preset("demo", {"setting": "worn"}))
    made = scratch_layers.make_layers(worn, 3).features
    for sizes, times in ((made.half_width, 8), (made.half_length, 5), (made.strength, 4)):
        low, high = np.quantile(sizes[~made.is_dig], [0.05, 0.95])
        assert high > times * low


# ---- users' files ----------------------------------------------------------------------------


def test_a_profile_a_mesh_and_an_environment_of_the_users(make_house: Any, tmp_path: Path) -> None:
    house = make_house()
    inbox = house.workspace.inbox("glass_scratches")
    inbox.mkdir(parents=True)
    profile = inbox / "diamond.csv"
    profile.write_text("v,n\n-6,0\n-4,1\n-1,-3\n0,-3.5\n2,-2\n4,1.5\n7,0\n")
    mesh = inbox / "block.obj"
    solid = solid_shapes.plate(1.0, 1.0, 0.6)
    mesh.write_text(
        "".join(f"v {x} {y} {z}\n" for x, y, z in solid.vertices)
        + "".join(f"f {a} {b} {c}\n" for a, b, c in solid.triangles + 1)
    )
    sky = tmp_path / "sky.hdr"
    light = np.full((16, 32, 3), 0.1, np.float32)
    light[4, 20] = 40.0
    assert cv2.imwrite(str(sky), light)
    keys = {"setting": Source.of(profile).key, "object": Source.of(mesh).key}
    request = Request(SCRATCHES, [keys], "test", TINY | {"environment": str(sky)})
    made = house.launcher.launch(request)
    assert {outcome.state for outcome in made} == {"made"}
    points = _open(house, "scratch_profile", {"setting": keys["setting"]})["points"].values
    assert points[:, 1].max() == 0.0
    assert np.isclose(points[:, 1].min(), -4.5)  # from the lower crest
    # The same file is current; another one under its name is not.
    assert {outcome.state for outcome in house.launcher.launch(request)} == {"current"}
    assert cv2.imwrite(str(sky), light * 2)
    again = house.launcher.launch(request)
    made_again = [o.slot.asset for o in again if o.state == "made"]
    assert made_again == ["glass_frames", "glass_package"]


# ---- planted regressions ---------------------------------------------------------------------


def _deeper(right: Callable[..., Any], *arguments: Any) -> Any:
    return right(*arguments) * [1.0, 1.1]


def _nanometres_as_micrometres(right: Callable[..., Any], *arguments: Any) -> Any:
    return right(*arguments) * [1.0, 1000.0]


def _raised(right: Callable[..., Any], *arguments: Any) -> Any:
    return right(*arguments) + np.array([0.0, 0.1])


def _brighter_table(right: Callable[..., Any], *arguments: Any) -> Any:
    solved = right(*arguments)
    return solved._replace(leaving=solved.leaving * 1.001)


def _one_sided(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    made = right(*arguments, **options)
    return made._replace(rho=made.rho * np.linspace(0.99, 1.01, made.rho.shape[-1]))


def _other_profile(right: Callable[..., Any], profile: Any, *arguments: Any) -> Any:
    return right(profile * [1.0, 1.6], *arguments)


def _skewed_sampler(right: Callable[..., Any], *arguments: Any) -> Any:
    lobe = right(*arguments)
    return lobe._replace(cdf=(lobe.cdf.astype(np.float64) ** 1.1).astype(np.float32))


def _generous_sampler(right: Callable[..., Any], *arguments: Any) -> Any:
    lobe = right(*arguments)
    return lobe._replace(share=(lobe.share * np.float32(1.02)).astype(np.float32))


def _other_exponent(right: Callable[..., Any], *arguments: Any) -> Any:
    factors = right(*arguments)
    return factors._replace(gamma=factors.gamma * 0.8)


def _wide_scratches(right: Callable[..., Any], *arguments: Any) -> Any:
    made = right(*arguments)
    wide = made.features._replace(half_width=made.features.half_width * np.float32(2.0))
    return features.layers_of_features(made.angle, wide)


def _moved_map(right: Callable[..., Any], *arguments: Any) -> Any:
    return np.roll(right(*arguments), 40, axis=2)


def _holed(right: Callable[..., Any], *arguments: Any) -> Any:
    solid = right(*arguments)
    return solid._replace(triangles=solid.triangles[:-1], corner_normals=solid.corner_normals[:-1])


def _smaller(right: Callable[..., Any], *arguments: Any) -> Any:
    solid = right(*arguments)
    return solid._replace(vertices=solid.vertices * 0.8)


def _negative_pixel(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    picture = right(*arguments, **options)
    picture.radiance[0, 0] = -1.0
    return picture


def _unscratched(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    picture = right(*arguments, **options)
    return picture._replace(scratched=picture.scratched * 0)


def _close_view_lost(right: Callable[..., Any], picture: Any) -> Any:
    """Scratches fill more of the close view than of the far one."""
    clean = right(picture)
    return clean * np.float32(0.01) if picture.normal.any(axis=2).all() else clean


def _furnace_times(factor: float) -> Callable[..., Any]:
    def wrong(right: Callable[..., Any], *arguments: Any) -> Any:
        picture = right(*arguments)
        return picture._replace(radiance=picture.radiance * np.float32(factor))

    return wrong


def _inside_out(right: Callable[..., Any], *arguments: Any) -> Any:
    places, shading, facing = right(*arguments)
    return places, shading, -facing


def _short_scratches(right: Callable[..., Any], contrast: Any) -> Any:
    found = right(contrast)
    return found._replace(segments=found.segments._replace(length=2 * found.segments.width))


def _turned(right: Callable[..., Any], scratches: Any, seed: int) -> Any:
    of = scratches.segments
    return right(scratches._replace(segments=of._replace(angle=of.angle + 0.5)), seed)


def _slight(right: Callable[..., Any], scratches: Any, seed: int) -> Any:
    return right(scratches._replace(strength=0.4 * scratches.strength), seed)


REGRESSIONS = (
    Regression("aspect", profiles, "cut_profile", _deeper, SETTING),
    Regression("aspect", profiles, "cut_profile", _nanometres_as_micrometres, SETTING),
    Regression("opening_tilt", profiles, "cut_profile", _raised, SETTING),
    Regression("energy_error", glass_table, "solve_glass", _brighter_table, SETTING),
    Regression("reciprocity_error", glass_table, "glass_table", _one_sided, SETTING),
    Regression("paths_z_rms", glass_table, "factors_of_both_sides", _other_profile, SETTING),
    Regression("paths_z_rms", scratch_table, "view_factors", _other_profile, PAPER),
    Regression(
        "across_error",
        glass_table,
        "_with_mean",
        lambda right, *arguments: right(*arguments) * np.float32(1.001),
        SETTING,
    ),
    Regression("sampler_p", lobes, "make_lobe", _skewed_sampler, SETTING),
    Regression("interpolation_error", fresnel, "fresnel_factors", _other_exponent, PAPER),
    Regression("largest_share", lobes, "make_lobe", _generous_sampler, SETTING),
    Regression("coverage_error", scratch_layers, "make_layers", _wide_scratches, SETTING),
    Regression("slenderness", photograph_layers, "find_segments", _short_scratches, PHOTO),
    Regression("photo_direction_error", photograph_layers, "layers_like", _turned, PHOTO),
    Regression("photo_coverage_ratio", photograph_layers, "layers_like", _slight, PHOTO),
    Regression("map_z", coverage, "coverage_maps", _moved_map, SETTING),
    Regression("edge_error", solid_shapes, "plate", _holed, PLATE),
    Regression("volume", solid_shapes, "plate", _smaller, PLATE),
    Regression("not_finite", frames, "trace_picture", _negative_pixel, KEYS),
    Regression("furnace_excess", frames, "trace_furnace", _furnace_times(1.1), KEYS),
    Regression("furnace_loss", frames, "trace_furnace", _furnace_times(0.9), KEYS),
    Regression("scratched_share", frames, "trace_picture", _unscratched, KEYS),
    Regression(
        "mean_brightness",
        colour,
        "to_8bit",
        lambda right, picture: right(np.asarray(picture) * 0.5),
        KEYS,
    ),
    Regression("darker_view", frames, "denoised", _close_view_lost, KEYS),
    Regression(
        "denoised_change",
        frames,
        "denoised",
        lambda right, picture: right(picture) * np.float32(0.7),
        KEYS,
    ),
    Regression(
        "stage_flip",
        frames,
        "draw_scratched",
        lambda right, *arguments, **options: np.roll(right(*arguments, **options), 4, axis=1),
        KEYS,
    ),
    Regression(
        "stage_flip",
        frames,
        "draw_scratched",
        lambda right, *arguments, **options: right(*arguments, **options) * np.float32(0.3),
        KEYS,
    ),
    Regression(
        "mismatches",
        live_parts,
        "coverage_codes",
        lambda right, coverage: (coverage * 255).astype(np.uint8),
        KEYS,
    ),
    Regression("mismatches", stage_view, "corners_apart", _inside_out, KEYS),
    Regression("mismatches", encoding, "ktx2_bytes", lambda right, it: right(it[:, ::-1]), KEYS),
)


def test_a_photographs_layers_are_stored_with_what_it_does_not_tell(good: Any) -> None:
    photo, layers = (_open(good, name, PHOTO) for name in ("scratch_photo", "scratch_layers"))
    assert photo.sizes["segment"] > 30
    np.testing.assert_array_equal(layers["angle"], photo["angle"])
    assert float(layers["coverage"].sum("layer").mean()) == pytest.approx(0.06, rel=0.3)
    assert _open(good, "scratch_photo", SETTING).sizes["segment"] == 0
    assert _open(good, "scratch_profile", PHOTO).attrs["name"] == "pane.png"


def test_a_look_that_the_photograph_tells_is_not_set(good: Any) -> None:
    with pytest.raises(ValueError, match=r"pane\.png: digs is set to 0\.5; expected no such"):
        good.launcher.launch(Request(SCRATCHES, [PHOTO], given={"digs": 0.5}))


def test_a_photograph_without_scratches_is_refused_in_one_sentence(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).normal(120.0, 3.0, (128, 128))
    Image.fromarray(noise.astype(np.uint8)).save(tmp_path / "clean.png")
    sentence = r"clean\.png: number of scratches is 0 lines .*; expected 8 or more, .* set crop"
    with pytest.raises(ValueError, match=sentence):
        load_scratches(Source.of(tmp_path / "clean.png"), {})


def test_every_check_has_a_planted_regression() -> None:
    names = {check.name for plan in SCRATCHES.plans.values() for check in plan.checks}
    assert {regression.check for regression in REGRESSIONS} == names


@pytest.mark.parametrize("regression", REGRESSIONS, ids=lambda regression: regression.check)
def test_a_planted_regression_fails_its_check_and_the_last_good_version_stays(
    good: Any, regression: Regression, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert_check_finds(good, SCRATCHES, regression, monkeypatch)


# ---- bad input -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"albedo": 1.2}, r"'albedo' is 1\.2; input should be less than or equal to 1"),
        ({"refractive_index": 1.0}, r"'refractive_index' is 1\.0; input should be greater than 1"),
        ({"bins": 31}, r"'bins' is 31; input should be a multiple of 2"),
        ({"bins": 6}, r"'bins' is 6; input should be greater than or equal to 8"),
        ({"width": 0.0}, r"'width' is 0\.0; input should be greater than 0"),
        ({"profile_width": 0.0}, r"'profile_width' is 0\.0; input should be greater than 0"),
        ({"threshold": 0.7}, r"'threshold' is 0\.7; input should be less than or equal to 0\.5"),
        ({"roughness": 0.5, "method": "exact"}, r"roughness is 0\.5 with the method exact"),
        ({"roughness": 0.5, "walls": "paper"}, r"roughness is 0\.5 with the paper's walls"),
        ({"resolution": 100}, r"resolution is 100; expected a power of two"),
        ({"shape": "u", "profile_depth": 8.0}, r"depth of the profile is 8; expected at most 5"),
        ({"environment": "moon"}, r"environment is 'moon'; expected room, lamps, sky, uniform"),
        ({"environment": "gone.hdr"}, r"gone\.hdr: .* missing"),
        ({"length": 0.001, "width": 0.0001}, r"makes 40000000 scratches; expected at most 2000000"),
    ],
)
def test_bad_settings_are_refused_before_any_work(
    good: Any, given: dict[str, Any], sentence: str
) -> None:
    store = good.workspace.store
    before = {slot: store.pointer(slot) for slot in store.slots()}
    with pytest.raises(ValueError, match=sentence) as refused:
        good.launcher.launch(Request(SCRATCHES, [KEYS], given=given))
    assert len(str(refused.value).splitlines()) == 1
    assert {slot: store.pointer(slot) for slot in store.slots()} == before


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("loop.csv", "v,n\n-5,0\n3,-4\n-3,-4\n5,0\n", r"loop\.csv: the profile crosses itself"),
        ("nan.csv", "v,n\n-5,0\n0,nan\n5,0\n", r"nan\.csv: .*1 more without a height"),
        ("hang.csv", "v,n\n0,0\n-3,-2\n2,-4\n5,0\n", r"hang\.csv: the profile runs back under"),
        (
            "open.obj",
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n",
            r"open\.obj: .*open|open\.obj: .*border",
        ),
    ],
)
def test_bad_files_are_refused_before_any_work(
    good: Any, name: str, content: str, sentence: str
) -> None:
    inbox = good.workspace.inbox("glass_scratches")
    inbox.mkdir(parents=True, exist_ok=True)
    (inbox / name).write_text(content)
    key = Source.of(inbox / name).key
    keys = KEYS | {"object" if name.endswith("obj") else "setting": key}
    with pytest.raises(ValueError, match=sentence) as refused:
        good.launcher.launch(Request(SCRATCHES, [keys], preset="test"))
    assert len(str(refused.value).splitlines()) == 1
    (inbox / name).unlink()


@pytest.mark.parametrize(
    ("value", "sentence"),
    [(np.nan, r"sky\.exr: .*no number in 32 of 512"), (0.0, r"sky\.exr: .*all black")],
)
def test_an_environment_with_bad_radiance_is_refused(
    good: Any, tmp_path: Path, value: float, sentence: str
) -> None:
    import OpenEXR

    light = np.zeros((16, 32, 3), np.float32)
    light[3] = value
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"RGB": light}) as file:
        file.write(str(tmp_path / "sky.exr"))
    with pytest.raises(ValueError, match=sentence):
        good.launcher.launch(
            Request(SCRATCHES, [KEYS], given={"environment": str(tmp_path / "sky.exr")})
        )
