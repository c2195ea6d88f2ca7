"""What each vertex sees, one bit a direction, in few bytes and without loss.

Vertices that are near each other see nearly the same. Each vertex has up to three *references*
among those before it, whose bits differ least from its own. Where all references agree around a
direction, the bit is theirs, unless the row has a flag. Every other bit is predicted by a few
models, whose contexts are bits that the decoder has: before it in its own picture, and around it in
the references'. Their answers are mixed in the logistic domain by weights that learn (Mahoney,
"Adaptive weighing of context models for lossless data compression", 2005), and the result drives
the range coder of `entropy_coding`. All of it is in whole numbers, so every machine reads the same
bits; docs/ssdf_file.md is the specification.
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
Whole = NDArray[np.int64]

REFERENCES = 3
MODELS, CONTEXTS, SETS = 6, 1 << 16, 15
_FASTEST = 30
"""A model's chance moves by 1 / (times seen + 1.6), at least by 1 / 31.6."""
_RATE = 5
_SURE = 14
"""The weights where all references agree."""
_FIRST_WEIGHT, _MOST_WEIGHT = 1 << 14, 1 << 18
_FLAG_SPEED = 800
_USUAL = 12
"""Differing bits that a step back is worth, which the vertex before took, too."""


def mixing_tables() -> tuple[Whole, Whole, Whole]:
    """256 ln(p / (1 - p)) of chances p in 1 / 4096, its inverse from -2047 on, and the rates."""
    places = (np.arange(4096) + 0.5) / 4096.0
    logit = np.clip(np.rint(256.0 * np.log(places / (1.0 - places))), -2047, 2047)
    chance = np.clip(np.rint(65536.0 / (1.0 + np.exp(-np.arange(-2047, 2048) / 256.0))), 32, 65504)
    rates = 327680 // (10 * np.arange(_FASTEST + 1) + 16)
    return logit.astype(np.int64), chance.astype(np.int64), rates.astype(np.int64)


def encode_visibility(
    visible: NDArray[np.bool_], triangles: NDArray[np.integer]
) -> tuple[bytes, bytes]:
    """Codes of the references and of the bits of visibility (V, n²); triangles (F, 3)."""
    n = math.isqrt(visible.shape[1])
    bits = visible.reshape(-1, n, n).astype(np.uint8)
    references = _references(visible, triangles)
    before = encode_references(references)
    room = np.empty(64 + bits.size, np.uint8)
    used = _run(bits, references, room, True, *mixing_tables())
    return before, room[1:used].tobytes()


def decode_visibility(before: bytes, code: bytes, count: int, n: int) -> NDArray[np.bool_]:
    """The bits (V, n²) of ``count`` vertices V.

    Raises ValueError for codes that end too early, or point at vertices that there are not.
    """
    references = decode_references(before, count)
    bits = np.zeros((count, n, n), np.uint8)
    data = np.frombuffer(code, np.uint8)
    if _run(bits, references, data.copy(), False, *mixing_tables()) > len(data):
        raise ValueError(f"the code ends after {len(data)} bytes; expected more.")
    return bits.reshape(count, -1).astype(bool)


# ---- references --------------------------------------------------------------------------------


def _references(visible: NDArray[np.bool_], triangles: NDArray[np.integer]) -> Whole:
    """(V, 3): earlier vertices, at most two edges away or the one before; -1 for the first."""
    from scipy.sparse import coo_array

    sides, count = edge_vertices(triangles), len(visible)
    ones = np.ones(len(sides), np.int32)
    near = coo_array((ones, (sides[:, 0], sides[:, 1])), shape=(count, count)).tocsr()
    near = near + near.T
    near = (near @ near + near).tocsr()
    packed = np.packbits(visible, axis=1)
    found = np.full((count, REFERENCES), -1, np.int64)
    for vertex in range(1, count):
        around = near.indices[near.indptr[vertex] : near.indptr[vertex + 1]]
        around = np.unique(np.append(around[around < vertex], vertex - 1))
        apart = np.bitwise_count(packed[around] ^ packed[vertex]).sum(axis=1).astype(np.int64)
        usual = np.isin(vertex - around, vertex - 1 - found[vertex - 1])
        best = around[np.argsort(apart - _USUAL * usual, kind="stable")[:REFERENCES]]
        found[vertex] = np.append(best, np.repeat(best[:1], REFERENCES - len(best)))
    return found


def encode_references(references: Whole) -> bytes:
    """Steps back from each vertex (V, 3), by their places in a list of the last ones used.

    Two groups of numbers: 1 and the place of each step, 0 for a new one; and the new steps. A step
    that is in the list is moved to its front, a new one is put there.
    """
    recent: list[int] = []
    places, new = [], []
    for step in (np.arange(len(references))[:, None] - references).ravel().tolist():
        if step in recent:
            places.append(recent.index(step) + 1)
            recent.remove(step)
        else:
            places.append(0)
            new.append(step)
        recent.insert(0, step)
    contexts = np.append(np.arange(len(places)) % REFERENCES, np.full(len(new), REFERENCES))
    return struct.pack("<I", len(new)) + coder.encode(np.array(places + new), contexts)


def decode_references(code: bytes, count: int) -> Whole:
    """The vertices (V, 3) that ``count`` vertices refer to.

    Raises ValueError for a code that ends too early, or points at what is not before a vertex.
    """
    (new,) = struct.unpack_from("<I", code)
    wanted = REFERENCES * count
    if new > wanted:
        raise ValueError("the file is damaged: it has more new steps than steps.")
    contexts = np.append(np.arange(wanted) % REFERENCES, np.full(new, REFERENCES))
    told = coder.decode(code[4:], contexts).tolist()
    fresh = iter(told[wanted:])
    recent: list[int] = []
    steps: list[int] = []
    for place in told[:wanted]:
        if not 0 <= place <= len(recent):
            raise ValueError("the file is damaged: a step is not in the list.")
        step = recent.pop(place - 1) if place else next(fresh, 0)
        recent.insert(0, step)
        steps.append(step)
    references = np.arange(count)[:, None] - np.array(steps, np.int64).reshape(count, REFERENCES)
    before = (references >= 0) & (references < np.arange(count)[:, None])
    if not before[1:].all() or (references[:1] != -1).any():
        raise ValueError("the file is damaged: a vertex refers to one that is not before it.")
    return references


# ---- bits --------------------------------------------------------------------------------------


@njit(cache=True, nogil=True)
def _pad(picture: Bits, padded: Bits, across: Bits, soft: Bits) -> None:
    """The picture with its border twice more on each side; sums of nine, weighted 1 2 1 both ways,
    of which ``across`` are those along rows."""
    n = len(picture)
    padded[2 : n + 2, 2 : n + 2] = picture
    for k in range(2):
        padded[k, 2 : n + 2] = picture[0]
        padded[n + 2 + k, 2 : n + 2] = picture[n - 1]
    for y in range(n + 4):
        padded[y, 0] = padded[y, 1] = padded[y, 2]
        padded[y, n + 2] = padded[y, n + 3] = padded[y, n + 1]
    for y in range(n + 2):
        for x in range(n):
            row = padded[y + 1]
            across[y, x] = row[x + 1] + 2 * row[x + 2] + row[x + 3]
    for y in range(n):
        for x in range(n):
            soft[y, x] = across[y, x] + 2 * across[y + 1, x] + across[y + 2, x]


@njit(cache=True, nogil=True, inline="always")
def _nine(a: Bits, y: int, x: int) -> Any:
    """Nine bits around a place, row by row, the first the lowest."""
    whole, place = np.int64(0), 0
    for dy in range(-1, 2):
        for dx in range(-1, 2):
            whole |= np.int64(a[y + dy, x + dx]) << place
            place += 1
    return whole


@njit(cache=True, nogil=True)
def _contexts_at(own: Bits, refs: Bits, y: int, x: int, soft: Whole, found: Whole) -> None:
    """Fills the models' contexts."""
    a, b, c = refs[0], refs[1], refs[2]
    near = (
        np.int64(own[y, x - 1])
        | np.int64(own[y - 1, x - 1]) << 1
        | np.int64(own[y - 1, x]) << 2
        | np.int64(own[y - 1, x + 1]) << 3
    )
    far = (
        np.int64(own[y, x - 2])
        | np.int64(own[y - 2, x]) << 1
        | np.int64(own[y - 2, x + 1]) << 2
        | np.int64(own[y - 2, x - 1]) << 3
        | np.int64(own[y - 1, x + 2]) << 4
    )
    around_a, around_b, around_c = _nine(a, y, x), _nine(b, y, x), _nine(c, y, x)
    at_a, at_b, at_c = (around_a >> 4) & 1, (around_b >> 4) & 1, (around_c >> 4) & 1
    found[0] = near | far << 4 | at_b << 9 | (around_b >> 7 & 1) << 10 | (around_a >> 4) << 11
    found[1] = near | around_a << 4 | at_b << 13 | at_c << 14
    found[2] = near | around_b << 4 | at_a << 13 | at_c << 14
    found[3] = near | around_c << 4 | at_a << 13 | at_b << 14
    found[4] = near | soft[0] << 4 | soft[1] << 9
    cross_a = around_a >> 1 & 1 | (around_a >> 3 & 7) << 1 | (around_a >> 7 & 1) << 4
    cross_b = around_b >> 1 & 1 | (around_b >> 3 & 7) << 1 | (around_b >> 7 & 1) << 4
    wide_a = (
        np.int64(a[y - 2, x])
        | np.int64(a[y, x - 2]) << 1
        | np.int64(a[y, x + 2]) << 2
        | np.int64(a[y + 2, x]) << 3
    )
    found[5] = near & 1 | (near >> 2 & 1) << 1 | wide_a << 2 | cross_a << 6 | cross_b << 11


@njit(cache=True, nogil=True)
def _run(
    bits: Bits,
    references: Whole,
    code: Bits,
    writes: bool,
    logit: Whole,
    chance: Whole,
    rates: Whole,
) -> int:
    """Writes the bits (V, n, n) into the code, or reads them from it. Bytes of the code."""
    count, n = bits.shape[:2]
    state = np.array([0, (1 << 32) - 1, 0, 1 if writes else 0, 0], np.int64)
    if not writes:
        for _ in range(4):
            state[0] = (state[0] << 8) | coder._next(state, code)
    models = np.full((MODELS, CONTEXTS), 32768, np.int32)
    times = np.zeros((MODELS, CONTEXTS), np.uint8)
    mixing = np.full((SETS, MODELS), _FIRST_WEIGHT, np.int64)
    flags = np.full(32, 32768, np.int64)
    refs = np.zeros((REFERENCES, n + 4, n + 4), np.uint8)
    soft = np.zeros((REFERENCES, n, n), np.uint8)
    across = np.zeros((n + 2, n), np.uint8)
    own = np.zeros((n + 4, n + 4), np.uint8)
    contexts, answers = np.zeros(MODELS, np.int64), np.zeros(MODELS, np.int64)
    sums, total = np.zeros(REFERENCES, np.int64), np.zeros(n, np.uint8)
    for v in range(count):
        for k in range(REFERENCES):
            if references[v, k] >= 0:
                _pad(bits[references[v, k]], refs[k], across, soft[k])
        own[:] = refs[0]
        recent = 0
        for y in range(n):
            active, unlike = 0, 0
            for x in range(n):
                total[x] = soft[0, y, x] + soft[1, y, x] + soft[2, y, x]
                if total[x] != 0 and total[x] != 48:
                    active += 1
                elif bits[v, y, x] != refs[0, y + 2, x + 2]:
                    unlike = 1
            place = recent * 4 + min(active, 3) + (0 if v else 16)
            unlike = _binary(state, code, writes, 65536 - flags[place], unlike)
            flags[place] += ((65535 * unlike - flags[place]) * _FLAG_SPEED) >> 16
            flags[place] = min(max(flags[place], 32), 65504)
            recent = unlike + 2 * (recent & 1)
            for x in range(n):
                if not unlike and (total[x] == 0 or total[x] == 48):
                    bits[v, y, x] = own[y + 2, x + 2] = refs[0, y + 2, x + 2]
                    continue
                for k in range(REFERENCES):
                    sums[k] = soft[k, y, x]
                _contexts_at(own, refs, y + 2, x + 2, sums, contexts)
                before = np.int64(own[y + 2, x + 1]) ^ np.int64(own[y + 1, x + 2])
                chosen = before + 2 * min(int(abs(np.int64(total[x]) - 24) >> 2), 6)
                if total[x] == 0 or total[x] == 48:
                    chosen = np.int64(_SURE)
                mixed = 0
                for i in range(MODELS):
                    answers[i] = logit[models[i, contexts[i]] >> 4]
                    mixed += answers[i] * mixing[chosen, i]
                p = chance[min(max(mixed >> 16, -2047), 2047) + 2047]
                bit = _binary(state, code, writes, 65536 - p, int(bits[v, y, x]))
                error = ((bit << 12) - (p >> 4)) * _RATE
                for i in range(MODELS):
                    weight = mixing[chosen, i] + ((answers[i] * error + 8192) >> 14)
                    mixing[chosen, i] = min(max(weight, -_MOST_WEIGHT), _MOST_WEIGHT)
                    at = contexts[i]
                    models[i, at] += ((bit * 65535 - models[i, at]) * rates[times[i, at]]) >> 15
                    times[i, at] = min(times[i, at] + 1, _FASTEST)
                bits[v, y, x] = own[y + 2, x + 2] = bit
    if writes:
        for _ in range(5):
            coder._shift(state, code)
    return int(state[4])


@njit(cache=True, nogil=True, inline="always")
def _binary(state: Whole, code: Bits, writes: bool, chance_of_0: int, bit: int) -> int:
    if writes:
        coder._put(state, code, chance_of_0, bit)
        return bit
    return coder._get(state, code, chance_of_0)
