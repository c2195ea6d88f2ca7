"""Dagster's config of a settings class: the same fields, all optional, and ``preset``."""

from __future__ import annotations

import typing
from types import UnionType
from typing import Any, Literal, Union

import dagster as dg
import pydantic

from assets_defs.settings import Settings


def config_class(settings: type[Settings]) -> type[dg.Config]:
    """The Dagster config of a settings class: `preset` and every field, all optional."""
    fields: dict[str, Any] = {"preset": (str | None, pydantic.Field(default=None))}
    for name, field in settings.model_fields.items():
        about = pydantic.Field(default=None, description=field.description)
        fields[name] = (_plain_type(field.annotation) | None, about)
    made = pydantic.create_model(f"{settings.__name__}Config", __base__=dg.Config, **fields)
    return made


def _plain_type(annotation: Any) -> Any:
    """The type as Dagster's config system knows it."""
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is Literal:
        return type(arguments[0])
    if origin is tuple:
        return list[arguments[0]]  # type: ignore[valid-type]
    if origin in (Union, UnionType):
        return _plain_type(next(kind for kind in arguments if kind is not type(None)))
    return annotation
