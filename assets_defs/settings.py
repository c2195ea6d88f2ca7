"""Settings of assets: typed, with presets, remembered by the versions that they made.

A system declares plain pydantic classes. What is not given comes from the current version's
settings, so a rematerialisation repeats what was there; without a current version it comes from
the preset.
"""

from __future__ import annotations

import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

import pydantic

Preset = Literal["test", "demo", "paper"]
PRESETS: tuple[Preset, ...] = typing.get_args(Preset)
DEFAULT_PRESET: Preset = "demo"


UserFile = "user file"
"""Mark of a field, ``Annotated[str, UserFile]``, that may name a file of the user's: what the file
holds then counts like a setting."""


class SettingsError(ValueError):
    """A setting is outside what it may be; the text is one sentence."""


class Settings(pydantic.BaseModel):
    """Base of an asset's settings. Field defaults are the preset `demo`."""

    model_config = pydantic.ConfigDict(frozen=True, extra="forbid")
    sizes: ClassVar[Mapping[Preset, Mapping[str, Any]]] = {}
    """What the other presets have different."""

    @classmethod
    def preset(cls, name: Preset, keys: Mapping[str, str]) -> Self:
        """The settings of a preset for a partition (``{"photo": "grass"}``)."""
        return cls(**cls.sizes.get(name, {}))

    def files(self) -> dict[str, Path]:
        """The files that settings name, by field."""
        named = {
            name: Path(str(getattr(self, name)))
            for name, field in type(self).model_fields.items()
            if UserFile in field.metadata
        }
        return {name: path for name, path in named.items() if path.is_file()}


def resolve(
    settings: type[Settings],
    asset: str,
    keys: Mapping[str, str],
    *,
    preset: str | None,
    given: Mapping[str, Any],
    current: Mapping[str, Any] | None,
) -> Settings:
    """Settings for one materialisation. Raises SettingsError.

    ``given`` wins over ``preset``, which wins over the ``current`` version's settings.
    """
    if preset is not None and preset not in PRESETS:
        raise SettingsError(f"preset is {preset!r}; expected one of {', '.join(PRESETS)}.")
    name = preset or DEFAULT_PRESET
    base = settings.preset(name, keys).model_dump()
    if preset is None and current is not None:
        base |= {field: value for field, value in current.items() if field in base}
    try:
        return settings(**(base | dict(given)))
    except pydantic.ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(part) for part in first["loc"]) or "settings"
        problem = first["msg"].removeprefix("Value error, ")
        expected = problem[0].lower() + problem[1:]
        raise SettingsError(
            f"{asset}: setting {field!r} is {first['input']!r}; {expected}."
        ) from error
