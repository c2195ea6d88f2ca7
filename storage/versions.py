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
Readers resolve the pointer once and then read a folder that does not change. A version that is
found damaged is taken out of use like a rejected one: it has not the verdict of the check `stored`.
"""

from __future__ import annotations

import os
import shutil
import time
import uuid
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

from storage import zarr_files
from storage.errors import DamagedError, NoVersionError, StoreError
from storage.slot_files import Pointer, SlotFiles, Verdicts, is_slot
from storage.work_state import WorkState, clear_work

if TYPE_CHECKING:
    import xarray as xr

KEEP_VERSIONS = 5
LEAST_AGE_SECONDS = 24 * 3600.0
_STAMP = "%Y%m%dT%H%M%S%f"
KEEP_VERDICTS = 200
STORED = "stored"
"""Name of the verdict against a version whose bytes are not those that were written."""
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

    def files(self, slot: Slot) -> SlotFiles:
        """The slot's folder."""
        return SlotFiles(self.root / slot.system / slot.asset / slot.partition)

    def pointer(self, slot: Slot) -> Pointer:
        """The slot's pointer; an empty one where nothing was ever published.

        Where it is damaged: what it must have said.
        """
        return self.files(slot).pointer()

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
            try:
                if self.record(slot, version).get("run") == run:
                    return version
            except DamagedError:
                continue
        pointer = self.pointer(slot)
        if pointer.version is None and pointer.candidates:
            return pointer.candidates[-1]
        return self.current(slot)

    def folder(self, slot: Slot, version: str | None = None) -> Path:
        """Folder of a version (of the current one by default): a plain Zarr v3 group."""
        found = version or self.current(slot)
        path = self.files(slot).version_folder(found)
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
        return self.files(slot).versions()

    def slots(self) -> Iterator[Slot]:
        """Every slot that holds something, in the order of names."""
        for folder in sorted(self.root.glob("*/*/*")):
            parts = folder.relative_to(self.root).parts
            if not any(part.startswith(".") for part in parts) and is_slot(folder):
                yield Slot(*parts)

    # ---- writing -----------------------------------------------------------------------------

    def write(self, slot: Slot, dataset: xr.Dataset, record: Mapping[str, Any]) -> Written:
        """Write a dataset as a new version, a candidate until its checks have passed.

        ``record`` must hold ``settings``, ``recipe`` and ``checks``, the names of the blocking
        checks; with none of them the version becomes current at once. Content that equals the
        current version's under equal settings, from the same assets, adds no version. Raises
        StoreFullError, StoreError; then nothing that was stored has changed.
        """
        version = self._new_name(slot)
        files = self.files(slot)
        staged = files.staging / version
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
            clear_work(files.folder / "work")
        except OSError as error:
            raise zarr_files.disk_error(error, staged) from error
        finally:
            shutil.rmtree(staged, ignore_errors=True)
        self.collect(slot)
        return written

    def _publish(self, slot: Slot, staged: Path, written: Written) -> Written:
        record = zarr_files.read_record(staged)  # As JSON: a tuple among settings is a list now.
        files = self.files(slot)
        with files.locked() as pointer:
            if pointer.version is not None and self._is_equal(slot, pointer.version, record):
                files.point(replace(pointer, recipe=record["recipe"]))
                return Written(pointer.version, written.content, False)
            published = files.version_folder(written.version)
            published.parent.mkdir(exist_ok=True)
            os.rename(staged, published)
            try:
                zarr_files.sync_folder(published.parent)
                waiting = replace(pointer, candidates=(*pointer.candidates, written.version))
                files.point(self._promoted(slot, waiting, written.version))
            except (OSError, StoreError):
                # A full disk: what the pointer does not name must not fill it further.
                if files.pointer() == pointer:
                    shutil.rmtree(published, ignore_errors=True)
                raise
        return written

    def _is_equal(self, slot: Slot, version: str, record: Mapping[str, Any]) -> bool:
        """Whether a version is undamaged and has the same content under the same settings, made
        from the same assets: checks read these by name, which newer code may ask for."""
        try:
            now = self.record(slot, version)
            if any(now[name] != record[name] for name in ("content", "settings")):
                return False
            if _assets_of(now) != _assets_of(record):
                return False
            zarr_files.verify(self.folder(slot, version))
        except StoreError:
            return False  # What is written now takes its place.
        return True

    def work(self, slot: Slot, recipe: str) -> WorkState:
        """Where work on a version of this recipe keeps its state until the version is written."""
        return WorkState(self.files(slot).folder / "work", recipe[:16])

    # ---- verdicts ----------------------------------------------------------------------------

    def verdicts(self, slot: Slot, version: str) -> Verdicts:
        """What each check said of a version; nothing where that is damaged."""
        try:
            return self.files(slot).verdicts(version)
        except DamagedError:
            return {}

    def is_in_use(self, slot: Slot, version: str) -> bool:
        """Whether a version has not been found damaged."""
        return bool(self.verdicts(slot, version).get(STORED, {}).get("passed", True))

    def pass_version(self, slot: Slot, version: str, check: str, figure: float | None) -> None:
        """Note that a check passed; the last one that was waited for makes the version current."""
        files = self.files(slot)
        with files.locked() as pointer:
            files.note(version, check, passed=True, figure=figure)
            promoted = self._promoted(slot, pointer, version)
            if promoted != pointer:
                files.point(promoted)

    def reject(self, slot: Slot, version: str, check: str, reason: str) -> str | None:
        """Note that a check failed; the last good version is current again.

        Compare-and-swap: only a pointer that names the rejected version changes. Returns the
        version that is current now.
        """
        files = self.files(slot)
        with files.locked() as pointer:
            files.note(version, check, passed=False, figure=None, reason=reason)
            candidates = tuple(name for name in pointer.candidates if name != version)
            earlier = tuple(name for name in pointer.earlier if name != version)
            changed = replace(pointer, candidates=candidates, earlier=earlier)
            if pointer.version == version:
                changed = self._step_back(slot, changed)
                if changed.version is None and check != STORED:
                    changed = replace(changed, settings=None)  # They were rejected with it.
            files.point(changed)
            return changed.version

    def discard(self, damage: DamagedError) -> str | None:
        """Take a version that was found damaged out of use; the last good one is current again.

        Returns the version that is current now. Where a second look finds nothing wrong (another
        process has discarded it, a cable was loose) nothing changes.
        """
        parts = damage.folder.relative_to(self.root).parts
        slot, version = Slot(*parts[:3]), parts[-1]
        try:
            zarr_files.verify(damage.folder)
        except DamagedError as error:
            return self.reject(slot, version, STORED, error.what)
        return self.pointer(slot).version

    def rollback(self, slot: Slot) -> str:
        """Make the good version before the current one current again; a damaged one is passed over.

        Raises NoVersionError where there is none.
        """
        files = self.files(slot)
        with files.locked() as pointer:
            changed = self._step_back(slot, pointer)
            if changed.version is None:
                raise NoVersionError(
                    f"{slot}: no earlier good version; expected one to go back to."
                )
            files.point(changed)
            return changed.version

    def _step_back(self, slot: Slot, pointer: Pointer) -> Pointer:
        """The pointer to the newest earlier version that is undamaged, or to none."""
        for number, version in enumerate(pointer.earlier):
            try:
                zarr_files.verify(self.folder(slot, version))
            except StoreError as error:
                what = error.what if isinstance(error, DamagedError) else str(error)
                self.files(slot).note(version, STORED, passed=False, figure=None, reason=what)
                continue
            record, earlier = self.record(slot, version), pointer.earlier[number + 1 :]
            now = {"recipe": record["recipe"], "settings": record["settings"]}
            return replace(pointer, version=version, earlier=earlier, **now)
        return replace(pointer, version=None, recipe=None, earlier=())

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
        return Pointer(version, record["recipe"], earlier, candidates, record["settings"])

    # ---- collection --------------------------------------------------------------------------

    def collect(self, slot: Slot) -> list[str]:
        """Delete what nobody needs: returns the names.

        The current version, the good ones that the pointer names and the ``keep`` newest stay;
        nothing younger than ``least_age_seconds`` goes, so a reader or a writer that is still at
        work keeps its folder.
        """
        files = self.files(slot)
        with files.locked() as pointer:
            named = {pointer.version, *pointer.earlier}
            kept = named.union(self.versions(slot)[-self.keep :])
            old = [
                name
                for name in self.versions(slot)
                if name not in kept and self._is_old(files.version_folder(name) / "zarr.json")
            ]
            # The pointer first: it must not name a folder that is gone.
            candidates = tuple(name for name in pointer.candidates if name not in old)
            if candidates != pointer.candidates:
                files.point(replace(pointer, candidates=candidates))
            moved = [files.staging / f"collected-{name}" for name in old]
            for name, path in zip(old, moved, strict=True):
                os.rename(files.version_folder(name), path)
        verdicts = sorted((files.folder / "verdicts").glob("*.json"))[:-KEEP_VERDICTS]
        gone = [path for path in verdicts if path.stem not in self.versions(slot)]
        staging = files.staging.iterdir()
        left = [path for path in staging if path not in moved and self._is_old(path)]
        for path in (*moved, *left, *gone):
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


def _assets_of(record: Mapping[str, Any]) -> set[str]:
    """Names of the assets that a version was made from."""
    return {entry["asset"] for entry in record.get("inputs", ())}
