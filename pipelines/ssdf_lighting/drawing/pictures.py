"""Pictures of maps on the sphere, of clusters, of errors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.contact_sheet import contact_sheet
from pipelines.drawing.plots import canvas_picture, new_figure

_SIDE = 160  # pixels of a map


def maps_picture(values: NDArray[np.floating], *, limit: float) -> NDArray[np.uint8]:
    """Functions (k, n²) on the octahedral square side by side: blue below 0, orange above, white at
    0, full colour at ``limit``. The middle is up, the corners are down."""
    n = round(values.shape[1] ** 0.5)
    scaled = np.clip(values.reshape(-1, n, n) / limit, -1.0, 1.0)[..., None]
    orange, blue = np.array([217.0, 95.0, 14.0]), np.array([33.0, 102.0, 172.0])
    colour = 255.0 + np.where(scaled > 0, scaled * (orange - 255.0), -scaled * (blue - 255.0))
    times = max(1, _SIDE // n)
    large = np.rint(colour).astype(np.uint8)[:, ::-1].repeat(times, axis=1).repeat(times, axis=2)
    framed = np.pad(large, ((0, 0), (2, 2), (2, 2), (0, 0)), constant_values=60)
    return contact_sheet(framed)


def sky_picture(visible: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """What vertices see: the share of all that see each direction, and some of them alone."""
    share = visible.mean(axis=0, keepdims=True)
    some = visible[np.linspace(0, len(visible) - 1, 7).astype(int)]
    return maps_picture(np.concatenate([share, some]) * 2.0 - 1.0, limit=1.0)


def basis_picture(vectors: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Vectors (k, n²) of a basis, each to its own scale."""
    return maps_picture(vectors / np.abs(vectors).max(axis=1, keepdims=True), limit=1.0)


def cluster_sizes_picture(cluster: NDArray[np.integer]) -> NDArray[np.uint8]:
    """How many vertices the clusters have, from the largest to the smallest."""
    sizes = np.sort(np.bincount(cluster))[::-1]
    figure, canvas = new_figure(5.0, 2.6)
    axes = figure.add_subplot()
    axes.bar(np.arange(len(sizes)), sizes, width=1.0, color="#2166ac")
    axes.set(xlabel="clusters, largest first", ylabel="vertices")
    return canvas_picture(canvas)


def error_histogram(vertex_rmse: NDArray[np.floating], rmse: float) -> NDArray[np.uint8]:
    """Errors of the vertices, and that of all."""
    figure, canvas = new_figure(5.0, 2.6)
    axes = figure.add_subplot()
    lowest = max(float(vertex_rmse.min()), rmse / 1000.0)
    edges = np.geomspace(lowest, max(float(vertex_rmse.max()), 2.0 * lowest), 60)
    axes.hist(np.clip(vertex_rmse, edges[0], edges[-1]), bins=edges, color="#2166ac")
    axes.axvline(rmse, color="#d95f0e", label=f"all: {rmse:.4f} rad")
    axes.set(xscale="log", xlabel="RMSE of a vertex, rad", ylabel="vertices")
    axes.legend()
    return canvas_picture(canvas)


def rate_distortion_picture(curve: Mapping[str, Mapping[str, Any]]) -> NDArray[np.uint8]:
    """Bytes against error, by the number of clusters: the paper's form for 4 to 96 values, the
    compact one for several steps (``paper``: values, bytes, error; ``ours``: step, bytes of the
    file, in memory, error)."""
    figure, canvas = new_figure(8.0, 4.6)
    axes = figure.add_subplot()
    shades = np.linspace(0.25, 1.0, len(curve))
    for shade, (clusters, forms) in zip(shades, curve.items(), strict=True):
        paper, ours = np.array(forms["paper"]), np.array(forms["ours"])
        orange, blue = (0.85, 0.37, 0.05, shade), (0.13, 0.40, 0.67, shade)
        axes.plot(paper[:, 1], paper[:, 2], "o-", color=orange, label=f"paper's form, {clusters}")
        axes.plot(ours[:, 2], ours[:, 3], "s--", color=blue, label=f"in memory, {clusters}")
        axes.plot(ours[:, 1], ours[:, 3], "s-", color=blue, label=f"file, {clusters}")
    axes.set(xscale="log", yscale="log", xlabel="bytes", ylabel="RMSE, rad")
    axes.grid(alpha=0.3)
    figure.legend(loc="outside right center", title="form, clusters", fontsize=7)
    return canvas_picture(canvas)


def cluster_colours(count: int) -> NDArray[np.float32]:
    """Distinct linear colours (count, 3): hues a golden angle apart."""
    from skimage.color import hsv2rgb

    number = np.arange(count)
    hue = number * 0.61803399 % 1.0
    hsv = np.stack([hue, 0.55 + 0.35 * (number % 3 == 0), 0.95 - 0.3 * (number % 2)], axis=-1)
    return (hsv2rgb(hsv[None])[0] ** 2.2).astype(np.float32)


def error_map(
    picture: NDArray[np.uint8], reference: NDArray[np.uint8], gain: float
) -> NDArray[np.uint8]:
    """Differences of two pictures around grey, ``gain`` times: brighter is too bright."""
    difference = picture.astype(np.float64) - reference
    return np.clip(np.rint(128.0 + gain * difference), 0, 255).astype(np.uint8)
