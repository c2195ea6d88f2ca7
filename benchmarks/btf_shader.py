"""The shader that draws BTFs, on the stage and in the browser, against NumPy."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.decoder_arrays import LAYERS, DecoderArrays, direction_inputs_of_vectors
from pipelines.neural_btf.latent_texture import between_levels, parallax_terms
from pipelines.neural_btf.live_parts import HOME, HOME_LIGHT, cloth_sights, scenery_of, unit_light
from pipelines.neural_btf.stage_view import Showing, draw_cloth
from pipelines.neural_btf.surface_lookup import dimming, held_directions

_SIZE = (96, 72)
_TILES = 1.0
"""So large that a pixel sees one or two texels: the finest latents and coarser ones are drawn."""


def shader_figures(btf: CompressedBtf, size: tuple[int, int] = _SIZE) -> dict[str, float]:
    """RMSE over alpha of the hanging cloth as the stage's shader decodes it, against NumPy in
    double precision.

    ``shader_vs_numpy_rmse``, of pixels that show cloth; ``shader_vs_numpy_null_rmse``: texels of
    every level in another order; ``student_shader_vs_numpy_rmse`` where there is a student.
    """
    figures = {"shader_vs_numpy_rmse": _apart(btf, btf, size)}
    random = np.random.default_rng(0)
    finest, *coarser = (
        random.permutation(level) for level in (btf.latents_of(slice(None)), *btf.mips)
    )
    shuffled = replace(btf, latents=finest, mips=tuple(coarser), ids=None)
    figures["shader_vs_numpy_null_rmse"] = _apart(btf, shuffled, size)
    if btf.student is not None:
        student = btf.by_student()
        figures["student_shader_vs_numpy_rmse"] = _apart(student, student, size)
    return figures


def _apart(drawn: CompressedBtf, evaluated: CompressedBtf, size: tuple[int, int]) -> float:
    scenery = scenery_of(drawn)._replace(around=None)
    showing = Showing(unit_light(HOME_LIGHT), _TILES, 1.0)
    picture = draw_cloth(scenery, showing, HOME, width=size[0], height=size[1])
    sights = cloth_sights(scenery, showing, HOME, size)
    light, view = held_directions(sights.light), held_directions(sights.view)
    inputs = direction_inputs_of_vectors(light, view)
    latents = _latents(evaluated, sights.places, inputs[:, 2:], sights.footprint)
    colours = _decoded(evaluated.decoder, np.concatenate([latents, inputs], axis=1))
    held = np.maximum(np.clip(colours, evaluated.least, evaluated.largest), 0.0)
    expected = held * dimming(sights.light[:, 2])[:, None]
    found = picture[sights.seen, :3] / drawn.alpha
    return math.sqrt(float(np.mean((found - expected) ** 2)))


def _latents(
    btf: CompressedBtf,
    places: NDArray[np.float64],
    views: NDArray[np.float32],
    footprint: NDArray[np.float64],
) -> NDArray[np.float32]:
    """Latents (n, c) at places (n, 2) in tiles."""
    parallax = np.zeros((9, 2)) if btf.parallax is None else btf.parallax
    across, down = (parallax_terms(views) @ parallax).T
    size = btf.height, btf.width
    rows = (1.0 - places[:, 1]) * btf.height - 0.5 + down
    columns = places[:, 0] * btf.width - 0.5 + across
    levels = (btf.latents_of(slice(None)), *btf.mips)
    return between_levels(levels, size, (rows, columns), footprint * max(size))


def _decoded(decoder: DecoderArrays, values: NDArray[np.floating]) -> NDArray[np.float64]:
    """RGB over alpha (n, 3) of inputs (n, c + 4)."""
    found = values.astype(np.float64)
    for layer in range(1, LAYERS + 1):
        found = found @ decoder[f"weight_{layer}"].T.astype(np.float64) + decoder[f"bias_{layer}"]
        if layer < LAYERS:
            found = np.maximum(found, 0.0)
    return found
