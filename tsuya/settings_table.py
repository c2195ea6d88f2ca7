"""What can be set of a system: types, ranges, defaults and meanings, as the code declares them."""

from __future__ import annotations

import typing
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Union

from pydantic.fields import FieldInfo

from assets_defs.system import System

if TYPE_CHECKING:
    from rich.table import Table


class SettingRow(NamedTuple):
    """One setting, in words."""

    name: str
    assets: str
    """The assets that have it."""
    values: str
    """Type and range."""
    default: str
    """Of the preset `demo`."""
    meaning: str


def setting_rows(system: System) -> list[SettingRow]:
    """Every setting of a system, in the order of its graph; one row where assets share it."""
    assets: dict[str, list[str]] = {}
    fields: dict[str, FieldInfo] = {}
    for plan in system.plans.values():
        for name, field in plan.settings.model_fields.items():
            assets.setdefault(name, []).append(plan.name)
            fields.setdefault(name, field)
    return [
        SettingRow(
            name,
            ", ".join(assets[name]),
            _values(field),
            _shown(field.default),
            (field.description or "").rstrip("."),
        )
        for name, field in fields.items()
    ]


def settings_table(system: System) -> Table:
    """The rows as a table."""
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=f"{system.title}: settings, for --set", title_justify="left")
    for column in ("setting", "of", "values", "default", "meaning"):
        table.add_column(column)
    for row in setting_rows(system):
        table.add_row(*map(escape, row))
    return table


def _values(field: FieldInfo) -> str:
    """Type and range of a field: `whole number, 1 to 8`."""
    bounds = {
        name: getattr(rule, name)
        for rule in field.metadata
        for name in ("ge", "gt", "le", "lt", "multiple_of")
        if getattr(rule, name, None) is not None
    }
    parts = [_kind(field.annotation)]
    low = (
        f"{bounds['ge']:g}"
        if "ge" in bounds
        else f"over {bounds['gt']:g}"
        if "gt" in bounds
        else ""
    )
    high = (
        f"{bounds['le']:g}"
        if "le" in bounds
        else f"under {bounds['lt']:g}"
        if "lt" in bounds
        else ""
    )
    if low and high:
        parts.append(f"{low} to {high}")
    elif low:
        parts.append(low if low.startswith("over") else f"{low} or more")
    elif high:
        parts.append(high if high.startswith("under") else f"at most {high}")
    if "multiple_of" in bounds:
        parts.append(f"a multiple of {bounds['multiple_of']:g}")
    return ", ".join(parts)


_WORDS = {int: "whole number", float: "number", bool: "true or false", str: "text"}


def _kind(annotation: Any) -> str:
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is Literal:
        return " or ".join(str(argument) for argument in arguments)
    if origin in (Union, UnionType):
        return " or ".join(
            "null" if argument is NoneType else _kind(argument) for argument in arguments
        )
    if origin is typing.Annotated:
        return _kind(arguments[0])
    if origin is tuple:
        return f"[{', '.join(_kind(a) for a in arguments if a is not Ellipsis)}]"
    return _WORDS.get(annotation, getattr(annotation, "__name__", str(annotation)))


def _shown(default: Any) -> str:
    return "null" if default is None else str(default)
