"""Pictures as PNG files: what the assets show of themselves, under ``pictures/<system>/``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from assets_defs.definitions import SYSTEMS
from storage.versions import Slot, VersionedStore


def write_gallery(store: VersionedStore, slots: Iterable[Slot], folder: Path) -> list[Path]:
    """Write the pictures of the current versions as PNGs; returns their paths."""
    from PIL import Image

    written = []
    for slot in slots:
        pictures = SYSTEMS[slot.system].plans[slot.asset].pictures
        if pictures is None:
            continue
        for name, picture in pictures(store.open(slot)).items():
            path = folder / slot.system / f"{slot.asset}-{slot.partition}-{name}.png"
            path.parent.mkdir(parents=True, exist_ok=True)
            Image.fromarray(picture).save(path)
            written.append(path)
    return written
