"""Pictures of a BTF and of what became of it: photographs, clusters, loss curve, errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import auto_exposure, to_8bit
from pipelines.drawing.contact_sheet import contact_sheet
from pipelines.drawing.picture_metrics import flip_map
from pipelines.drawing.plots import canvas_picture, new_figure
from pipelines.light.directions import Pairs, angles_between, unit_vectors

_DIFFERENCE_TIMES = 4
TEXELS_PER_DEGREE = 67.0 / 4
"""Of sight, for FLIP: a texel is seen as large as four pixels of a screen."""
_SHOWN_PAIRS = ((0, 0, 0, 0), (0, 0, 45, 90), (0, 0, 60, 0), (60, 0, 30, 180), (60, 90, 60, 90),
                (75, 270, 75, 90))  # fmt: skip
"""View theta and phi, light theta and phi, in degrees: a look from above and from the side."""
PAPER_PAIRS = ((15, 60, 30, 60), (75, 345, 45, 0))
"""View and light of figure 7, in degrees. The paper's second light has theta = 345°, which cannot
be; 45° stands in for it, as the light's phi there is 0."""


def nearest_images(
    pairs: Pairs, wanted: Sequence[tuple[float, float, float, float]]
) -> NDArray[np.int64]:
    """Numbers of the photographs nearest to (view theta, phi, light theta, phi) in degrees."""
    found = []
    for view_theta, view_phi, light_theta, light_phi in wanted:
        view = np.radians([view_theta, view_phi])
        light = np.radians([light_theta, light_phi])
        away = angles_between(pairs.view, view) ** 2 + angles_between(pairs.light, light) ** 2
        found.append(int(away.argmin()))
    return np.array(found, np.int64)


def shown_images(pairs: Pairs) -> NDArray[np.int64]:
    """Numbers of the photographs that `photograph_sheet` is to show."""
    return nearest_images(pairs, _SHOWN_PAIRS)


def photograph_sheet(images: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Photographs (n, y, x, 3) side by side, exposed alike, tiles of at least 192 pixels."""
    encoded = to_8bit(images.astype(np.float32) * auto_exposure(images))
    times = max(1, -(-192 // min(images.shape[1:3])))
    large = encoded.repeat(times, axis=1).repeat(times, axis=2)
    return np.hstack([np.pad(one, ((4, 4), (4, 4), (0, 0))) for one in large])


def restored_picture(
    original: NDArray[np.floating], restored: NDArray[np.floating], pairs: Pairs
) -> NDArray[np.uint8]:
    """Rows of original, restored, difference (x 4), FLIP for photographs (pair, y, x, 3).

    A row has one exposure, from the original; the difference is absolute, as brightness; FLIP, what
    an eye notices of it, goes from black, nothing, to white, all (1).
    """
    figure, canvas = new_figure(11.2, 2.9 * len(original))
    axes = figure.subplots(len(original), 4, squeeze=False)
    for row, (measured, given, light, view) in enumerate(
        zip(original, restored, pairs.light, pairs.view, strict=True)
    ):
        scale = auto_exposure(measured)
        rmse = float(np.sqrt(np.mean((given - measured) ** 2)))
        difference = np.abs(given - measured) * scale * _DIFFERENCE_TIMES
        truth, picture = to_8bit(measured * scale), to_8bit(given * scale)
        flip = flip_map(picture, truth, TEXELS_PER_DEGREE)
        for axis, shown, title in (
            (axes[row, 0], truth, f"measured: view {_words(view)}"),
            (axes[row, 1], picture, f"restored: light {_words(light)}"),
            (
                axes[row, 2],
                to_8bit(difference),
                f"|difference| x {_DIFFERENCE_TIMES}, RMSE {rmse:.3f}",
            ),
            (axes[row, 3], flip, f"FLIP, mean {flip.mean():.3f}"),
        ):
            axis.imshow(shown, interpolation="nearest", cmap="magma", vmin=0.0, vmax=1.0)
            axis.set_title(title, fontsize=9)
            axis.set_axis_off()
    return canvas_picture(canvas)


def cluster_map(ids: NDArray[np.integer], height: int, width: int) -> NDArray[np.uint8]:
    """Every texel in the colour of its cluster; colours are drawn by lot."""
    colours = np.random.default_rng(0).integers(40, 256, (int(ids.max()) + 1, 3), dtype=np.uint8)
    picture = colours[ids].reshape(height, width, 3)
    times = max(1, 384 // max(height, width))
    return picture.repeat(times, axis=0).repeat(times, axis=1)


def loss_curve(step: NDArray[np.integer], rmse: NDArray[np.floating]) -> NDArray[np.uint8]:
    """RMSE of the batches over the steps of training, on a logarithmic axis."""
    figure, canvas = new_figure(5.4, 3.2)
    axis = figure.subplots()
    axis.plot(step, rmse, color="tab:blue")
    axis.set(xlabel="step", ylabel="RMSE of the batches, over alpha", yscale="log")
    axis.grid(alpha=0.3, which="both")
    return canvas_picture(canvas)


def error_picture(
    rmse_texel: NDArray[np.floating], rmse_image: NDArray[np.floating], pairs: Pairs
) -> NDArray[np.uint8]:
    """Errors of the texels as a map, and of views and lights on the hemisphere seen from above."""
    figure, canvas = new_figure(10.5, 3.4)
    left, middle, right = figure.subplots(1, 3)
    shown = left.imshow(rmse_texel, cmap="magma", interpolation="nearest", vmin=0.0)
    left.set_title("RMSE of every texel", fontsize=9)
    left.set_axis_off()
    figure.colorbar(shown, ax=left)
    for axis, directions, name in ((middle, pairs.view, "view"), (right, pairs.light, "light")):
        keys, inverse = np.unique(np.round(directions, 6), axis=0, return_inverse=True)
        mean = np.sqrt(np.bincount(inverse.ravel(), rmse_image**2) / np.bincount(inverse.ravel()))
        place = unit_vectors(keys)
        points = axis.scatter(place[:, 0], place[:, 1], c=mean, cmap="magma", vmin=0.0, s=46)
        axis.set_title(f"RMSE by {name}", fontsize=9)
        axis.set(aspect="equal", xlim=(-1.1, 1.1), ylim=(-1.1, 1.1))
        axis.set_axis_off()
        figure.colorbar(points, ax=axis)
    return canvas_picture(canvas)


def material_wall(panels: Sequence[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Moving pictures (frame, y, x, 3) of several materials as one, in two rows."""
    return np.stack([contact_sheet(np.stack(frames)) for frames in zip(*panels, strict=True)])


def _words(direction: NDArray[np.floating]) -> str:
    theta, phi = np.degrees(direction)
    return f"({theta:.3g}°, {phi:.3g}°)"
