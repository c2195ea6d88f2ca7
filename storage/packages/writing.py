"""Packages as bytes: `meta.json`, then one file a part, the same bytes for the same contents."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from storage.packages.encoding import encoded
from storage.packages.schema import PackageSchema, PicturePart

FORMAT = 1
META = "meta.json"
COLOUR_SPACE = "linear Rec. 709 (sRGB primaries), white D65"
_DATE = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class Source:
    """What a package was made from."""

    name: str
    licence: str = "not stated"


@dataclass(frozen=True)
class PaperFigure:
    """What the paper states for the same thing."""

    value: float
    where: str
    """Table or figure, and its row."""


@dataclass(frozen=True)
class Figure:
    """A figure of the package's quality or size."""

    name: str
    value: float
    units: str = "1"
    paper: PaperFigure | None = None


@dataclass(frozen=True)
class View:
    """A frame of the stage that a live view can draw again."""

    name: str
    picture: str
    """Name of the picture part that holds it."""
    width: int
    height: int
    supersampling: int
    camera: Mapping[str, Any]
    """position, target, up (three numbers each), view_angle (degrees, vertical), height (of an
    orthographic picture, else None): as `pipelines.drawing.stage.Camera`."""
    state: Mapping[str, Any] = field(default_factory=dict)
    """The live view's own settings: light, layers, exposure …"""


@dataclass(frozen=True)
class Contents:
    """All that is in a package."""

    title: str
    sources: Sequence[Source]
    values: Mapping[str, Any]
    """Arrays and meshes by the names of their parts, `poster` and `input` among them."""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    views: Sequence[View] = ()
    figures: Sequence[Figure] = ()
    lineage: Sequence[Mapping[str, Any]] = ()
    """The versions that it was made of, with what their checks said."""


def write_package(schema: PackageSchema, contents: Contents) -> bytes:
    """A package's bytes.

    Raises ValueError for what is not as the schema declares: a part or parameter that is missing,
    unknown, or of another type or shape; a view without its picture.

    >>> from storage.packages.conformance import SMALL, small_contents
    >>> content = write_package(SMALL, small_contents())
    >>> content[:4], content == write_package(SMALL, small_contents())
    (b'PK\\x03\\x04', True)
    """
    _check(schema, contents)
    files, parts = [], {}
    for name, value in contents.values.items():
        part = schema.part(name)
        content, described = encoded(name, part, value)
        file = name + part.suffix
        files.append((file, content))
        parts[name] = {
            "file": file,
            "kind": part.kind,
            "bytes": len(content),
            "sha256": hashlib.sha256(content).hexdigest(),
            "units": part.units,
            "meaning": part.meaning,
            **described,
        }
    meta = {
        "format": FORMAT,
        "system": schema.system,
        "schema": schema.number,
        "title": contents.title,
        "source": [asdict(source) for source in contents.sources],
        "colour_space": COLOUR_SPACE,
        "up": "z",
        "parameters": {
            name: {
                "value": contents.parameters[name],
                "units": parameter.units,
                "meaning": parameter.meaning,
            }
            for name, parameter in schema.parameters.items()
        },
        "parts": parts,
        "views": [asdict(view) for view in contents.views],
        "figures": [asdict(figure) for figure in contents.figures],
        "lineage": list(contents.lineage),
    }
    text = json.dumps(meta, indent=1, sort_keys=True, allow_nan=False).encode()
    return _zip([(META, text), *files])


def _check(schema: PackageSchema, contents: Contents) -> None:
    missing = schema.missing(contents.values)
    if missing:
        raise ValueError(f"{schema.system}: parts {', '.join(missing)} are missing.")
    if set(contents.parameters) != set(schema.parameters):
        raise ValueError(
            f"{schema.system}: parameters are {sorted(contents.parameters)}; "
            f"expected {sorted(schema.parameters)}."
        )
    for view in contents.views:
        if view.picture not in contents.values:
            raise ValueError(f"view {view.name!r} shows {view.picture!r}; expected a picture part.")
        if not isinstance(schema.part(view.picture), PicturePart):
            raise ValueError(f"view {view.name!r} shows {view.picture!r}, which is no picture.")


def _zip(files: Sequence[tuple[str, bytes]]) -> bytes:
    """A zip of these files in their order; compressed where that makes them smaller."""
    import zlib

    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, content in files:
            entry = zipfile.ZipInfo(name, _DATE)
            entry.external_attr = 0o644 << 16
            smaller = len(zlib.compress(content, 9)) < len(content)
            entry.compress_type = zipfile.ZIP_DEFLATED if smaller else zipfile.ZIP_STORED
            archive.writestr(entry, content, compresslevel=9)
    return packed.getvalue()
