"""``tsuya demo``: every system's built-in examples; each picture's path as soon as it is there."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from assets_defs.launcher import Outcome, Request
from assets_defs.systems import SYSTEMS
from tsuya.console import shown_path
from tsuya.gallery import write_overviews, write_pictures
from tsuya.session import launch_all, open_session, report


def run_demo(as_json: bool) -> None:
    """Launch the examples of all systems, write and name their pictures, report."""
    paths: list[Path] = []
    with open_session() as session:
        store, folder = session.workspace.store, session.workspace.pictures

        def name(written: Sequence[Path]) -> None:
            paths.extend(written)
            for path in written if not as_json else ():
                session.say(shown_path(path))

        def show(outcomes: Sequence[Outcome]) -> None:
            name(write_pictures(store, [outcome.slot for outcome in outcomes], folder))

        requests = [Request(system, system.examples(), "demo") for system in SYSTEMS.values()]
        launched = launch_all(session, requests, show)
        slots = [outcome.slot for outcome in launched.outcomes]
        name(write_overviews(store, slots, folder))
    report(session, launched, paths if as_json else (), as_json)
    if not as_json:
        click.echo(
            "\nThe pictures are under pictures/. `tsuya view` shows everything live in a browser, "
            "`make ui` opens the graph."
        )
