"""One command's surroundings: the workspace, the Dagster instance of the web UI, the launcher."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import dagster as dg
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from assets_defs.definitions import build_definitions
from assets_defs.launcher import Launcher
from assets_defs.workspace import CHECKOUT, Workspace


class SetUpError(Exception):
    """The checkout is not set up."""


@dataclass(frozen=True)
class Session:
    """What the commands work with."""

    workspace: Workspace
    instance: dg.DagsterInstance
    launcher: Launcher


@contextmanager
def open_session(console: Console) -> Iterator[Session]:
    """Open the instance that the web UI shows; progress goes to the console.

    Raises SetUpError where ``make setup`` has not been run.
    """
    from dotenv import load_dotenv

    load_dotenv(CHECKOUT / ".env")
    if not os.environ.get("DAGSTER_HOME"):
        raise SetUpError(f"{CHECKOUT}: DAGSTER_HOME is not set; expected `make setup` to be run.")
    workspace = Workspace.from_environment()
    with Display(console) as display, dg.DagsterInstance.get() as instance:
        definitions = build_definitions(workspace, {"progress": display})
        job = definitions.get_repository_def().get_job
        yield Session(workspace, instance, Launcher(instance, workspace, job, display))


class Display:
    """A bar for the whole launch and one for the asset at work.

    Not a terminal: one line for every asset instead.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._bars = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.percentage:>3.0f} %"),
            TimeElapsedColumn(),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._whole: dict[str, TaskID] = {}
        self._asset: tuple[str, TaskID] | None = None

    def __enter__(self) -> Display:
        self._bars.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._bars.stop()

    def __call__(self, what: str, fraction: float) -> None:
        """Show a fraction: of a system (no brackets in its name) or of one of its assets."""
        if "[" not in what:
            if what not in self._whole:
                self._whole[what] = self._bars.add_task(what, total=1.0)
            self._bars.update(self._whole[what], completed=fraction)
            return
        if self._asset is None or self._asset[0] != what:
            if self._asset is not None:
                self._bars.remove_task(self._asset[1])
            self._asset = (what, self._bars.add_task(what.replace("[", r"\["), total=1.0))
            if not self._console.is_terminal:
                self._console.print(what, markup=False, highlight=False)
        self._bars.update(self._asset[1], completed=fraction)
