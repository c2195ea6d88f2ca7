"""State of long work (a training run), kept so that a killed process can go on.

work/<recipe>.state    the state behind the hash of its bytes, replaced atomically
work/<recipe>.lock     held by the one process that works on the recipe
"""

from __future__ import annotations

import fcntl
import hashlib
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from storage.errors import StoreError
from storage.zarr_files import disk_error

_MAGIC = b"tsuya work state 1\n"
_log = logging.getLogger(__name__)


class BusyError(StoreError):
    """Another process works on the same recipe."""


@dataclass(frozen=True)
class WorkState:
    """The state of one recipe: other settings start afresh, and beside it."""

    folder: Path
    recipe: str

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Be the one who works on this recipe. Raises BusyError where another process does."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            held = _locked(self._path.with_suffix(".lock"))
        except OSError as error:
            raise disk_error(error, self._path) from error
        if held is None:
            raise BusyError(
                f"{self._path}: another process works on the same recipe; expected to be alone: "
                "wait for it, or end it, and run again."
            )
        try:
            yield
        finally:
            os.close(held)

    def read(self) -> bytes | None:
        """What was kept last for this recipe; None where nothing was.

        A state that is torn, damaged or not of this format is told in one sentence and left out.
        """
        try:
            data = self._path.read_bytes()
        except FileNotFoundError:
            return None
        head = len(_MAGIC) + hashlib.sha256().digest_size
        state = data[head:]
        if data[:head] != _MAGIC + hashlib.sha256(state).digest():
            _log.warning("%s: the kept state is not whole; the work starts anew.", self._path)
            return None
        return state

    def keep(self, state: bytes) -> None:
        """Replace what was kept. Raises StoreError, StoreFullError.

        A process killed meanwhile leaves the old state whole.
        """
        beside = self._path.with_suffix(f".{os.getpid()}.part")
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with beside.open("wb") as file:
                file.write(_MAGIC + hashlib.sha256(state).digest())
                file.write(state)
                file.flush()
                os.fsync(file.fileno())
            os.replace(beside, self._path)
        except OSError as error:
            beside.unlink(missing_ok=True)
            raise disk_error(error, self._path) from error

    @property
    def _path(self) -> Path:
        return self.folder / f"{self.recipe}.state"


def clear_work(folder: Path) -> None:
    """Delete all states that no process works on: what they were for is there, or unwanted."""
    for recipe in {path.name.partition(".")[0] for path in folder.glob("*.*")}:
        lock = folder / f"{recipe}.lock"
        held = _locked(lock)
        if held is None:
            continue
        for path in (*folder.glob(f"{recipe}.*state"), *folder.glob(f"{recipe}.*part"), lock):
            path.unlink(missing_ok=True)
        os.close(held)
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()


def _locked(path: Path) -> int | None:
    """A descriptor that holds the lock (the kernel frees it at a process's end); None where taken.

    Raises OSError.
    """
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # Who cleared the work may have deleted the file just before the lock was ours.
            if os.fstat(descriptor).st_ino == os.stat(path).st_ino:
                return descriptor
        except BlockingIOError:
            os.close(descriptor)
            return None
        except FileNotFoundError:
            pass
        os.close(descriptor)
