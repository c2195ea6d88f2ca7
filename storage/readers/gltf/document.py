"""The shape of a glTF's JSON: the properties that are read, as the standard has them (glTF 2.0, 5).

What is checked once, here, later modules rely on: types, ranges, and that each reference leads to
an entry. Properties that are not read are not checked: a file whose camera is wrong is read.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from storage.readers.bad_input import BadInput

COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
"""Numbers of an element, by the type of its accessor."""
COMPONENT_TYPES = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4"}
"""NumPy's names of the types of numbers, little-endian each."""

MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
DRACO = "KHR_draco_mesh_compression"
INSTANCING = "EXT_mesh_gpu_instancing"
VISIBILITY = "KHR_node_visibility"

_LARGEST_WHOLE = 1 << 48
_MISSING = "missing"
_WAY_OUT = "or export it anew (Blender, gltf-transform)"


class _Wrong(Exception):  # noqa: N818 - never leaves this module
    def __init__(self, found: Any, expected: str) -> None:
        self.found, self.expected = found, expected
        self.place: list[str] = []


_Check = Callable[[Any], Any]
"""From a value to what it stands for; raises _Wrong."""


class _Object:
    """An object with properties of known names; others are passed over."""

    def __init__(self, required: Mapping[str, _Check], optional: Mapping[str, _Check]) -> None:
        self._required, self._known = required, {**required, **optional}

    def __call__(self, value: Any) -> Any:
        if not isinstance(value, dict):
            raise _Wrong(value, "an object")
        name = ""
        try:
            for name in self._required:
                if value.get(name) is None:
                    raise _Wrong(_MISSING, "this property")
            for name in [name for name in value if name in self._known]:
                if value[name] is None:
                    del value[name]
                else:
                    value[name] = self._known[name](value[name])
        except _Wrong as wrong:
            wrong.place.append(f".{name}")
            raise
        return value


class _ListOf:
    """A list of what is alike."""

    def __init__(self, check: _Check) -> None:
        self._check = check

    def __call__(self, value: Any) -> Any:
        if not isinstance(value, list):
            raise _Wrong(value, "a list")
        row = 0
        try:
            for row, entry in enumerate(value):
                value[row] = self._check(entry)
        except _Wrong as wrong:
            wrong.place.append(f"[{row}]")
            raise
        return value


def _by_name(check: _Check) -> _Check:
    """An object of what is alike, by names of its own."""

    def checked_object(value: Any) -> Any:
        return _Object({}, dict.fromkeys(value, check) if isinstance(value, dict) else {})(value)

    return checked_object


def checked(file: Path, description: Any) -> dict[str, Any]:
    """The JSON, checked in place: whole numbers written as 4.0 become 4, numbers become floats,
    properties that are null vanish.

    Raises BadInput naming the property that is not as the standard has it.
    """
    counts = {}
    if isinstance(description, dict):
        counts = {name: len(held) for name, held in description.items() if isinstance(held, list)}
    try:
        document: dict[str, Any] = _table(counts)(description)
    except _Wrong as wrong:
        field = "".join(reversed(wrong.place)).lstrip(".") or "content"
        shown = _MISSING if wrong.found is _MISSING else json.dumps(wrong.found)[:60]
        expected = f"{wrong.expected}, as glTF 2.0 has it, {_WAY_OUT}"
        raise BadInput(file, field, shown, expected) from None
    return document


# --- Checks of single values --------------------------------------------------------------------


def _whole(value: Any) -> int:
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if type(value) is not int or not 0 <= value < _LARGEST_WHOLE:
        raise _Wrong(value, "a whole number of at least 0")
    return value


def _number(value: Any) -> float:
    if type(value) not in (int, float) or not abs(value) < 1e300 or not math.isfinite(value):
        raise _Wrong(value, "a finite number")
    return float(value)


def _numbers(count: int) -> _Check:
    def check(value: Any) -> list[float]:
        if not isinstance(value, list) or len(value) != count:
            raise _Wrong(value, f"{count} numbers")
        return [_number(entry) for entry in value]

    return check


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise _Wrong(value, "a text")
    return value


def _flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise _Wrong(value, "true or false")
    return value


def _one_of(*values: Any) -> _Check:
    def check(value: Any) -> Any:
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if isinstance(value, bool | list | dict) or value not in values:
            raise _Wrong(value, "one of " + ", ".join(f"{known}" for known in values))
        return value

    return check


# --- The standard's properties ------------------------------------------------------------------


def _table(counts: dict[str, int]) -> _Object:
    """What is checked; ``counts``: entries of the document's lists, by name."""

    def to(kind: str) -> _Check:
        def check(value: Any) -> int:
            number = _whole(value)
            if number >= counts.get(kind, 0):
                raise _Wrong(value, f"one of the {counts.get(kind, 0)} {kind}, counted from 0")
            return number

        return check

    attributes = _by_name(to("accessors"))
    compressed = _Object(
        {"buffer": to("buffers"), "byteLength": _whole, "byteStride": _whole, "count": _whole},
        {"byteOffset": _whole, "mode": _text, "filter": _text},
    )
    draco = _Object({"bufferView": to("bufferViews"), "attributes": _by_name(_whole)}, {})
    primitive = _Object(
        {"attributes": attributes},
        {
            "indices": to("accessors"),
            "mode": _one_of(*range(7)),
            "targets": _ListOf(attributes),
            "extensions": _Object({}, {DRACO: draco}),
        },
    )
    where = {"bufferView": to("bufferViews")}
    index_types, types = _one_of(5121, 5123, 5125), _one_of(*COMPONENT_TYPES)
    indices = _Object(where | {"componentType": index_types}, {"byteOffset": _whole})
    values = _Object(where, {"byteOffset": _whole})
    sparse = _Object({"count": _whole, "indices": indices, "values": values}, {})
    accessor = _Object(
        {"componentType": types, "count": _whole, "type": _one_of(*COMPONENTS)},
        where | {"byteOffset": _whole, "normalized": _flag, "sparse": sparse},
    )
    view = _Object(
        {"buffer": to("buffers"), "byteLength": _whole},
        {
            "byteOffset": _whole,
            "byteStride": _whole,
            "extensions": _Object({}, dict.fromkeys(MESHOPT, compressed)),
        },
    )
    node_extensions = {
        INSTANCING: _Object({"attributes": attributes}, {}),
        VISIBILITY: _Object({}, {"visible": _flag}),
    }
    node = _Object(
        {},
        {
            "children": _ListOf(to("nodes")),
            "mesh": to("meshes"),
            "skin": to("skins"),
            "matrix": _numbers(16),
            "translation": _numbers(3),
            "rotation": _numbers(4),
            "scale": _numbers(3),
            "weights": _ListOf(_number),
            "extensions": _Object({}, node_extensions),
        },
    )
    skin = _Object({"joints": _ListOf(to("nodes"))}, {"inverseBindMatrices": to("accessors")})
    mesh = _Object({"primitives": _ListOf(primitive)}, {"weights": _ListOf(_number)})
    return _Object(
        {"asset": _Object({}, {})},
        {
            "scene": to("scenes"),
            "scenes": _ListOf(_Object({}, {"nodes": _ListOf(to("nodes"))})),
            "nodes": _ListOf(node),
            "meshes": _ListOf(mesh),
            "skins": _ListOf(skin),
            "accessors": _ListOf(accessor),
            "bufferViews": _ListOf(view),
            "buffers": _ListOf(_Object({"byteLength": _whole}, {"uri": _text})),
            "extensionsUsed": _ListOf(_text),
            "extensionsRequired": _ListOf(_text),
        },
    )
