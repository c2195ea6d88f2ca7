"""Bits that flip on disk: whether each is noticed, and what is stored afterwards."""

from __future__ import annotations

import random
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from assets_defs.launcher import Request
from assets_defs.systems import SYSTEMS
from storage import zarr_files
from storage.errors import StoreError
from storage.verification import verify_slot
from storage.versions import Slot, VersionedStore
from tsuya.session import Session

_FUR = SYSTEMS["photo_fur"]
_KEYS = {"photo": "grass", "mesh": "square"}
_SLOT = Slot("photo_fur", "fur_photo", "flipped")


def run_bit_flips(count: int, launched: int, session: Session, seed: int) -> dict[str, Any]:
    """Flip ``count`` bits of a slot's files, and ``launched`` of a graph that is launched again.

    A flip is noticed where reading is refused or gives what was written, and verifying names it;
    mended where what is current afterwards is whole and what it should be: the version itself, the
    last good one, or, having been launched again, the same content.
    """
    chance = random.Random(seed)
    flips = [_flip_of_slot(session.workspace.store, chance) for _ in range(count)]
    session.launcher.launch(Request(_FUR, [_KEYS], "test"))
    flips += [_flip_of_graph(session, chance) for _ in range(launched)]
    return {
        "bit_flips": len(flips),
        "flips_unnoticed": sum(not noticed for noticed, _ in flips),
        "flips_unmended": sum(not mended for _, mended in flips),
        "flips_launched_again": launched,
    }


def _flip_of_slot(store: VersionedStore, chance: random.Random) -> tuple[bool, bool]:
    import xarray as xr

    folder = store.files(_SLOT).folder
    kept = folder.with_name("kept")
    if not kept.exists():
        for seed in (1, 2):
            field = np.random.default_rng(seed).normal(size=(64, 48))
            dataset = xr.Dataset({"field": (("y", "x"), field)}, coords={"y": np.arange(64)})
            record = {"settings": {"seed": seed}, "recipe": str(seed), "checks": ["sharp"]}
            version = store.write(_SLOT, dataset, record).version
            store.pass_version(_SLOT, version, "sharp", 0.5)
        shutil.copytree(folder, kept)
    good = {version: store.open(_SLOT, version).load() for version in store.versions(_SLOT)}
    earlier, current = sorted(good)
    path = _flip_one(folder, chance)
    read_right = True
    for version, dataset in good.items():
        try:
            read_right &= store.open(_SLOT, version).load().identical(dataset)
        except StoreError:
            continue
    found = list(verify_slot(store, _SLOT))
    expected = earlier if current in path.relative_to(folder).parts[:2] else current
    mended = store.pointer(_SLOT).version == expected and not list(verify_slot(store, _SLOT))
    shutil.rmtree(folder)
    shutil.copytree(kept, folder)
    return read_right and len(found) == 1, mended


def _flip_of_graph(session: Session, chance: random.Random) -> tuple[bool, bool]:
    """One bit of a current version; whoever launches next, forced or not, mends it."""
    store = session.workspace.store
    slots = [
        _FUR.slot(plan.name, {name: _KEYS[name] for name in plan.by})
        for plan in _FUR.plans.values()
    ]
    before = {slot: store.record(slot)["content"] for slot in slots}
    slot = chance.choice(slots)
    version = store.current(slot)
    _flip_one(store.folder(slot, version), chance)
    if chance.random() < 0.5:
        noticed = bool(list(verify_slot(store, slot)))
        session.launcher.launch(Request(_FUR, [_KEYS]))
    else:
        session.launcher.launch(Request(_FUR, [_KEYS], force=True))
        noticed = store.current(slot) != version
    after = {slot: store.record(slot)["content"] for slot in slots}
    for each in slots:
        zarr_files.verify(store.folder(each))
    return noticed, after == before


def _flip_one(folder: Path, chance: random.Random) -> Path:
    """Flip one bit of one file; each file is as likely as the others, however small."""
    files = sorted(path for path in folder.rglob("*") if path.is_file() and path.stat().st_size)
    path = chance.choice(files)
    data = bytearray(path.read_bytes())
    data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    path.write_bytes(data)
    return path
