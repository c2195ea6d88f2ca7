"""Points that several photographs show, each seen from one of them: what poses are tested by.

A star is a photograph with its features and where these lie in other photographs. Under given
poses and lenses the best point along a feature's ray leaves residuals in all of them, whatever
surfaces there are: right poses leave fractions of a pixel.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
View = tuple[int, int]
"""Frame and camera."""

_FEATURES = 1500
_KEPT, _BANDS = 240, 4
"""Features of a star at most, and bands of its picture that have as many each."""
_RATIO = 0.8
"""Of the best match's distance to the second best's (Lowe 2004), at most."""
_OFF_LINE = 1.0
"""Pixels from the epipolar line of a pair's own geometry, beyond which a match is none."""
_LEAST_MATCHES = 20
_LEAST_SHARE = 0.5
"""Of the matches: where fewer fit one epipolar geometry, walls look alike and none is sure."""
_ROUNDS = 3
_USUAL = 1.0
"""Pixels: a residual from which on a sighting counts for less."""


class Star(NamedTuple):
    """n features of one photograph in k others."""

    view: View
    others: tuple[View, ...]
    pixels: FloatArray
    """(n, 2)."""
    seen: FloatArray
    """(n, k, 2), pixels; nan where a photograph does not show a feature."""


class Sights(NamedTuple):
    """A star's features under poses."""

    inverse_depth: FloatArray
    """(n,), 1 / unit of the poses, along the camera's axis; nan where it cannot be told."""
    residual: FloatArray
    """(n, k), pixels; nan where there is no sight."""
    elsewhen: NDArray[np.bool_]
    """(k,), which of the photographs are of another instant."""


def find_stars(
    load: Callable[[int], NDArray[np.uint8]], windows: Sequence[Sequence[int]]
) -> list[Star]:
    """Stars of the photographs (c, h, w, 3) of some frames: one a window, of its first frame.

    Each of the first frame's cameras is a middle; its others are all photographs of the window.
    SIFT (Lowe, Distinctive image features from scale-invariant keypoints, IJCV 2004); matches that
    do not fit the pair's own epipolar geometry are left out.
    """
    finder = cv2.SIFT.create(nfeatures=_FEATURES)
    found: dict[int, list[tuple[FloatArray, NDArray[np.float32]]]] = {}

    def features(frame: int) -> list[tuple[FloatArray, NDArray[np.float32]]]:
        if frame not in found:
            found[frame] = [_features(finder, picture) for picture in load(frame)]
        return found[frame]

    stars = []
    for window in windows:
        cameras = range(len(features(window[0])))
        every = [(frame, camera) for frame in window for camera in cameras]
        for camera in cameras:
            own = (window[0], camera)
            others = tuple(one for one in every if one != own)
            pixels, descriptors = features(window[0])[camera]
            seen = [
                _matched(pixels, descriptors, *features(frame)[other]) for frame, other in others
            ]
            shown = np.stack(seen, axis=1) if seen else np.full((len(pixels), 0, 2), np.nan)
            rows = _most_seen(pixels[:, 1], np.isfinite(shown[..., 0]).sum(axis=1))
            stars.append(Star(own, others, pixels[rows], shown[rows]))
    return stars


def _most_seen(height: FloatArray, sights_each: NDArray[np.int64]) -> NDArray[np.int64]:
    """Features that most others show, two at least, from each band: the road has few."""
    kept = []
    edges = np.linspace(height.min(initial=0), height.max(initial=0), _BANDS + 1)[1:-1]
    band = np.searchsorted(edges, height)
    for number in range(_BANDS):
        rows = np.flatnonzero((band == number) & (sights_each >= 2))
        kept.append(rows[np.argsort(-sights_each[rows], kind="stable")][: _KEPT // _BANDS])
    return np.concatenate(kept)


def _features(
    finder: cv2.SIFT, picture: NDArray[np.uint8]
) -> tuple[FloatArray, NDArray[np.float32]]:
    grey = cv2.cvtColor(np.ascontiguousarray(picture), cv2.COLOR_RGB2GRAY)
    points, descriptors = finder.detectAndCompute(grey, None)
    if descriptors is None:
        return np.zeros((0, 2)), np.zeros((0, 128), np.float32)
    return np.array([point.pt for point in points]).reshape(-1, 2), np.asarray(descriptors)


def _matched(
    pixels: FloatArray,
    descriptors: NDArray[np.float32],
    their_pixels: FloatArray,
    their_descriptors: NDArray[np.float32],
) -> FloatArray:
    """Where the features (n, 2) are in another photograph; nan where they are not."""
    seen = np.full(pixels.shape, np.nan)
    if min(len(pixels), len(their_pixels)) < _LEAST_MATCHES:
        return seen
    pairs = cv2.BFMatcher(cv2.NORM_L2).knnMatch(descriptors, their_descriptors, k=2)
    kept = [one for one, two in pairs if one.distance < _RATIO * two.distance]
    if len(kept) < _LEAST_MATCHES:
        return seen
    ours = np.array([one.queryIdx for one in kept])
    theirs = np.array([one.trainIdx for one in kept])
    _, inside = cv2.findFundamentalMat(
        pixels[ours], their_pixels[theirs], cv2.USAC_MAGSAC, _OFF_LINE, 0.999, 2000
    )
    if inside is None or inside.sum() < max(_LEAST_MATCHES, _LEAST_SHARE * len(kept)):
        return seen
    good = inside.ravel() > 0
    seen[ours[good]] = their_pixels[theirs[good]]
    return seen


def sights(star: Star, poses: FloatArray, intrinsics: FloatArray) -> Sights:
    """The best point along each feature's ray, and what it leaves in each photograph.

    poses (f, c, 4, 4), camera to world, intrinsics (c, 3, 3). Linear in the inverse depth,
    weighted again by residuals, so that a single wrong match does not matter.
    """
    frame, camera = star.view
    rays = np.concatenate([star.pixels, np.ones((len(star.pixels), 1))], axis=1)
    rays = rays @ np.linalg.inv(intrinsics[camera]).T
    far, near = [], []
    for other, theirs in star.others:
        way = np.linalg.inv(poses[other, theirs]) @ poses[frame, camera]
        far.append(rays @ (intrinsics[theirs] @ way[:3, :3]).T)
        near.append(intrinsics[theirs] @ way[:3, 3])
    a, b = np.stack(far, axis=1), np.array(near)[None]
    # u (a_z + r b_z) = a_x + r b_x, and as much for v: two equations a sight.
    left = star.seen * b[..., 2:] - b[..., :2]
    right = a[..., :2] - star.seen * a[..., 2:]
    known = np.isfinite(star.seen[..., 0])
    weight = known.astype(np.float64)
    for _ in range(_ROUNDS):
        rows = weight[..., None]
        square = np.nansum(rows * left**2, axis=(1, 2))
        both = np.nansum(rows * left * right, axis=(1, 2))
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = np.where(square > 0, both / square, np.nan)
            at = a + inverse[:, None, None] * b
            off = np.linalg.norm(at[..., :2] / at[..., 2:] - star.seen, axis=-1)
        # Behind a camera nothing is seen.
        residual = np.where(at[..., 2] > 0, off, np.inf)
        residual = np.where(known, residual, np.nan)
        weight = np.where(known, 1.0 / np.maximum(np.nan_to_num(off, nan=1e6), _USUAL), 0.0)
    elsewhen = np.array([other != frame for other, _ in star.others], bool)
    return Sights(inverse, residual, elsewhen)


def confirmed_share(found: Sequence[Sights], pixels: float = 2.0) -> float:
    """Share of the sights at other instants that lie this near to where the poses have them.

    In pixels. A point that has to be behind its own camera is confirmed by none; what a rig's
    cameras see at one instant says nothing of the way. 0 without sights.
    """
    good = asked = 0
    for one in found:
        residual = one.residual[:, one.elsewhen]
        known = ~np.isnan(residual)
        before = (one.inverse_depth > 0)[:, None]
        good += int((known & before & (residual < pixels)).sum())
        asked += int(known.sum())
    return good / asked if asked else 0.0


def mean_residual(found: Sequence[Sights], most: float = 4.0) -> float:
    """Mean of the residuals, each no more than ``most``, in pixels; nan without sights."""
    every = np.concatenate([one.residual[~np.isnan(one.residual)] for one in found])
    return float(np.minimum(every, most).mean()) if len(every) else float("nan")
