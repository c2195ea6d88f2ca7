"""The draped cloth in several forms of one material: tables 3 and 4 and figure 8 of the paper.

The same rays and the same directions of light for each, so that what differs is the material. Also
how much less a renderer's samples scatter that are drawn from a material's table of directions.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter, uniform_filter

from pipelines.drawing.colour import auto_exposure, luminance, to_8bit
from pipelines.drawing.plots import canvas_picture, new_figure
from pipelines.light.built_in_environments import sky
from pipelines.light.directions import unit_vectors
from pipelines.light.environment_lookup import radiance_from_directions
from pipelines.light.environment_maps import Radiance
from pipelines.light.environment_sampling import (
    direction_pdfs,
    make_environment_sampler,
    sample_directions,
)
from pipelines.neural_btf.draping.frames import daylight, whole_camera
from pipelines.neural_btf.draping.gathering import floor_shading, lighting_of
from pipelines.neural_btf.draping.picture_errors import picture_rmse
from pipelines.neural_btf.draping.rendering import View, render
from pipelines.neural_btf.draping.scene import draped_scene
from pipelines.neural_btf.draping.simulation import SIDE
from pipelines.neural_btf.importance import (
    LIGHT_CELLS,
    VIEW_CELLS,
    ImportanceTable,
    importance_table,
)
from pipelines.neural_btf.material import Material, surface_radiance

REFERENCE, RAW = "none", "raw"
"""Names of the unclustered network and of the measured BTF."""
SAMPLES = 128
"""A pixel, as the paper's."""
_CROPS_A_WIDTH = 10
"""A crop is a square of this part of the picture's width."""
_SUN_RADIUS = 1.5
_SIGHTS = 96
_DRAWN = 512

Crop = tuple[slice, slice]


class DrapedCloths(NamedTuple):
    """One picture a material, exposed alike."""

    pictures: dict[str, NDArray[np.float32]]
    """(y, x, 3) linear in [0, 1]: the 99 % quantile of the reference's cloth is 0.8."""
    cloth: NDArray[np.bool_]
    """(y, x) where all of a pixel is cloth."""
    seconds: dict[str, float]
    """What a picture took."""


def draped_cloths(
    materials: Mapping[str, Material],
    tile: tuple[float, float] = (0.1, 0.1),
    *,
    width: int = 320,
    samples: int = SAMPLES,
) -> DrapedCloths:
    """Each material's picture; ``tile``: width and height in metres. One of them is REFERENCE,
    whose table directions are drawn from for all. Raises KeyError where it is missing."""
    table = importance_table(materials[REFERENCE])
    scene, lighting = draped_scene(), lighting_of(daylight())
    shading = floor_shading(scene, lighting, 64, 256)
    view = View(whole_camera(), (width, width * 3 // 4), samples, tile)
    pictures, seconds = {}, {}
    for name, material in materials.items():
        start = time.perf_counter()
        taken = render(scene, lighting, shading, [material], table, view)
        seconds[name] = time.perf_counter() - start
        pictures[name] = taken.pictures[0]
    cloth = taken.cloth == 1.0
    exposure = np.float32(auto_exposure(pictures[REFERENCE][cloth]))
    shown = {name: np.clip(picture * exposure, 0, 1) for name, picture in pictures.items()}
    return DrapedCloths(shown, cloth, seconds)


def dark_and_bright_crops(
    picture: NDArray[np.floating], cloth: NDArray[np.bool_]
) -> dict[str, Crop]:
    """The darkest and the brightest square with nothing but cloth, of a picture (y, x, 3).

    By mean luminance; a tenth of the width a side. The paper's crops were chosen by eye.
    """
    side = max(1, picture.shape[1] // _CROPS_A_WIDTH)
    before = side // 2
    whole = minimum_filter(cloth.astype(np.uint8), side, mode="constant") > 0
    mean = uniform_filter(luminance(picture.astype(np.float64)), side)
    found = {}
    for name, place in (
        ("dark", np.where(whole, mean, np.inf).argmin()),
        ("bright", np.where(whole, mean, -np.inf).argmax()),
    ):
        row, column = (int(at) - before for at in np.unravel_index(place, cloth.shape))
        found[name] = (slice(row, row + side), slice(column, column + side))
    return found


def cloth_errors(drawn: DrapedCloths) -> dict[str, Any]:
    """RMSE in the dark and the bright crop and over all cloth, to the reference as in figure 8 and
    to the raw BTF where there is one; seconds a picture."""
    crops = dark_and_bright_crops(drawn.pictures[REFERENCE], drawn.cloth)
    figures: dict[str, Any] = {"cloth_render_s": drawn.seconds}
    for against in (REFERENCE, RAW):
        if against not in drawn.pictures:
            continue
        right = drawn.pictures[against]
        figures[f"cloth_rmse_to_{against}"] = {
            name: {
                **{crop: picture_rmse(picture[at], right[at]) for crop, at in crops.items()},
                "whole": picture_rmse(picture[drawn.cloth], right[drawn.cloth]),
            }
            for name, picture in drawn.pictures.items()
            if name != against
        }
    return figures


def crops_sheet(drawn: DrapedCloths) -> NDArray[np.uint8]:
    """Figure 8: a column a material, the picture over its dark and its bright crop."""
    crops = dark_and_bright_crops(drawn.pictures[REFERENCE], drawn.cloth)
    errors = cloth_errors(drawn)[f"cloth_rmse_to_{REFERENCE}"]
    figure, canvas = new_figure(2.3 * len(drawn.pictures), 6.6)
    axes = figure.subplots(3, len(drawn.pictures), squeeze=False, height_ratios=(3, 4, 4))
    for column, (name, picture) in enumerate(drawn.pictures.items()):
        shown = to_8bit(picture)
        axes[0, column].imshow(shown)
        axes[0, column].set_title(name, fontsize=9)
        for row, (crop, at) in enumerate(crops.items(), start=1):
            part = picture[at] * auto_exposure(drawn.pictures[REFERENCE][at])
            axes[row, column].imshow(to_8bit(part), interpolation="nearest")
            error = f", {errors[name][crop]:.4f}" if name in errors else ""
            axes[row, column].set_title(f"{crop}{error}", fontsize=9)
            top, left = at[0].start - 0.5, at[1].start - 0.5
            across, down = at[1].stop - at[1].start, at[0].stop - at[0].start
            colour = "white" if crop == "dark" else "black"
            x = [left, left + across, left + across, left, left]
            y = [top, top, top + down, top + down, top]
            axes[0, column].plot(x, y, color=colour, linewidth=0.8)
        for axis in axes[:, column]:
            axis.set_axis_off()
    return canvas_picture(canvas)


# ---- sampling --------------------------------------------------------------------------------


def sampling_variance_ratio(material: Material, seed: int = 0) -> dict[str, float]:
    """Variance of samples by the cosine over that of ours, and over that with an even table: what
    the table does not know.

    Of the light that texels seen from anywhere reflect, the mean of 96 of them. ``even light``:
    ours are drawn from the table. ``small sun``: half from the table and half from the sky, whose
    sun has 1.5 degrees; the even table's figure is what the sky's half does alone.
    """
    rng = np.random.default_rng(seed)
    height = rng.uniform(math.cos(math.radians(75)), 1.0, _SIGHTS)
    view = unit_vectors(np.stack([np.arccos(height), rng.uniform(0, 2 * math.pi, _SIGHTS)], -1))
    view, places = (np.repeat(x, _DRAWN, axis=0) for x in (view, rng.random((_SIGHTS, 2))))
    fitted = importance_table(material)
    even = ImportanceTable(
        np.full((*VIEW_CELLS, *LIGHT_CELLS), 1 / math.prod(LIGHT_CELLS), np.float32)
    )
    sunny = sky(128, sun_azimuth=30.0, sun_elevation=40.0, sun_radius=_SUN_RADIUS)
    figures = {}
    for light, environment in (("even light", None), ("small sun", sunny)):
        by_cosine = _variance(material, even, places, view, environment, by_sky=False)
        for name, table in (("", fitted), (", even table", even)):
            ours = _variance(
                material, table, places, view, environment, by_sky=environment is not None
            )
            figures[light + name] = by_cosine / ours
    return figures


def _variance(
    material: Material,
    table: ImportanceTable,
    places: NDArray[np.float64],
    view: NDArray[np.float64],
    environment: Radiance | None,
    *,
    by_sky: bool,
) -> float:
    """Mean over sights of a sample's variance; ``by_sky``: half are drawn from the environment."""
    uniforms = np.random.default_rng(1).random((len(view), 2))
    light = table.sample(view, uniforms)
    sampler = None if environment is None else make_environment_sampler(environment)
    half = np.arange(len(view)) % 2 == 1
    if by_sky and sampler is not None:
        light[half] = sample_directions(sampler, uniforms[half])[0]
    density = table.pdf(light, view)
    if by_sky and sampler is not None:
        density = 0.5 * (density + direction_pdfs(sampler, light))
    value = np.zeros(len(view))
    up = light[:, 2] > 0
    value[up] = luminance(surface_radiance(material, places[up], light[up], view[up]))
    if environment is not None:
        value *= luminance(radiance_from_directions(environment, light))
    terms = np.divide(value, math.pi * density, out=np.zeros_like(value), where=up)
    sights = terms.reshape(_SIGHTS, -1)
    if not by_sky:
        return float(sights.var(axis=1).mean())
    return float((sights[:, ::2].var(axis=1) + sights[:, 1::2].var(axis=1)).mean() / 2)


def tile_of(height: int, width: int, tiles: float = 20.0) -> tuple[float, float]:
    """Width and height, metres, of a tile of photographs (rows, columns), so many on 2 m."""
    return SIDE / tiles, SIDE / tiles * height / width
