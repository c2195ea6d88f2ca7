"""Settings: who wins, what is refused and how, and what Dagster makes of their types."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import dagster as dg
import pytest
from pydantic import Field, ValidationError, field_validator

from assets_defs.dagster_settings import config_class
from assets_defs.settings import PRESETS, Preset, Settings, SettingsError, resolve
from assets_defs.systems import SYSTEMS


class Sample(Settings):
    """One field of every kind."""

    count: int = Field(40, ge=1, le=100, description="How many")
    share: float = Field(0.25, ge=0.0, lt=0.5)
    crop: tuple[int, int] | None = None
    thickness: float | None = Field(None, gt=0.0, allow_inf_nan=False)
    kind: Literal["round", "flat"] = "round"
    angles: tuple[float, ...] = (0.0, 90.0)
    wet: bool = False
    name: str = "fur"

    @field_validator("name")
    @classmethod
    def _is_a_slug(cls, name: str) -> str:
        if " " in name:
            raise ValueError("Expected no space")
        return name

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"count": 4},
        "paper": {"count": 90, "kind": "flat"},
    }


class Keyed(Settings):
    """Settings that depend on the partition."""

    layers: int = 15

    @classmethod
    def preset(cls, name: Preset, keys: Mapping[str, str]) -> Keyed:
        """Fewer on the square."""
        return cls(layers=8 if keys["mesh"] == "square" else 15)


def resolved(
    preset: str | None = None,
    given: Mapping[str, Any] | None = None,
    current: Mapping[str, Any] | None = None,
) -> Sample:
    settings = resolve(Sample, "shell_stack", {}, preset=preset, given=given or {}, current=current)
    assert isinstance(settings, Sample)
    return settings


# ---- who wins --------------------------------------------------------------------------------

COUNTS = {None: 40, "demo": 40, "test": 4, "paper": 90}


@pytest.mark.parametrize(
    ("preset", "given", "current"),
    list(itertools.product((None, *PRESETS), (None, 71), (None, 17))),
)
def test_given_wins_over_preset_over_current_over_demo(
    preset: str | None, given: int | None, current: int | None
) -> None:
    found = resolved(
        preset,
        {} if given is None else {"count": given},
        None if current is None else {"count": current, "wet": True},
    )
    expected = COUNTS[preset]
    if preset is None and current is not None:
        expected = current
    if given is not None:
        expected = given
    assert found.count == expected
    assert found.wet is (preset is None and current is not None)


def test_a_rematerialisation_repeats_what_was_there() -> None:
    before = resolved("paper", {"crop": (3, 4), "share": 0.1})
    assert resolved(current=before.model_dump()) == before
    # … and after the record has been through JSON.
    assert resolved(current=before.model_dump(mode="json")) == before
    assert resolved("demo", current=before.model_dump()) == Sample()


def test_a_field_that_a_version_did_not_have_yet_comes_from_demo() -> None:
    assert resolved(current={"count": 5}) == Sample(count=5)


def test_a_field_that_is_gone_is_forgotten() -> None:
    assert resolved(current={"count": 5, "gone": 1}) == Sample(count=5)


def test_presets_know_the_partition() -> None:
    layers = {
        mesh: resolve(Keyed, "shell_mesh", {"mesh": mesh}, preset=None, given={}, current=None)
        for mesh in ("square", "teapot")
    }
    assert layers == {"square": Keyed(layers=8), "teapot": Keyed(layers=15)}


# ---- refusals --------------------------------------------------------------------------------


@pytest.mark.parametrize("preset", ["papers", "", "Demo"])
def test_an_unknown_preset_is_refused(preset: str) -> None:
    with pytest.raises(SettingsError) as caught:
        resolved(preset)
    assert str(caught.value) == f"preset is {preset!r}; expected one of test, demo, paper."


@pytest.mark.parametrize(
    ("given", "beginning", "end"),
    [
        ({"count": 0}, "setting 'count' is 0; ", "greater than or equal to 1."),
        ({"count": 2.5}, "setting 'count' is 2.5; ", "."),
        ({"count": "many"}, "setting 'count' is 'many'; ", "."),
        ({"share": 0.5}, "setting 'share' is 0.5; ", "less than 0.5."),
        ({"thickness": float("nan")}, "setting 'thickness' is nan; ", "."),
        ({"thickness": float("inf")}, "setting 'thickness' is inf; ", "finite number."),
        ({"kind": "wet"}, "setting 'kind' is 'wet'; ", "'round' or 'flat'."),
        ({"crop": [1, "x"]}, "setting 'crop.1' is 'x'; ", "."),
        ({"crop": [1]}, "setting 'crop", "."),
        ({"name": "a b"}, "setting 'name' is 'a b'; expected no space", "no space."),
        ({"colour": 3}, "setting 'colour' is 3; ", "not permitted."),
    ],
    ids=lambda value: str(value) if isinstance(value, dict) else "",
)
def test_a_setting_outside_its_range_is_refused_in_one_sentence(
    given: dict[str, Any], beginning: str, end: str
) -> None:
    with pytest.raises(SettingsError) as caught:
        resolved(given=given)
    sentence = str(caught.value)
    assert sentence.startswith(f"shell_stack: {beginning}")
    assert sentence.endswith(end)
    assert "\n" not in sentence
    assert ". " not in sentence
    assert isinstance(caught.value, ValueError)


def test_a_current_version_that_is_out_of_range_now_is_refused_too() -> None:
    with pytest.raises(SettingsError, match=r"^shell_stack: setting 'count' is 500; "):
        resolved(current={"count": 500})


def test_settings_do_not_change_and_take_no_unknown_field() -> None:
    settings = Sample()
    with pytest.raises(ValidationError):
        settings.count = 3  # type: ignore[misc]
    with pytest.raises(ValidationError):
        Sample(colour=1)  # type: ignore[call-arg]


# ---- Dagster ---------------------------------------------------------------------------------


def run_with(settings: type[Settings], config: Mapping[str, Any]) -> dict[str, Any]:
    """What an op sees of its config: the fields that were given."""
    seen: dict[str, Any] = {}

    def tiny(context: Any, config: Any) -> None:
        given = config.model_dump()
        seen.update({name: value for name, value in given.items() if value is not None})

    tiny.__annotations__ = {"context": dg.OpExecutionContext, "config": config_class(settings)}
    made = dg.op(tiny)

    @dg.job
    def once() -> None:
        made()

    result = once.execute_in_process(run_config={"ops": {"tiny": {"config": dict(config)}}})
    assert result.success
    return seen


def test_every_field_and_the_preset_is_optional() -> None:
    fields = config_class(Sample).model_fields
    assert list(fields) == ["preset", *Sample.model_fields]
    assert all(field.default is None and not field.is_required() for field in fields.values())
    assert fields["count"].description == "How many"
    assert run_with(Sample, {}) == {}


def test_dagster_hands_over_what_was_given_and_it_resolves() -> None:
    config = {
        "preset": "paper",
        "count": 7,
        "share": 0.125,
        "crop": [10, 20],
        "thickness": 1.5,
        "kind": "flat",
        "angles": [10.0, 20.0, 30.0],
        "wet": True,
        "name": "other",
    }
    seen = run_with(Sample, config)
    assert seen == config
    found = resolved(seen.pop("preset"), seen)
    assert found == Sample(
        count=7,
        share=0.125,
        crop=(10, 20),
        thickness=1.5,
        kind="flat",
        angles=(10.0, 20.0, 30.0),
        wet=True,
        name="other",
    )


def test_a_false_or_zero_that_was_given_is_not_taken_for_nothing() -> None:
    seen = run_with(Sample, {"wet": False, "share": 0.0})
    assert seen == {"wet": False, "share": 0.0}
    assert resolved(given=seen, current={"wet": True, "share": 0.3}) == Sample(share=0.0)


@pytest.mark.parametrize("config", [{"count": "many"}, {"crop": 3}, {"wet": 2}, {"colour": 1}])
def test_dagster_refuses_another_type_before_the_run(config: dict[str, Any]) -> None:
    with pytest.raises(dg.DagsterInvalidConfigError):
        run_with(Sample, config)


@pytest.mark.parametrize(
    "settings",
    [plan.settings for system in SYSTEMS.values() for plan in system.plans.values()],
    ids=lambda settings: settings.__name__,
)
@pytest.mark.parametrize(
    "preset",
    [
        preset if preset == "paper" else pytest.param(preset, marks=pytest.mark.slow)
        for preset in PRESETS
    ],
)
def test_the_settings_of_every_asset_go_through_dagster_and_back(
    settings: type[Settings], preset: Preset
) -> None:
    keys = dict.fromkeys((d.name for s in SYSTEMS.values() for d in s.dimensions), "any")
    expected = settings.preset(preset, keys)
    config = {
        name: value for name, value in expected.model_dump(mode="json").items() if value is not None
    }
    seen = run_with(settings, config)
    assert resolve(settings, "any", keys, preset=None, given=seen, current=None) == expected
