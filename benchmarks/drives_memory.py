"""Peak of memory of one camera's depth over a drive: ``python -m benchmarks.drives_memory FRAMES``.

Photographs of noise, made when they are asked for; nothing is kept of what is found.
"""

from __future__ import annotations

import resource
import sys

import numpy as np

from pipelines.street_billboards.capture.drive_depth import DriveDepth, DriveFrames, RigFrame

_WIDTH, _HEIGHT = 640, 400


def peak(frames: int) -> float:
    """Megabytes."""
    lens = np.array([[400.0, 0, 319.5], [0, 400, 199.5], [0, 0, 1]])[None]
    poses = np.tile(np.eye(4), (frames, 1, 1, 1))
    poses[:, 0, 2, 3] = np.arange(frames)

    def load(frame: int) -> RigFrame:
        random = np.random.default_rng(frame)
        pixels = random.integers(0, 255, (1, _HEIGHT, _WIDTH, 3), np.uint8)
        return RigFrame(pixels, lens, poses[frame])

    found = DriveDepth(DriveFrames(load, poses, np.arange(frames)), nearest=2.0, farthest=40.0)
    for frame in range(frames):
        found.before_sky(frame)
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6


if __name__ == "__main__":
    print(peak(int(sys.argv[1])))
