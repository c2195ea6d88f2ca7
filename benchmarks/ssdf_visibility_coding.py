"""The rival of the compressed distances: the bits of visibility themselves, without loss.

A coder as strong as we could make it. Each vertex has up to three *references* among those before
it, whose bits differ least from its own. A row of directions of which nothing unlike the references
is seen costs one flag; else each bit is predicted by nine models, whose contexts are bits that the
decoder has: before it in its own picture, and around it in the references'. Their answers are mixed
in the logistic domain by weights that learn (Mahoney, "Adaptive weighing of context models for
lossless data compression", 2005), and the result drives the range coder of `entropy_coding`.
"""

from __future__ import annotations

import math
import struct
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipelines.geometry.mesh_edges import edge_vertices
from pipelines.ssdf_lighting.compression import entropy_coding as coder

Bits = NDArray[np.uint8]

_REFERENCES = 3
_MODELS, _CONTEXTS, _SETS = 9, 1 << 16, 32
_FASTEST = 30
"""A model's chance moves by 1 / (times seen + 1.6), at least by 1 / 31.6."""
_RATE = 5
_HEADER = struct.Struct("<III")


def _tables() -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """ln(p / (1 - p)) of p in 1 / 4096, its inverse from -2047 on, and the rates."""
    places = (np.arange(4096) + 0.5) / 4096.0
    logit = np.clip(np.rint(256.0 * np.log(places / (1.0 - places))), -2047, 2047)
    chance = np.clip(np.rint(65536.0 / (1.0 + np.exp(-np.arange(-2047, 2048) / 256.0))), 32, 65504)
    rates = np.floor(65536.0 / (np.arange(_FASTEST + 1) + 1.6))
    return logit.astype(np.int64), chance.astype(np.int64), rates.astype(np.int64)


def encode_visibility(visible: NDArray[np.bool_], triangles: NDArray[np.integer]) -> bytes:
    """The code of the visibility (V, n²) of the vertices of triangles (F, 3)."""
    n = math.isqrt(visible.shape[1])
    bits = visible.reshape(-1, n, n).astype(np.uint8)
    references = _references(visible, triangles)
    steps = (np.arange(len(bits))[:, None] - references).T.astype(np.int64)
    # A step that the vertex before has, too, is a 0.
    steps[:, 1:] = np.where(steps[:, 1:] == steps[:, :-1], 0, steps[:, 1:])
    contexts = np.repeat(np.arange(_REFERENCES), len(bits))
    before = coder.encode(steps.ravel(), contexts)
    room = np.empty(64 + bits.size, np.uint8)
    used = _run(bits, references, room, True, *_tables())
    header = _HEADER.pack(len(bits), n, len(before))
    return header + before + room[1:used].tobytes()


def decode_visibility(data: bytes) -> NDArray[np.bool_]:
    """The visibility (V, n²) of a code."""
    count, n, length = _HEADER.unpack_from(data)
    contexts = np.repeat(np.arange(_REFERENCES), count)
    told = coder.decode(data[_HEADER.size : _HEADER.size + length], contexts)
    steps = told.reshape(_REFERENCES, count).astype(np.int64)
    for row in steps:
        for vertex in range(1, count):
            if row[vertex] == 0:
                row[vertex] = row[vertex - 1]
    references = np.arange(count)[:, None] - steps.T
    bits = np.zeros((count, n, n), np.uint8)
    code = np.frombuffer(data[_HEADER.size + length :], np.uint8).copy()
    _run(bits, references, code, False, *_tables())
    return bits.reshape(count, -1).astype(bool)


# ---- references --------------------------------------------------------------------------------


def _references(visible: NDArray[np.bool_], triangles: NDArray[np.integer]) -> NDArray[np.int64]:
    """(V, 3): earlier vertices, at most two edges away or the one before; -1 for the first."""
    from scipy.sparse import coo_array

    sides, count = edge_vertices(triangles), len(visible)
    ones = np.ones(len(sides), np.int32)
    near = coo_array((ones, (sides[:, 0], sides[:, 1])), shape=(count, count)).tocsr()
    near = near + near.T
    near = (near @ near + near).tocsr()
    packed = np.packbits(visible, axis=1)
    found = np.full((count, _REFERENCES), -1, np.int64)
    for vertex in range(1, count):
        around = near.indices[near.indptr[vertex] : near.indptr[vertex + 1]]
        around = np.unique(np.append(around[around < vertex], vertex - 1))
        apart = np.bitwise_count(packed[around] ^ packed[vertex]).sum(axis=1)
        best = around[np.argsort(apart, kind="stable")[:_REFERENCES]]
        found[vertex] = np.append(best, np.repeat(best[:1], _REFERENCES - len(best)))
    return found


# ---- bits --------------------------------------------------------------------------------------


@njit(cache=True, nogil=True)
def _pad(picture: Bits, padded: Bits) -> None:
    """The picture with its border twice more on each side."""
    n = len(picture)
    for y in range(n + 4):
        for x in range(n + 4):
            padded[y, x] = picture[min(max(y - 2, 0), n - 1), min(max(x - 2, 0), n - 1)]


@njit(cache=True, nogil=True)
def _around(a: Bits, y: int, x: int) -> tuple[np.int64, np.int64, np.int64]:
    """Nine bits, their sum, and their sum weighted 1 2 1, 2 4 2, 1 2 1."""
    whole, count, soft, place = np.int64(0), np.int64(0), np.int64(0), 0
    for dy in range(-1, 2):
        for dx in range(-1, 2):
            bit = np.int64(a[y + dy, x + dx])
            whole |= bit << place
            count += bit
            soft += bit * (2 - abs(dy)) * (2 - abs(dx))
            place += 1
    return whole, count, soft


@njit(cache=True, nogil=True)
def _contexts_at(
    own: Bits, refs: Bits, y: int, x: int, seen: NDArray[np.int64], found: NDArray[np.int64]
) -> int:
    """Fills the models' contexts; returns the set of mixing weights. ``seen`` (3, 3) `_around`."""
    a, b, c = refs[0], refs[1], refs[2]
    w, nw, n, ne = (
        np.int64(own[y, x - 1]),
        np.int64(own[y - 1, x - 1]),
        np.int64(own[y - 1, x]),
        np.int64(own[y - 1, x + 1]),
    )
    ww, nn, nee = np.int64(own[y, x - 2]), np.int64(own[y - 2, x]), np.int64(own[y - 1, x + 2])
    near = w | nw << 1 | n << 2 | ne << 3
    more = ww | nn << 1 | np.int64(own[y - 2, x + 1]) << 2 | np.int64(own[y - 2, x - 1]) << 3
    at_a, at_b, at_c = np.int64(a[y, x]), np.int64(b[y, x]), np.int64(c[y, x])
    soft_a, soft_b, soft_c = seen[0, 2], seen[1, 2], seen[2, 2]
    ahead = (
        np.int64(a[y + 1, x])
        | np.int64(a[y, x + 1]) << 1
        | np.int64(a[y + 1, x + 1]) << 2
        | np.int64(a[y + 1, x - 1]) << 3
    )
    found[0] = (
        near
        | more << 4
        | nee << 8
        | at_a << 9
        | at_b << 10
        | ahead << 11
        | np.int64(b[y + 1, x]) << 15
    )
    found[1] = seen[0, 0] | near << 9 | at_b << 13 | at_c << 14
    found[2] = seen[1, 0] | near << 9 | at_a << 13 | at_c << 14
    found[3] = seen[2, 0] | near << 9 | at_a << 13 | at_b << 14
    found[4] = (((soft_a >> 1) * 9 + (soft_b >> 1)) * 9 + (soft_c >> 1)) * 16 + near
    unlike_a = (
        w ^ a[y, x - 1]
        | (nw ^ a[y - 1, x - 1]) << 1
        | (n ^ a[y - 1, x]) << 2
        | (ne ^ a[y - 1, x + 1]) << 3
    )
    unlike_b = (
        w ^ b[y, x - 1]
        | (nw ^ b[y - 1, x - 1]) << 1
        | (n ^ b[y - 1, x]) << 2
        | (ne ^ b[y - 1, x + 1]) << 3
    )
    found[5] = unlike_a | soft_a << 4 | unlike_b << 9 | at_b << 13
    found[6] = soft_a + 17 * (soft_b + 17 * near)
    total = soft_a + soft_b + soft_c
    found[7] = total | near << 6 | ww << 10 | nn << 11 | nee << 12
    found[8] = (
        np.int64(a[y - 2, x])
        | np.int64(a[y + 2, x]) << 1
        | np.int64(a[y, x - 2]) << 2
        | np.int64(a[y, x + 2]) << 3
        | np.int64(a[y - 1, x]) << 4
        | np.int64(a[y + 1, x]) << 5
        | np.int64(a[y, x - 1]) << 6
        | np.int64(a[y, x + 1]) << 7
        | at_a << 8
        | w << 9
        | n << 10
        | at_b << 11
        | np.int64(b[y + 1, x]) << 12
        | np.int64(b[y, x + 1]) << 13
        | np.int64(b[y - 1, x]) << 14
        | np.int64(b[y, x - 1]) << 15
    )
    return int((w ^ n) + 2 * min(abs(total - 24) >> 2, 6))


@njit(cache=True, nogil=True)
def _run(
    bits: Bits,
    references: NDArray[np.int64],
    code: Bits,
    writes: bool,
    logit: NDArray[np.int64],
    chance: NDArray[np.int64],
    rates: NDArray[np.int64],
) -> int:
    """Writes the bits (V, n, n) into the code, or reads them from it. Bytes of the code."""
    count, n = bits.shape[:2]
    state = np.array([0, (1 << 32) - 1, 0, 1 if writes else 0, 0], np.int64)
    if not writes:
        for _ in range(4):
            state[0] = (state[0] << 8) | coder._next(state, code)
    models = np.full((_MODELS, _CONTEXTS), 32768, np.int64)
    times = np.zeros((_MODELS, _CONTEXTS), np.int64)
    mixing = np.full((_SETS, _MODELS), 22938, np.int64)
    flags = np.full(64, 32768, np.int64)
    refs = np.zeros((_REFERENCES, n + 4, n + 4), np.uint8)
    own = np.zeros((n + 4, n + 4), np.uint8)
    seen = np.zeros((n, _REFERENCES, 3), np.int64)
    contexts, answers = np.zeros(_MODELS, np.int64), np.zeros(_MODELS, np.int64)
    for v in range(count):
        for k in range(_REFERENCES):
            if references[v, k] >= 0:
                _pad(bits[references[v, k]], refs[k])
        own[:] = refs[0]
        recent = 0
        for y in range(n):
            active, unlike = 0, 0
            for x in range(n):
                for k in range(_REFERENCES):
                    seen[x, k] = _around(refs[k], y + 2, x + 2)
                total = seen[x, :, 1].sum()
                if 0 < total < 27:
                    active += 1
                elif bits[v, y, x] != refs[0, y + 2, x + 2]:
                    unlike = 1
            place = recent * 4 + min(active, 3) + (0 if references[v, 0] >= 0 else 16)
            unlike = _binary(state, code, writes, 65536 - flags[place], unlike)
            flags[place] += ((65535 * unlike - flags[place]) * 800) >> 16
            flags[place] = min(max(flags[place], 32), 65504)
            recent = unlike + 2 * (recent & 1)
            for x in range(n):
                total = seen[x, :, 1].sum()
                if not unlike and (total == 0 or total == 27):
                    bits[v, y, x] = own[y + 2, x + 2] = refs[0, y + 2, x + 2]
                    continue
                chosen = _contexts_at(own, refs, y + 2, x + 2, seen[x], contexts)
                if total == 0 or total == 27:
                    chosen += 16
                mixed = 0
                for i in range(_MODELS):
                    answers[i] = logit[models[i, contexts[i]] >> 4]
                    mixed += answers[i] * mixing[chosen, i]
                p = chance[min(max(mixed >> 16, -2047), 2047) + 2047]
                bit = _binary(state, code, writes, 65536 - p, int(bits[v, y, x]))
                error = ((bit << 12) - (p >> 4)) * _RATE
                for i in range(_MODELS):
                    mixing[chosen, i] += (answers[i] * error + 8192) >> 14
                    at = contexts[i]
                    models[i, at] += ((bit * 65535 - models[i, at]) * rates[times[i, at]]) >> 16
                    times[i, at] = min(times[i, at] + 1, _FASTEST)
                bits[v, y, x] = own[y + 2, x + 2] = bit
    if writes:
        for _ in range(5):
            coder._shift(state, code)
    return int(state[4])


@njit(cache=True, nogil=True)
def _binary(state: Any, code: Bits, writes: bool, chance_of_0: int, bit: int) -> int:
    if writes:
        coder._put(state, code, chance_of_0, bit)
        return bit
    return coder._get(state, code, chance_of_0)
