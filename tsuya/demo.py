"""``tsuya demo``: every system's built-in examples; each picture's path as soon as it is there."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from assets_defs.launcher import Outcome, Request
from assets_defs.systems import SYSTEMS
from tsuya.gallery import PICTURES, write_overviews, write_pictures
from tsuya.session import Session, launch_all, open_session, report


def run_demo(as_json: bool) -> None:
    """Launch the examples of all systems, write and name their pictures, report."""
    with open_session() as session:

        def show(outcomes: Sequence[Outcome]) -> None:
            slots = [outcome.slot for outcome in outcomes]
            _name(session, write_pictures(session.workspace.store, slots, PICTURES), as_json)

        requests = [Request(system, system.examples(), "demo") for system in SYSTEMS.values()]
        launched = launch_all(session, requests, show)
        slots = [outcome.slot for outcome in launched.outcomes]
        _name(session, write_overviews(session.workspace.store, slots, PICTURES), as_json)
    report(session, launched, as_json)
    if not as_json:
        click.echo("\nThe pictures are under pictures/. `make ui` opens the graph in a browser.")


def _name(session: Session, paths: Sequence[Path], as_json: bool) -> None:
    """Say where pictures are."""
    here = Path.cwd()
    for path in paths if not as_json else ():
        session.say(str(path.relative_to(here) if path.is_relative_to(here) else path))
