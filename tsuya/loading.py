"""Stored versions for notebooks and scripts, without Dagster: `tsuya.load`, `tsuya.open`."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from assets_defs.workspace import Workspace
from storage.stored_version import StoredVersion
from storage.versions import VersionedStore
from tsuya.keys import parse_key

if TYPE_CHECKING:
    import xarray as xr


def load(key: str, store: Path | str | None = None) -> Any:
    """The system's own object of a key's current version: decoder, stack, table, atlases, mesh …

    ``key`` is ``system/asset/partition``; ``store`` the store's folder, by default the one that the
    command line uses. An asset whose dataset is what one works with gives the dataset. Raises
    ValueError for a key that names no asset, NoVersionError where nothing is stored.

    >>> basis = tsuya.load("ssdf_lighting/ssdf_basis/teapot")   # doctest: +SKIP
    """
    version = _current(key, store)
    datasets = importlib.import_module(f"assets_defs.{version.slot.system}.datasets")
    loader = datasets.LOADERS.get(version.slot.asset)
    return version.dataset if loader is None else loader(version)


def open(key: str, store: Path | str | None = None) -> xr.Dataset:
    """The dataset of a key's current version, lazy. Arguments and errors as `load`.

    >>> tsuya.open("photo_fur/fur_frames/teapot.grass")["frames"].shape   # doctest: +SKIP
    (4, 384, 384, 3)
    """
    return _current(key, store).dataset


def _current(key: str, store: Path | str | None) -> StoredVersion:
    slot = parse_key(key)
    found = Workspace.of_checkout().store if store is None else VersionedStore(store)
    return StoredVersion(found, slot, found.current(slot))
