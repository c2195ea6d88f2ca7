"""Which way up photographs lie in their files, by what they themselves show.

Directions come with the photographs' names, and nothing in a file says where their phi = 0 is in
the picture: a turned or mirrored database is read without complaint, and every light comes from a
wrong side. But light and relief tell. From brightness as it follows the light, seen from above,
come slopes, and from these the relief: of the eight ways a square can lie only the right one has
slopes that are those of one surface, with the shadows where photographs are dark (turned by half,
hills are hollows: shadows would fall where it is bright), and with the parallax of oblique views.
A way's score is the mean of three correlations over the texels: of how dark photographs from above
are, compared with a ring of lights, and what the relief would make them; of the part of it that is
the same under opposite lights, where slopes cancel and shadows do not; and of oblique views and
what the relief would show in them, wherever the plane is to which they are rectified.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.light.directions import Pairs
from pipelines.neural_btf.relief import (
    STEEPEST_LIGHT,
    Floats,
    heights,
    moved,
    parallax,
    relative,
    shaded,
    slopes,
)

Read = Callable[[NDArray[np.intp]], NDArray[np.floating]]
"""Photographs (image, y, x, channel) of these numbers."""

ORIENTATIONS = (
    "upright",
    "turned 90",
    "turned 180",
    "turned 270",
    "mirrored",
    "mirrored, turned 90",
    "mirrored, turned 180",
    "mirrored, turned 270",
)
"""How photographs lie in their files: left and right changed or not, then turned by degrees
counter-clockwise."""
CLEAR_MARGIN = 0.03
"""Of the best score over the second: less says nothing."""
CLEAR_SCORE = 0.25
"""Photographs dealt at random to lights and views seldom reach both."""
LARGEST_PATCH = 256
"""Pixels a side of what is looked at."""
SMALLEST_SIDE = 24
"""Texels; less shows no relief."""

_PATCH = 64  # texels a side, at any scale
_WIDEST_GAP = np.radians(100.0)
_SCALES = (1, 2, 4)
_EXAGGERATIONS = (0.5, 1.0, 2.0)  # of the relief: blur flattens it, gloss steepens it
_FEWEST = 5  # directions all around that make a ring
_MOST = 12  # directions of a ring that are looked at
_ABOVE = np.radians(12.0)  # as good as straight above
_GRAZING = np.radians((40.0, 80.0))
_OBLIQUE = np.radians((25.0, 62.0))
_STEEP_LIGHTS = np.radians(35.0)
_PLANES = (-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0)  # texels: the rectified plane's parallax
_BRIGHTEST = 0.6  # of a ring's mean: dark is dark, how bright bright is depends on the gloss


class Scores(dict[str, float]):
    """The orientations' scores, -1 to 1.

    >>> scores = Scores({"upright": 0.5, "turned 90": 0.25, "mirrored": 0.125})
    >>> scores.best, scores.margin("upright"), scores.margin("mirrored"), scores.are_clear
    ('upright', 0.25, -0.375, True)
    """

    @property
    def best(self) -> str:
        """The orientation with the highest score."""
        return max(self, key=self.__getitem__)

    @property
    def are_clear(self) -> bool:
        """Whether they can be trusted: flat or glassy materials show no relief."""
        return self[self.best] >= CLEAR_SCORE and self.margin(self.best) >= CLEAR_MARGIN

    def margin(self, orientation: str) -> float:
        """An orientation's score over the best of the others."""
        return self[orientation] - max(self[name] for name in self if name != orientation)


class Looks(NamedTuple):
    """The photographs that are looked at, grey.

    above: (light, y, x), seen from above under ``lights`` (light, 2), which stand in ``rings``.
    oblique: (view, y, x) from ``views`` (view, 2), the mean over steep lights; flat: (y, x), the
    same from above. There may be no oblique views.
    """

    above: Floats
    lights: NDArray[np.float64]
    rings: list[NDArray[np.intp]]
    oblique: Floats
    views: NDArray[np.float64]
    flat: Floats


def turned_upright(photographs: NDArray[np.floating], orientation: str) -> NDArray[np.floating]:
    """Photographs (..., y, x, channel) as they lie in files, upright: a view of the same memory.

    >>> upright = np.arange(6).reshape(2, 3, 1)
    >>> turned_upright(np.rot90(upright), "turned 90").tolist() == upright.tolist()
    True
    """
    turns = ORIENTATIONS.index(orientation)
    axes = (photographs.ndim - 3, photographs.ndim - 2)
    found = np.rot90(photographs, -(turns % 4), axes)
    return found[..., ::-1, :] if turns >= 4 else found


def orientation_scores(pairs: Pairs, read: Read) -> Scores | None:
    """Scores of the eight orientations, or None where there is too little to see.

    ``read`` is asked for about two hundred photographs, all of one view at a time, of the middle
    of `central_patch`. None: no view from above with lights all around, or too few texels.
    """
    looks = _looks(pairs, read)
    if looks is None:
        return None
    best: Scores | None = None
    for scale in _SCALES:
        part = _scaled(looks, scale)
        if min(part.above.shape[1:]) < (SMALLEST_SIDE if scale == 1 else _PATCH):
            break
        scores = Scores({name: _score(part, name) for name in ORIENTATIONS})
        if best is None or scores[scores.best] > best[best.best]:
            best = scores
    return best


# ---- choosing --------------------------------------------------------------------------------


def central_patch(height: int, width: int) -> tuple[int, int, int, int]:
    """Left, top, width, height of what is looked at of photographs of a size.

    >>> central_patch(400, 100)
    (0, 72, 100, 256)
    """
    across, down = min(width, LARGEST_PATCH), min(height, LARGEST_PATCH)
    return (width - across) // 2, (height - down) // 2, across, down


def _looks(pairs: Pairs, read: Read) -> Looks | None:
    views, view = np.unique(np.round(pairs.view, 6), axis=0, return_inverse=True)
    of_view = [np.flatnonzero(view.ravel() == k) for k in range(len(views))]
    above = of_view[0]  # sorted by theta
    rings = _rings(pairs.light[above], 0.0, _GRAZING[1])
    thetas = [pairs.light[above[ring[0]], 0] for ring in rings]
    if views[0, 0] > _ABOVE or not rings or min(thetas) > STEEPEST_LIGHT:
        return None
    if max(thetas) < _GRAZING[0]:
        return None
    lit = above[np.concatenate(rings)]
    around = _oblique_ring(views)
    steep = [_steep(images, pairs.light[images]) for images in of_view]
    oblique = [_grey(read(steep[k])).mean(axis=0) for k in around if len(steep[k])]
    flat = _grey(read(steep[0])).mean(axis=0) if oblique else np.empty(0, np.float32)
    ends = np.cumsum([len(ring) for ring in rings])
    return Looks(
        _grey(read(lit)),
        pairs.light[lit],
        [np.arange(end - len(ring), end) for ring, end in zip(rings, ends, strict=True)],
        np.array(oblique, np.float32),
        views[around] if oblique else np.empty((0, 2)),
        flat,
    )


def _oblique_ring(views: NDArray[np.float64]) -> NDArray[np.intp]:
    """The ring of views nearest to 45 degrees; empty where there is none."""
    rings = _rings(views, *_OBLIQUE)
    nearest = min(rings, key=lambda ring: abs(views[ring[0], 0] - np.pi / 4), default=None)
    return np.empty(0, np.intp) if nearest is None else nearest


def _rings(directions: NDArray[np.float64], least: float, most: float) -> list[NDArray[np.intp]]:
    """Numbers of directions of one theta, in ``least`` to ``most``, that stand all around."""
    thetas = np.round(np.degrees(directions[:, 0]) * 2) / 2
    found = []
    for theta in np.unique(thetas):
        ring = np.flatnonzero(thetas == theta)
        ring = ring[np.argsort(directions[ring, 1])][:: -(-len(ring) // _MOST)]
        gaps = np.diff(directions[ring, 1], append=directions[ring[0], 1] + 2 * np.pi)
        if least <= np.radians(theta) <= most and len(ring) >= _FEWEST and gaps.max() < _WIDEST_GAP:
            found.append(ring)
    return found


def _steep(images: NDArray[np.intp], lights: NDArray[np.float64]) -> NDArray[np.intp]:
    """Of a view's images those under steep lights, the same lights for every view."""
    images = images[np.lexsort(lights.T[::-1])]
    lights = lights[np.lexsort(lights.T[::-1])]
    found = images[lights[:, 0] <= _STEEP_LIGHTS]
    return found[:: max(1, -(-len(found) // _MOST))]


def _grey(photographs: NDArray[np.floating]) -> Floats:
    return photographs.astype(np.float32).mean(axis=-1)


# ---- scoring ---------------------------------------------------------------------------------


def _scaled(looks: Looks, scale: int) -> Looks:
    """The middle of what is looked at, ``scale`` pixels to a texel."""

    def scaled(pictures: Floats) -> Floats:
        rows, columns = (min(size // scale, _PATCH) for size in pictures.shape[-2:])
        top = (pictures.shape[-2] - scale * rows) // 2
        left = (pictures.shape[-1] - scale * columns) // 2
        middle = pictures[..., top : top + scale * rows, left : left + scale * columns]
        blocks = middle.reshape(*middle.shape[:-2], rows, scale, columns, scale)
        return blocks.mean(axis=(-3, -1))

    return looks._replace(
        above=scaled(looks.above),
        oblique=scaled(looks.oblique) if len(looks.oblique) else looks.oblique,
        flat=scaled(looks.flat) if len(looks.oblique) else looks.flat,
    )


def _score(looks: Looks, orientation: str) -> float:
    """How far the relief that the slopes give explains the photographs, if they lie so."""

    def upright(pictures: Floats) -> Floats:
        return turned_upright(pictures[..., None], orientation)[..., 0]

    above = upright(looks.above)
    grazing = [ring for ring in looks.rings if looks.lights[ring[0], 0] >= _GRAZING[0]]
    azimuths = [looks.lights[ring, 1] for ring in grazing]
    dark = [_darkness(above[ring]) for ring in grazing]
    changes = _changes(upright(looks.oblique)) if len(looks.oblique) else None
    relief = heights(slopes(above, looks.lights, looks.rings))
    scores = []
    for exaggeration in _EXAGGERATIONS:
        guess = exaggeration * relief
        shadows = [_darkness(shaded(guess, looks.lights[ring])) for ring in grazing]
        found = [
            _correlation(np.concatenate(dark), np.concatenate(shadows)),
            _correlation(_even_part(dark, azimuths), _even_part(shadows, azimuths)),
        ]
        if changes is not None:
            found.append(_seen(guess, upright(looks.flat), looks.views, changes))
        scores.append(float(np.mean(found)))
    return max(scores)


def _seen(relief: Floats, flat: Floats, views: NDArray[np.float64], changes: Floats) -> float:
    """Correlation of what changes from view to view with what a relief would show, at best."""
    distances = [parallax(relief, view) for view in views]
    return max(
        _correlation(
            changes,
            _changes(
                np.stack(
                    [
                        moved(flat, distance + np.float32(plane), float(phi))
                        for distance, (_, phi) in zip(distances, views, strict=True)
                    ]
                )
            ),
        )
        for plane in _PLANES
    )


def _even_part(rings: list[Floats], azimuths: list[NDArray[np.float64]]) -> Floats:
    """Of rings (light, y, x) the waves (2, y, x) of half a turn, all after each other."""
    found = []
    for ring, phi in zip(rings, azimuths, strict=True):
        waves = [np.ones_like(phi)]
        waves += [wave(turns * phi) for turns in (1, 2) for wave in (np.cos, np.sin)]
        inverse = np.linalg.pinv(np.stack(waves, axis=1))[3:].astype(np.float32)
        found.append(np.einsum("kl,lyx->kyx", inverse, ring))
    return np.concatenate(found)


def _darkness(ring: Floats) -> Floats:
    """Where a ring's photographs (light, y, x) are dark, compared with each texel's mean."""
    ratio = np.minimum(relative(ring, 0.02), _BRIGHTEST)
    return ratio - ratio.mean(axis=0)


def _changes(views: Floats) -> Floats:
    """What changes from view to view (view, y, x), the brightness of a whole one aside."""
    even = views / (views.mean(axis=(1, 2), keepdims=True) + 1e-12)
    return even - even.mean(axis=0)


def _correlation(one: Floats, other: Floats) -> float:
    lengths = np.sqrt(np.vdot(one, one) * np.vdot(other, other))
    return float(np.vdot(one, other) / lengths) if lengths > 0 else 0.0
