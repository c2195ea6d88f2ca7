"""``tsuya remove SYSTEM/ITEM``: an item of the inbox, with everything that was made of it.

What may be killed at any time goes in this order: the file first, in one moment, so that nothing
is made of it anew; then what is stored, slot by slot, each in one moment; the partition last. What
a killed command leaves is still known by its versions or its partition, and the same command goes
on with it; a partition without either is deleted by the inbox, too.
"""

from __future__ import annotations

import os
import shutil
import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from assets_defs.sources import entry_of
from assets_defs.system import System
from assets_defs.systems import SYSTEMS
from assets_defs.workspace import Workspace
from storage.versions import Slot, VersionedStore
from tsuya.console import shown_path

if TYPE_CHECKING:
    import dagster as dg

_REMOVED = ".removed-"
"""Begins the names of what is out of the store and not deleted yet."""


@dataclass(frozen=True)
class Removal:
    """What goes with an item."""

    system: System
    dimension: str
    key: str
    file: Path | None
    """What lies in the inbox; None for a built-in item, and where it is gone."""
    slots: Sequence[Slot]
    has_partition: bool
    """Whether there is a partition that goes: built-in ones stay."""


def remove(key: str, *, ask: bool) -> None:
    """Say what goes, ask, remove it. Raises ValueError for a key that names nothing."""
    from tsuya.history import open_history

    workspace = Workspace.of_checkout()
    with open_history() as instance:
        removal = find(key, workspace, instance)
        for line in _listing(removal, workspace.store):
            click.echo(line)
        if ask and not click.confirm("Remove this?"):
            click.echo("Nothing was removed.")
            return
        carry_out(removal, workspace, instance)
    click.echo(f"{key} was removed.")


def find(key: str, workspace: Workspace, instance: dg.DagsterInstance) -> Removal:
    """What belongs to ``SYSTEM/ITEM``. Raises ValueError where that is nothing."""
    name, _, item = key.strip("/").partition("/")
    if name not in SYSTEMS or not item or "/" in item:
        raise ValueError(f"key is {key!r}; expected SYSTEM/ITEM with one of {', '.join(SYSTEMS)}.")
    system = SYSTEMS[name]
    inbox = workspace.inbox(name)
    known: list[str] = []
    for dimension in system.dimensions:
        sources = system.sources(dimension.name, inbox)
        registered = instance.get_dynamic_partitions(system.partitions_name(dimension.name))
        slots = [
            slot
            for slot in _stored(system, workspace.store)
            if system.is_made_of(slot, dimension.name, item)
        ]
        path = sources[item].path if item in sources else None
        has_partition = item in registered and item not in dimension.builtin
        if path is not None or slots or has_partition:
            file = None if path is None else entry_of(path, inbox)
            return Removal(system, dimension.name, item, file, slots, has_partition)
        if dimension.needs_no_file(item):
            raise ValueError(f"{key}: is built in, and nothing of it is stored; expected versions.")
        known += [other for other in {*sources, *registered} if other not in dimension.builtin]
    expected = f"one of {', '.join(sorted(known))}" if known else "one, but there is none"
    raise ValueError(f"{key}: no such item of yours; expected {expected}.")


def carry_out(removal: Removal, workspace: Workspace, instance: dg.DagsterInstance) -> None:
    """Remove it. Raises ValueError where the disk does not let it be removed, StoreError."""
    system, store = removal.system, workspace.store
    away = [*store.root.glob(f"{system.name}/*/{_REMOVED}*")]  # of commands that were killed
    try:
        if removal.file is not None:
            # Named like an unfinished copy: the inbox sweeps those.
            away.append(removal.file.with_name(f".{uuid.uuid4().hex}.part"))
            os.rename(removal.file, away[-1])
        for slot in removal.slots:
            folder = store.files(slot).folder
            with store.files(slot).locked():
                away.append(folder.with_name(f"{_REMOVED}{uuid.uuid4().hex}"))
                os.rename(folder, away[-1])
        if removal.has_partition:
            partitions = system.partitions_name(removal.dimension)
            instance.delete_dynamic_partition(partitions, removal.key)
    except OSError as error:
        raise ValueError(
            f"{error.filename}: cannot be removed ({error.strerror}); expected to be allowed to. "
            "Run again afterwards: what is left is still known."
        ) from error
    for path in away:
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


def _stored(system: System, store: VersionedStore) -> list[Slot]:
    """All slots of a system, those too that hold only what a killed process left."""
    folders = (path for path in sorted(store.root.glob(f"{system.name}/*/*")) if path.is_dir())
    return [Slot(system.name, path.parent.name, path.name) for path in folders]


def _listing(removal: Removal, store: VersionedStore) -> list[str]:
    """What goes, a line each; what stays of a built-in item."""
    builtin = removal.system.dimension(removal.dimension).builtin
    lines = [f"{removal.system.name}/{removal.key}:"]
    if removal.file is not None:
        what = " and all in it" if removal.file.is_dir() and not removal.file.is_symlink() else ""
        lines.append(f"  {shown_path(removal.file)}{what}")
    for slot in removal.slots:
        folder = store.files(slot).folder
        size = sum(path.lstat().st_size for path in folder.rglob("*") if path.is_file())
        count = len(store.versions(slot))
        lines.append(f"  {slot}: {count} version{'' if count == 1 else 's'}, {size / 1e6:.1f} MB")
    if removal.has_partition:
        lines.append(f"  the partition {removal.key} of {removal.dimension}")
    if removal.key in builtin:
        lines.append(f"  {removal.key} itself is built in and stays.")
    return lines
