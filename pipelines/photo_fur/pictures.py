"""Pictures of what the model found: the histogram with its decay, and the layers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.plots import canvas_picture, new_figure
from pipelines.photo_fur.attenuation import Attenuation


def decay_picture(
    counts: NDArray[np.int64],
    edges: NDArray[np.float64],
    attenuation: Attenuation,
    boundaries: NDArray[np.float64],
) -> NDArray[np.uint8]:
    """The histogram with Imax and Imin, and I(h) with the layers' boundaries, side by side."""
    figure, canvas = new_figure(9, 3.4)
    left, right = figure.subplots(1, 2)
    shown = np.minimum(edges, 1.0)
    left.stairs(counts, shown, fill=True, color="0.6")
    for value, name in ((attenuation.darkest, "Imin"), (attenuation.brightest, "Imax")):
        left.axvline(value, color="tab:red")
        left.annotate(
            f" {name} = {value:.3g}",
            (value, 1.0),
            xycoords=("data", "axes fraction"),
            va="top",
            color="tab:red",
            rotation=90,
            ha="right",
        )
    left.set(xlabel="luminance (linear)", ylabel="pixels", xlim=(0, 1.05 * attenuation.brightest))
    depth = np.linspace(0, 1, 200)
    right.plot(depth, attenuation.luminance_at(depth), color="tab:blue")
    layers = len(boundaries) - 1
    right.plot(np.arange(layers + 1) / layers, boundaries, "o", color="tab:red", markersize=4)
    right.set(xlabel="depth / thickness", ylabel="luminance (linear)", xlim=(0, 1), ylim=(0, None))
    right.set_title(f"I(h) = Imax exp(-{attenuation.coefficient:.3g} h), {layers} layers")
    return canvas_picture(canvas)


def lie_picture(
    direction: NDArray[np.floating], coherence: NDArray[np.floating]
) -> NDArray[np.uint8]:
    """How hair lies in a photograph: the direction as a hue, paler where nothing has one."""
    from matplotlib.colors import hsv_to_rgb

    hue = np.mod(direction / (2 * np.pi), 1.0)
    colours = hsv_to_rgb(np.stack([hue, np.clip(coherence, 0, 1), np.ones_like(hue)], axis=-1))
    return (colours * 255).astype(np.uint8)


def layer_picture(layer: NDArray[np.uint8], layers: int) -> NDArray[np.uint8]:
    """The layer of every pixel in colour: yellow at the tips, violet at the skin, red dropped."""
    from matplotlib import colormaps

    depth = (layers - layer.astype(np.float64)) / max(layers - 1, 1)
    coloured = (colormaps["viridis"](np.clip(depth, 0.0, 1.0))[..., :3] * 255).astype(np.uint8)
    coloured[layer == 0] = (200, 0, 0)
    return coloured
