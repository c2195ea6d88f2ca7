"""The versioned store: a version is written once, checked, and only then made current.

    <root>/<system>/<asset>/<partition>/
        current.json           the pointer, replaced atomically
        versions/<version>/    Zarr v3 groups, never changed once they are here
        verdicts/<version>.json  what the checks said of a version, with their figures
        staging/               versions being written; a killed writer leaves its piece here
        work/                  state of long work, to go on from after a kill
        lock                   held for the milliseconds in which the pointer is replaced

A new version is a *candidate* until every blocking check of its asset has passed it; then it is
promoted. So what is current has passed, whenever a process is killed. A version that fails is
rejected: it stays for inspection, and if it was current the last good one takes its place.
Readers resolve the pointer once and then read a folder that does not change.
"""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import time
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

from storage import zarr_files
from storage.errors import NoVersionError, StoreError
from storage.work_state import WorkState

if TYPE_CHECKING:
    import xarray as xr

KEEP_VERSIONS = 5
LEAST_AGE_SECONDS = 24 * 3600.0
_STAMP = "%Y%m%dT%H%M%S%f"
WHOLE = "whole"
"""Folder of an asset that has no partitions."""


@dataclass(frozen=True)
class Slot:
    """Where the versions of one asset's partition live."""

    system: str
    asset: str
    partition: str = WHOLE

    def __str__(self) -> str:
        return f"{self.system}/{self.asset}/{self.partition}"


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


@dataclass(frozen=True)
class Written:
    """What became of a dataset handed to the store."""

    version: str
    content: str
    is_new: bool
    """False where content and settings equal the current version's: nothing was added."""


class VersionedStore:
    """Versions of all assets below one local root folder."""

    def __init__(
        self,
        root: Path | str,
        *,
        keep: int = KEEP_VERSIONS,
        least_age_seconds: float = LEAST_AGE_SECONDS,
    ) -> None:
        self.root = Path(root)
        self.keep = keep
        self.least_age_seconds = least_age_seconds

    # ---- reading -----------------------------------------------------------------------------

    def pointer(self, slot: Slot) -> Pointer:
        """The slot's pointer; an empty one where nothing was ever published."""
        path = self._folder(slot) / "current.json"
        try:
            fields = json.loads(path.read_text())
        except FileNotFoundError:
            return Pointer()
        except ValueError as error:
            raise StoreError(f"{path}: is not JSON ({error}); expected a pointer.") from error
        return Pointer(
            fields["version"],
            fields["recipe"],
            tuple(fields["earlier"]),
            tuple(fields["candidates"]),
        )

    def current(self, slot: Slot) -> str:
        """The current version. Raises NoVersionError where there is none."""
        pointer = self.pointer(slot)
        if pointer.version is None:
            waiting = f" ({len(pointer.candidates)} not checked)" if pointer.candidates else ""
            raise NoVersionError(
                f"{slot}: no version has passed its checks{waiting}; expected one. "
                f"Materialise {slot.system}/{slot.asset} first."
            )
        return pointer.version

    def version_under_check(self, slot: Slot, run: str) -> str:
        """The version that a check of this run is about: the run's own, else the current one.

        A run has none of its own where its content was equal to the current version's.
        """
        for version in reversed(self.versions(slot)):
            if self.record(slot, version).get("run") == run:
                return version
        pointer = self.pointer(slot)
        if pointer.version is None and pointer.candidates:
            return pointer.candidates[-1]
        return self.current(slot)

    def folder(self, slot: Slot, version: str | None = None) -> Path:
        """Folder of a version (of the current one by default): a plain Zarr v3 group."""
        found = version or self.current(slot)
        path = self._folder(slot) / "versions" / found
        if not path.is_dir():
            raise NoVersionError(f"{path}: no such version; expected one of {self.versions(slot)}.")
        return path

    def open(self, slot: Slot, version: str | None = None) -> xr.Dataset:
        """A version (the current one by default) as a lazy dataset.

        Reading an absent chunk raises MissingChunkError.
        """
        return zarr_files.open_dataset(self.folder(slot, version))

    def record(self, slot: Slot, version: str | None = None) -> dict[str, Any]:
        """Settings, inputs, hashes and times of a version (of the current one by default)."""
        return zarr_files.read_record(self.folder(slot, version))

    def versions(self, slot: Slot) -> list[str]:
        """All complete versions, oldest first: good, waiting and rejected ones."""
        folder = self._folder(slot) / "versions"
        return sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []

    def slots(self) -> Iterator[Slot]:
        """Every slot that holds something, in the order of names."""
        for path in sorted(self.root.glob("*/*/*/current.json")):
            yield Slot(*path.parent.relative_to(self.root).parts)

    # ---- writing -----------------------------------------------------------------------------

    def write(self, slot: Slot, dataset: xr.Dataset, record: Mapping[str, Any]) -> Written:
        """Write a dataset as a new version, a candidate until its checks have passed.

        ``record`` must hold ``settings``, ``recipe`` and ``checks``, the names of the blocking
        checks; with none of them the version becomes current at once. Content that equals the
        current version's under equal settings adds no version. Raises StoreFullError, StoreError;
        then nothing that was stored has changed.
        """
        version = self._new_name(slot)
        staged = self._folder(slot) / "staging" / version
        try:
            named = {"version": version, "partition": slot.partition}
            zarr_files.write_dataset(dataset, staged, {**record, **named})
            zarr_files.verify_complete(staged)
            content = zarr_files.content_hash(staged)
            zarr_files.add_to_record(
                staged,
                content=content,
                created=datetime.now(UTC).isoformat(timespec="seconds"),
                array_bytes=int(dataset.nbytes),
            )
            zarr_files.sync(staged)
            written = self._publish(slot, staged, Written(version, content, True))
            shutil.rmtree(self._folder(slot) / "work", ignore_errors=True)
        except OSError as error:
            raise zarr_files.disk_error(error, staged) from error
        finally:
            shutil.rmtree(staged, ignore_errors=True)
        self.collect(slot)
        return written

    def _publish(self, slot: Slot, staged: Path, written: Written) -> Written:
        record = zarr_files.read_record(staged)  # As JSON: a tuple among settings is a list now.
        with self._locked(slot) as pointer:
            if pointer.version is not None and self._is_equal(slot, pointer.version, record):
                self._point(slot, replace(pointer, recipe=record["recipe"]))
                return Written(pointer.version, written.content, False)
            versions = self._folder(slot) / "versions"
            versions.mkdir(exist_ok=True)
            os.rename(staged, versions / written.version)
            try:
                zarr_files.sync_folder(versions)
                waiting = replace(pointer, candidates=(*pointer.candidates, written.version))
                self._point(slot, self._promoted(slot, waiting, written.version))
            except (OSError, StoreError):
                # A full disk: what the pointer does not name must not fill it further.
                if self.pointer(slot) == pointer:
                    shutil.rmtree(versions / written.version, ignore_errors=True)
                raise
        return written

    def _is_equal(self, slot: Slot, version: str, record: Mapping[str, Any]) -> bool:
        """Whether a version is complete and has the same content under the same settings."""
        try:
            now = self.record(slot, version)
            zarr_files.verify_complete(self.folder(slot, version))
        except StoreError:
            return False  # Damaged by hand: what is written now takes its place.
        return all(now[name] == record[name] for name in ("content", "settings"))

    def work(self, slot: Slot, recipe: str) -> WorkState:
        """Where work on a version of this recipe keeps its state until the version is written."""
        return WorkState(self._folder(slot) / "work", recipe[:16])

    # ---- verdicts ----------------------------------------------------------------------------

    def verdicts(self, slot: Slot, version: str) -> dict[str, dict[str, Any]]:
        """What each check said of a version: ``{check: {"passed": …, "figure": …}}``."""
        path = self._folder(slot) / "verdicts" / f"{version}.json"
        return dict(json.loads(path.read_text())) if path.exists() else {}

    def pass_version(self, slot: Slot, version: str, check: str, figure: float | None) -> None:
        """Note that a check passed; the last one that was waited for makes the version current."""
        with self._locked(slot) as pointer:
            self._note(slot, version, check, passed=True, figure=figure)
            promoted = self._promoted(slot, pointer, version)
            if promoted != pointer:
                self._point(slot, promoted)

    def reject(self, slot: Slot, version: str, check: str, reason: str) -> str | None:
        """Note that a check failed; the last good version is current again.

        Compare-and-swap: only a pointer that names the rejected version changes. Returns the
        version that is current now.
        """
        with self._locked(slot) as pointer:
            self._note(slot, version, check, passed=False, figure=None, reason=reason)
            candidates = tuple(name for name in pointer.candidates if name != version)
            earlier = tuple(name for name in pointer.earlier if name != version)
            changed = replace(pointer, candidates=candidates, earlier=earlier)
            if pointer.version == version:
                changed = self._step_back(slot, changed)
            self._point(slot, changed)
            return changed.version

    def rollback(self, slot: Slot) -> str:
        """Make the good version before the current one current again.

        Raises NoVersionError where there is none.
        """
        with self._locked(slot) as pointer:
            changed = self._step_back(slot, pointer)
            if changed.version is None:
                raise NoVersionError(
                    f"{slot}: no earlier good version; expected one to go back to."
                )
            self._point(slot, changed)
            return changed.version

    def _step_back(self, slot: Slot, pointer: Pointer) -> Pointer:
        if not pointer.earlier:
            return replace(pointer, version=None, recipe=None)
        version, *earlier = pointer.earlier
        recipe = self.record(slot, version)["recipe"]
        return replace(pointer, version=version, recipe=recipe, earlier=tuple(earlier))

    def _promoted(self, slot: Slot, pointer: Pointer, version: str) -> Pointer:
        """The pointer once a candidate has passed all its checks; else the same pointer.

        A version older than the current one joins the earlier good ones.
        """
        if version not in pointer.candidates:
            return pointer
        record = self.record(slot, version)
        verdicts = self.verdicts(slot, version)
        if not all(verdicts.get(check, {}).get("passed") for check in record["checks"]):
            return pointer
        candidates = tuple(name for name in pointer.candidates if name != version)
        if pointer.version is not None and version < pointer.version:
            older = tuple(sorted((version, *pointer.earlier), reverse=True))[: self.keep - 1]
            return replace(pointer, earlier=older, candidates=candidates)
        before = () if pointer.version is None else (pointer.version,)
        earlier = (*before, *pointer.earlier)[: self.keep - 1]
        return Pointer(version, record["recipe"], earlier, candidates)

    # ---- collection --------------------------------------------------------------------------

    def collect(self, slot: Slot) -> list[str]:
        """Delete what nobody needs: returns the names.

        The current version, the good ones that the pointer names and the ``keep`` newest stay;
        nothing younger than ``least_age_seconds`` goes, so a reader or a writer that is still at
        work keeps its folder.
        """
        folder = self._folder(slot)
        with self._locked(slot) as pointer:
            named = {pointer.version, *pointer.earlier}
            kept = named.union(self.versions(slot)[-self.keep :])
            old = [
                name
                for name in self.versions(slot)
                if name not in kept and self._is_old(folder / "versions" / name / "zarr.json")
            ]
            # The pointer first: it must not name a folder that is gone.
            candidates = tuple(name for name in pointer.candidates if name not in old)
            if candidates != pointer.candidates:
                self._point(slot, replace(pointer, candidates=candidates))
            moved = [folder / "staging" / f"collected-{name}" for name in old]
            for name, path in zip(old, moved, strict=True):
                os.rename(folder / "versions" / name, path)
        staging = (folder / "staging").iterdir()
        left = [path for path in staging if path not in moved and self._is_old(path)]
        for path in (*moved, *left):
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)
        return [*old, *(path.name for path in left)]

    def _is_old(self, path: Path) -> bool:
        """Whether a path and all in it were last changed ``least_age_seconds`` ago or before."""
        youngest = time.time() - self.least_age_seconds
        try:
            # A folder's own time says little: a writer may still be filling it, deep inside.
            return path.stat().st_mtime <= youngest and all(
                inside.stat().st_mtime <= youngest for inside in path.rglob("*")
            )
        except FileNotFoundError:
            return False

    # ---- files -------------------------------------------------------------------------------

    def _new_name(self, slot: Slot) -> str:
        """A name that sorts behind all others, even when the clock was set back."""
        now = datetime.now(UTC).replace(tzinfo=None)
        for newest in self.versions(slot)[-1:]:
            before = datetime.strptime(newest.partition("-")[0], _STAMP)
            now = max(now, before + timedelta(microseconds=1))
        return f"{now:{_STAMP}}-{uuid.uuid4().hex[:8]}"

    def _folder(self, slot: Slot) -> Path:
        return self.root / slot.system / slot.asset / slot.partition

    @contextmanager
    def _locked(self, slot: Slot) -> Iterator[Pointer]:
        """Hold the slot's lock (the kernel frees it when a process dies)."""
        folder = self._folder(slot)
        (folder / "staging").mkdir(parents=True, exist_ok=True)
        with (folder / "lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield self.pointer(slot)

    def _point(self, slot: Slot, pointer: Pointer) -> None:
        self._replace(slot, "current.json", asdict(pointer))

    def _note(self, slot: Slot, version: str, check: str, **verdict: Any) -> None:
        fields = {**self.verdicts(slot, version), check: verdict}
        self._replace(slot, f"verdicts/{version}.json", fields)

    def _replace(self, slot: Slot, name: str, fields: Mapping[str, Any]) -> None:
        """Write aside, fsync, rename over: a reader sees the old file or the new one."""
        path = self._folder(slot) / name
        aside = f"{name.replace('/', '-')}.{uuid.uuid4().hex[:8]}"
        beside = self._folder(slot) / "staging" / aside
        try:
            path.parent.mkdir(exist_ok=True)
            with beside.open("w") as file:
                json.dump(fields, file, indent=2)
                file.flush()
                os.fsync(file.fileno())
            os.replace(beside, path)
            zarr_files.sync_folder(path.parent)
        except OSError as error:
            beside.unlink(missing_ok=True)
            raise zarr_files.disk_error(error, path) from error
