"""``python -m docs.room``: traces the room and writes pipelines/light/room.exr. Some minutes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from docs.room.furnishing import furnished_room
from docs.room.light import LitRoom, draw_map
from docs.room.looks import EYE
from pipelines.light import room

_GATHERED, _SAMPLES = 192, 12
_COMPRESSION = 150.0
"""How much DWA may leave out."""


def traced_room(
    height: int, samples: int, gathered: int, step: float = 0.22
) -> NDArray[np.float32]:
    """The room's map (H, 2 H, 3), ``samples`` a texel, with light from ``gathered`` rays of each
    piece of at most ``step`` metres."""
    return draw_map(LitRoom(*furnished_room(step), gathered), EYE, height, samples)


def write_room(path: Path, radiance: NDArray[np.float32]) -> None:
    """The map as OpenEXR, in halfs, by DWA, which loses what nobody sees."""
    import OpenEXR

    header = {
        "compression": OpenEXR.DWAB_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "dwaCompressionLevel": _COMPRESSION,
    }
    with OpenEXR.File(header, {"RGB": radiance.astype(np.float16)}) as file:
        file.write(str(path))


if __name__ == "__main__":
    made = traced_room(room.ROOM_ROWS, _SAMPLES, _GATHERED)
    write_room(Path(room.__file__).with_suffix(".exr"), made)
