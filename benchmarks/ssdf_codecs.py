"""General codecs on SSDFs, a vertex at a time: zfp and JPEG XL at a given error.

``python -m benchmarks.ssdf_codecs MATRIX.npy RMSE`` in a process of its own, for some builds of zfp
break Zarr. Prints one JSON object: bytes of all vertices at the RMSE (weighted by solid angle),
interpolated between settings.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.ssdf_lighting.distances.octahedral import resolution_of
from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights

_SAMPLED = 1500
_ZFP_TOLERANCES = np.geomspace(0.01, 0.6, 8)
_JXL_DISTANCES = np.geomspace(0.3, 12.0, 8)


def codec_bytes(matrix: NDArray[np.float32], rmse: float) -> dict[str, Any]:
    """Bytes that each codec takes for all vertices; evenly sampled ones stand for the rest."""
    import imagecodecs

    rows = matrix[np.linspace(0, len(matrix) - 1, min(_SAMPLED, len(matrix))).astype(int)]
    n = resolution_of(matrix.shape[1])
    blocks = np.ascontiguousarray(rows.reshape(-1, n, n))

    def zfp(block: NDArray[np.float32], setting: float) -> tuple[int, NDArray[np.float32]]:
        code = imagecodecs.zfp_encode(block, level=float(setting), mode="a")  # type: ignore[arg-type]
        return len(code), imagecodecs.zfp_decode(code)

    def jxl(block: NDArray[np.float32], setting: float) -> tuple[int, NDArray[np.float32]]:
        # It expects values from 0 to 1; as 16 bit whole numbers all builds take them.
        whole = np.rint((block / np.pi + 1.0) / 2.0 * 65535.0).astype(np.uint16)
        code = imagecodecs.jpegxl_encode(whole, distance=float(setting), effort=7)
        back = imagecodecs.jpegxl_decode(code).reshape(block.shape).astype(np.float32)
        return len(code), ((back / 65535.0) * 2.0 - 1.0) * np.float32(np.pi)

    scale = len(matrix) / len(blocks)
    return {
        "zfp": _at(zfp, blocks, _ZFP_TOLERANCES, rmse) * scale,
        "jxl": _at(jxl, blocks[::5], _JXL_DISTANCES, rmse) * scale * len(blocks) / len(blocks[::5]),
    }


def _at(
    codec: Callable[[NDArray[np.float32], float], tuple[int, NDArray[np.float32]]],
    blocks: NDArray[np.float32],
    settings: NDArray[np.float64],
    rmse: float,
) -> float:
    """Bytes at the error, between settings, both on logarithmic scales."""
    weights = root_weights(blocks[0].size).reshape(blocks.shape[1:])
    errors, sizes = [], []
    for setting in settings:
        total, squares = 0, 0.0
        for block in blocks:
            size, back = codec(block, setting)
            total += size
            squares += float((((back - block) * weights).astype(np.float64) ** 2).sum())
        errors.append((squares / blocks.size) ** 0.5)
        sizes.append(total)
    order = np.argsort(errors)
    if not errors[order[0]] <= rmse <= errors[order[-1]]:
        raise ValueError(f"errors reach from {min(errors)} to {max(errors)}; expected {rmse}.")
    logs = np.interp(np.log(rmse), np.log(np.array(errors)[order]), np.log(np.array(sizes)[order]))
    return float(np.exp(logs))


if __name__ == "__main__":
    print(json.dumps(codec_bytes(np.load(sys.argv[1], mmap_mode="r"), float(sys.argv[2]))))
