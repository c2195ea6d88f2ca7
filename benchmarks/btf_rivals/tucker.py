"""Factorisations whose every number has one step: water-filling, entropy-coded.

Values are ``scores`` (texel, rank) times loadings over (view, light, channel). For `pca` the
loadings are kept as they are; for `tucker` they are a core times a matrix of views, one of lights
and one of channels (Tucker 1966; De Lathauwer, De Moor, Vandewalle 2000). All are scaled so that an
error of theirs is as large an error of the values, and then quantised with one and the same step,
so that each bit saves as much error as any other (reverse water-filling): bits follow importance.
Scores are coded texel by texel beside their neighbours, or as cosines over the whole photograph
(``cosines``), which finds a weave's repetition but decodes all texels at once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.btf_rivals.budget import FILLED, filled
from benchmarks.btf_rivals.code_length import CORE, FACTOR, SCORES, code_bits, quantised
from benchmarks.btf_rivals.components import Components
from benchmarks.btf_rivals.rival import MeasuredBtf, Rival

_RANKS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96)
_COLUMN_WORTH = 1.5
"""A column of a matrix is kept where its numbers are this many steps long, in the mean."""
_STEP_BYTES = 2
"""A step of a column, as a half float."""


class Coded(NamedTuple):
    """A factorisation as it is decoded, and its size."""

    bytes: int
    scores: NDArray[np.float32]
    """(M, 1 + rank); the first column is constant."""
    loadings: NDArray[np.float32]
    """(1 + rank, views * lights * 3)."""
    settings: dict[str, Any]


class _Loadings(NamedTuple):
    values: NDArray[np.float32]
    bits: float
    settings: dict[str, Any]


def factorisation(
    name: str, measured: MeasuredBtf, components: Components, budget: int, *, cosines: bool
) -> Rival:
    """The best rank of a `tucker` or `pca` rival that fits into ``budget`` bytes.

    Raises ValueError where not even rank 1 does.
    """
    matrices = name != "pca"
    best: tuple[float, Coded] | None = None
    step = float(np.linalg.norm(components.tensor[1])) / len(measured.abrdfs) ** 0.5
    worse = 0
    for rank in _RANKS:
        if rank >= len(components.tensor) and rank > 1:
            rank = len(components.tensor) - 1
        encode = _encoder(components, measured.size, rank, matrices=matrices, cosines=cosines)
        coded = filled(encode, budget, step)
        if coded is None:
            break
        if coded.bytes >= FILLED * budget:
            step = coded.settings["step"]
        error = measured.trial_error(_restored(measured, coded, measured.trial_texels))
        worse = 0 if best is None or error < best[0] else worse + 1
        if best is None or error < best[0]:
            best = error, coded
        if worse == 2 or rank == len(components.tensor) - 1:
            break
    if best is None:
        raise ValueError(f"{budget} bytes are too few for a {name} of rank 1; give it more.")
    coded = best[1]
    settings = {"cosines": cosines, **coded.settings}

    def restore(first: int, last: int) -> NDArray[np.float32]:
        return _restored(measured, coded, slice(first, last))

    return Rival(name, coded.bytes, settings, restore, by_texel=not cosines)


def _restored(
    measured: MeasuredBtf, coded: Coded, texels: NDArray[np.int64] | slice
) -> NDArray[np.float32]:
    values = coded.scores[texels] @ coded.loadings
    return np.clip(values.reshape(len(values), -1, 3), 0.0, measured.alpha)


def _encoder(
    components: Components, size: tuple[int, int], rank: int, *, matrices: bool, cosines: bool
) -> Callable[[float], Coded]:
    """What codes the first components with a given step."""
    texels = len(components.texels)
    kept = components.tensor[: 1 + rank]
    whole = kept.reshape(1 + rank, -1)
    loadings_of = _core_coder(kept) if matrices else _plain_coder(kept)

    def encode(step: float) -> Coded:
        loadings = loadings_of(step)
        lengths = np.linalg.norm(loadings.values, axis=1)
        used = np.flatnonzero(lengths[1:] > 0) + 1
        rows = loadings.values[used]
        scores = _least_squares(components.texels[:, : 1 + rank], whole, loadings.values[0], rows)
        coded, bits = _coded_scores(scores, step / lengths[used], size, cosines=cosines)
        constant = np.full((texels, 1), texels**-0.5, np.float32)
        return Coded(
            int(np.ceil((bits + loadings.bits) / 8)) + 4,
            np.concatenate([constant, coded], axis=1),
            np.concatenate([loadings.values[:1], rows]),
            {"rank": len(used), "step": step, "scores_bytes": round(bits / 8)} | loadings.settings,
        )

    return encode


def _least_squares(
    columns: NDArray[np.float32],
    whole: NDArray[np.float32],
    mean: NDArray[np.float32],
    rows: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Scores (M, rank) of quantised loadings, which are no longer orthogonal."""
    wanted = whole @ rows.T
    wanted[0] -= mean @ rows.T
    gram = (rows @ rows.T).astype(np.float64)
    turned = np.linalg.lstsq(gram, wanted.T.astype(np.float64), rcond=1e-6)[0]
    return columns @ turned.T.astype(np.float32)


def _coded_scores(
    scores: NDArray[np.float32], steps: NDArray[np.float32], size: tuple[int, int], *, cosines: bool
) -> tuple[NDArray[np.float32], float]:
    """Scores (M, rank) as they are decoded, and their bits."""
    from scipy.fft import dctn, idctn

    if not len(steps):
        return scores, 0.0
    images = (scores / steps).T.reshape(-1, *size)
    if cosines:
        images = dctn(images, axes=(1, 2), norm="ortho")
    symbols = quantised(images)
    decoded = symbols.astype(np.float32)
    if cosines:
        decoded = idctn(decoded, axes=(1, 2), norm="ortho")
    return decoded.reshape(len(steps), -1).T * steps, code_bits(symbols, SCORES)


# ---- loadings --------------------------------------------------------------------------------


def _channel_matrix(kept: NDArray[np.float32]) -> NDArray[np.float32]:
    """The (3, 3) rotation of channels, as half floats hold it."""
    return _rotation(kept, 3)[0].astype(np.float16).astype(np.float32)


def _rotation(
    kept: NDArray[np.float32], axis: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Singular vectors (n, n) of one axis and their singular values, largest first."""
    rows = np.moveaxis(kept, axis, 0).reshape(kept.shape[axis], -1)
    squares, vectors = np.linalg.eigh((rows @ rows.T).astype(np.float64))
    lengths = np.sqrt(np.maximum(squares[::-1], 0.0))
    return vectors[:, ::-1].astype(np.float32), lengths.astype(np.float32)


def _plain_coder(kept: NDArray[np.float32]) -> Callable[[float], _Loadings]:
    """Loadings of every view and light, channels rotated."""
    channels = _channel_matrix(kept)
    turned = kept @ np.linalg.inv(channels).T.astype(np.float32)

    def code(step: float) -> _Loadings:
        symbols = quantised(np.moveaxis(turned / step, 3, 1))
        bits = code_bits(np.moveaxis(symbols, 1, 3), CORE) + 16 * channels.size
        values = np.moveaxis(symbols, 1, 3).astype(np.float32) * np.float32(step) @ channels.T
        return _Loadings(values.reshape(len(kept), -1).astype(np.float32), bits, {})

    return code


def _core_coder(kept: NDArray[np.float32]) -> Callable[[float], _Loadings]:
    """A core, and matrices of views, lights and channels."""
    channels = _channel_matrix(kept)
    (views, of_view), (lights, of_light) = _rotation(kept, 1), _rotation(kept, 2)
    turned = kept @ np.linalg.inv(channels).T.astype(np.float32)

    def code(step: float) -> _Loadings:
        view, view_bits = _coded_matrix(views, of_view, step)
        light, light_bits = _coded_matrix(lights, of_light, step)
        core = np.einsum(
            "rvlc,av,bl->rabc", turned, np.linalg.pinv(view), np.linalg.pinv(light), optimize=True
        )
        symbols = np.moveaxis(quantised(np.moveaxis(core / step, 3, 1)), 1, 3)
        core = symbols.astype(np.float32) * np.float32(step) @ channels.T
        values = np.einsum("rabc,va,lb->rvlc", core, view, light, optimize=True)
        bits = code_bits(symbols, CORE) + view_bits + light_bits + 16 * channels.size
        settings = {"views": view.shape[1], "lights": light.shape[1], "core_bytes": round(bits / 8)}
        return _Loadings(values.reshape(len(kept), -1).astype(np.float32), bits, settings)

    return code


def _coded_matrix(
    vectors: NDArray[np.float32], lengths: NDArray[np.float32], step: float
) -> tuple[NDArray[np.float32], float]:
    """The columns (n, kept) that are worth their bits, and those."""
    worth = len(vectors) ** 0.5 * _COLUMN_WORTH * step
    kept = max(1, int(np.sum(lengths > worth)))
    steps = step / np.maximum(lengths[:kept], step)
    symbols = np.rint(vectors[:, :kept] / steps).astype(np.int32)
    bits = code_bits(symbols, FACTOR) + 8 * _STEP_BYTES * kept
    return (symbols * steps).astype(np.float32), bits
