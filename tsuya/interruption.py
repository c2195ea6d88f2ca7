"""Ctrl-C: ends every step within seconds, the second time at once.

An interruption is an exception that Python raises between two of its own instructions. Compiled
loops, ray casts and traces take minutes without one, and where it is raised inside a callback of
theirs it is printed and forgotten. So a thread of its own hears the signal, too: it remembers that
it came, and ends the process when nothing else has. Nothing stored is lost by that: versions are
published whole or not at all.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
from collections.abc import Callable
from types import TracebackType

GRACE_SECONDS = 8.0
EXIT_CODE = 130
_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """While entered, in the main thread: whether a person wants the process to end.

    ``end`` is called before the process is ended by force, to put the terminal in order and to say
    the one sentence.
    """

    def __init__(self, end: Callable[[], None]) -> None:
        self._end = end
        self._asked = threading.Event()
        self._left = threading.Event()

    @property
    def asked(self) -> bool:
        """Whether Ctrl-C was pressed."""
        return self._asked.is_set()

    def __enter__(self) -> Interruption:
        # The interpreter writes each signal's number here, whatever handler Dagster has set and
        # whatever the main thread does.
        self._hears, writes = socket.socketpair()
        writes.setblocking(False)
        self._writes = writes
        self._before = signal.set_wakeup_fd(writes.fileno(), warn_on_full_buffer=False)
        self._unraisable = sys.unraisablehook
        sys.unraisablehook = self._overhear
        threading.Thread(target=self._listen, name="interruption", daemon=True).start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._left.set()
        sys.unraisablehook = self._unraisable
        signal.set_wakeup_fd(self._before)
        self._writes.close()

    def _overhear(self, unraisable: sys.UnraisableHookArgs) -> None:
        """An interruption that was raised where nobody can catch it: it was heard here."""
        if not self._asked.is_set():
            self._unraisable(unraisable)

    def _listen(self) -> None:
        while True:
            heard = self._hears.recv(1)
            if not heard:
                return
            if heard[0] not in _SIGNALS:
                continue
            if self._asked.is_set():
                self._force()
            self._asked.set()
            threading.Thread(target=self._wait, name="interruption's grace", daemon=True).start()

    def _wait(self) -> None:
        if not self._left.wait(GRACE_SECONDS):
            self._force()

    def _force(self) -> None:
        try:
            self._end()
        finally:
            os._exit(EXIT_CODE)
