"""Skins in their rest pose: where the joints, as the file has them, put each vertex."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.gltf.accessors import Accessors


class Posed(NamedTuple):
    """``positions`` (V, 3) in the scene; ``mirrored`` (V,), whether a vertex's matrix mirrors."""

    positions: NDArray[np.float64]
    mirrored: NDArray[np.bool_]


def joint_matrices(
    document: dict[str, Any], accessors: Accessors, world: NDArray[np.float64], skin: int
) -> NDArray[np.float64]:
    """(J, 4, 4): from a skinned mesh's own space to the scene, by each joint (glTF 2.0, 3.7.3.3):
    the node of the mesh has no say."""
    entry = document["skins"][skin]
    matrices = world[np.array(entry["joints"], np.int64)].reshape(-1, 4, 4)
    if "inverseBindMatrices" not in entry:
        return matrices
    what = f"inverseBindMatrices of skins[{skin}]"
    inverse = accessors.floats(entry["inverseBindMatrices"], (16,), what)
    if len(inverse) < len(matrices):
        found = f"of {len(inverse)} matrices for {len(matrices)} joints"
        raise BadInput(accessors.buffers.file, what, found, "one for each joint")
    return matrices @ inverse[: len(matrices)].reshape(-1, 4, 4).transpose(0, 2, 1)


def posed(
    file: Path,
    positions: NDArray[np.float64],
    joints: NDArray[np.int64],
    weights: NDArray[np.float64],
    matrices: NDArray[np.float64],
) -> Posed:
    """Positions (V, 3) moved by ``joints`` (V, J) with ``weights`` (V, J), of any sums.

    Vertices without weights follow their first joint. Raises BadInput for joints that are none.
    """
    wrong = (joints < 0) | (joints >= len(matrices))
    if (wrong & (weights != 0)).any() or len(matrices) == 0:
        found = f"a reference to joint {joints[wrong][0]}" if wrong.any() else "a skin without any"
        raise BadInput(file, "a joint", found, f"one of joints 0 to {len(matrices) - 1}")
    joints = np.where(wrong, 0, joints)  # without weight, writers leave what they like
    total = weights.sum(axis=1, keepdims=True)
    shares = np.divide(weights, total, out=np.zeros_like(weights), where=total > 0)
    shares[:, 0] += (total <= 0)[:, 0]
    moved = np.zeros_like(positions)
    signs = np.zeros(len(positions))
    mirrors = np.linalg.det(matrices[:, :3, :3]) < 0
    for column in range(joints.shape[1]):
        used = np.flatnonzero(shares[:, column])
        joint, share = joints[used, column], shares[used, column]
        turned = np.einsum("vij,vj->vi", matrices[joint, :3, :3], positions[used])
        moved[used] += share[:, None] * (turned + matrices[joint, :3, 3])
        signs[used] += share * np.where(mirrors[joint], -1.0, 1.0)
    return Posed(moved, signs < 0)
