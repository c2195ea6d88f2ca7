"""The files of one slot: how they are named, read, and replaced in one moment.

What lies here and is not the store's (``Thumbs.db``, a foreign folder) is not looked at. A pointer
that is damaged or lost is made again of the versions and their verdicts.
"""

from __future__ import annotations

import fcntl
import os
import re
import uuid
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from storage import sealed_json, zarr_files
from storage.errors import DamagedError

Verdicts = dict[str, dict[str, Any]]
"""What each check said of a version: ``{check: {"passed": …, "figure": …}}``."""

_VERSION = re.compile(r"\d{8}T\d{12}-[0-9a-f]{8}")


@dataclass(frozen=True)
class Pointer:
    """What ``current.json`` says."""

    version: str | None = None
    """The current version; it has passed all its blocking checks."""
    recipe: str | None = None
    """Hash of code, settings and inputs that last produced this version's content."""
    earlier: tuple[str, ...] = ()
    """Good versions before the current one, newest first."""
    candidates: tuple[str, ...] = ()
    """Versions that wait for their checks, oldest first."""
    settings: Mapping[str, Any] | None = field(default=None, compare=False)
    """Of the current version; where it was found damaged and none is left, what it had."""


@dataclass(frozen=True)
class SlotFiles:
    """One slot's folder."""

    folder: Path

    @property
    def staging(self) -> Path:
        """Where versions and small files are written before they are renamed."""
        return self.folder / "staging"

    def versions(self) -> list[str]:
        """All complete versions, oldest first."""
        folder = self.folder / "versions"
        if not folder.is_dir():
            return []
        return sorted(p.name for p in folder.iterdir() if _VERSION.fullmatch(p.name) and p.is_dir())

    def version_folder(self, version: str) -> Path:
        """Where a version lies."""
        return self.folder / "versions" / version

    def record(self, version: str) -> dict[str, Any]:
        """A version's record. Raises DamagedError."""
        return zarr_files.read_record(self.version_folder(version))

    # ---- the pointer -------------------------------------------------------------------------

    def pointer(self) -> Pointer:
        """The pointer; where it is damaged or lost, what it must have said."""
        try:
            return self.stored_pointer()
        except DamagedError:
            return self.rebuilt_pointer()

    def stored_pointer(self) -> Pointer:
        """What ``current.json`` says; an empty pointer where nothing was ever published.

        Raises DamagedError where it cannot be read, or is lost while there are verdicts.
        """
        path = self.folder / "current.json"
        try:
            fields = sealed_json.loads(path.read_bytes())
            fields.pop(sealed_json.SEAL, None)
            earlier, candidates = tuple(fields.pop("earlier")), tuple(fields.pop("candidates"))
            return Pointer(**fields, earlier=earlier, candidates=candidates)
        except FileNotFoundError as error:
            if not any((self.folder / "verdicts").glob("*.json")):
                return Pointer()
            raise DamagedError(self.folder, "current.json, the pointer, is lost") from error
        except (OSError, ValueError, KeyError, TypeError) as error:
            what = f"current.json, the pointer, cannot be read ({error})"
            raise DamagedError(self.folder, what) from error

    def rebuilt_pointer(self) -> Pointer:
        """The pointer that versions and verdicts demand: the newest good version is current."""
        good: list[str] = []
        waiting: list[str] = []
        recipe = settings = None
        for version in self.versions():
            try:
                record, verdicts = self.record(version), self.verdicts(version)
            except DamagedError:
                continue
            if not all(verdict["passed"] for verdict in verdicts.values()):
                continue
            if all(check in verdicts for check in record["checks"]):
                good.append(version)
                recipe, settings = record["recipe"], record["settings"]
            else:
                waiting.append(version)
        newest = good[-1] if good else None
        return Pointer(newest, recipe, tuple(reversed(good[:-1])), tuple(waiting), settings)

    @contextmanager
    def locked(self) -> Iterator[Pointer]:
        """Hold the slot's lock (the kernel frees it when a process dies)."""
        try:
            self.staging.mkdir(parents=True, exist_ok=True)
            lock = (self.folder / "lock").open("w")
        except OSError as error:
            raise zarr_files.disk_error(error, self.folder) from error
        with lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield self.pointer()

    def point(self, pointer: Pointer) -> None:
        """Replace the pointer."""
        self._replace("current.json", asdict(pointer))

    # ---- verdicts ----------------------------------------------------------------------------

    def verdicts(self, version: str) -> Verdicts:
        """What the checks said of a version. Raises DamagedError."""
        path = self.folder / "verdicts" / f"{version}.json"
        try:
            fields = sealed_json.loads(path.read_bytes())
            # Verdicts from before there were seals stand by themselves.
            found = fields["checks"] if sealed_json.SEAL in fields else fields
            if not all(isinstance(verdict["passed"], bool) for verdict in found.values()):
                raise ValueError("a verdict is neither for nor against")
        except FileNotFoundError:
            return {}
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            what = f"verdicts/{version}.json cannot be read ({error})"
            raise DamagedError(self.folder, what) from error
        return dict(found)

    def note(self, version: str, check: str, **verdict: Any) -> None:
        """Add what a check said to a version's verdicts; damaged ones start anew."""
        try:
            before = self.verdicts(version)
        except DamagedError:
            before = {}
        self._replace(f"verdicts/{version}.json", {"checks": {**before, check: verdict}})

    def forget(self, version: str) -> None:
        """Put a version's verdicts away."""
        (self.folder / "verdicts" / f"{version}.json").unlink(missing_ok=True)

    # ---- files -------------------------------------------------------------------------------

    def damage(self) -> list[str]:
        """What is wrong with the small files, a sentence each; the arrays are not looked at."""
        reads: list[Callable[[], object]] = [self.stored_pointer]
        for version in self.versions():
            reads += [partial(self.verdicts, version), partial(self.record, version)]
        found = []
        for read in reads:
            try:
                read()
            except DamagedError as error:
                found.append(error.what)
        return found

    def _replace(self, name: str, fields: Mapping[str, Any]) -> None:
        """Write aside, fsync, rename over: a reader sees the old file or the new one."""
        path = self.folder / name
        aside = f"{name.replace('/', '-')}.{uuid.uuid4().hex[:8]}"
        beside = self.staging / aside
        try:
            path.parent.mkdir(exist_ok=True)
            with beside.open("wb") as file:
                sealed_json.dump({**fields, sealed_json.SEAL: sealed_json.BLANK}, file)
                file.flush()
                os.fsync(file.fileno())
            os.replace(beside, path)
            zarr_files.sync_folder(path.parent)
        except OSError as error:
            beside.unlink(missing_ok=True)
            raise zarr_files.disk_error(error, path) from error


def is_slot(folder: Path) -> bool:
    """Whether a folder is a slot that holds something."""
    return (folder / "current.json").exists() or (folder / "versions").is_dir()
