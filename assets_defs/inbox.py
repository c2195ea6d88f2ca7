"""The inbox: a file dropped into ``data/inbox/<system>/`` is registered and made.

Anything may lie there. Each item is looked at alone, and only once it lies still; links are
followed inside the system's inbox. An item that passes its check gets a partition and a run; what
cannot be used is named, with the reason, in `NOTES` beside it for as long as it lies there. The
partition of an item that is gone goes with it, unless versions of it are stored: these stay to be
looked at, and `tsuya remove` is for them.

What is already registered under its name and has not changed since is left alone: the command
line registers the files that it copies here and launches them itself.
"""

# Dagster looks at the sensor's annotations itself: no postponed ones here.
import json
import os
import time
import uuid
from collections.abc import Callable, Mapping
from concurrent.futures import Future, wait
from pathlib import Path
from threading import Thread
from typing import Any, TypedDict, cast

import dagster as dg

from assets_defs.dagster_assets import dynamic_partitions
from assets_defs.rematerialisation import LaunchConfig
from assets_defs.sources import NOTES, Source, by_key, json_hash
from assets_defs.system import Dimension, System
from assets_defs.taking_in import take_in
from assets_defs.workspace import Workspace
from storage.errors import StoreError

__all__ = ["SETTLED_SECONDS", "inbox_sensor", "take_in"]

SETTLED_SECONDS = 3.0
"""A file that changed more recently may still be on its way."""
CHECK_SECONDS = 5.0
"""So long a tick waits for checks; what is not done then is for later ticks."""
_Change = dg.AddDynamicPartitionsRequest | dg.DeleteDynamicPartitionsRequest
_HEAD = "What lies here and is not used, and why. This file goes when all of it is used or gone."


def inbox_sensor(
    job: dg.JobDefinition, systems: Mapping[str, System], workspace: Workspace
) -> dg.SensorDefinition:
    """The one sensor. A tick looks at names, sizes and times; what changed is read and checked
    beside it, so that a tick stays short."""
    checks = _Checks()

    @dg.sensor(
        name="inbox",
        job=job,
        minimum_interval_seconds=10,
        default_status=dg.DefaultSensorStatus.RUNNING,
        description="Registers files dropped into data/inbox/<system>/ and requests their runs.",
    )
    def look(context: dg.SensorEvaluationContext) -> dg.SensorResult:
        seen = _seen(context.cursor)
        now: dict[str, _Entry] = {}
        runs: list[dg.RunRequest] = []
        changes: list[_Change] = []
        checks.start_tick()
        for system in systems.values():
            its = {name: seen[name] for name in seen if name.startswith(f"{system.name}/")}
            tick = _Look(system, workspace, context.instance, checks, its)
            try:
                tick.look()
            except Exception as error:  # a system's trouble is not the others'
                context.log.exception(f"{system.name}: {error}")
                now |= its
                continue
            now |= tick.now
            runs += tick.runs
            changes += tick.changes
            try:
                _write_notes(workspace.inbox(system.name), tick.notes)
            except OSError as error:  # a folder that is only read
                context.log.warning(f"{system.name}: {NOTES} cannot be written ({error}).")
        return dg.SensorResult(
            run_requests=runs, dynamic_partitions_requests=changes, cursor=json.dumps(now)
        )

    return look


class _Entry(TypedDict):
    """What the cursor keeps of an item, by its place."""

    key: str
    stamp: str
    refused: str | None


def _seen(cursor: str | None) -> dict[str, _Entry]:
    """What was seen; nothing where the cursor is of an earlier kind."""
    entries: dict[str, Any] = json.loads(cursor or "{}")
    return {name: cast(_Entry, entry) for name, entry in entries.items() if isinstance(entry, dict)}


class _Look:
    """One look into one system's inbox."""

    def __init__(
        self,
        system: System,
        workspace: Workspace,
        instance: dg.DagsterInstance,
        checks: "_Checks",
        seen: Mapping[str, _Entry],
    ) -> None:
        self.system, self.workspace, self.instance = system, workspace, instance
        self.checks, self.seen = checks, seen
        self.seen_keys = {entry["key"] for entry in seen.values()}
        self.inbox = workspace.inbox(system.name)
        self.now: dict[str, _Entry] = {}
        self.runs: list[dg.RunRequest] = []
        self.changes: list[_Change] = []
        self.notes: dict[str, str] = {}

    def look(self) -> None:
        """Look at everything. Raises ValueError where the inbox cannot be read."""
        # Before the files: what is registered meanwhile has its file already.
        registered = {
            dimension.name: set(
                self.instance.get_dynamic_partitions(self.system.partitions_name(dimension.name))
            )
            for dimension in self.system.dimensions
        }
        found = self.system.found(self.inbox)
        self.notes = {
            name: why for name, why in found.oddities.items() if _is_settled(self.inbox / name)
        }
        for dimension in self.system.dimensions:
            before = registered[dimension.name]
            keep, new = set(dimension.builtin), set(dimension.builtin) - before
            for source in by_key(found.items[dimension.name]).values():
                usable = self._usable(dimension, source, before)
                keep |= set() if usable is False else {source.key}
                new |= {source.key} - before if usable else set()
            gone = {key for key in before - keep if self._is_bare(dimension, key)}
            partitions = dynamic_partitions(self.system, dimension.name)
            if new:
                self.changes.append(partitions.build_add_request(sorted(new)))
            if gone:
                self.changes.append(partitions.build_delete_request(sorted(gone)))
            self._remember(before - gone)

    def _usable(self, dimension: Dimension, source: Source, registered: set[str]) -> bool | None:
        """Whether an item can be used; None where this is not known yet."""
        name = _name(source, self.inbox)
        place = f"{self.system.name}/{name}"
        before = self.seen.get(place)
        try:
            stamp = _stamp(source, self.inbox)
        except FileNotFoundError:
            return None  # Gone while it was looked at: the next look says more.
        except OSError as error:
            self.notes[name] = f"{source.name}: cannot be read ({error.strerror})."
            return False
        except ValueError as error:
            self.notes[name] = str(error)
            return False
        if stamp is None:
            return None
        item = f"{place}:{stamp}:{source.key}"
        if before is not None and (before["stamp"], before["key"]) == (stamp, source.key):
            self.now[place] = before
            if (
                source.key in registered
                and before["refused"]
                and self._is_bare(dimension, source.key)
            ):
                # With settings of its own, like a crop, the command line can use it.
                self.now[place] = {**before, "refused": None}
            if not self.now[place]["refused"]:
                return True
            self.notes[name] = str(before["refused"])
            if item in self.checks.answered:
                return False
        elif before is None and source.key in registered - self.seen_keys:
            self.now[place] = _Entry(key=source.key, stamp=stamp, refused=None)
            return True
        try:
            refused = self.checks.problem(
                item, lambda: _check(self.system, dimension, source, self.workspace)
            )
        except TimeoutError:
            return None
        if not _is_still(source, self.inbox, stamp):
            return None
        self.notes.pop(name, None)
        self.now[place] = _Entry(key=source.key, stamp=stamp, refused=refused)
        if refused:
            self.notes[name] = refused
            return False
        self.runs.append(_request(self.system, dimension, source, stamp))
        return True

    def _is_bare(self, dimension: Dimension, key: str) -> bool:
        """Whether a key needs a file, and no version is stored that was made of one."""
        if dimension.needs_no_file(key):
            return False
        store = self.workspace.store
        stored = (s for s in store.slots() if self.system.is_made_of(s, dimension.name, key))
        return not any(map(store.versions, stored))

    def _remember(self, registered: set[str]) -> None:
        """What is away for now, or on its way, and has a partition: another item that comes under
        its name is not the command line's."""
        for place, entry in self.seen.items():
            if entry["key"] in registered:
                self.now.setdefault(place, entry)


class _Checks:
    """Checks one after the other in a thread beside the ticks: a large file's takes minutes."""

    def __init__(self) -> None:
        self.answered: set[str] = set()
        """What was checked by this process: another's code may refuse other things."""
        self._futures: dict[str, Future[str | None]] = {}
        self._wanted: set[str] = set()
        self._until = 0.0

    def start_tick(self) -> None:
        """Forget what the last tick did not ask for; time starts to count."""
        for item in self._futures.keys() - self._wanted:
            if self._futures[item].done():
                del self._futures[item]
        self._wanted = set()
        self._until = time.monotonic() + CHECK_SECONDS

    def problem(self, item: str, check: Callable[[], None]) -> str | None:
        """What is wrong with an item. Raises TimeoutError where that is not known yet."""
        self._wanted.add(item)
        if item not in self._futures:
            if wait(self._futures.values(), self._left()).not_done or self._left() == 0:
                raise TimeoutError
            self._futures[item] = Future()
            Thread(target=_answer, args=(self._futures[item], check), daemon=True).start()
        problem = self._futures[item].result(self._left())
        del self._futures[item]
        self.answered.add(item)
        return problem

    def _left(self) -> float:
        return max(self._until - time.monotonic(), 0.0)


def _answer(future: Future[str | None], check: Callable[[], None]) -> None:
    """Do a check; what it raises is the answer."""
    try:
        check()
    except ValueError as error:
        future.set_result(str(error))
    except Exception as error:  # anything may lie in an inbox
        future.set_result(f"it cannot be read ({type(error).__name__}: {error}).")
    else:
        future.set_result(None)


def _check(system: System, dimension: Dimension, source: Source, workspace: Workspace) -> None:
    """Raise ValueError for an item that cannot be used with the settings of its run."""
    for plan in system.plans.values():
        if plan.from_source and plan.by == (dimension.name,):
            keys = {dimension.name: source.key}
            try:
                settings = system.resolve(
                    plan.name, keys, workspace.store, preset=None, given={}
                ).model_dump()
            except StoreError:
                continue  # The run puts that right, or says it.
            dimension.check(source, settings)


def _stamp(source: Source, inbox: Path) -> str | None:
    """Names, sizes, times and rights of an item's files; None while it may be on its way.

    Raises ValueError and OSError as `Source.contents`.
    """
    statuses = [(name, file.stat()) for name, file in source.contents(inbox)]
    own = [] if source.path is None else [source.path.stat()]  # a folder's own time
    if not all(_lies_still(status) for status in (*own, *(status for _, status in statuses))):
        return None
    told = [[name, s.st_size, s.st_mtime_ns, s.st_mode] for name, s in statuses]
    return json_hash(told)[:16]


def _name(source: Source, inbox: Path) -> str:
    """An item's place, from the inbox."""
    return "" if source.path is None else source.path.relative_to(inbox).as_posix()


def _lies_still(status: os.stat_result) -> bool:
    """Whether a file was not changed just now. A time in the future is a clock's fault."""
    return abs(time.time() - status.st_mtime) >= SETTLED_SECONDS


def _is_settled(path: Path) -> bool:
    try:
        return _lies_still(path.lstat())
    except OSError:
        return False


def _is_still(source: Source, inbox: Path, stamp: str) -> bool:
    try:
        return _stamp(source, inbox) == stamp
    except (ValueError, OSError):
        return False


def _write_notes(inbox: Path, notes: Mapping[str, str]) -> None:
    """Replace the notes where they say something else."""
    file = inbox / NOTES
    lines = [_HEAD, ""]
    for name, why in sorted(notes.items()):
        line = why if why.startswith(Path(name).name) else f"{name}: {why}"
        lines.append("".join(c if c.isprintable() else "?" for c in line))
    text = "\n".join(lines) + "\n" if notes else ""
    before = file.read_text(encoding="utf-8", errors="replace") if file.is_file() else ""
    if text == before:
        return
    if not text:
        file.unlink()
        return
    beside = inbox / f".{NOTES}.{uuid.uuid4().hex[:8]}"
    beside.write_text(text, encoding="utf-8")
    os.replace(beside, file)


def _request(system: System, dimension: Dimension, source: Source, stamp: str) -> dg.RunRequest:
    """A launch of the new item with the other dimensions' defaults."""
    keys = {other.name: other.default for other in system.dimensions} | {dimension.name: source.key}
    # What was removed and is dropped again is another request: its inode's time differs.
    changed = source.path.stat().st_ctime_ns if source.path else 0
    return dg.RunRequest(
        run_key=f"{system.name}/{source.key}:{stamp}:{changed}",
        run_config=dg.RunConfig(
            ops={"launch_graph": LaunchConfig(system=system.name, partitions=[keys])}
        ),
        tags={"tsuya/dropped": f"{system.name}/{source.key}"[:60]},
    )
