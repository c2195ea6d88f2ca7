"""Readers under attack: thousands of broken files, each of which has to be read or refused.

Workers that have imported everything take one input after the other; who does not end within the
limit is killed, and another worker goes on behind that input.
"""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
import random
import re
import resource
import runpy
import shutil
import socket
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.bad_input_cases import named_cases
from benchmarks.bad_input_files import Case, valid_cases
from benchmarks.bad_input_mutations import mutated
from storage.btf_file import read_btf_file, read_texel
from storage.packages import read_package
from storage.readers import BadInput
from storage.readers.btf import open_btf
from storage.readers.drives import read_drive, read_frame
from storage.readers.environments import read_environment
from storage.readers.meshes import read_mesh
from storage.readers.photographs import read_photograph
from storage.readers.profiles import read_profile
from storage.readers.scenes import read_scene

LIMIT_SECONDS = 10.0
LIMIT_BYTES = 1 << 30
"""Above the idle process."""
LONGEST_SENTENCE = 600

_SHOWN = 20  # offenders of a report
_ADDRESS_SPACE = 8 << 30  # protects the machine; what is above LIMIT_BYTES is noticed anyway
_WORKERS = 2


def _read_btf(path: Path) -> None:
    btf = open_btf(path)
    btf.read(0, min(2, btf.images))


def _read_btf_file(path: Path) -> None:
    data = path.read_bytes()
    with contextlib.suppress(BadInput):  # it does not look at the checksum
        read_texel(data, 0, 0, 0, path.name)
    read_btf_file(data, path.name)


def _read_drive(path: Path) -> None:
    read_frame(read_drive(path), 0)


def _read_package(path: Path) -> None:
    package = read_package(path)
    for name in package.parts:
        package.value(name)


READERS: dict[str, Callable[[Path], object]] = {
    "photograph": read_photograph,
    "environment": read_environment,
    "mesh": read_mesh,
    "scene": read_scene,
    "profile": read_profile,
    "btf": _read_btf,
    "btf_file": _read_btf_file,
    "drive": _read_drive,
    "package": _read_package,
    "script": lambda path: runpy.run_path(str(path)),  # of the fuzzer's own tests
}


class Verdict(NamedTuple):
    """``kind``: read, refused, wrong_exceptions, hangs or blow_ups."""

    number: int
    reader: str
    case: str
    kind: str
    what: str = ""


def run_bad_inputs(count: int, seed: int) -> dict[str, Any]:
    """Give ``count`` inputs to the readers: the named cases first, then mutations of valid files.

    Returns ``bad_inputs``, how many there were; ``wrong_exceptions``, other ends than a result or
    the readers' own sentence, crashes of the process among them; ``hangs``, above 10 s;
    ``blow_ups``, more than a GiB above the idle process; ``by_reader``, the same and those read and
    refused for each reader; ``offenders``, the first few. Equal seeds give equal inputs.
    """
    return report(judged(count, seed, named_cases()))


def report(verdicts: Sequence[Verdict]) -> dict[str, Any]:
    """Counts, and the first that are neither read nor refused."""
    kinds = Counter(verdict.kind for verdict in verdicts)
    by_reader: dict[str, Counter[str]] = {}
    for verdict in verdicts:
        by_reader.setdefault(verdict.reader, Counter())[verdict.kind] += 1
    wrong = sorted(v for v in verdicts if v.kind not in ("read", "refused"))
    return {
        "bad_inputs": len(verdicts),
        **{kind: kinds[kind] for kind in ("wrong_exceptions", "hangs", "blow_ups")},
        "by_reader": {reader: dict(counts) for reader, counts in sorted(by_reader.items())},
        "offenders": [verdict._asdict() for verdict in wrong[:_SHOWN]],
    }


def judged(count: int, seed: int, named: Sequence[Case]) -> list[Verdict]:
    """What became of each input."""
    lanes = [_Lane(range(first, count, _WORKERS), seed, named) for first in range(_WORKERS)]
    try:
        while open_lanes := {lane.connection: lane for lane in lanes if not lane.done}:
            for connection in wait(list(open_lanes), timeout=0.1):
                assert isinstance(connection, Connection)
                open_lanes[connection].hear()
            for lane in open_lanes.values():
                lane.watch()
    finally:
        for lane in lanes:
            lane.stop()
    return [verdict for lane in lanes for verdict in lane.verdicts]


def case_of(index: int, seed: int, named: Sequence[Case], valid: Sequence[Case]) -> Case:
    """An input: a named case, or a mutation of a valid one."""
    if index < len(named):
        return named[index]
    chance = random.Random(f"{seed} {index}")
    readers = list(dict.fromkeys(case.reader for case in valid))
    reader = readers[index % len(readers)]  # as many of each, however many formats it reads
    return mutated(chance.choice([case for case in valid if case.reader == reader]), chance)


def written(case: Case, folder: Path) -> Path:
    """What the reader is given, once the case's files lie in an empty folder."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for name, content in case.files.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, bytes):
            file.write_bytes(content)
        elif content == "folder":
            file.mkdir()
        elif content == "pipe":
            os.mkfifo(file)
        elif content == "socket":
            with socket.socket(socket.AF_UNIX) as end:
                end.bind(str(file))
        else:
            file.symlink_to("/dev/zero")
    return folder / case.entry


class _Lane:
    """Every other input, and the worker that takes them."""

    def __init__(self, indices: range, seed: int, named: Sequence[Case]) -> None:
        self.indices, self.seed, self.named = indices, seed, named
        self.verdicts: list[Verdict] = []
        self.done = not indices
        self._start(indices)

    def _start(self, indices: range) -> None:
        context = multiprocessing.get_context("spawn")  # libraries' threads do not outlive a fork
        self.connection, theirs = context.Pipe(duplex=False)
        self.process = context.Process(
            target=_work, args=(theirs, indices, self.seed, self.named), daemon=True
        )
        self.process.start()
        theirs.close()
        self.current: tuple[int, str, str] | None = None
        self.since = time.monotonic()

    def hear(self) -> None:
        """Take one message: an input begins, or has ended; nothing more comes from the dead."""
        try:
            message = self.connection.recv()
        except (EOFError, OSError):
            self.process.join()
            code = self.process.exitcode
            if self.current is None and code == 0:
                self.done = True
                return
            self._replace("wrong_exceptions", f"the process ended with {code}")
            return
        if isinstance(message, Verdict):
            self.verdicts.append(message)
            self.current = None
        else:
            self.current = message
        self.since = time.monotonic()

    def watch(self) -> None:
        """Kill a worker whose input takes too long."""
        if self.current and time.monotonic() - self.since > LIMIT_SECONDS:
            if self.connection.poll():  # it has ended, and nobody has heard it yet
                return
            self.process.kill()
            self.process.join()
            self._replace("hangs", f"more than {LIMIT_SECONDS:g} s")

    def _replace(self, kind: str, what: str) -> None:
        if self.current is None:
            raise RuntimeError(f"a worker could not start: {what}")
        index, reader, name = self.current
        self.verdicts.append(Verdict(index, reader, name, kind, what))
        self.connection.close()
        left = self.indices[self.indices.index(index) + 1 :]
        self.done = not left
        if left:
            self._start(left)

    def stop(self) -> None:
        """End the worker, whatever it does."""
        self.process.kill()
        self.process.join()


# --- In the worker ------------------------------------------------------------------------------


def _work(connection: Connection, indices: range, seed: int, named: Sequence[Case]) -> None:
    warnings.simplefilter("ignore")
    valid = valid_cases()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "in"
        for case in valid:  # imports everything, and is the proof that they are valid
            READERS[case.reader](written(case, folder))
        silence = os.open(os.devnull, os.O_WRONLY)
        for stream in (1, 2):  # what decoders have to say about what is broken
            os.dup2(silence, stream)
        resource.setrlimit(resource.RLIMIT_AS, (_address_space(), resource.RLIM_INFINITY))
        for index in indices:
            case = case_of(index, seed, named, valid)
            path = written(case, folder)
            connection.send((index, case.reader, case.name))
            connection.send(Verdict(index, case.reader, case.name, *_judge(case.reader, path)))
    connection.close()


def _judge(reader: str, path: Path) -> tuple[str, str]:
    Path("/proc/self/clear_refs").write_text("5")  # the peak counts anew from here
    idle = _memory("VmRSS")
    kind, what = "read", ""
    try:
        READERS[reader](path)
    except BadInput as error:
        kind, what = "refused", str(error)
        if wrong := _fault(error):
            kind, what = "wrong_exceptions", f"{wrong}: {what[:300]}"
    except BaseException as error:
        kind, what = "wrong_exceptions", f"{type(error).__name__}: {error}"[:300]
    taken = _memory("VmHWM") - idle
    if taken > LIMIT_BYTES:
        return "blow_ups", f"{taken / LIMIT_BYTES:.1f} GiB; {kind} {what}"[:300]
    return kind, what


def _fault(error: BadInput) -> str:
    """What is wrong with a refusal, '' for nothing."""
    sentence = str(error)
    if not re.fullmatch(r".+: .+ is .+; expected .+\.", sentence):
        return "not one sentence"
    if len(sentence) > LONGEST_SENTENCE or max(len(error.found), len(error.field)) > 80:
        return "a long sentence"
    return ""


def _memory(key: str) -> int:
    """Bytes, by the kernel."""
    text = Path("/proc/self/status").read_text()
    return 1024 * int(text.split(f"{key}:")[1].split()[0])


def _address_space() -> int:
    return _memory("VmSize") + _ADDRESS_SPACE


if __name__ == "__main__":
    count, seed = (int(word) for word in sys.argv[1:3])
    print(json.dumps(run_bad_inputs(count, seed), indent=1))
