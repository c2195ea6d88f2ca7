"""The BTF graph at its smallest, a planted regression for every check, killed and bad runs."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import dagster as dg
import numpy as np
import pytest

from assets_defs.launcher import LaunchError, Request
from assets_defs.neural_btf import compressed as file_assets
from assets_defs.neural_btf import datasets
from assets_defs.neural_btf import package as package_assets
from assets_defs.neural_btf import rate_distortion as rate_assets
from assets_defs.neural_btf.datasets import compressed_btf_of
from assets_defs.neural_btf.graph import BTF
from pipelines.light import directions
from pipelines.neural_btf import (
    clusters,
    compressed,
    principal_abrdfs,
    restoration,
)
from pipelines.neural_btf.draping import rendering
from pipelines.neural_btf.training import batches, quantiser
from pipelines.neural_btf.training import trainer as training
from pipelines.virtual.cloth import gonioreflectometer
from storage.btf_file import values_of
from tests.assets_defs.regressions import Regression, assert_check_finds, materialise
from tests.storage.readers.btf_writers import FIFTEEN, write_ubo2003_zip

MATERIAL = {"material": "knit"}
WITHOUT = MATERIAL | {"clusters": "none"}
CLUSTERED = MATERIAL | {"clusters": "20"}
RELIEF = {"material": "twill"}
"""With more texels and directions: enough to see which way up the photographs are."""


@pytest.fixture(scope="module")
def good(house: Any) -> Any:
    """The house with both columns made once."""
    house.launcher.launch(Request(BTF, [WITHOUT, CLUSTERED], preset="test"))
    given = {"texels": 32, "directions": 41}
    house.launcher.launch(Request(BTF, [RELIEF], preset="test", given=given))
    return house


def _materialise(
    house: Any, asset: str, keys: Mapping[str, str], **given: Any
) -> dg.ExecuteInProcessResult:
    return materialise(house, BTF, asset, keys, **given)


def _tries_again(house: Any) -> int:
    """How often steps of the last run were tried again."""
    (run,) = house.instance.get_runs(limit=1)
    return len(house.instance.all_logs(run.run_id, of_type=dg.DagsterEventType.STEP_UP_FOR_RETRY))


def _pointers(house: Any) -> dict[Any, Any]:
    store = house.workspace.store
    return {slot: store.pointer(slot) for slot in store.slots()}


def test_every_asset_is_current_and_has_passed_every_check(good: Any) -> None:
    store = good.workspace.store
    for keys in (WITHOUT, CLUSTERED):
        for plan in BTF.plans.values():
            slot = BTF.slot(plan.name, {name: keys[name] for name in plan.by})
            verdicts = store.verdicts(slot, store.current(slot))
            assert set(verdicts) == {check.name for check in plan.checks}
            assert all(verdict["passed"] for verdict in verdicts.values())


def test_columns_have_the_bytes_of_the_table(good: Any) -> None:
    store = good.workspace.store
    without = store.open(BTF.slot("compressed_btf", WITHOUT))
    clustered = store.open(BTF.slot("compressed_btf", CLUSTERED))
    assert "ids" not in without
    assert compressed_btf_of(without).latents.shape == (144, 8)
    assert compressed_btf_of(clustered).latents.shape == (20, 8)


def test_a_version_says_what_it_was_made_of(good: Any) -> None:
    store = good.workspace.store
    slot = BTF.slot("restored_images", CLUSTERED)
    record = store.record(slot)
    assert record["asset"] == "neural_btf/restored_images"
    assert record["partition"] == "20.knit"
    assert record["source"] is None
    for entry in record["inputs"]:
        keys = {name: CLUSTERED[name] for name in BTF.plans[entry["asset"]].by}
        made = store.record(BTF.slot(entry["asset"], keys), entry["version"])
        assert entry["content"] == made["content"]
        assert entry["partition"] == made["partition"]
    assert {entry["asset"] for entry in record["inputs"]} == set(
        BTF.plans["restored_images"].inputs
    )
    first = store.record(BTF.slot("btf_images", MATERIAL))
    assert first["source"] == "built-in:knit"
    assert first["settings"]["texels"] == 12
    assert first["settings"]["directions"] == 15


def test_restored_photographs_are_those_nearest_to_figure_7(good: Any) -> None:
    restored = good.workspace.store.open(BTF.slot("restored_images", WITHOUT))
    images = good.workspace.store.open(BTF.slot("btf_images", MATERIAL))

    def vectors(directions: Any) -> Any:
        theta, phi = np.moveaxis(np.asarray(directions), -1, 0)
        return np.stack(
            [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
        )

    def away(dataset: Any, names: tuple[str, str], wanted: Any) -> Any:
        angles = [
            np.arccos(np.clip(vectors(dataset[name].values) @ vectors(np.radians(way)), -1, 1))
            for name, way in zip(names, wanted, strict=True)
        ]
        return angles[0] ** 2 + angles[1] ** 2

    # View and light of the paper's figure 7; its 345° of the second light's theta cannot be.
    wanted = [((15, 60), (30, 60)), ((75, 345), (45, 0))]
    for number, pair in enumerate(wanted):
        nearest = away(images, ("view", "light"), pair).min()
        shown = away(restored, ("pair_view", "pair_light"), pair)[number]
        assert shown == pytest.approx(nearest, abs=1e-9)
        same = (images["view"] == restored["pair_view"][number]).all("angle")
        same &= (images["light"] == restored["pair_light"][number]).all("angle")
        (index,) = np.flatnonzero(same.values)
        expected = images["images"][index].values
        np.testing.assert_array_equal(restored["original"].values[number], expected)


@pytest.mark.slow
def test_a_second_launch_makes_nothing_and_a_forced_one_gives_the_same(good: Any) -> None:
    store = good.workspace.store
    before = {slot: store.current(slot) for slot in store.slots()}
    outcomes = good.launcher.launch(Request(BTF, [WITHOUT, CLUSTERED]))
    assert {outcome.state for outcome in outcomes} == {"current"}
    outcomes = good.launcher.launch(Request(BTF, [CLUSTERED], force=True))
    assert {outcome.state for outcome in outcomes} == {"made"}
    assert {slot: store.current(slot) for slot in store.slots()} == before


def test_one_setting_remakes_only_what_depends_on_it(good: Any) -> None:
    outcomes = good.launcher.launch(Request(BTF, [CLUSTERED], given={"width": 40}))
    made = [outcome.slot.asset for outcome in outcomes if outcome.state == "made"]
    assert made == ["cloth_frames"]
    good.launcher.launch(Request(BTF, [CLUSTERED], preset="test"))


def test_the_papers_training_runs_through_the_graph(good: Any) -> None:
    """So few steps of it teach nothing: what is shown of it is refused, not the network."""
    given = {"training": "paper", "paper_steps": 400, "form": "float32"}
    keys = MATERIAL | {"clusters": "21"}
    with pytest.raises(LaunchError, match=r"(restored_images|cloth_frames): .* expected at "):
        good.launcher.launch(Request(BTF, [keys], "test", given))
    trained = good.workspace.store.open(BTF.slot("neural_btf", keys))
    assert float(trained["encoder_residual"]) == pytest.approx(0.0, abs=1e-6)
    assert "parallax" not in trained


# ---- planted regressions ---------------------------------------------------------------------


def _double_pair(right: Callable[..., Any], *arguments: Any) -> Any:
    pairs = right(*arguments)
    pairs.light[1] = pairs.light[0]
    return pairs


def _dark_view(right: Callable[..., Any], self: Any, view: Any) -> Any:
    return right(self, view) * (view[0] > 0)


def _mirrored_view(right: Callable[..., Any], self: Any, view: Any) -> Any:
    return right(self, view)[:, :, ::-1]


def _shifted_texels(right: Callable[..., Any], images: Any) -> Any:
    return right(images[:, ::-1])


def _wide_deviation(right: Callable[..., Any], images: Any) -> Any:
    found = right(images)
    return found._replace(deviation=found.deviation * 1.01)


def _weak_components(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    found = right(*arguments, **options)
    return found._replace(singular_values=found.singular_values * 0.9)


def _shifted_start(right: Callable[..., Any], ids: Any, clusters: int) -> Any:
    members = right(ids, clusters)
    members.starts[1] += 1
    return members


def _mixed_clusters(right: Callable[..., Any], *arguments: Any) -> Any:
    return np.random.default_rng(0).permutation(right(*arguments))


def _no_rate(right: Callable[..., Any], self: Any, name: str, fraction: float) -> None:
    right(self, name, fraction)
    for optimiser in self._optimisers:
        for group in optimiser.param_groups:
            group["lr"] = 0.0


def _not_rounded(right: Callable[..., Any], *network_and_datasets: Any) -> Any:
    """Numbers as float32, as if training had not known better."""
    held = right(*network_and_datasets)
    return dataclasses.replace(
        held,
        decoder={name: values_of(part) for name, part in held.decoder.items()},
        student={name: values_of(part) for name, part in held.student.items()},
        latents=values_of(held.latents),
        mips=(),
    )


def _next_numbers(right: Callable[..., Any], self: Any, values: Any) -> Any:
    return np.roll(right(self, values), 1, axis=0)


def _swapped_directions(right: Callable[..., Any], pairs: Any) -> Any:
    return right(directions.Pairs(light=pairs.view, view=pairs.light))


def _next_cluster(right: Callable[..., Any], self: Any, texels: Any) -> Any:
    found = right(self, texels)
    return found if self.ids is None else np.roll(found, 1, axis=0)


def _mean_colours(right: Callable[..., Any], *arguments: Any) -> Any:
    """The mean ABRDF for every texel: no texel differs from the next."""
    found = right(*arguments)
    return np.broadcast_to(found.mean(axis=0), found.shape).copy()


def _next_texels(right: Callable[..., Any], *arguments: Any) -> Any:
    return np.random.default_rng(0).permutation(right(*arguments))


def _light_from_behind(
    right: Callable[..., Any], material: Any, places: Any, light: Any, *more: Any
) -> Any:
    """Of the compressed BTF alone."""
    is_wrong = isinstance(material, compressed.CompressedBtf)
    return right(material, places, light * [-1, -1, 1] if is_wrong else light, *more)


def _next_latents(right: Callable[..., Any], *given: Any) -> Any:
    values = right(*given)
    return values | {"latents": np.roll(values["latents"], 1, axis=0)}


def _other_texels(right: Callable[..., Any], *given: Any) -> Any:
    btf = right(*given)
    order = np.random.default_rng(0).permutation(len(btf.latents))
    return dataclasses.replace(btf, latents=btf.latents[order])


REGRESSIONS = (
    Regression("missing_pairs", directions, "all_pairs", _double_pair, MATERIAL),
    Regression(
        "dark_share",
        gonioreflectometer.Gonioreflectometer,
        "photographs",
        _dark_view,
        MATERIAL,
    ),
    Regression(
        "mean_radiance",
        gonioreflectometer.Gonioreflectometer,
        "photographs",
        lambda right, self, view: right(self, view) * 1.1,
        MATERIAL,
    ),
    Regression(
        "orientation_margin",
        gonioreflectometer.Gonioreflectometer,
        "photographs",
        _mirrored_view,
        RELIEF,
    ),
    Regression("transposition_error", datasets, "transposed_view", _shifted_texels, MATERIAL),
    Regression("statistics_error", principal_abrdfs, "image_statistics", _wide_deviation, MATERIAL),
    Regression("explained", principal_abrdfs, "principal_components", _weak_components, MATERIAL),
    Regression("smallest_cluster", clusters, "cluster_members", _shifted_start, CLUSTERED),
    Regression("spread_ratio", clusters, "k_means_plus_plus", _mixed_clusters, CLUSTERED),
    Regression("loss_ratio", training.Trainer, "_set_rate", _no_rate, WITHOUT),
    Regression(
        "encoder_residual",
        batches,
        "standardised",
        lambda right, values, *statistics: right(values, *statistics) * 0.0,
        WITHOUT,
    ),
    Regression("size_ratio", file_assets, "quantised_btf_file", _not_rounded, WITHOUT),
    Regression("rmse_over_network", quantiser.Quantiser, "symbols", _next_numbers, WITHOUT),
    Regression("rmse", restoration, "direction_inputs", _swapped_directions, WITHOUT),
    Regression("rmse_over_none", compressed.CompressedBtf, "latents_of", _next_cluster, CLUSTERED),
    Regression("rmse_over_null", compressed.CompressedBtf, "abrdfs", _mean_colours, WITHOUT),
    Regression("worst_photographs", restoration, "direction_inputs", _swapped_directions, WITHOUT),
    Regression("worst_texels", compressed.CompressedBtf, "abrdfs", _mean_colours, CLUSTERED),
    Regression("grazing_detail", compressed.CompressedBtf, "abrdfs", _next_texels, CLUSTERED),
    Regression("closeup_over_flat", rendering, "surface_radiance", _light_from_behind, WITHOUT),
    Regression("file_over_rounding", rate_assets, "compressed_btf_of", _other_texels, WITHOUT),
    Regression("file_over_null", rate_assets, "compressed_btf_of", _other_texels, WITHOUT),
    Regression("mismatches", package_assets, "_values", _next_latents, CLUSTERED),
)


def test_every_check_has_a_planted_regression() -> None:
    names = {check.name for plan in BTF.plans.values() for check in plan.checks}
    assert {regression.check for regression in REGRESSIONS} == names


@pytest.mark.parametrize("regression", REGRESSIONS, ids=lambda regression: regression.check)
def test_a_planted_regression_fails_its_check_and_the_last_good_version_stays(
    good: Any, regression: Regression, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert_check_finds(good, BTF, regression, monkeypatch)


def test_a_failing_check_ends_the_launch_with_its_sentence(
    good: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A material a tenth brighter is within the bounds, but not what it was."""
    before = _pointers(good)
    right = gonioreflectometer.Gonioreflectometer.photographs
    monkeypatch.setattr(
        gonioreflectometer.Gonioreflectometer,
        "photographs",
        lambda self, view: right(self, view) * 1.1,
    )
    with pytest.raises(LaunchError, match=r"knit.*mean_radiance.*last good version") as failure:
        good.launcher.launch(Request(BTF, [CLUSTERED], force=True))
    assert len(str(failure.value).splitlines()) == 1
    assert failure.value.outcomes == ()
    assert _pointers(good) == before


# ---- killed and resumed ----------------------------------------------------------------------


def test_a_stopped_training_goes_on_and_gives_what_an_uninterrupted_one_gives(
    good: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = good.workspace.store
    given = {"network_seed": 5}
    slot = BTF.slot("neural_btf", CLUSTERED)
    before = store.pointer(slot)
    work = store.root / slot.system / slot.asset / slot.partition / "work"
    steps = training.Trainer.step

    def killed(self: training.Trainer) -> None:
        if self.steps_done == 70:
            raise KeyboardInterrupt
        steps(self)

    with monkeypatch.context() as patch:
        patch.setattr(training, "KEEP_SECONDS", 0.0)
        patch.setattr(training.Trainer, "step", killed)
        with pytest.raises(KeyboardInterrupt):
            good.launcher.launch(Request(BTF, [CLUSTERED], given=given))
    assert store.pointer(slot) == before
    assert len(list(work.glob("*.state"))) == 1
    restored: list[int] = []
    restore = training.Trainer.restore

    def told(self: training.Trainer, kept: bytes) -> None:
        restore(self, kept)
        restored.append(self.steps_done)

    with monkeypatch.context() as patch:
        patch.setattr(training.Trainer, "restore", told)
        assert _materialise(good, "neural_btf", CLUSTERED, **given).success
    assert restored == [70]
    assert not work.exists()
    # Uninterrupted it gives the same content: no new version.
    resumed = store.current(slot)
    assert resumed != before.version
    assert _materialise(good, "neural_btf", CLUSTERED).success
    assert store.current(slot) == resumed
    assert store.rollback(slot) == before.version


def test_a_state_is_of_one_recipe(good: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    store = good.workspace.store
    slot = BTF.slot("neural_btf", CLUSTERED)
    before = store.pointer(slot)
    work = store.root / slot.system / slot.asset / slot.partition / "work"
    step = training.Trainer.step

    def killed(self: training.Trainer) -> None:
        if self.steps_done == 4:
            raise KeyboardInterrupt
        step(self)

    with monkeypatch.context() as patch:
        patch.setattr(training, "KEEP_SECONDS", 0.0)
        patch.setattr(training.Trainer, "step", killed)
        assert not _materialise(good, "neural_btf", CLUSTERED, network_seed=7).success
    assert _tries_again(good) == 0
    assert len(list(work.glob("*.state"))) == 1
    assert store.pointer(slot) == before
    restored: list[bytes] = []
    monkeypatch.setattr(training.Trainer, "restore", lambda self, kept: restored.append(kept))
    assert _materialise(good, "neural_btf", CLUSTERED, network_seed=8).success
    assert restored == []
    assert not work.exists()
    assert store.rollback(slot) == before.version


# ---- users' BTFs, good and bad ---------------------------------------------------------------


@pytest.fixture
def inbox(good: Any) -> Iterator[Path]:
    """The system's inbox, emptied afterwards."""
    folder: Path = good.workspace.inbox(BTF.name)
    folder.mkdir(parents=True, exist_ok=True)
    yield folder
    for path in folder.iterdir():
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()


def _photographs(path: Path) -> None:
    """A cloth of stripes, darker towards the edge of the hemisphere, 14 x 10 pixels."""
    theta = np.radians([direction[0] for direction in FIFTEEN])
    stripes = 140 + 60 * np.sin(np.arange(14)) * np.cos(np.arange(10))[:, None]
    noise = np.random.default_rng(0).normal(0, 6, (225, 10, 14, 3))
    brightness = (np.cos(theta)[:, None] * np.cos(theta)[None] ** 0.5).reshape(-1, 1, 1, 1)
    codes = brightness * (stripes[..., None] * [1.0, 0.7, 0.5]) + noise
    write_ubo2003_zip(path, np.clip(codes, 0, 255).astype(np.uint8), FIFTEEN, FIFTEEN)


def test_a_users_zip_becomes_a_compressed_btf(good: Any, inbox: Path) -> None:
    _photographs(inbox / "Wolle.zip")
    (key,) = set(BTF.sources("material", inbox)) - set(BTF.dimension("material").builtin)
    keys = {"material": key, "clusters": "12"}
    given = {"crop": [2, 1, 8, 6], "steps": 200}
    outcomes = good.launcher.launch(Request(BTF, [keys], "test", given))
    assert [outcome.state for outcome in outcomes] == ["made"] * len(BTF.plans)
    store = good.workspace.store
    images = store.open(BTF.slot("btf_images", {"material": key}))
    assert dict(images.sizes) == {"image": 225, "y": 6, "x": 8, "channel": 3, "angle": 2}
    assert images.attrs["name"] == "Wolle.zip"
    assert "sRGB" in images.attrs["colour"]
    runtime = store.open(BTF.slot("compressed_btf", keys))
    btf = compressed_btf_of(runtime)
    assert (btf.latents.shape, btf.height, btf.width) == ((12, 8), 6, 8)
    runs = good.instance.get_runs_count()
    with pytest.raises(ValueError, match=r"Wolle\.zip: clusters is 49; expected at most 48"):
        good.launcher.launch(Request(BTF, [keys | {"clusters": "49"}]))
    with pytest.raises(ValueError, match=r"Wolle\.zip.*crop"):
        good.launcher.launch(Request(BTF, [keys], given={"crop": [8, 0, 8, 6]}))
    assert good.instance.get_runs_count() == runs


def test_a_folder_is_a_btf_of_its_own_with_the_same_pixels(good: Any, inbox: Path) -> None:
    _photographs(inbox / "wolle.zip")
    shutil.unpack_archive(inbox / "wolle.zip", inbox / "wolle")
    keys = [{"material": f"wolle-{kind}"} for kind in ("zip", "folder")]
    for one in keys:
        good.instance.add_dynamic_partitions("neural_btf_material", [one["material"]])
        assert _materialise(good, "btf_images", one, preset="test").success
    zipped, loose = (good.workspace.store.open(BTF.slot("btf_images", one)) for one in keys)
    assert zipped.sizes["x"] == 14
    assert zipped.attrs["name"] == "wolle.zip"
    assert loose.attrs["name"] == "wolle"
    for name in ("images", "light", "view"):
        np.testing.assert_array_equal(zipped[name].values, loose[name].values)


def test_any_whole_number_of_clusters_is_a_key(good: Any) -> None:
    inbox = good.workspace.inbox(BTF.name)
    assert BTF.source("clusters", "750", inbox).key == "750"
    # Known, and too many for the 12 x 12 texels.
    with pytest.raises(ValueError, match="clusters is 750; expected at most 144"):
        good.launcher.launch(Request(BTF, [MATERIAL | {"clusters": "750"}], "test"))


@pytest.mark.parametrize("key", ["007", "-3", "0", "x", "1.5"])
def test_clusters_are_none_or_a_whole_number(good: Any, key: str) -> None:
    with pytest.raises(ValueError, match=r"clusters .* is not known"):
        good.launcher.launch(Request(BTF, [MATERIAL | {"clusters": key}]))


def test_too_many_clusters_and_too_deep_an_encoder_are_refused_before_work(good: Any) -> None:
    runs = good.instance.get_runs_count()
    with pytest.raises(ValueError, match="clusters is 145; expected at most 144"):
        good.launcher.launch(Request(BTF, [MATERIAL | {"clusters": "145"}], "test"))
    with pytest.raises(ValueError, match="widths is"):
        good.launcher.launch(Request(BTF, [WITHOUT], "test", {"widths": [4] * 5}))
    assert good.instance.get_runs_count() == runs


def test_a_truncated_zip_is_refused_before_work(good: Any, inbox: Path) -> None:
    _photographs(inbox / "whole.zip")
    (inbox / "short.zip").write_bytes((inbox / "whole.zip").read_bytes()[:-30])
    runs = good.instance.get_runs_count()
    with pytest.raises(ValueError, match=r"short\.zip"):
        good.launcher.launch(Request(BTF, [{"material": "short-zip"}], "test"))
    assert good.instance.get_runs_count() == runs


def test_a_photograph_damaged_inside_ends_the_run_once_and_stores_nothing(
    good: Any, inbox: Path
) -> None:
    _photographs(inbox / "damaged.zip")
    data = bytearray((inbox / "damaged.zip").read_bytes())
    middle = len(data) // 2
    data[middle : middle + 40] = bytes(40)
    (inbox / "damaged.zip").write_bytes(data)
    before = _pointers(good)
    with pytest.raises(LaunchError, match=r"damaged-zip.*\.jpg: .* damaged") as failure:
        good.launcher.launch(Request(BTF, [{"material": "damaged-zip"}], "test"))
    assert len(str(failure.value).splitlines()) == 1
    assert _tries_again(good) == 0
    assert _pointers(good) == before
    folder = good.workspace.store.root / BTF.name / "btf_images" / "damaged-zip"
    assert [path for path in folder.rglob("*") if path.is_file() and path.name != "lock"] == []


@pytest.mark.parametrize(
    ("value", "words"),
    [(np.nan, "not finite"), (70_000.0, "at most 65504"), (-1.5, "more than -1")],
)
def test_values_that_cannot_be_stored_are_refused_once(
    good: Any, monkeypatch: pytest.MonkeyPatch, value: float, words: str
) -> None:
    class Wrong:
        def __init__(self, *arguments: Any) -> None:
            pass

        def photographs(self, view: Any) -> Any:
            photographs = np.full((15, 12, 12, 3), 0.5, np.float32)
            if view[1] > 5.0:  # not a photograph that the picture shows: it is met while writing
                photographs[7, 3, 4, 1] = value
            return photographs

    before = _pointers(good)
    monkeypatch.setattr(gonioreflectometer, "Gonioreflectometer", Wrong)
    with pytest.raises(LaunchError, match=words) as failure:
        good.launcher.launch(Request(BTF, [MATERIAL], force=True))
    assert len(str(failure.value).splitlines()) == 1
    assert _tries_again(good) == 0
    assert _pointers(good) == before
