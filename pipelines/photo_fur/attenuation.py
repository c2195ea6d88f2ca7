"""How deep in the fur a pixel lies, told from its brightness.

The fur is a uniform medium of thickness hb; light that enters from above decays with the depth h
as I(h) = Imax exp(-a h) (Eq. 1). The photograph's histogram gives Imax and Imin, the luminances at
the surface and at the skin. Depths here are fractions of hb, so a is per thickness.

Luminance is linear. The layers hardly depend on that: Eq. 4 is a geometric series, so any power of
the luminance (a display's gamma, say) cuts the photograph into the same layers.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import decode_srgb

Tails = Literal["end layers", "dropped"]

MOST_LAYERS = 250
"""A layer needs one step of the 8-bit depth code, and one code means *dropped*."""

DROPPED = 255
"""Depth code of a pixel that no layer shows."""


PAPER_ENDS = (0.0, 1.0)
"""Depths at Imax and Imin as the paper has them: the surface and the skin."""
CALIBRATED_ENDS = (0.36, 1.04)
"""The same for a family of virtual pelts of known depth (`python -m benchmarks fur --scale paper`):
over the top third nothing shades the hair, so that it is as bright there as at the tips."""


class Attenuation(NamedTuple):
    """The medium: luminance at the surface and at the skin, and the decay between them."""

    brightest: float
    """Imax, 1 = white."""
    darkest: float
    """Imin > 0."""

    @property
    def coefficient(self) -> float:
        """a, per thickness (Eq. 2 with hb = 1)."""
        return float(-np.log(self.darkest / self.brightest))

    def with_ends_at(self, ends: tuple[float, float]) -> Attenuation:
        """The medium in which these two luminances lie at other depths than 0 and 1.

        >>> Attenuation(0.5, 0.125).with_ends_at((0.5, 1.0))  # halved four times to the skin
        Attenuation(brightest=2.0, darkest=0.125)
        """
        if ends == PAPER_ENDS:
            return self
        at_brightest, at_darkest = ends
        decay = self.coefficient / (at_darkest - at_brightest)
        surface = float(self.brightest * np.exp(decay * at_brightest))
        return Attenuation(surface, float(surface * np.exp(-decay)))

    def luminance_at(self, depth: NDArray[np.floating]) -> NDArray[np.floating]:
        """I(h) for depths as fractions of the thickness (Eq. 1)."""
        return self.brightest * np.exp(-self.coefficient * depth)

    def boundaries(self, layers: int) -> NDArray[np.float64]:
        """I(n), n = 0 … layers: luminances between the layers (Eq. 4). Raises ValueError."""
        require_layers(layers)
        steps = np.arange(layers + 1) / layers
        luminances = np.asarray(self.brightest * (self.darkest / self.brightest) ** steps)
        luminances[-1] = self.darkest  # not an ulp beside it: Imin itself is a pixel's luminance
        return luminances


class Histogram(NamedTuple):
    """Pixels per bin of luminance; bin k lies between edges k and k + 1."""

    counts: NDArray[np.int64]
    edges: NDArray[np.float64]


def luminance_histogram(luminance: NDArray[np.floating]) -> Histogram:
    """256 bins, one about each sRGB code value, so an 8-bit grey photograph fills them exactly.

    luminance: any shape, linear, 0 and more; what is brighter than white is in the last bin.

    >>> import numpy as np
    >>> histogram = luminance_histogram(np.array([[0.0, 0.0, 0.5, 1.0]]))
    >>> histogram.counts.shape, histogram.edges.shape
    ((256,), (257,))
    >>> histogram.counts.nonzero()[0].tolist()
    [0, 188, 255]
    """
    codes = (np.arange(257) - 0.5) / 255.0
    edges = np.concatenate([[0.0], decode_srgb(codes[1:-1]), [np.inf]])
    places = np.searchsorted(edges, luminance.ravel(), side="right") - 1
    return Histogram(np.bincount(places, minlength=256)[:256].astype(np.int64), edges)


def fit_attenuation(luminance: NDArray[np.floating], *, tail: float) -> Attenuation:
    """Imax and Imin from the histogram, with a share of ``tail`` pixels cut off at each end.

    The thin tails of the histogram are noise (section 3.2): whole bins are cut while the pixels
    cut stay within the share. Pure black is no light at all and always counts as tail, since
    Imin must not be 0. Raises ValueError where no two luminances are left.

    >>> import numpy as np
    >>> brightest, darkest = fit_attenuation(np.linspace(0.1, 0.8, 50).reshape(5, 10), tail=0.0)
    >>> round(brightest, 3), round(darkest, 3)
    (0.8, 0.1)
    """
    if not 0.0 <= tail < 0.5:
        raise ValueError(f"tail is {tail}; expected a share in [0, 0.5).")
    histogram = luminance_histogram(luminance)
    allowed = tail * luminance.size
    below = np.cumsum(histogram.counts)
    above = np.cumsum(histogram.counts[::-1])
    darkest_edge = histogram.edges[int(np.argmax(below > allowed))]
    brightest_edge = histogram.edges[256 - int(np.argmax(above > allowed))]
    inside = (luminance >= darkest_edge) & (luminance < brightest_edge) & (luminance > 0)
    kept = luminance[inside]
    if kept.size == 0 or kept.min() == kept.max():
        raise ValueError(
            f"the photograph has a single luminance inside its tails of {tail:g}; "
            "expected lighter and darker pixels."
        )
    return Attenuation(float(kept.max()), float(kept.min()))


def layer_of(
    luminance: NDArray[np.floating],
    attenuation: Attenuation,
    layers: int,
    *,
    tails: Tails,
    opaque: NDArray[np.bool_] | None = None,
) -> NDArray[np.uint8]:
    """The layer of every pixel: n where I(n) < I <= I(n-1), 1 at the tips (section 3.2).

    Imin itself belongs to the last layer. Pixels outside [Imin, Imax] go to the end layers or
    are dropped (0), as all are that are not ``opaque``. Raises ValueError for a number of layers
    that cannot be drawn.

    >>> import numpy as np
    >>> luminance = np.array([[0.9, 0.8, 0.3, 0.1]])
    >>> layer_of(luminance, Attenuation(0.8, 0.2), 2, tails="dropped").tolist()
    [[0, 1, 2, 0]]
    """
    descending = attenuation.boundaries(layers)
    inner = descending[1:-1][::-1]
    layer = layers - np.searchsorted(inner, luminance, side="left")
    if tails == "dropped":
        outside = (luminance > attenuation.brightest) | (luminance < attenuation.darkest)
        layer = np.where(outside, 0, layer)
    if opaque is not None:
        layer = np.where(opaque, layer, 0)
    return layer.astype(np.uint8)


def layer_masks(layer: NDArray[np.uint8], layers: int) -> NDArray[np.bool_]:
    """One mask a layer, (layers, height, width); a dropped pixel is in none."""
    return layer[None] == np.arange(1, layers + 1, dtype=np.uint8)[:, None, None]


class ShellStack(NamedTuple):
    """The photograph cut into layers."""

    layer: NDArray[np.uint8]
    """(y, x): layer of the pixel, 1 at the tips; 0 = dropped."""
    masks: NDArray[np.bool_]
    """(layers, y, x): whether the pixel is in the layer."""


def make_shell_stack(
    luminance: NDArray[np.floating],
    attenuation: Attenuation,
    layers: int,
    *,
    tails: Tails,
    opaque: NDArray[np.bool_] | None = None,
) -> ShellStack:
    """The layer of every pixel of a photograph (y, x), and the layers' masks (section 3.2).

    Pixels that are not ``opaque`` are in none. Raises ValueError for a number of layers that cannot
    be drawn.

    >>> import numpy as np
    >>> luminance = np.array([[0.9, 0.6], [0.3, 0.2]])
    >>> stack = make_shell_stack(luminance, Attenuation(0.9, 0.2), 3, tails="dropped")
    >>> stack.layer.tolist(), stack.masks.shape
    ([[1, 1], [3, 3]], (3, 2, 2))
    """
    layer = layer_of(luminance, attenuation, layers, tails=tails, opaque=opaque)
    return ShellStack(layer, layer_masks(layer, layers))


class LayerHistogram(NamedTuple):
    """A photograph's histogram, the medium read from it, and how its pixels fall into layers."""

    attenuation: Attenuation
    histogram: Histogram
    boundaries: NDArray[np.float64]
    """(layers + 1,): luminances between the layers, descending (Eq. 4)."""
    pixels_per_layer: NDArray[np.int64]
    """(layers,): pixels in [Imin, Imax], tips first."""
    bright_tail: int
    """Pixels brighter than Imax."""
    dark_tail: int
    """Pixels darker than Imin."""


def layer_histogram(
    luminance: NDArray[np.floating],
    *,
    tail: float,
    layers: int,
    ends: tuple[float, float] = PAPER_ENDS,
) -> LayerHistogram:
    """Fit the medium to a photograph (``fit_attenuation``) and count the pixels of every layer.

    ends: depths of the brightest and the darkest pixels within the tails. Raises ValueError as
    ``fit_attenuation`` does and for a number of layers that cannot be drawn.

    >>> import numpy as np
    >>> found = layer_histogram(np.linspace(0.1, 0.8, 50), tail=0.02, layers=3)
    >>> found.pixels_per_layer.tolist(), found.bright_tail, found.dark_tail
    ([27, 13, 8], 1, 1)
    """
    attenuation = fit_attenuation(luminance, tail=tail).with_ends_at(ends)
    layer = layer_of(luminance, attenuation, layers, tails="dropped")
    return LayerHistogram(
        attenuation,
        luminance_histogram(luminance),
        attenuation.boundaries(layers),
        np.bincount(layer.ravel(), minlength=layers + 1)[1:],
        bright_tail=int(np.count_nonzero(luminance > attenuation.brightest)),
        dark_tail=int(np.count_nonzero(luminance < attenuation.darkest)),
    )


def code_steps(layers: int) -> int:
    """Steps of the 8-bit depth code in each layer. Raises ValueError."""
    require_layers(layers)
    return DROPPED // layers


def depth_code(
    luminance: NDArray[np.floating],
    attenuation: Attenuation,
    layers: int,
    *,
    tails: Tails,
    opaque: NDArray[np.bool_] | None = None,
) -> NDArray[np.uint8]:
    """Depth in 8 bits for the shader: layer n has the codes (n-1) s … n s - 1, s = code_steps.

    The steps divide the layers evenly, so comparing codes is exactly the comparison of the full
    luminance with I(n-1) and I(n), and the code still grows evenly with the depth, so filtering it
    makes sense. No layer shows what is not ``opaque``. Raises ValueError for a number of layers
    that cannot be drawn.

    >>> import numpy as np
    >>> luminance = np.array([[0.8, 0.4, 0.2, 0.1]])
    >>> depth_code(luminance, Attenuation(0.8, 0.2), 2, tails="dropped").tolist()
    [[0, 127, 253, 255]]
    """
    steps = code_steps(layers)
    layer = layer_of(luminance, attenuation, layers, tails=tails, opaque=opaque)
    with np.errstate(divide="ignore"):
        # In double precision: readers of packages compute the same codes in their own way.
        ratio = attenuation.brightest / luminance.astype(np.float64)
        depth = np.log(ratio) / attenuation.coefficient
    within = np.clip(depth * layers - (layer - 1.0), 0.0, 1.0)
    step = np.minimum((within * steps).astype(np.int64), steps - 1)
    code = (layer.astype(np.int64) - 1) * steps + step
    return np.where(layer == 0, DROPPED, code).astype(np.uint8)


def require_layers(layers: int) -> None:
    """Raise ValueError unless the number of layers can be drawn."""
    if not 1 <= layers <= MOST_LAYERS:
        raise ValueError(f"layers is {layers}; expected 1 to {MOST_LAYERS}.")
