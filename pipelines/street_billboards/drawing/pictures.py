"""Pictures of what streets are made of."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.plots import canvas_picture, new_figure
from pipelines.street_billboards.billboards import Billboards
from pipelines.street_billboards.textures.atlases import Page
from pipelines.street_billboards.textures.texture_tables import (
    SEEN,
    SIDE,
    CompressedTextures,
    ViewTextures,
)

Picture = NDArray[np.uint8]

_FAR = 30.0
"""Metres that have the last colour."""
_SHOWN = 24
"""Billboards on a sheet."""
_MOST_VIEWS = 8
_GREY = 90


def depth_picture(depth: NDArray[np.floating]) -> Picture:
    """Depth maps (camera, y, x) in colours side by side; what is not known is black."""
    from matplotlib import colormaps

    shown = np.hstack(list(depth))
    known = np.isfinite(shown)
    # Steps of the inverse depth are what stereo measures.
    near = 2.0 / np.where(known, np.maximum(shown, 2.0), 2.0)
    share = (near - 2.0 / _FAR) / (1 - 2.0 / _FAR)
    colours = colormaps["turbo"](np.clip(share, 0, 1))[..., :3] * 255
    return np.where(known[..., None], colours, 0).astype(np.uint8)


def way_picture(
    places: NDArray[np.floating], points: NDArray[np.floating], colours: Picture
) -> Picture:
    """Places (f, c, 3) of a drive's cameras and points (p, 3) in their colours, from above."""
    figure, canvas = new_figure(10, 5)
    axes = figure.subplots()
    step = max(len(points) // 200_000, 1)
    axes.scatter(*points[::step, :2].T, c=colours[::step] / 255.0, s=0.6, linewidths=0)
    for camera in range(places.shape[1]):
        axes.plot(*places[:, camera, :2].T, ".-", color="tab:blue", linewidth=0.8, markersize=3)
    axes.plot(*places[0, :, :2].T, "o", color="tab:green", markersize=6)
    reach = np.ptp(places[..., :2].reshape(-1, 2), axis=0).max() * 0.6 + 20.0
    middle = (places[..., :2].min(axis=(0, 1)) + places[..., :2].max(axis=(0, 1))) / 2
    axes.set(
        xlim=middle[0] + np.array([-reach, reach]), ylim=middle[1] + np.array([-reach, reach]) / 2
    )
    axes.set_aspect("equal")
    axes.set(xlabel="x, m", ylabel="y, m", title="the way from above, and what it was found by")
    return canvas_picture(canvas)


def points_picture(positions: NDArray[np.floating], colours: Picture) -> Picture:
    """Points (n, 3) in their colours, from above and from the side."""
    step = max(len(positions) // 200_000, 1)
    some, codes = positions[::step], colours[::step] / 255.0
    figure, canvas = new_figure(10, 6)
    axes = figure.subplots(2, 1, sharex=True)
    for number, (axis, name) in enumerate(((1, "y"), (2, "z"))):
        order = np.argsort(some[:, 3 - axis] * (1 if number == 0 else -1))
        axes[number].scatter(some[order, 0], some[order, axis], c=codes[order], s=0.3, linewidths=0)
        axes[number].set_aspect("equal")
        axes[number].set_ylabel(f"{name}, m")
    axes[1].set_xlabel("x, m")
    axes[0].set_title("points from above, and from the side")
    return canvas_picture(canvas)


def plan_picture(billboards: Billboards) -> Picture:
    """Billboards from above: those that stand still in blue, those that turn in red."""
    figure, canvas = new_figure(10, 3.5)
    axes = figure.subplots()
    still = ~billboards.turns
    reach = billboards.half_s[still, :2]
    ends = np.stack(
        [billboards.centre[still, :2] - reach, billboards.centre[still, :2] + reach], axis=1
    )
    from matplotlib.collections import LineCollection

    axes.add_collection(LineCollection(list(ends), colors="tab:blue", linewidths=0.6))
    axes.scatter(
        billboards.centre[~still, 0], billboards.centre[~still, 1], s=3, c="tab:red", linewidths=0
    )
    axes.set_aspect("equal")
    axes.autoscale()
    axes.set(xlabel="x, m", ylabel="y, m", title="billboards: still (blue), turning (red)")
    return canvas_picture(canvas)


def views_sheet(views: ViewTextures) -> Picture:
    """Views of some billboards, one a row of the sheet's halves; what was not seen is grey."""
    counts = np.diff(views.first)
    rows = np.flatnonzero(counts >= min(3, counts.max(initial=0)))
    rows = rows[np.linspace(0, len(rows) - 1, min(_SHOWN, len(rows))).astype(int)]
    sheet = np.full((len(rows), _MOST_VIEWS, SIDE + 1, SIDE + 1, 3), _GREY, np.uint8)
    for place, row in enumerate(rows):
        for column, view in enumerate(range(views.first[row], views.first[row + 1])[:_MOST_VIEWS]):
            seen = views.states[view] == SEEN
            sheet[place, column, :SIDE, :SIDE][seen] = views.colours[view][seen]
    return _in_columns(sheet)


def eigen_sheet(textures: CompressedTextures) -> Picture:
    """Eigen-images of the first channel of some billboards, one a row of the sheet's halves."""
    ranks = textures.ranks[:, 0].astype(np.int64)
    first = np.concatenate([[0], np.cumsum(ranks)])
    rows = np.flatnonzero(ranks > 0)
    rows = rows[np.linspace(0, len(rows) - 1, min(_SHOWN, len(rows))).astype(int)]
    sheet = np.full((len(rows), _MOST_VIEWS, SIDE + 1, SIDE + 1, 3), _GREY, np.uint8)
    for place, row in enumerate(rows):
        for column, plane in enumerate(range(first[row], first[row + 1])[:_MOST_VIEWS]):
            sheet[place, column, :SIDE, :SIDE] = textures.planes[0][plane][..., None]
    return _in_columns(sheet)


def _in_columns(sheet: Picture) -> Picture:
    """(row, column, y, x, 3) as one picture, twice its size, the second half beside the first."""
    if len(sheet) % 2:
        sheet = np.concatenate([sheet, np.full_like(sheet[:1], _GREY)])
    halves = np.split(sheet, 2) if len(sheet) else [sheet, sheet]
    beside = np.concatenate(halves, axis=1)
    rows, columns, height, width, _ = beside.shape
    picture = beside.swapaxes(1, 2).reshape(rows * height, columns * width, 3)
    return picture.repeat(2, axis=0).repeat(2, axis=1)


def atlas_picture(page: Page) -> Picture:
    """A corner of a page's eigen-images: four planes a tile, side by side."""
    corner = page.detail.texels[:256, :256]
    planes = [np.repeat(corner[..., channel, None], 3, axis=2) for channel in range(4)]
    return np.hstack(planes)
