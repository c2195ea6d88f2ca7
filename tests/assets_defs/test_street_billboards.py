"""The street's graph at its smallest, planted regressions, users' drives, bad input."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import tsuya
from assets_defs.launcher import Request
from assets_defs.sources import Source
from assets_defs.street_billboards.datasets import compressed_of, pages_of, views_of
from assets_defs.street_billboards.graph import STREET
from pipelines.geometry.cameras import moved_left
from pipelines.street_billboards import billboards, figures, live_tiles, octree
from pipelines.street_billboards.capture import drive_depth, exposure, point_fusion, stereo
from pipelines.street_billboards.drawing import culling, processor_street, quads, street_stage
from pipelines.street_billboards.frames import draw_view
from pipelines.street_billboards.street_model import StreetModel
from pipelines.street_billboards.textures import atlases, eigen_textures, view_textures
from pipelines.street_billboards.textures.texture_tables import SEEN
from pipelines.virtual.city import drive as city_drive
from pipelines.virtual.city import drive_photographs
from storage.packages import encoding
from tests.assets_defs.regressions import Regression, assert_check_finds

KEYS = {"drive": "city"}


@pytest.fixture(scope="module")
def good(house: Any) -> Any:
    """The house with the built-in drive made once."""
    house.launcher.launch(Request(STREET, [KEYS], preset="test"))
    return house


def _open(house: Any, asset: str, key: str = "city") -> Any:
    return house.workspace.store.open(STREET.slot(asset, {"drive": key}))


def test_every_asset_is_current_and_has_passed_every_check(good: Any) -> None:
    store = good.workspace.store
    for plan in STREET.plans.values():
        slot = STREET.slot(plan.name, KEYS)
        verdicts = store.verdicts(slot, store.current(slot))
        assert set(verdicts) == {check.name for check in plan.checks}
        assert all(verdict["passed"] for verdict in verdicts.values())


def test_held_out_frames_feed_nothing_but_the_judgement(good: Any) -> None:
    drive = _open(good, "drive_frames")
    (held,) = np.flatnonzero(drive["held_out"].values)
    assert held not in _open(good, "depth_maps")["frame"].values
    assert drive.sizes["frame"] == _open(good, "depth_maps").sizes["taken"] + 1
    truth = _open(good, "street_frames")["truth"].values
    np.testing.assert_array_equal(truth[0], drive["photographs"].values[held, 1])


def test_stored_textures_and_pages_read_back(good: Any) -> None:
    textures = compressed_of(_open(good, "eigen_textures"))
    pages = pages_of(_open(good, "texture_atlases"))
    again = atlases.pack_pages(textures)
    assert len(pages) == len(again)
    for stored, packed in zip(pages, again, strict=True):
        for name in ("detail", "tint"):
            np.testing.assert_array_equal(
                getattr(stored, name).texels, getattr(packed, name).texels
            )
            assert getattr(stored, name).side == getattr(packed, name).side
        np.testing.assert_array_equal(stored.records, packed.records)
        np.testing.assert_array_equal(stored.masks, packed.masks)
    assert int(_open(good, "eigen_textures")["bytes"]) < 98_304 * len(textures.ranks) / 8


def test_stored_streets_load_as_what_they_are_drawn_from(good: Any) -> None:
    root = good.workspace.store.root

    def load(asset: str) -> Any:
        return tsuya.load(f"street_billboards/{asset}/city", root)

    made, pages, textures = map(load, ("billboards", "texture_atlases", "eigen_textures"))
    drive, shown = load("drive_frames"), load("street_frames")
    street = StreetModel(made, pages, textures, load("depth_maps")["sky"].values)
    size = (drive.sizes["x"], drive.sizes["y"])
    pose = moved_left(drive["poses"].values[5, 1], 1.0)
    picture = draw_view(street, drive["intrinsics"].values[1], pose, size)
    np.testing.assert_array_equal(picture, shown["beside"].values[0, 0])
    assert load("view_textures").first[-1] == len(load("view_textures").colours)


@pytest.mark.slow
def test_a_drive_of_one_camera_goes_through_the_whole_graph(make_house: Any) -> None:
    """And its checks find what is wrong with a plane sweep as they do with stereo."""
    house = make_house()
    house.launcher.launch(Request(STREET, [KEYS], "test", {"cameras": 1}))
    store = house.workspace.store
    for plan in STREET.plans.values():
        slot = STREET.slot(plan.name, KEYS)
        verdicts = store.verdicts(slot, store.current(slot))
        assert set(verdicts) == {check.name for check in plan.checks}
        assert all(verdict["passed"] for verdict in verdicts.values())
    drive, frames = _open(house, "drive_frames"), _open(house, "street_frames")
    assert drive.sizes["camera"] == _open(house, "depth_maps").sizes["camera"] == 1
    (held,) = np.flatnonzero(drive["held_out"].values)
    np.testing.assert_array_equal(frames["truth"].values[0], drive["photographs"].values[held, 0])
    for check, wrong in (("depth_error", _swept_deeper), ("deviation_honest", _swept_too_surely)):
        with pytest.MonkeyPatch.context() as patch:
            regression = Regression(check, drive_depth, "sweep_depth", wrong, KEYS)
            assert_check_finds(house, STREET, regression, patch)


def _swept_deeper(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    found = right(*arguments, **options)
    return found._replace(depth=found.depth * np.float32(1.1))


def _swept_too_surely(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    found = right(*arguments, **options)
    return found._replace(deviation=found.deviation * np.float32(0.3))


@pytest.mark.slow
def test_the_papers_form_and_plain_sampling(make_house: Any, good: Any) -> None:
    occluded = views_of(_open(good, "view_textures"))
    given = {"sampling": "plain", "planes": "turning", "coding": "paper", "frames": 8}
    house = make_house()
    house.launcher.launch(Request(STREET, [KEYS], "test", given))
    textures = compressed_of(_open(house, "eigen_textures"))
    shown = np.diff(textures.first) > 0
    assert set(np.diff(textures.first)[shown]) == {32}
    assert set(np.unique(textures.ranks[shown])) == {16}
    assert _open(house, "billboards")["turns"].values.all()
    plain = views_of(_open(house, "view_textures"))
    assert (plain.states == SEEN).mean() > 0.2
    assert (occluded.states == SEEN).mean() > 0.2


# ---- users' drives ---------------------------------------------------------------------------


def _write_drive(good: Any, folder: Path, **changes: Any) -> None:
    """The first frames of the built-in drive in nerfstudio's layout."""
    drive = _open(good, "drive_frames")
    count = int(changes.get("count", 8))
    lens = drive["intrinsics"].values[0]
    height, width = drive.sizes["y"], drive.sizes["x"]
    folder.mkdir(parents=True)
    rows = []
    for frame in range(count):
        for camera in range(3):
            name = f"{frame:03d}-{camera}.png"
            picture = drive["photographs"].values[frame, camera]
            assert cv2.imwrite(str(folder / name), picture[..., ::-1])
            pose = drive["poses"].values[frame, camera] @ np.diag([1.0, -1.0, -1.0, 1.0])
            if "pose" in changes:
                pose = changes["pose"](pose)
            rows.append(
                {
                    "file_path": name,
                    "transform_matrix": pose.tolist(),
                    "camera": camera,
                    "time": frame,
                }
            )
    focal = float(lens[0, 0]) * float(changes.get("focal", 1.0))
    about = {"fl_x": focal, "fl_y": focal, "w": width, "h": height}
    about |= {"cx": width / 2, "cy": height / 2}
    (folder / "transforms.json").write_text(json.dumps(about | {"frames": rows}))


def test_a_drive_of_the_users(make_house: Any, good: Any) -> None:
    house = make_house()
    folder = house.workspace.inbox("street_billboards") / "avenue"
    _write_drive(good, folder, pose=lambda pose: _on_a_map(pose))
    key = Source.of(folder).key
    house.launcher.launch(Request(STREET, [{"drive": key}], "test"))
    made, ours = _open(house, "street_frames", key), _open(good, "street_frames")
    assert "beside_truth" not in made
    assert np.abs(_open(house, "billboards", key)["centre"].values).max() < 200.0
    # One frame less behind it, and no more: the held-out frame looks nearly as good.
    assert float(made["psnr"][0]) > float(ours["psnr"][0]) - 2.0


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"focal": 1.35}, r"The focal length is off by more than \d+%; expected one with which"),
        ({"pose": lambda pose: _shifted(pose, 0.35)}, r"the poses confirm \d+%; expected \d+%"),
        ({"pose": lambda pose: _at(pose, 5.0)}, r"the car|car moved|way"),
        ({"count": 2}, r"instants?"),
    ],
    ids=["focal length", "poses", "standing still", "too few"],
)
def test_a_bad_drive_is_refused_before_any_work(
    good: Any, changes: dict[str, Any], sentence: str
) -> None:
    inbox = good.workspace.inbox("street_billboards")
    folder = inbox / f"bad{len(list(inbox.parent.rglob('bad*')))}"
    _write_drive(good, folder, **changes)
    store = good.workspace.store
    before = {slot: store.pointer(slot) for slot in store.slots()}
    with pytest.raises(ValueError, match=sentence) as refused:
        good.launcher.launch(Request(STREET, [{"drive": Source.of(folder).key}], "test"))
    assert len(str(refused.value).splitlines()) == 1
    assert {slot: store.pointer(slot) for slot in store.slots()} == before


def _on_a_map(pose: Any) -> Any:
    """Where a national grid has it: single precision would be half a metre off."""
    moved = pose.copy()
    moved[:3, 3] += [412_345.0, 5_678_910.0, 234.0]
    return moved


def _shifted(pose: Any, factor: float) -> Any:
    """The car drives ``factor`` as far as it did; its cameras stay as far apart."""
    moved = pose.copy()
    moved[0, 3] *= factor
    return moved


def _at(pose: Any, x: float) -> Any:
    moved = pose.copy()
    moved[:2, 3] = [x, round(float(pose[1, 3] + 1.75) / 0.8) * 0.8]
    return moved


# ---- planted regressions ---------------------------------------------------------------------


def _bright_camera(right: Callable[..., Any], radiance: Any, gain: float, *others: Any) -> Any:
    return right(radiance, gain * (3.0 if others[-1].random() < 0.5 else 1.0), *others)


def _blurred(right: Callable[..., Any], *arguments: Any) -> Any:
    return cv2.blur(right(*arguments), (9, 9))


def _slower(
    right: Callable[..., Any], frames_: int, spacing: float, *rest: Any, **more: Any
) -> Any:
    return right(frames_, 0.9 * spacing, *rest, **more)


def _off_by_a_pixel(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    found, *rest = right(*arguments, **options)
    return found + np.float32(1.0), *rest


def _deeper(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    maps = right(*arguments, **options)
    return maps._replace(depth=maps.depth * np.float32(1.1))


def _too_sure(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    maps = right(*arguments, **options)
    return maps._replace(deviation=maps.deviation * np.float32(0.3))


def _half_unknown(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    maps = right(*arguments, **options)
    maps.depth[:, ::2] = np.nan
    maps.depth[:, :, ::2] = np.nan
    return maps


def _some(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    points = right(*arguments, **options)
    return type(points)(*(values[::3] for values in points))


def _nearer(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    points = right(*arguments, **options)
    moved = points.positions.copy()
    moved[::5] = [8.0, 0.0, 1.5] + 0.6 * (moved[::5] - [8.0, 0.0, 1.5])
    return points._replace(positions=moved)


def _tilted(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    made = right(*arguments, **options)
    return made._replace(half_t=made.half_t + np.float32(0.7) * made.half_s[:, [2, 1, 0]] + 0.2)


def _sparse(right: Callable[..., Any], positions: Any, side: float, least: int) -> Any:
    return right(positions, side, 12 * least)


def _mirrored(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    views = right(*arguments, **options)
    return views._replace(colours=views.colours[:, ::-1, ::-1].copy())


def _half_seen(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    views = right(*arguments, **options)
    states = views.states.copy()
    states[:, ::2] = 0
    return views._replace(states=states)


def _one_view(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    views = right(*arguments, **options)
    rows = views.first[:-1][np.diff(views.first) > 0]
    counts = np.minimum(np.diff(views.first), 1)
    return type(views)(
        np.concatenate([[0], np.cumsum(counts)]), *(values[rows] for values in views[1:])
    )


def _asked_for(factor: float) -> Callable[..., Any]:
    return lambda right, views, turns, error: right(views, turns, error=factor * error)


def _too_many(right: Callable[..., Any], views: Any, turns: Any, error: float) -> Any:
    """The last billboard gets 40 planes of nothing."""
    made = right(views, turns, error=error)
    last = int(np.flatnonzero(np.diff(made.first) > 0)[-1])
    count, rank = int(np.diff(made.first)[last]), int(made.ranks[last, 0])
    ranks = made.ranks.copy()
    ranks[last, 0] += 40
    own = made.weights[0][len(made.weights[0]) - count * rank :].reshape(count, rank)
    own = np.pad(own, ((0, 0), (0, 40)), constant_values=128)
    weights = np.concatenate([made.weights[0][: len(made.weights[0]) - count * rank], own.ravel()])
    nothing = np.full((40, 32, 32), 128, np.uint8)
    return made._replace(
        ranks=ranks,
        planes=(np.concatenate([made.planes[0], nothing]), *made.planes[1:]),
        scales=(np.pad(made.scales[0], (0, 40)), *made.scales[1:]),
        weights=(weights, *made.weights[1:]),
    )


def _half_the_error(right: Callable[..., Any], *arguments: Any) -> Any:
    rmse, psnr = right(*arguments)
    return rmse / 2, psnr


def _wrong_tile(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    made = right(*arguments, **options)
    for page in made:
        page.detail.texels[:] = page.detail.texels[::-1].copy()
    return made


def _bytes(factor: float, field: str) -> Callable[..., Any]:
    def wrong(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
        made = right(*arguments, **options)
        return [
            page._replace(**{field: int(factor * (page.bytes + page.padding))}) for page in made
        ]

    return wrong


def _few_seen(right: Callable[..., Any], *arguments: Any) -> Any:
    seen = right(*arguments)
    return seen[: len(seen) // 2]


def _wrong_exposure(right: Callable[..., Any], picture: Any, *others: Any) -> Any:
    return np.clip(right(picture, *others).astype(int) + 25, 0, 255).astype(np.uint8)


def _shaken(right: Callable[..., Any], picture: Any, *others: Any) -> Any:
    return np.roll(right(picture, *others), 3, axis=1)


def _paler(right: Callable[..., Any], *arguments: Any) -> Any:
    right(*arguments)
    arguments[-1][..., :3] //= 2


def _shifted_codes(right: Any, codes: Any) -> Any:
    return right(np.roll(codes, 3, axis=1))


def _beside(right: Any, *arguments: Any) -> Any:
    """Billboards a hand's breadth from where they stand."""
    headers = right(*arguments)
    headers[:, ::5, 1] += 0.1
    return headers


REGRESSIONS = (
    Regression("exposure_spread", drive_photographs, "expose_photograph", _bright_camera, KEYS),
    Regression("detail", drive_photographs, "expose_photograph", _blurred, KEYS),
    Regression("frame_spacing", city_drive, "plan_drive", _slower, KEYS),
    Regression("stereo_bad05", stereo, "refine_disparities", _off_by_a_pixel, KEYS),
    Regression("depth_error", stereo, "depth_maps", _deeper, KEYS),
    Regression("deviation_honest", stereo, "depth_maps", _too_sure, KEYS),
    Regression("known_share", stereo, "depth_maps", _half_unknown, KEYS),
    Regression(
        "agreement", point_fusion, "photometric_agreement", lambda right, *a: 0.5 * right(*a), KEYS
    ),
    Regression("points_a_metre", point_fusion, "fuse_points", _some, KEYS),
    Regression("stray_share", point_fusion, "fuse_points", _nearer, KEYS),
    Regression(
        "largest_gain", exposure, "exposure_gains", lambda right, *a: right(*a) ** 2 * 1.2, KEYS
    ),
    Regression("points_in", octree, "octree_leaves", _sparse, KEYS),
    Regression("off_plane", billboards, "fit_billboards", _tilted, KEYS),
    Regression(
        "still_share",
        billboards,
        "fit_billboards",
        lambda right, *a, **o: right(*a, **(o | {"all_turn": True})),
        KEYS,
    ),
    Regression("seen_share", view_textures, "view_textures", _half_seen, KEYS),
    Regression("sampling_error", view_textures, "view_textures", _mirrored, KEYS),
    Regression("views_each", view_textures, "view_textures", _one_view, KEYS),
    Regression("over_budget", eigen_textures, "compress_views", _asked_for(1.6), KEYS),
    Regression("sampled_rmse", eigen_textures, "decode_error", _half_the_error, KEYS),
    Regression("byte_share", eigen_textures, "compress_views", _asked_for(0.4), KEYS),
    Regression("excess_rank", eigen_textures, "compress_views", _too_many, KEYS),
    Regression("unpacked_error", atlases, "pack_pages", _wrong_tile, KEYS),
    Regression("bytes_a_metre", atlases, "pack_pages", _bytes(2.0, "bytes"), KEYS),
    Regression("padding_share", atlases, "pack_pages", _bytes(1.0, "padding"), KEYS),
    Regression("coverage", quads, "visible_billboards", _few_seen, KEYS),
    Regression("held_out_psnr", figures, "match_exposure", _wrong_exposure, KEYS),
    Regression("held_out_ssim", figures, "match_exposure", _shaken, KEYS),
    Regression("held_out_flip", figures, "match_exposure", _shaken, KEYS),
    Regression("shader_difference", processor_street, "decode_views", _paler, KEYS),
    Regression("mismatches", encoding, "_png", _shifted_codes, KEYS),
    Regression("tile_error", live_tiles, "page_headers", _beside, KEYS),
)


def test_every_check_has_a_planted_regression() -> None:
    names = {check.name for plan in STREET.plans.values() for check in plan.checks}
    assert {regression.check for regression in REGRESSIONS} == names


@pytest.mark.parametrize("regression", REGRESSIONS, ids=lambda regression: regression.check)
def test_a_planted_regression_fails_its_check_and_the_last_good_version_stays(
    good: Any, regression: Regression, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert_check_finds(good, STREET, regression, monkeypatch)


# ---- bad settings ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (
            {"coding": "paper", "byte_budget": 1_000_000},
            r"city: the textures of 27 m of road need \d+ bytes at least; expected no more than "
            r"byte_budget, 1000000",
        ),
        ({"frames": 3}, r"'frames' is 3; input should be greater than or equal to 8"),
        ({"voxel": 0.0}, r"'voxel' is 0\.0; input should be greater than 0\.02"),
        ({"rank": 40}, r"'rank' is 40; input should be less than or equal to 31"),
        ({"sampling": "guessed"}, r"'sampling' is 'guessed'; "),
    ],
)
def test_bad_settings_are_refused_before_any_work(
    good: Any, given: dict[str, Any], sentence: str
) -> None:
    store = good.workspace.store
    before = {slot: store.pointer(slot) for slot in store.slots()}
    with pytest.raises(ValueError, match=sentence) as refused:
        good.launcher.launch(Request(STREET, [KEYS], "test", given=given))
    assert len(str(refused.value).splitlines()) == 1
    assert {slot: store.pointer(slot) for slot in store.slots()} == before


def test_an_atlas_that_does_not_fit_says_its_bytes(good: Any) -> None:
    textures = compressed_of(_open(good, "eigen_textures"))
    with pytest.raises(ValueError, match=r"would take \d+ bytes; expected 200000"):
        atlases.pack_pages(textures, byte_budget=200_000)


def test_culled_billboards_are_out_of_the_picture(good: Any) -> None:
    """Drawn with everything sent, the first held-out frame is the same picture."""
    from assets_defs.street_billboards.datasets import billboards_of

    drive = _open(good, "drive_frames")
    pose, lens = drive["poses"].values[5, 1], drive["intrinsics"].values[1]
    size = (drive.sizes["x"], drive.sizes["y"])
    made = billboards_of(_open(good, "billboards"))
    sky = _open(good, "depth_maps")["sky"].values
    with street_stage.StreetStage(
        made, pages_of(_open(good, "texture_atlases")), sky, size
    ) as stage:
        view = stage.view(lens, pose)
    assert view.billboards < len(made.centre)
    assert len(culling.visible_billboards(made, lens, pose, *size)) >= view.billboards
