"""Pictures as files: what the assets show of themselves, under ``pictures/<system>/``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from assets_defs.systems import SYSTEMS
from assets_defs.workspace import CHECKOUT
from storage.versions import Slot, VersionedStore

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

PICTURES = CHECKOUT / "pictures"
_MILLISECONDS_A_FRAME = 250


def write_pictures(store: VersionedStore, slots: Sequence[Slot], folder: Path) -> list[Path]:
    """Write the pictures of the current versions: PNG, moving ones as WebP; returns their paths."""
    written = []
    for slot in slots:
        pictures = SYSTEMS[slot.system].plans[slot.asset].pictures
        if pictures is None:
            continue
        for name, picture in pictures(store.open(slot)).items():
            path = folder / slot.system / f"{slot.asset}-{slot.partition}-{name}"
            written.append(_write(picture, path))
    return written


def write_overviews(store: VersionedStore, slots: Sequence[Slot], folder: Path) -> list[Path]:
    """Write the pictures that show several partitions of a system; returns their paths."""
    written = []
    for system in SYSTEMS.values():
        own = [slot for slot in slots if slot.system == system.name]
        if system.overview is not None and own:
            for name, picture in system.overview(store, own).items():
                written.append(_write(picture, folder / system.name / name))
    return written


def _write(picture: NDArray[np.uint8], stem: Path) -> Path:
    """Write a picture (y, x, 3), or a moving one (frame, y, x, 3); returns its path."""
    from PIL import Image

    stem.parent.mkdir(parents=True, exist_ok=True)
    if picture.ndim == 3:
        path = stem.parent / f"{stem.name}.png"
        Image.fromarray(picture).save(path)
        return path
    path = stem.parent / f"{stem.name}.webp"
    first, *others = (Image.fromarray(frame) for frame in picture)
    pace = _MILLISECONDS_A_FRAME
    first.save(path, save_all=True, append_images=others, duration=pace, loop=0, quality=80)
    return path
