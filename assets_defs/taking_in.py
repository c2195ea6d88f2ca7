"""What is given to the command line is copied into the inbox and registered."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from assets_defs.sources import Source, entry_of, is_passed_over
from assets_defs.system import Dimension, System
from assets_defs.workspace import Workspace

if TYPE_CHECKING:
    import dagster as dg

_LEFT_BEHIND_SECONDS = 24 * 3600.0
"""A copy that has not been finished for so long belongs to a process that was killed."""


def take_in(
    path: Path,
    system: System,
    dimension: Dimension,
    given: Mapping[str, Any],
    workspace: Workspace,
    instance: dg.DagsterInstance,
) -> str:
    """Read a file or folder, copy it into the inbox and register it; returns its key.

    ``given`` are the settings that it is to be used with (a crop, say). Links are followed: the
    copy has none. A file that refers to others is copied with them, into a folder of its own that
    has the file's name. What lies in the inbox already under this name is not copied again; where
    the name is taken by other content, the copy gets digits of its hash. Raises ValueError for
    what cannot be used, or copied; then nothing is.
    """
    # Not of the last part: a link is known by its own name.
    last = path.name not in ("", "..")
    path = path.parent.resolve() / path.name if last else path.resolve()
    _check_name(path, dimension)
    inbox = workspace.inbox(system.name)
    try:
        source = _source(path)
        contents = source.contents()
        dimension.check(source, given)
        fingerprint = source.fingerprint
        known = system.sources(dimension.name, inbox)
        key = _taken_in_before(path, fingerprint, known)
        if key is None:
            taken = {other.name for other in known.values()}
            name = next(name for name in _names(path, fingerprint) if _is_free(name, inbox, taken))
            _copy(contents, inbox / name, is_folder=path.is_dir())
            sources = system.sources(dimension.name, inbox).values()
            key = next(s.key for s in sources if s.path and entry_of(s.path, inbox).name == name)
    except OSError as error:
        raise ValueError(
            f"{path.name}: cannot be copied to {inbox} ({error.strerror}); expected files that can "
            "be read, and room for them there."
        ) from error
    instance.add_dynamic_partitions(system.partitions_name(dimension.name), [key])
    return key


def _source(path: Path) -> Source:
    """What is given; a link to a file whose companions are beside what it leads to, as that."""
    source, real = Source.of(path), Source.of(path.resolve())
    return real if len(real.contents()) > len(source.contents()) else source


def _check_name(path: Path, dimension: Dimension) -> None:
    """Raise ValueError for what no item of the dimension can be called."""
    if not (dimension.folders if path.is_dir() else path.suffix.lower() in dimension.suffixes):
        found = "it is a folder" if path.is_dir() else f"ending is {path.suffix!r}"
        folder = ["a folder"] if dimension.folders else []
        expected = ", ".join([*dimension.suffixes, *folder])
        raise ValueError(f"{path.name}: {found}; expected one of {expected}.")
    if is_passed_over(path.name):
        raise ValueError(
            f"{path.name}: is named like something hidden or unfinished; expected a name without "
            "a dot or ~ in front, or .part, .tmp and the like behind. Rename it."
        )


def _taken_in_before(path: Path, fingerprint: str, known: Mapping[str, Source]) -> str | None:
    """The key of what lies in the inbox under one of the names and has the same content."""
    names = tuple(_names(path, fingerprint))
    for key, source in known.items():
        if source.path is not None and source.name in names:
            try:
                if source.fingerprint == fingerprint:
                    return key
            except (ValueError, OSError):
                continue  # What is broken there is not the same.
    return None


def _names(path: Path, fingerprint: str) -> Sequence[str]:
    """The names that a copy may have, the first free one is taken."""
    stem, ending = (path.name, "") if path.is_dir() else (path.stem, path.suffix)
    # Cut, because a name of 255 bytes must not become longer.
    return [path.name, *(f"{stem[:48]}-{fingerprint[:n]}{ending}" for n in (8, 16, 32, 64))]


def _is_free(name: str, inbox: Path, taken: set[str]) -> bool:
    # In folders of the user's there may be files of the name, which have the key.
    return name not in taken and not os.path.lexists(inbox / name)


def _copy(contents: Sequence[tuple[str, Path]], target: Path, *, is_folder: bool) -> None:
    """Copy files aside, then move them to their place in one moment.

    Times are not copied: what was copied just now is seen to have been.
    """
    file = contents[0][1].name if contents else ""
    places = [inside for inside, _ in contents]
    if len(set(places)) < len(places) or (not is_folder and target.name in places):
        twice = next(p for p in places if places.count(p) > 1 or p == target.name)
        raise ValueError(
            f"{file}: refers to two files named {twice}; expected different names, as files from "
            "other folders are copied beside it."
        )
    target.parent.mkdir(parents=True, exist_ok=True)
    _sweep(target.parent)
    aside = Path(tempfile.mkdtemp(prefix=".", suffix=".part", dir=target.parent))
    try:
        copy = aside / target.name
        for inside, original in contents:
            alone = not is_folder and len(contents) == 1
            place = copy if alone else copy / (inside or target.name)
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(original, place)
        try:
            os.rename(copy, target)
        except OSError:
            if not target.is_dir():  # else another process was faster
                raise
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _sweep(inbox: Path) -> None:
    """Delete what killed processes left behind."""
    for left in inbox.glob(".*.part"):
        if time.time() - left.lstat().st_mtime > _LEFT_BEHIND_SECONDS:
            if left.is_dir() and not left.is_symlink():
                shutil.rmtree(left, ignore_errors=True)
            else:
                left.unlink(missing_ok=True)
