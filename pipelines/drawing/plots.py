"""Plots as pictures, without a screen."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def new_figure(width: float, height: float) -> tuple[Any, Any]:
    """A figure of this size in inches, 110 pixels each, and the canvas to draw it on."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=110, layout="constrained")
    return figure, FigureCanvasAgg(figure)


def canvas_picture(canvas: Any) -> NDArray[np.uint8]:
    """The picture (y, x, 3) of a canvas."""
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()
