"""One command's surroundings: the workspace, the Dagster instance of the web UI, the launcher."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import click
import dagster as dg
from rich.console import Console

from assets_defs.definitions import build_definitions
from assets_defs.ended_runs import end_dead_runs, process_tags
from assets_defs.launcher import Launcher, LaunchError, Outcome, Request
from assets_defs.systems import SYSTEMS
from assets_defs.workspace import Workspace
from tsuya.console import INTERRUPTED, fail, output, shown_path
from tsuya.display import Display
from tsuya.history import open_history
from tsuya.interruption import Interruption
from tsuya.report import figures_table, file_notes, outcome_reports, sizes_table


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

    Ctrl-C ends what is under way: KeyboardInterrupt. Raises SetUpError where ``make setup`` has not
    been run.
    """
    workspace = Workspace.of_checkout()
    display = Display(Console(stderr=True))

    def end() -> None:
        display.stop()
        click.echo(INTERRUPTED, err=True)

    with open_history() as instance, display, Interruption(end) as interruption:

        def progress(what: str, fraction: float) -> None:
            if interruption.asked:  # where the exception was swallowed
                raise KeyboardInterrupt
            display(what, fraction)

        end_dead_runs(instance)  # of commands before, that were killed
        definitions = build_definitions(workspace, {"progress": progress})
        job = definitions.get_repository_def().get_job
        launcher = Launcher(instance, workspace, job, progress, process_tags())
        yield Session(workspace, instance, launcher, display.say)


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


def report(session: Session, launched: Launched, pictures: Sequence[Path], as_json: bool) -> None:
    """Print what became of the launches and where the pictures are; exit with 1 on a failure."""
    reports = outcome_reports(session.workspace.store, launched.outcomes)
    if as_json:
        summary = {
            "seconds": round(launched.seconds, 3),
            "failures": launched.failures,
            "pictures": [str(path) for path in pictures],
        }
        click.echo(json.dumps(summary | {"assets": reports}))
    else:
        systems = SYSTEMS.values()
        output().print(sizes_table(systems, reports), figures_table(systems, reports))
        made = sum(1 for outcome in launched.outcomes if outcome.state == "made")
        current = len(reports) - made
        for note in file_notes(reports):
            click.echo(note)
        for path in pictures:
            click.echo(shown_path(path))
        click.echo(f"{made} made, {current} current already, {launched.seconds:.1f} s.")
    if launched.failures:
        fail("\n".join(launched.failures), 1)
