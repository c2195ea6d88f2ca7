"""Valid files made wrong: flipped, cut, repeated, with impossible numbers, lengths and nesting."""

from __future__ import annotations

import contextlib
import copy
import io
import json
import random
import re
import struct
import zipfile
from collections.abc import Callable
from typing import Any

from benchmarks.bad_input_files import Case, glb, with_png_checksums, zipped
from storage.btf_file.layout import HEADER, sealed
from storage.packages.conformance import rehashed

_NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
_WORDS = (
    b"1e400", b"-1e400", b"nan", b"inf", b"-inf", b"-1", b"0", b"0.5", b"1e-300", b"1e300", b"1e18",
    b"4294967295", b"2147483648", b"18446744073709551616", b"-2147483649", b"9" * 400, b"1" * 5000,
    b"", b"x", b"1_0", b"0x10", b"1,5", b"1/0", b"\xff", b"\0", "٣".encode(),
)  # fmt: skip
_VALUES: tuple[Any, ...] = (
    None, True, False, "", "x", "a" * 5000, [], {}, [[]], -1, 0, 0.5, 1e300, 1e-300, -1e308, 2**31,
    2**63, 10**18, 10**400, float("nan"), float("inf"), "1", [1, 2], {"a": 1}, [0] * 16, "\ud800",
)  # fmt: skip
_INTEGERS = (0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x10000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)


def mutated(case: Case, chance: random.Random) -> Case:
    """The case with one of its files changed, once or a few times."""
    name = case.entry or chance.choice(sorted(case.files))
    if case.reader == "drive" and chance.random() < 0.6:
        described = sorted(name for name in case.files if not name.endswith((".png", ".jpg")))
        name = chance.choice(described)
    if case.reader == "scene" and chance.random() < 0.3 and case.entry == "mesh.obj":
        name = "mesh.mtl"
    data = case.files[name]
    assert isinstance(data, bytes)
    for _ in range(chance.choice((1, 1, 1, 2, 3, 8))):
        data = _mutation_of(name, chance)(data, chance)
    return case._replace(files={**case.files, name: data})


def _mutation_of(name: str, chance: random.Random) -> Callable[[bytes, random.Random], bytes]:
    ending = name.rsplit(".", 1)[-1]
    special = _SPECIAL.get(ending)
    if special and chance.random() < 0.6:
        return special
    if ending in ("ply", "obj", "mtl", "csv", "json", "hdr", "txt") and chance.random() < 0.6:
        return _numbers
    return chance.choice(_ON_BYTES)


def _flip(data: bytes, chance: random.Random) -> bytes:
    out = bytearray(data)
    for _ in range(chance.choice((1, 2, 8, 64)) if out else 0):
        out[_place(out, chance)] ^= 1 << chance.randrange(8)
    return bytes(out)


def _cut(data: bytes, chance: random.Random) -> bytes:
    return data[: chance.randrange(len(data) + 1)]


def _insert(data: bytes, chance: random.Random) -> bytes:
    at = _place(data, chance)
    piece = chance.choice((chance.randbytes(chance.randrange(1, 64)), b"\0" * 999, b"\n", b" "))
    return data[:at] + piece + data[at:]


def _drop(data: bytes, chance: random.Random) -> bytes:
    at = _place(data, chance)
    return data[:at] + data[at + chance.randrange(1, 64) :]


def _double(data: bytes, chance: random.Random) -> bytes:
    first, last = sorted((_place(data, chance), _place(data, chance)))
    return data[:last] + data[first:last] * chance.choice((1, 1, 3)) + data[last:]


def _swap(data: bytes, chance: random.Random) -> bytes:
    first, middle, last = sorted(_place(data, chance) for _ in range(3))
    return data[:first] + data[middle:last] + data[first:middle] + data[last:]


def _integer(data: bytes, chance: random.Random) -> bytes:
    """Lengths and counts of binary headers."""
    form = chance.choice(("<I", ">I", "<H", ">H", "B"))
    size = struct.calcsize(form)
    if len(data) < size:
        return data
    at = min(_place(data, chance), len(data) - size)
    value = chance.choice(_INTEGERS) & (256**size - 1)
    return data[:at] + struct.pack(form, value) + data[at + size :]


_ON_BYTES = (_flip, _flip, _cut, _insert, _drop, _double, _swap, _integer, _integer)


def _numbers(data: bytes, chance: random.Random) -> bytes:
    found = list(_NUMBER.finditer(data))
    if not found:
        return _flip(data, chance)
    match = chance.choice(found[:8] if chance.random() < 0.3 else found)
    return data[: match.start()] + chance.choice(_WORDS) + data[match.end() :]


def _place(data: bytes | bytearray, chance: random.Random) -> int:
    """Headers twice as often as the rest."""
    most = len(data) if chance.random() < 0.5 else min(len(data), 256)
    return chance.randrange(max(most, 1))


# --- Formats with a structure of their own ------------------------------------------------------


def _json(data: bytes, chance: random.Random) -> bytes:
    try:
        top = json.loads(data)
    except (ValueError, RecursionError):
        return _flip(data, chance)
    if not isinstance(top, dict | list):  # cut down to a number
        return _flip(data, chance)
    if chance.random() < 0.05:
        depth = chance.choice((50, 100, 500, 990, 100_000))
        return b"[" * depth + data + b"]" * depth
    holders = [top]
    for holder in holders:
        values = holder.values() if isinstance(holder, dict) else holder
        holders += [value for value in values if isinstance(value, dict | list) and value]
    holder = chance.choice(holders)
    if not holder or not isinstance(holder, dict | list):
        return data
    key: Any = chance.choice(list(holder)) if isinstance(holder, dict) else _index(holder, chance)
    action = chance.random()
    if action < 0.15:
        del holder[key]
    elif action < 0.3 and isinstance(holder, list):
        holder.extend([holder[key]] * chance.choice((1, 2, 50)))
    elif action < 0.4:
        others = list(chance.choice(holders)) or [None]
        holder[key] = copy.deepcopy(chance.choice(others))
    else:
        holder[key] = chance.choice(_VALUES)
    return json.dumps(top).encode()


def _index(holder: list[Any], chance: random.Random) -> int:
    return chance.randrange(len(holder))


def _glb(data: bytes, chance: random.Random) -> bytes:
    if len(data) < 20:
        return data
    (length,) = struct.unpack_from("<I", data, 12)
    return glb(_json(data[20 : 20 + length].rstrip(), chance), data[28 + length :])


def _zip(data: bytes, chance: random.Random) -> bytes:
    """A member's content changed, and packed again."""
    files = _members(data, chance)
    return _flip(data, chance) if files is None else zipped(files)


def _package(data: bytes, chance: random.Random) -> bytes:
    """A part or `meta.json` changed, and packed again; often with hashes that belong to it."""
    files = _members(data, chance)
    if files is None:
        return _flip(data, chance)
    if chance.random() < 0.7:
        with contextlib.suppress(Exception):  # meta.json is not what it was
            return rehashed(files)
    return zipped(files)


def _members(data: bytes, chance: random.Random) -> dict[str, bytes] | None:
    """The members of a zip, one of them changed; None where it is no zip, or has none."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            files = {name: archive.read(name) for name in archive.namelist()}
    except Exception:  # changed before
        return None
    if not any(files):
        return None
    name = chance.choice(sorted(files))
    files[name] = _mutation_of(name, chance)(files[name], chance)
    return files


def _png(data: bytes, chance: random.Random) -> bytes:
    return with_png_checksums(chance.choice(_ON_BYTES)(data, chance))


def _btf_file(data: bytes, chance: random.Random) -> bytes:
    """With a length and a checksum that belong to it, so that what is behind them is met."""
    found = chance.choice(_ON_BYTES)(data, chance)
    return sealed(found) if len(found) >= HEADER.size else found


_SPECIAL = {
    "json": _json, "glb": _glb, "zip": _zip, "tsuya": _package, "png": _png, "tbtf": _btf_file,
}  # fmt: skip
