"""Pieces of a long film, each mapped alone, put into one world."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.poses.bundle import Bundle, Priors, Sightings, adjust_bundle

FEWEST_SHARED = 3
"""Frames with a pose in both pieces that join them."""


class Piece(NamedTuple):
    """Frames that were mapped together."""

    frames: NDArray[np.int64]
    """(f,), their numbers in the film."""
    bundle: Bundle
    seen: Sightings
    deviation: float
    """Of its focal length, relative; 0: given."""
    errors: NDArray[np.float64]
    """(n,), of its points, as of ``FoundPoses``."""
    nearest: NDArray[np.int64]
    colours: NDArray[np.uint8]


class Joined(NamedTuple):
    """All pieces in the world of the first; fields as of ``FoundPoses``."""

    frames: NDArray[np.int64]
    poses: NDArray[np.float64]
    intrinsics: NDArray[np.float64]
    deviation: float
    points: NDArray[np.float64]
    errors: NDArray[np.float64]
    sightings: NDArray[np.int64]
    nearest: NDArray[np.int64]
    colours: NDArray[np.uint8]
    notes: tuple[str, ...]


class Similarity(NamedTuple):
    """Of one world into another: scale * turn @ point + shift."""

    scale: float
    turn: NDArray[np.float64]
    shift: NDArray[np.float64]

    def points(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """(…, 3), moved."""
        return self.scale * points @ self.turn.T + self.shift

    def poses(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """(…, 4, 4), camera to world, moved."""
        moved = poses.copy()
        moved[..., :3, :3] = self.turn @ poses[..., :3, :3]
        moved[..., :3, 3] = self.points(poses[..., :3, 3])
        return moved


def join_pieces(pieces: list[Piece], *, fixed_focal: bool) -> Joined:
    """Put pieces into the world of the first, by the poses of the frames that they share.

    One film has one focal length: the pieces' mean, weighted by their deviations, is put into all
    of them. Where two pieces share fewer than three frames the film falls apart: the part with
    most frames is kept, and that is said. At least one piece.
    """
    focal, deviation = common_focal(pieces)
    if len(pieces) > 1 and not fixed_focal:
        pieces = [_with_focal(piece, focal) for piece in pieces]
    runs: list[list[Piece]] = []
    for piece in pieces:
        if runs and len(_shared(runs[-1][-1], piece)[0]) >= FEWEST_SHARED:
            into = pose_similarity(*_shared_poses(runs[-1][-1], piece))
            runs[-1].append(_moved(piece, into))
        else:
            runs.append([piece])
    longest = max(runs, key=lambda run: len(np.unique(np.concatenate([p.frames for p in run]))))
    notes = []
    if len(runs) > 1:
        first, last = longest[0].frames[0], longest[-1].frames[-1]
        notes.append(
            f"The film falls into {len(runs)} parts that no frames join: the longest, frames "
            f"{first} to {last}, is used."
        )
    frames, rows = np.unique(np.concatenate([p.frames for p in longest]), return_index=True)
    every = np.concatenate([p.bundle.poses for p in longest])
    return Joined(
        frames,
        every[rows],
        longest[0].bundle.intrinsics[0],
        deviation,
        np.concatenate([p.bundle.points for p in longest]),
        np.concatenate([p.errors for p in longest]),
        np.concatenate([np.bincount(p.seen.point, minlength=len(p.errors)) for p in longest]),
        np.concatenate([p.nearest for p in longest]),
        np.concatenate([p.colours for p in longest]),
        tuple(notes),
    )


def common_focal(pieces: list[Piece]) -> tuple[float, float]:
    """The pieces' focal length in pixels, by their deviations, and its relative deviation."""
    logarithms = np.log([piece.bundle.intrinsics[0, 0, 0] for piece in pieces])
    deviations = np.array([piece.deviation for piece in pieces])
    if (deviations == 0).all() or not np.isfinite(deviations).any():
        return float(np.exp(np.median(logarithms))), float(deviations[0])
    weights = 1 / deviations**2
    middle = (weights * logarithms).sum() / weights.sum()
    stated = 1 / np.sqrt(weights.sum())
    if len(pieces) > 1:  # where they disagree more than they say, it is wider (Birge's ratio)
        spread = (weights * (logarithms - middle) ** 2).sum() / (len(pieces) - 1)
        stated *= max(1.0, np.sqrt(spread))
    return float(np.exp(middle)), float(stated)


def pose_similarity(source: NDArray[np.float64], target: NDArray[np.float64]) -> Similarity:
    """The similarity that takes poses (k, 4, 4) nearest to others of the same cameras.

    The turn is the mean of the cameras' turns (the chordal one), as places on a straight road say
    nothing of a roll about it; scale and shift follow from the places by least squares. At least
    two places that differ.
    """
    left, _, right = np.linalg.svd(np.einsum("kij,klj->il", target[:, :3, :3], source[:, :3, :3]))
    turn = left @ np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right
    a, b = source[:, :3, 3] @ turn.T, target[:, :3, 3]
    from_a, from_b = a - a.mean(axis=0), b - b.mean(axis=0)
    scale = float((from_a * from_b).sum() / (from_a**2).sum())
    return Similarity(scale, turn, b.mean(axis=0) - scale * a.mean(axis=0))


def _with_focal(piece: Piece, focal: float) -> Piece:
    intrinsics = piece.bundle.intrinsics.copy()
    intrinsics[:, [0, 1], [0, 1]] = focal
    changed = piece.bundle._replace(intrinsics=intrinsics)
    return piece._replace(bundle=adjust_bundle(changed, piece.seen, Priors()))


def _shared(first: Piece, second: Piece) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    _, a, b = np.intersect1d(first.frames, second.frames, return_indices=True)
    return a, b


def _shared_poses(first: Piece, second: Piece) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    a, b = _shared(first, second)
    return second.bundle.poses[b], first.bundle.poses[a]


def _moved(piece: Piece, by: Similarity) -> Piece:
    bundle = piece.bundle
    moved = bundle._replace(poses=by.poses(bundle.poses), points=by.points(bundle.points))
    return piece._replace(bundle=moved)
