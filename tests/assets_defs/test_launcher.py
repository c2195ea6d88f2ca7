"""What the launcher refuses before any work, and what it tells of a failure."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import dagster as dg
import numpy as np
import pytest
from PIL import Image

from assets_defs.inbox import take_in
from assets_defs.launcher import LaunchError, Request
from assets_defs.photo_fur.graph import FUR
from pipelines.photo_fur import attenuation


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"layers": 0}, ("layers", "0")),
        ({"layers": 1000}, ("layers", "1000")),
        ({"thickness": -0.1}, ("thickness", "-0.1")),
        ({"thickness": float("nan")}, ("thickness", "nan")),
        ({"tail": 0.7}, ("tail", "0.7")),
        ({"no_such_setting": 1}, ("no_such_setting", "expected one of")),
        ({"fill": "stripes"}, ("fill", "stripes")),
    ],
)
def test_bad_settings_are_refused_before_any_work(
    house: Any, given: dict[str, Any], words: tuple[str, ...]
) -> None:
    with pytest.raises(ValueError, match=r"expected|should|may") as refusal:
        house.launcher.launch(Request(FUR, [{"photo": "grass", "mesh": "square"}], "test", given))
    assert all(word in str(refusal.value) for word in words)
    assert "\n" not in str(refusal.value)
    assert list(house.workspace.store.slots()) == []
    assert house.instance.get_runs_count() == 0


def test_a_crop_is_for_photographs_of_files(house: Any) -> None:
    given = {"crop": [0, 0, 64, 64]}
    with pytest.raises(ValueError, match="crop is set for grass"):
        house.launcher.launch(Request(FUR, [{"photo": "grass"}], "test", given))


def test_an_unknown_key_is_refused(house: Any) -> None:
    with pytest.raises(ValueError, match="photo 'nobody' is not known"):
        house.launcher.launch(Request(FUR, [{"photo": "nobody"}]))


def test_a_bad_photograph_is_refused_and_not_taken_in(house: Any, tmp_path: Path) -> None:
    path = tmp_path / "flat.png"
    Image.fromarray(np.full((80, 80, 3), 90, np.uint8)).save(path)
    with pytest.raises(ValueError, match=r"flat\.png"):
        take_in(path, FUR, FUR.dimension("photo"), {}, house.workspace, house.instance)
    assert FUR.files("photo", house.workspace.inbox("photo_fur")) == []


def test_a_photograph_is_taken_in_once_and_apart_from_others_of_its_name(
    house: Any, tmp_path: Path
) -> None:
    noise = np.random.default_rng(1).integers(0, 256, (80, 80, 3), dtype=np.uint8)
    keys = []
    for folder, picture in (("a", noise), ("b", noise), ("c", noise[::-1])):
        (tmp_path / folder).mkdir()
        path = tmp_path / folder / "Fell, grün.png"
        Image.fromarray(picture).save(path)
        keys.append(take_in(path, FUR, FUR.dimension("photo"), {}, house.workspace, house.instance))
    assert keys[0] == keys[1] != keys[2]
    path = tmp_path / "grass.png"
    Image.fromarray(noise).save(path)
    built_in = take_in(path, FUR, FUR.dimension("photo"), {}, house.workspace, house.instance)
    assert built_in == "grass-png"
    outcomes = house.launcher.launch(Request(FUR, [{"photo": keys[0]}], "test"))
    assert [outcome.state for outcome in outcomes] == ["made"] * 3
    stored = house.workspace.store.open(FUR.slot("fur_photo", {"photo": keys[0]}))
    assert stored.attrs["name"] == "Fell, grün.png"
    for name in FUR.files("photo", house.workspace.inbox("photo_fur")):
        name.unlink()


def test_a_failure_is_told_in_its_own_words_and_ends_the_launch(
    house: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*arguments: Any, **options: Any) -> Any:
        raise ValueError("the photograph has a single luminance.")

    monkeypatch.setattr(attenuation, "fit_attenuation", broken)
    with pytest.raises(LaunchError, match=r"grass.*: the photograph has a single luminance"):
        house.launcher.launch(Request(FUR, [{"photo": "grass"}], "test"))
    runs = house.instance.get_runs(filters=dg.RunsFilter(statuses=[dg.DagsterRunStatus.FAILURE]))
    assert [run.job_name for run in runs] == ["photo_fur_photo"]


def test_a_failure_leaves_out_what_needs_it_and_the_rest_goes_on(
    house: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = attenuation.fit_attenuation

    def wrong_for_large(luminance: Any, **options: Any) -> Any:
        if luminance.shape == (64, 64):
            raise ValueError("this pelt is wrong.")
        return right(luminance, **options)

    monkeypatch.setattr(attenuation, "fit_attenuation", wrong_for_large)
    keys = [{"photo": photo, "mesh": "square"} for photo in ("pelt", "grass")]
    with pytest.raises(LaunchError, match="this pelt is wrong") as failure:
        house.launcher.launch(Request(FUR, keys, "test", force=True))
    assert len(str(failure.value).splitlines()) == 1
    made = {str(outcome.slot) for outcome in failure.value.outcomes}
    assert "photo_fur/fur_frames/square.grass" in made
    assert "photo_fur/fur_frames/square.pelt" not in made


def test_a_passing_trouble_is_tried_again(house: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    right = attenuation.fit_attenuation
    tries = []

    def flaky(*arguments: Any, **options: Any) -> Any:
        tries.append(1)
        if len(tries) == 1:
            raise OSError("the network drive is away")
        return right(*arguments, **options)

    monkeypatch.setattr(attenuation, "fit_attenuation", flaky)
    house.launcher.launch(Request(FUR, [{"photo": "grass"}], "test", force=True))
    assert len(tries) == 2


def test_progress_is_told_up_to_the_end(house: Any) -> None:
    house.heard.clear()
    house.launcher.launch(Request(FUR, [{"photo": "grass"}], "test", force=True))
    assert house.heard[-1] == ("photo_fur", 1.0)
    assert any(what == "fur_photo [grass]" for what, _ in house.heard)
