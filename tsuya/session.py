"""One command's surroundings: the workspace, the Dagster instance of the web UI, the launcher."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import NamedTuple

import click
import dagster as dg
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from assets_defs.definitions import build_definitions
from assets_defs.launcher import Launcher, LaunchError, Outcome, Request
from assets_defs.systems import SYSTEMS
from assets_defs.workspace import CHECKOUT, Workspace
from tsuya.console import SetUpError, fail, output
from tsuya.report import figures_table, outcome_reports, sizes_table


@dataclass(frozen=True)
class Session:
    """What the commands work with."""

    workspace: Workspace
    instance: dg.DagsterInstance
    launcher: Launcher
    say: Callable[[str], None]
    """Print a line on standard output while progress is shown."""


@contextmanager
def open_session() -> Iterator[Session]:
    """Open the instance that the web UI shows; progress goes to standard error.

    Raises SetUpError where ``make setup`` has not been run.
    """
    workspace = Workspace.of_checkout()
    if not os.environ.get("DAGSTER_HOME"):
        raise SetUpError(f"{CHECKOUT}: DAGSTER_HOME is not set; expected `make setup` to be run.")
    with Display(Console(stderr=True)) as display, dg.DagsterInstance.get() as instance:
        definitions = build_definitions(workspace, {"progress": display})
        job = definitions.get_repository_def().get_job
        yield Session(workspace, instance, Launcher(instance, workspace, job, display), display.say)


class Launched(NamedTuple):
    """What several launches came to."""

    outcomes: list[Outcome]
    failures: list[str]
    seconds: float


def launch_all(
    session: Session,
    requests: Sequence[Request],
    show: Callable[[Sequence[Outcome]], None] = lambda outcomes: None,
) -> Launched:
    """Launch one after the other; a failure ends none of the others.

    ``show`` is told what there is of each partition as soon as it is there.
    """
    started = time.perf_counter()
    outcomes: list[Outcome] = []
    failures: list[str] = []
    for request in requests:
        try:
            outcomes += session.launcher.launch(request, show)
        except LaunchError as error:
            outcomes += error.outcomes
            failures.append(str(error))
    return Launched(outcomes, failures, time.perf_counter() - started)


def report(session: Session, launched: Launched, as_json: bool) -> None:
    """Print what became of the launches; exit with 1 where something failed."""
    reports = outcome_reports(session.workspace.store, launched.outcomes)
    if as_json:
        summary = {"seconds": round(launched.seconds, 3), "failures": launched.failures}
        click.echo(json.dumps(summary | {"assets": reports}))
    else:
        systems = SYSTEMS.values()
        output().print(sizes_table(systems, reports), figures_table(systems, reports))
        made = sum(1 for outcome in launched.outcomes if outcome.state == "made")
        current = len(reports) - made
        click.echo(f"{made} made, {current} current already, {launched.seconds:.1f} s.")
    if launched.failures:
        fail("\n".join(launched.failures), 1)


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

    def say(self, line: str) -> None:
        """Print a line on standard output, above the bars."""
        self._bars.stop()
        click.echo(line)
        self._bars.start()

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
