"""What the assets show of themselves as files, a folder a system."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from assets_defs.systems import SYSTEMS
from storage.versions import Slot, VersionedStore
from tsuya.picture_files import write_picture

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

_LINEAR = ("y", "x", "channel")


def write_pictures(store: VersionedStore, slots: Sequence[Slot], folder: Path) -> list[Path]:
    """Write the pictures of the current versions: PNG, moving ones as WebP; returns their paths."""
    written = []
    for slot in slots:
        pictures = SYSTEMS[slot.system].plans[slot.asset].pictures
        for name, picture in pictures(store.open(slot)).items() if pictures else ():
            ending = "webp" if picture.ndim == 4 else "png"
            written += write_picture(picture, _stem(folder, slot, name), ending)
    return written


def write_overviews(store: VersionedStore, slots: Sequence[Slot], folder: Path) -> list[Path]:
    """Write the pictures that show several partitions of a system; returns their paths."""
    written = []
    for system in SYSTEMS.values():
        own = [slot for slot in slots if slot.system == system.name]
        if system.overview is not None and own:
            for name, picture in system.overview(store, own).items():
                ending = "webp" if picture.ndim == 4 else "png"
                written += write_picture(picture, folder / system.name / name, ending)
    return written


def write_pictures_as(store: VersionedStore, slot: Slot, ending: str, folder: Path) -> list[Path]:
    """Write one current version's pictures in one format; returns their paths.

    ``ending``: as in `write_picture`. EXR takes linear arrays of the dataset itself where it has
    some, other pictures come from 8 bits; films are of the moving pictures only. Raises ValueError
    where there is nothing to show, NoVersionError.
    """
    plan = SYSTEMS[slot.system].plans[slot.asset]
    dataset = store.open(slot)
    shown: dict[str, NDArray[Any]] = {} if plan.pictures is None else dict(plan.pictures(dataset))
    if ending == "exr":
        shown |= _linear_pictures(dataset)
    if ending in ("webp", "mp4"):
        shown = {name: p for name, p in shown.items() if p.ndim == 4} | _moving(dataset)
    if not shown:
        what = "moving pictures" if ending in ("webp", "mp4") else "pictures"
        raise ValueError(f"{slot} shows no {what}; expected an asset that does, or another --as.")
    written = []
    for name, picture in shown.items():
        written += write_picture(picture, _stem(folder, slot, name), ending)
    return written


def _stem(folder: Path, slot: Slot, name: str) -> Path:
    return folder / slot.system / f"{slot.asset}-{slot.partition}-{name}"


def _linear_pictures(dataset: xr.Dataset) -> dict[str, NDArray[Any]]:
    """Arrays (y, x, channel), or several such, of floats: linear light by their schema."""
    return {
        str(name): variable.values
        for name, variable in dataset.variables.items()
        if variable.dtype.kind == "f" and variable.dims[-3:] == _LINEAR and variable.ndim <= 4
    }


def _moving(dataset: xr.Dataset) -> dict[str, NDArray[Any]]:
    """Arrays (frame, y, x, channel) of 8 bits: what is drawn one after the other."""
    return {
        str(name): variable.values
        for name, variable in dataset.variables.items()
        if variable.dtype.kind == "u" and variable.dims[-3:] == _LINEAR and variable.ndim == 4
    }
