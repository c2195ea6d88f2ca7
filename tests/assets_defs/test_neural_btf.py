"""The BTF graph at its smallest, a planted regression for every check, killed and bad runs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from assets_defs.launcher import LaunchError, Request
from assets_defs.neural_btf import BTF
from assets_defs.neural_btf import network as network_assets
from assets_defs.neural_btf.datasets import payload_bytes
from pipelines import clustering, directions, lowrank
from pipelines.neural_btf import (
    abrdf,
    compressed,
    gonioreflectometer,
    panel,
    representatives,
    training,
)
from tests.assets_defs.regressions import Regression, assert_found
from tests.storage.readers.btf_writers import FIFTEEN, write_ubo2003_zip

MATERIAL = {"material": "knit"}
WITHOUT = MATERIAL | {"clusters": "none"}
CLUSTERED = MATERIAL | {"clusters": "20"}


@pytest.fixture(scope="module")
def good(house: Any) -> Any:
    """The house with both columns made once."""
    house.launcher.launch(Request(BTF, [WITHOUT, CLUSTERED], preset="test"))
    return house


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
    assert payload_bytes(without) == 4 * (24_383 + 8 * 144)
    assert payload_bytes(clustered) == 4 * (24_383 + 8 * 20 + 144)


def test_restored_photographs_are_those_nearest_to_figure_7(good: Any) -> None:
    restored = good.workspace.store.open(BTF.slot("restored_images", WITHOUT))
    images = good.workspace.store.open(BTF.slot("btf_images", MATERIAL))
    # Of the coarse table: (15°, 60°) lies nearer to (30°, 60°) than to the normal.
    found = np.degrees(restored["pair_view"].values)
    assert found == pytest.approx(np.array([[30, 60], [60, 0]]), abs=1e-9) or found[0, 0] == 0
    for number, view in enumerate(restored["pair_view"].values):
        light = restored["pair_light"].values[number]
        same = (images["view"].values == view).all(1) & (images["light"].values == light).all(1)
        (index,) = np.flatnonzero(same)
        expected = images["images"][index].values
        np.testing.assert_array_equal(restored["original"].values[number], expected)


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
    given = {"training": "paper", "paper_steps": 400}
    keys = [MATERIAL | {"clusters": "21"}]
    good.launcher.launch(Request(BTF, keys, "test", given))
    trained = good.workspace.store.open(BTF.slot("neural_btf", keys[0]))
    assert float(trained["encoder_residual"]) == pytest.approx(0.0, abs=1e-6)


# ---- planted regressions ---------------------------------------------------------------------


def _double_pair(right: Callable[..., Any], *arguments: Any) -> Any:
    pairs = right(*arguments)
    pairs.light[1] = pairs.light[0]
    return pairs


def _dark_view(right: Callable[..., Any], self: Any, view: Any) -> Any:
    return right(self, view) * (view[0] > 0)


def _shifted_texels(right: Callable[..., Any], images: Any) -> Any:
    return right(images[:, ::-1])


def _wide_deviation(right: Callable[..., Any], images: Any) -> Any:
    found = right(images)
    return found._replace(deviation=found.deviation * 1.01)


def _weak_components(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    found = right(*arguments, **options)
    return found._replace(singular_values=found.singular_values * 0.9)


def _shifted_start(right: Callable[..., Any], ids: Any, clusters: int) -> Any:
    order, starts = right(ids, clusters)
    starts[1] += 1
    return order, starts


def _mixed_clusters(right: Callable[..., Any], *arguments: Any) -> Any:
    return np.random.default_rng(0).permutation(right(*arguments))


def _no_rate(right: Callable[..., Any], self: Any, name: str, fraction: float) -> None:
    right(self, name, fraction)
    for optimiser in self._optimisers:
        for group in optimiser.param_groups:
            group["lr"] = 0.0


def _needless_list(right: Callable[..., Any], *datasets: Any) -> Any:
    packed, shown = right(*datasets)
    return packed.assign(ids=datasets[1]["ids"]), shown


def _scaled_weights(right: Callable[..., Any], *datasets: Any) -> Any:
    packed, shown = right(*datasets)
    return packed.assign(weight_2=packed["weight_2"] * 1.01), shown


def _swapped_directions(right: Callable[..., Any], pairs: Any) -> Any:
    return right(directions.Pairs(light=pairs.view, view=pairs.light))


def _tiny_panel(right: Callable[..., Any], *arguments: Any) -> Any:
    made = right(*arguments)
    return made._replace(vertices=made.vertices * 0.3)


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
    Regression("transposition_error", abrdf, "texel_rows", _shifted_texels, MATERIAL),
    Regression("statistics_error", abrdf, "statistics", _wide_deviation, MATERIAL),
    Regression("explained", lowrank, "principal_components", _weak_components, MATERIAL),
    Regression("smallest_cluster", representatives, "members", _shifted_start, CLUSTERED),
    Regression("spread_ratio", clustering, "k_means_plus_plus", _mixed_clusters, CLUSTERED),
    Regression("loss_ratio", training.Trainer, "_set_rate", _no_rate, WITHOUT),
    Regression(
        "encoder_residual",
        training,
        "standardised",
        lambda right, values, *statistics: right(values, *statistics) * 0.0,
        WITHOUT,
    ),
    Regression("bytes_over_table", network_assets, "packed", _needless_list, WITHOUT),
    Regression("decoding_error", network_assets, "packed", _scaled_weights, WITHOUT),
    Regression("rmse", compressed, "direction_inputs", _swapped_directions, WITHOUT),
    Regression("rmse_over_none", compressed, "direction_inputs", _swapped_directions, CLUSTERED),
    Regression("worst_image", compressed, "direction_inputs", _swapped_directions, WITHOUT),
    Regression("worst_texel", compressed, "direction_inputs", _swapped_directions, WITHOUT),
    Regression("coverage", panel, "folded_panel", _tiny_panel, WITHOUT),
    Regression(
        "mean_brightness", panel, "to_8bit", lambda right, picture: right(picture * 0.7), WITHOUT
    ),
)


def test_every_check_has_a_planted_regression() -> None:
    names = {check.name for plan in BTF.plans.values() for check in plan.checks}
    assert {regression.check for regression in REGRESSIONS} == names


@pytest.mark.parametrize("regression", REGRESSIONS, ids=lambda regression: regression.check)
def test_a_planted_regression_fails_its_check_and_the_last_good_version_stays(
    good: Any, regression: Regression, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert_found(good, BTF, regression, monkeypatch)


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
        if self.done == 70:
            raise KeyboardInterrupt
        steps(self)

    with monkeypatch.context() as patch:
        patch.setattr(training, "KEEP_SECONDS", 0.0)
        patch.setattr(training.Trainer, "step", killed)
        with pytest.raises(KeyboardInterrupt):
            good.launcher.launch(Request(BTF, [CLUSTERED], given=given))
    assert store.pointer(slot) == before
    assert [path.suffix for path in work.iterdir()] == [".state"]
    restored = []
    restore = training.Trainer.restore
    with monkeypatch.context() as patch:
        patch.setattr(
            training.Trainer,
            "restore",
            lambda self, kept: (restore(self, kept), restored.append(self.done)),
        )
        good.launcher.launch(Request(BTF, [CLUSTERED], given=given))
    assert restored == [70]
    assert not work.exists()
    resumed = store.record(slot)["content"]
    good.launcher.launch(Request(BTF, [CLUSTERED], given=given, force=True))
    assert store.record(slot)["content"] == resumed
    good.launcher.launch(Request(BTF, [CLUSTERED], preset="test"))


# ---- users' BTFs, good and bad ---------------------------------------------------------------


@pytest.fixture
def inbox(good: Any) -> Any:
    """The system's inbox, emptied afterwards."""
    folder = good.workspace.inbox(BTF.name)
    folder.mkdir(parents=True, exist_ok=True)
    yield folder
    for path in folder.iterdir():
        path.unlink()


def _photographs(path: Path) -> None:
    noise = np.random.default_rng(0).integers(0, 256, (225, 10, 14, 3), dtype=np.uint8)
    write_ubo2003_zip(path, noise, FIFTEEN, FIFTEEN)


def test_a_users_zip_becomes_a_compressed_btf(good: Any, inbox: Path) -> None:
    _photographs(inbox / "Wolle.zip")
    (key,) = set(BTF.sources("material", inbox)) - set(BTF.dimension("material").builtin)
    keys = {"material": key, "clusters": "12"}
    # Noise is no material: only the way through the graph is looked at, up to the clusters.
    good.launcher.launch(Request(BTF, [{"material": key}], "test", {"crop": [2, 1, 8, 6]}))
    store = good.workspace.store
    images = store.open(BTF.slot("btf_images", {"material": key}))
    assert dict(images.sizes) == {"image": 225, "y": 6, "x": 8, "channel": 3, "angle": 2}
    assert images.attrs["name"] == "Wolle.zip"
    assert "sRGB" in images.attrs["colour"]
    with pytest.raises(ValueError, match=r"Wolle\.zip: clusters is 49; expected at most 48"):
        good.launcher.launch(Request(BTF, [keys | {"clusters": "49"}]))


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
    good: Any, inbox: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _photographs(inbox / "damaged.zip")
    data = bytearray((inbox / "damaged.zip").read_bytes())
    middle = len(data) // 2
    data[middle : middle + 40] = bytes(40)
    (inbox / "damaged.zip").write_bytes(data)
    slots = set(good.workspace.store.slots())
    with pytest.raises(LaunchError, match=r"damaged\.zip|jpg"):
        good.launcher.launch(Request(BTF, [{"material": "damaged-zip"}], "test"))
    assert set(good.workspace.store.slots()) == slots


@pytest.mark.parametrize(
    ("value", "words"),
    [(np.nan, "not finite"), (70_000.0, "at most 65504"), (-1.5, "more than -1")],
)
def test_values_that_cannot_be_stored_are_refused_once(
    good: Any, monkeypatch: pytest.MonkeyPatch, value: float, words: str
) -> None:
    right = gonioreflectometer.Gonioreflectometer.photographs
    calls = []

    def wrong(self: Any, view: Any) -> Any:
        calls.append(1)
        photographs = right(self, view)
        photographs[0, 0, 0, 0] = value
        return photographs

    store = good.workspace.store
    slot = BTF.slot("btf_images", MATERIAL)
    before = store.pointer(slot)
    monkeypatch.setattr(gonioreflectometer.Gonioreflectometer, "photographs", wrong)
    with pytest.raises(LaunchError, match=words):
        good.launcher.launch(Request(BTF, [MATERIAL], force=True))
    assert store.pointer(slot) == before
    assert len(calls) <= 3, "tried again"
