"""The command line: ``tsuya run``, ``demo``, ``status``, ``path``, ``rollback``, ``doctor``.

Exit codes: 0 done, 1 a run or a check failed, 2 what was given cannot be used, 130 interrupted.
"""

from __future__ import annotations

import functools
import json
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import click
from rich.console import Console

from assets_defs.inbox import take_in
from assets_defs.launcher import LaunchError, Outcome, Request, check_settings
from assets_defs.settings import PRESETS
from assets_defs.system import Dimension, System
from assets_defs.systems import SYSTEMS
from assets_defs.workspace import CHECKOUT, Workspace
from storage.errors import StoreError
from tsuya.doctor import examine
from tsuya.gallery import write_gallery
from tsuya.report import (
    figures_table,
    outcome_reports,
    parse_key,
    sizes_table,
    slot_report,
    status_table,
)
from tsuya.session import Session, SetUpError, open_session

PICTURES = CHECKOUT / "pictures"

_as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")


def _says_errors(command: Callable[..., None]) -> Callable[..., None]:
    """What went wrong as one sentence on stderr, and the exit code that belongs to it."""

    @functools.wraps(command)
    def wrapped(*arguments: Any, **options: Any) -> None:
        try:
            command(*arguments, **options)
        except KeyboardInterrupt:
            _fail("Interrupted: what was made stays; run again to go on.", 130)
        except (ValueError, StoreError, SetUpError) as error:
            _fail(str(error), 2)

    return wrapped


def _fail(sentence: str, code: int) -> None:
    click.echo(sentence, err=True)
    sys.exit(code)


@click.group()
@click.version_option(package_name="tsuya")
def main() -> None:
    """Appearance measurements to compact assets and pictures."""


@main.group()
def run() -> None:
    """Make a system's assets; what is current is skipped."""


def _run_command(system: System) -> click.Command:
    """``tsuya run SYSTEM``: one option a dimension, from what the system declares."""

    @_says_errors
    def launch(
        preset: str | None, settings: Sequence[str], force: bool, as_json: bool, **items: Any
    ) -> None:
        with open_session(Console(stderr=True)) as session:
            given = _fields(settings)
            check_settings(system, preset, given)  # before a file is copied
            chosen = {
                dimension.name: [
                    _key(item, system, dimension, given, session)
                    for item in items[dimension.name] or dimension.examples
                ]
                for dimension in system.dimensions
            }
            request = Request(system, system.cross_product(chosen), preset, given, force)
            launched = _launch(session, [request])
        _report(session, launched, as_json)

    options: list[click.Parameter] = [
        click.Option(
            [f"--{dimension.name}"],
            multiple=True,
            help=f"{_what_may_be_given(dimension)}; may be repeated. "
            f"Default: {', '.join(dimension.examples)}.",
        )
        for dimension in system.dimensions
    ]
    options += [
        click.Option(["--preset"], type=click.Choice(PRESETS), help="Sizes; default: as before."),
        click.Option(
            ["--set", "settings"],
            multiple=True,
            metavar="FIELD=VALUE",
            help="A setting, for every asset that has it; may be repeated.",
        ),
        click.Option(["--force"], is_flag=True, help="Also make what is current."),
        click.Option(["--json", "as_json"], is_flag=True, help="Print one JSON object."),
    ]
    names = sorted({f for plan in system.plans.values() for f in plan.settings.model_fields})
    return click.Command(
        system.name,
        callback=launch,
        params=options,
        help=f"{system.title}. Settings: {', '.join(names)}.",
    )


def _what_may_be_given(dimension: Dimension) -> str:
    folders = ", a folder" if dimension.folders else ""
    file = (
        f"A file ({', '.join(dimension.suffixes)}){folders} or one of "
        if dimension.suffixes
        else ""
    )
    return f"{file}{', '.join(dimension.builtin)}{', a number' if dimension.numbers else ''}"


for _system in SYSTEMS.values():
    run.add_command(_run_command(_system))


@main.command()
@_as_json
@_says_errors
def demo(as_json: bool) -> None:
    """Make every system's built-in examples and write their pictures."""
    with open_session(Console(stderr=True)) as session:
        requests = [Request(system, system.examples(), "demo") for system in SYSTEMS.values()]
        launched = _launch(session, requests)
    slots = [outcome.slot for outcome in launched.outcomes]
    written = write_gallery(session.workspace.store, slots, PICTURES)
    _report(session, launched, as_json)
    if not as_json:
        for path in written:
            click.echo(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)
        click.echo("\nLook at the pictures above. `make ui` opens the graph: http://127.0.0.1:3000")


@main.command()
@_as_json
@_says_errors
def status(as_json: bool) -> None:
    """What is stored: versions, sizes, what waits for checks, what was rejected."""
    store = _workspace().store
    reports = [slot_report(store, slot) for slot in store.slots()]
    if as_json:
        click.echo(json.dumps({"assets": reports}))
    else:
        _output().print(status_table(reports))


@main.command()
@click.argument("key")
@_says_errors
def path(key: str) -> None:
    """Print the folder of KEY's current version, e.g. photo_fur/fur_photo/grass."""
    click.echo(_workspace().store.folder(parse_key(key)))


@main.command()
@click.argument("key")
@_says_errors
def rollback(key: str) -> None:
    """Make the good version before KEY's current one current again."""
    click.echo(_workspace().store.rollback(parse_key(key)))


@main.command()
@_as_json
def doctor(as_json: bool) -> None:
    """Check what the project needs of this machine, and draw one picture."""
    _workspace()
    findings = examine(PICTURES / "doctor.png")
    if as_json:
        click.echo(json.dumps({"findings": [vars(finding) for finding in findings]}))
    for finding in findings if not as_json else ():
        click.echo(f"{'ok  ' if finding.met else 'FAIL'} {finding.requirement}: {finding.found}")
    sys.exit(0 if all(finding.met for finding in findings) else 1)


def _output() -> Console:
    """Standard output; a file or a pipe gets lines wide enough for the tables."""
    return Console(width=None if sys.stdout.isatty() else 160)


def _workspace() -> Workspace:
    from dotenv import load_dotenv

    load_dotenv(CHECKOUT / ".env")
    return Workspace.from_environment()


def _key(
    item: str, system: System, dimension: Dimension, given: Mapping[str, Any], session: Session
) -> str:
    """The key of a built-in or registered item; a file is taken into the inbox."""
    known = system.sources(dimension.name, session.workspace.inbox(system.name))
    if item in known or not (dimension.suffixes or dimension.folders):
        return system.source(dimension.name, item, session.workspace.inbox(system.name)).key
    if not Path(item).exists():
        raise ValueError(
            f"{item}: no such {dimension.name}; expected a file or one of {', '.join(known)}."
        )
    return take_in(Path(item), system, dimension, given, session.workspace, session.instance)


def _fields(settings: Sequence[str]) -> Mapping[str, Any]:
    """``FIELD=VALUE`` pairs; values are JSON where they can be, else text."""
    fields = {}
    for pair in settings:
        name, equals, value = pair.partition("=")
        if not equals:
            raise ValueError(f"--set is {pair!r}; expected FIELD=VALUE.")
        try:
            fields[name] = json.loads(value)
        except ValueError:
            fields[name] = value
    return fields


class _Launched(NamedTuple):
    """What several launches came to."""

    outcomes: list[Outcome]
    failures: list[str]
    seconds: float


def _launch(session: Session, requests: Sequence[Request]) -> _Launched:
    """Launch one after the other; a failure ends none of the others."""
    started = time.perf_counter()
    outcomes: list[Outcome] = []
    failures: list[str] = []
    for request in requests:
        try:
            outcomes += session.launcher.launch(request)
        except LaunchError as error:
            outcomes += error.outcomes
            failures.append(str(error))
    return _Launched(outcomes, failures, time.perf_counter() - started)


def _report(session: Session, launched: _Launched, as_json: bool) -> None:
    """Print what became of the launches; exit with 1 where something failed."""
    reports = outcome_reports(session.workspace.store, launched.outcomes)
    if as_json:
        summary = {"seconds": round(launched.seconds, 3), "failures": launched.failures}
        click.echo(json.dumps(summary | {"assets": reports}))
    else:
        _output().print(sizes_table(reports), figures_table(reports))
        made = sum(1 for outcome in launched.outcomes if outcome.state == "made")
        current = len(reports) - made
        click.echo(f"{made} made, {current} current already, {launched.seconds:.1f} s.")
    if launched.failures:
        _fail("\n".join(launched.failures), 1)
