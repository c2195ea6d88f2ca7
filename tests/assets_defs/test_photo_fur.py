"""The fur graph at its smallest, and a planted regression for every one of its checks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from PIL import Image

from assets_defs.launcher import LaunchError, Request
from assets_defs.photo_fur.datasets import LOADERS
from assets_defs.photo_fur.graph import FUR
from pipelines.geometry import shapes
from pipelines.geometry.meshes import Mesh
from pipelines.photo_fur import (
    attenuation,
    frames,
    laying,
    lie,
    packed_fur,
    photograph,
    photograph_lie,
    shells,
    stage_view,
    suitability,
)
from pipelines.photo_fur.laid_fur import laid_fur
from pipelines.photo_fur.photograph import FurPhotograph
from pipelines.virtual.pelt import pelt as virtual_pelt
from storage.stored_version import StoredVersion
from storage.versions import Slot
from tests.assets_defs.regressions import Regression, assert_check_finds, assert_found

KEYS = {"photo": "grass", "mesh": "square"}
PELT_KEYS = {"photo": "pelt", "mesh": "teapot"}
CUT_KEYS = {"photo": "cut-png", "mesh": "square"}


@pytest.fixture(scope="module")
def good(house: Any) -> Any:
    """The house with the whole graph made once."""
    random = np.random.default_rng(5)
    codes = random.integers(30, 160, (80, 96, 4)).astype(np.uint8)
    codes[..., 3] = 255
    codes[:, :24] = (255, 255, 255, 0)
    inbox = house.workspace.inbox("photo_fur")
    inbox.mkdir(parents=True, exist_ok=True)
    Image.fromarray(codes).save(inbox / "cut.png")
    for keys in (KEYS, PELT_KEYS, CUT_KEYS):
        house.launcher.launch(Request(FUR, [keys], preset="test"))
    return house


def test_every_asset_is_current_and_has_passed_every_check(good: Any) -> None:
    for keys in (KEYS, PELT_KEYS, CUT_KEYS):
        for plan in FUR.plans.values():
            slot = FUR.slot(plan.name, {name: keys[name] for name in plan.by})
            pointer = good.workspace.store.pointer(slot)
            assert pointer.version is not None
            assert pointer.candidates == ()
            verdicts = good.workspace.store.verdicts(slot, pointer.version)
            assert set(verdicts) == {check.name for check in plan.checks}
            assert all(verdict["passed"] for verdict in verdicts.values())


def test_frames_show_the_photograph_from_above(good: Any) -> None:
    store = good.workspace.store
    picture = store.open(Slot("photo_fur", "fur_frames", "square.grass"))["frames"].values[0]
    photo = store.open(Slot("photo_fur", "fur_photo", "grass"))["radiance"].values
    encoded = np.where(photo <= 0.0031308, 12.92 * photo, 1.055 * photo ** (1 / 2.4) - 0.055)
    encoded = encoded.repeat(3, axis=0).repeat(3, axis=1)  # 128 pixels are shown as 384
    assert np.abs(picture / 255 - encoded).max() <= 0.5 / 255 + 1e-6


def test_what_is_loaded_draws_what_is_stored(good: Any) -> None:
    """The objects that LOADERS make of stored versions, through the numerics to the pictures."""
    store = good.workspace.store

    def load(asset: str, partition: str) -> Any:
        slot = Slot("photo_fur", asset, partition)
        return LOADERS[asset](StoredVersion(store, slot, store.current(slot)))

    photograph, mesh = load("attenuation", "pelt"), load("shell_mesh", "teapot")
    assert isinstance(photograph, FurPhotograph)
    assert isinstance(mesh, shells.ShellMesh)
    hair, patches = load("lie_field", "teapot"), load("fur_patches", "teapot.pelt")
    laid = laid_fur(mesh.vertices[-1], mesh.normals, hair, patches, mesh.thickness, mesh.layers)
    drawn = frames.draw_laid_frames(
        photograph, laid, frames.ROUND_VIEWS, (72, 96), 1, "end layers", lambda _: None
    )
    stored = store.open(Slot("photo_fur", "fur_frames", "teapot.pelt"))
    np.testing.assert_array_equal(drawn.pictures, stored["frames"].values)
    np.testing.assert_array_equal(drawn.coverage, stored["coverage"].values)
    heights = store.open(Slot("photo_fur", "shell_mesh", "teapot"))["height"].values
    np.testing.assert_array_equal(mesh.heights, heights)
    stack = load("shell_stack", "pelt")
    assert isinstance(stack, attenuation.ShellStack)
    found = attenuation.make_shell_stack(
        photograph.luminance, photograph.attenuation, 15, tails="end layers"
    )
    np.testing.assert_array_equal(stack.layer, found.layer)
    np.testing.assert_array_equal(stack.masks, found.masks)


def test_the_plain_look_is_the_papers(good: Any) -> None:
    store, slot = good.workspace.store, Slot("photo_fur", "fur_frames", "teapot.pelt")
    full = store.open(slot)["frames"].values
    good.launcher.launch(Request(FUR, [PELT_KEYS], given={"look": "plain"}))
    plain = store.open(slot)["frames"].values
    photograph, mesh = (
        LOADERS[asset](StoredVersion(store, found, store.current(found)))
        for asset, found in (
            ("attenuation", Slot("photo_fur", "attenuation", "pelt")),
            ("shell_mesh", Slot("photo_fur", "shell_mesh", "teapot")),
        )
    )
    assert isinstance(photograph, FurPhotograph)
    assert isinstance(mesh, shells.ShellMesh)
    drawn = frames.draw_frames(photograph, mesh, frames.ROUND_VIEWS, size=(72, 96), supersampling=1)
    np.testing.assert_array_equal(drawn.pictures, plain)
    assert np.abs(plain.astype(float) - full).mean() > 5
    good.launcher.launch(Request(FUR, [PELT_KEYS], preset="test"))
    np.testing.assert_array_equal(store.open(slot)["frames"].values, full)


def test_a_cut_out_goes_through_the_whole_graph(good: Any) -> None:
    """Its transparent part is white: taken for fur, it would be the tips."""
    store = good.workspace.store
    photo = store.open(Slot("photo_fur", "fur_photo", "cut-png"))
    opaque = np.broadcast_to(np.arange(96) >= 24, (80, 96))
    np.testing.assert_array_equal(photo["opaque"].values, opaque)
    assert not photo["radiance"].values[:, :24].any()
    medium = store.open(Slot("photo_fur", "attenuation", "cut-png"))
    assert int(medium["histogram"].sum()) == opaque.sum()
    seen = photo["luminance"].values[opaque]
    expected = attenuation.fit_attenuation(seen, tail=0.005).with_ends_at((0.36, 1.04))
    assert float(medium["brightest"]) == pytest.approx(expected.brightest, rel=1e-6)
    stack = store.open(Slot("photo_fur", "shell_stack", "cut-png"))
    np.testing.assert_array_equal(stack["layer"].values > 0, opaque)
    assert not stack["mask"].values[:, :, :24].any()
    frames = store.open(Slot("photo_fur", "fur_frames", "square.cut-png"))
    assert float(frames["coverage"][0]) == pytest.approx(0.75, abs=1e-9)
    slot = Slot("photo_fur", "fur_photo", "cut-png")
    notes = store.record(slot, store.current(slot))["notes"]
    assert notes == ["25 % of the pixels are transparent and were left out."]


def test_a_second_launch_makes_nothing_and_a_forced_one_everything(good: Any) -> None:
    store = good.workspace.store
    before = {slot: store.current(slot) for slot in store.slots()}
    outcomes = good.launcher.launch(Request(FUR, [KEYS]))
    assert {outcome.state for outcome in outcomes} == {"current"}
    outcomes = good.launcher.launch(Request(FUR, [KEYS], force=True))
    assert {outcome.state for outcome in outcomes} == {"made"}
    # The same settings give the same content, and equal content makes no new version.
    assert {slot: store.current(slot) for slot in store.slots()} == before


def test_one_setting_remakes_only_what_depends_on_it(good: Any) -> None:
    outcomes = good.launcher.launch(Request(FUR, [KEYS], given={"width": 64}))
    assert [outcome.slot.asset for outcome in outcomes if outcome.state == "made"] == ["fur_frames"]
    # … and is remembered.
    outcomes = good.launcher.launch(Request(FUR, [KEYS]))
    assert {outcome.state for outcome in outcomes} == {"current"}
    good.launcher.launch(Request(FUR, [KEYS], preset="test"))


# ---- planted regressions ---------------------------------------------------------------------


def _dropped(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    return np.full_like(right(*arguments, **options), attenuation.DROPPED)


def _hardly_any(right: Callable[..., Any], *arguments: Any) -> Any:
    radiance, opaque = right(*arguments)
    opaque[:, 30:] = False
    return radiance, opaque


def _left_lit(right: Callable[..., Any], radiance: Any, fur: Any) -> suitability.EvenlyLit:
    slope = np.linspace(1.0, 0.3, radiance.shape[1], dtype=np.float32)[:, None]
    return suitability.EvenlyLit(radiance * slope, 0.0)


def _shuffled_code(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    code = right(*arguments, **options)
    return np.random.default_rng(0).permutation(code.ravel()).reshape(code.shape)


def _linear_layers(
    right: Callable[..., Any], grey: Any, medium: Any, layers: int, **options: Any
) -> Any:
    depth = (medium.brightest - grey) / (medium.brightest - medium.darkest)
    return np.clip(np.floor(depth * layers) + 1, 1, layers).astype(np.uint8)


def _doubled_masks(right: Callable[..., Any], layer: Any, layers: int) -> Any:
    masks = right(layer, layers)
    masks[0] |= masks[-1]
    return masks


def _stretched_teapot(right: Callable[..., Any], segments: int) -> Any:
    mesh = right(segments)
    return Mesh(mesh.vertices, mesh.triangles, mesh.uvs * [8.0, 1.0], mesh.normals)


def _inside_out_teapot(right: Callable[..., Any], segments: int) -> Any:
    mesh = right(segments)
    return Mesh(mesh.vertices, mesh.triangles[:, ::-1], mesh.uvs, -mesh.normals)


def _sideways_field(
    right: Callable[..., Any], vertices: Any, normals: Any, *others: Any
) -> lie.LieField:
    field: lie.LieField = right(vertices, normals, *others)
    return field._replace(tangents=np.cross(normals, field.tangents))


def _drawn_out_patches(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    laid = right(*arguments, **options)
    return laid._replace(uvs=laid.uvs**3)


def _turned_pieces(right: Callable[..., Any], *arguments: Any) -> Any:
    piece = right(*arguments)
    return piece._replace(directions=piece.directions + np.pi / 2)


def _shuffled_pelt(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    pelt = right(*arguments, **options)
    pixels = pelt.radiance.reshape(-1, 3)
    shuffled = np.random.default_rng(0).permutation(pixels).reshape(pelt.radiance.shape)
    return pelt._replace(radiance=shuffled)


REGRESSIONS = (
    Regression(
        "contrast", photograph, "expose", lambda right, *photo: right(*photo) * 0.05 + 0.5, KEYS
    ),
    Regression(
        "clipped_share",
        photograph,
        "expose",
        lambda right, *photo: np.clip(right(*photo) * 6, 0, 1),
        KEYS,
    ),
    Regression("fur_share", photograph, "fit_cutout", _hardly_any, CUT_KEYS),
    Regression("unevenness", suitability, "evenly_lit", _left_lit, KEYS),
    Regression(
        "kept_share",
        attenuation,
        "fit_attenuation",
        lambda right, grey, tail: right(grey, tail=0.2),
        KEYS,
    ),
    Regression(
        "decay_error",
        attenuation.Attenuation,
        "boundaries",
        lambda right, self, layers: np.linspace(self.brightest, self.darkest, layers + 1),
        KEYS,
    ),
    Regression("depth_rank_correlation", virtual_pelt, "make_pelt", _shuffled_pelt, PELT_KEYS),
    Regression(
        "depth_rmse_ratio",
        attenuation.Attenuation,
        "with_ends_at",
        lambda right, self, ends: self,
        PELT_KEYS,
    ),
    Regression("partition_error", attenuation, "layer_masks", _doubled_masks, KEYS),
    Regression("interval_error", attenuation, "layer_of", _linear_layers, KEYS),
    Regression(
        "step_error",
        shells,
        "shell_heights",
        lambda right, thickness, layers: right(thickness, layers) ** 2 / thickness,
        KEYS,
    ),
    Regression("texture_stretch", shapes, "teapot", _stretched_teapot, PELT_KEYS),
    Regression("outward_share", shapes, "teapot", _inside_out_teapot, PELT_KEYS),
    Regression("guide_error", lie, "lie_field", _sideways_field, PELT_KEYS),
    Regression("strand_scale_spread", laying, "lay", _drawn_out_patches, PELT_KEYS),
    Regression("lie_error", photograph_lie, "pieces_of", _turned_pieces, PELT_KEYS),
    Regression("aslant_rmse", stage_view, "depth_code", _shuffled_code, KEYS),
    Regression("least_coverage", stage_view, "depth_code", _dropped, KEYS),
    Regression(
        "mismatches",
        packed_fur,
        "lie_codes",
        lambda right, *arguments: right(*arguments) + np.uint8(1),
        KEYS,
    ),
    Regression(
        "photograph_gain_db",
        packed_fur,
        "packed_photograph",
        lambda right, photograph, quality: right(
            photograph._replace(radiance=photograph.radiance[::-1]), quality
        ),
        KEYS,
    ),
    Regression(
        "mean_brightness", frames, "to_8bit", lambda right, picture: right(picture * 0.8), KEYS
    ),
)


def test_every_check_has_a_planted_regression() -> None:
    names = {check.name for plan in FUR.plans.values() for check in plan.checks}
    assert {regression.check for regression in REGRESSIONS} == names


@pytest.mark.parametrize("regression", REGRESSIONS, ids=lambda regression: regression.check)
def test_a_planted_regression_fails_its_check_and_the_last_good_version_stays(
    good: Any, regression: Regression, monkeypatch: pytest.MonkeyPatch
) -> None:
    planted_upstream = regression.check == "depth_rank_correlation"
    found = assert_found if planted_upstream else assert_check_finds
    found(good, FUR, regression, monkeypatch)


def test_a_step_inside_the_bound_is_a_regression_too(
    good: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A slightly darker picture passes the bounds, not the comparison with the last good one."""
    store = good.workspace.store
    slot = Slot("photo_fur", "fur_frames", "teapot.pelt")
    before = store.current(slot)
    right = frames.to_8bit

    def darker(picture: Any) -> Any:
        """But for the background, which the figure leaves out."""
        whole = right(picture)
        is_fur = (whole != right(np.array(frames.BACKGROUND))).any(axis=-1, keepdims=True)
        return np.where(is_fur, right(picture * 0.9), whole)

    monkeypatch.setattr(frames, "to_8bit", darker)
    with pytest.raises(LaunchError, match="last good version"):
        good.launcher.launch(Request(FUR, [PELT_KEYS], force=True))
    assert store.current(slot) == before
    # Other settings are another lineage: there is nothing to compare with.
    good.launcher.launch(Request(FUR, [PELT_KEYS], force=True, given={"width": 80}))
    assert store.current(slot) != before


def test_slots_read_their_partitions_in_the_order_of_the_dimensions_names() -> None:
    assert FUR.slot("fur_frames", KEYS) == Slot("photo_fur", "fur_frames", "square.grass")
