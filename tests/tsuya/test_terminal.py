"""A real terminal: bars that move, Ctrl-C that ends what is under way, one sentence."""

from __future__ import annotations

import os
import pty
import re
import select
import sys
import time
from pathlib import Path
from typing import NamedTuple

import pytest

TSUYA = str(Path(sys.executable).with_name("tsuya"))
PELT = ("run", "photo_fur", "--photo", "pelt", "--mesh", "square")
LONG = ("--set", "pelt_samples=4000", "--set", "pelt_size=300")
STUCK = """
import ctypes
from pipelines.virtual.pelt import pelt

def stuck(*arguments, **options):
    # In C for ever, whatever signals come: a lock that its holder takes again.
    lock = ctypes.create_string_buffer(64)
    for _ in range(2):
        ctypes.CDLL(None).pthread_mutex_lock(lock)

pelt.make_pelt = stuck
from tsuya.cli import main
main()
"""


class Said(NamedTuple):
    """What a command in a terminal came to."""

    code: int
    seconds: float
    """From the first Ctrl-C to the end."""
    screens: list[str]
    """Each time that something was read."""


def in_terminal(arguments: list[str], home: Path, *, presses: list[float]) -> Said:
    """Run a command in a pseudo-terminal; press Ctrl-C so long after the asset's bar is seen."""
    child, terminal = pty.fork()
    if child == 0:
        places = {"DAGSTER_HOME": str(home / "dagster"), "TSUYA_DATA": str(home / "data")}
        os.execvpe(arguments[0], arguments, {**os.environ, **places, "TERM": "xterm"})
    screens: list[str] = []
    begun: float | None = None
    first: float | None = None
    left = list(presses)
    last = time.monotonic() + 90.0
    while time.monotonic() < last:
        if select.select([terminal], [], [], 0.1)[0]:
            try:
                data = os.read(terminal, 65_536)
            except OSError:
                break
            screens.append(data.decode(errors="replace"))
            if begun is None and "fur_photo [" in screens[-1]:
                begun = time.monotonic()
        if begun is not None and left and time.monotonic() - begun > left[0]:
            left.pop(0)
            os.write(terminal, b"\x03")
            first = first or time.monotonic()
    _, status = os.waitpid(child, 0)
    os.close(terminal)
    return Said(os.waitstatus_to_exitcode(status), time.monotonic() - (first or last), screens)


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A Dagster home and a data folder."""
    (tmp_path / "dagster").mkdir()
    (tmp_path / "dagster" / "dagster.yaml").write_text("telemetry: {enabled: false}\n")
    return tmp_path


def test_the_bars_move_and_ctrl_c_ends_with_one_sentence(home: Path) -> None:
    said = in_terminal([TSUYA, *PELT, *LONG], home, presses=[2.5])
    assert said.code == 130
    assert said.seconds < 10.0
    shown = "".join(said.screens)
    # While the asset says nothing, its clock and its wheel go on.
    clocks = set(re.findall(r"fur_photo \[pelt\].*?(\d:\d\d:\d\d)", shown))
    assert len(clocks) >= 2
    assert "Traceback" not in shown
    last = shown.replace("\x1b[2K", "").replace("\x1b[1A", "").replace("\x1b[?25h", "")
    assert last.rstrip().splitlines()[-1].strip() == (
        "Interrupted: what was made stays; run again to go on."
    )


@pytest.mark.parametrize(("presses", "least", "most"), [([1.0], 5.0, 10.0), ([1.0, 1.5], 0.0, 3.0)])
def test_a_step_that_hears_nothing_is_ended_all_the_same(
    home: Path, presses: list[float], least: float, most: float
) -> None:
    """Stuck in C: after the grace, or at once when Ctrl-C is pressed again."""
    said = in_terminal([sys.executable, "-c", STUCK, *PELT], home, presses=presses)
    assert said.code == 130
    assert least < said.seconds < most
    shown = "".join(said.screens)
    assert shown.count("Interrupted: what was made stays") == 1
    assert "Traceback" not in shown
