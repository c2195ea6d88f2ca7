"""The command line, ``tsuya``: make, look, go back, examine.

Exit codes: 0 done, 1 a run or a check failed, 2 what was given cannot be used, 130 interrupted.
Commands import what they need when they are called: help comes at once, and only what launches
imports Dagster.
"""

from __future__ import annotations

import json
import sys

import click

from tsuya.console import output, says_errors

as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")


@click.group()
@click.version_option(package_name="tsuya")
def main() -> None:
    """Appearance measurements to compact assets and pictures."""


class _Systems(click.Group):
    """``tsuya run SYSTEM``: the systems are imported when their names are asked for."""

    def list_commands(self, context: click.Context) -> list[str]:
        from assets_defs.systems import SYSTEMS

        return list(SYSTEMS)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        from assets_defs.systems import SYSTEMS
        from tsuya.run_command import run_command

        return run_command(SYSTEMS[name]) if name in SYSTEMS else None


@main.group(cls=_Systems)
def run() -> None:
    """Make a system's assets; what is current is skipped."""


@main.command()
@as_json
@says_errors
def demo(as_json: bool) -> None:
    """Make every system's built-in examples and write their pictures."""
    from tsuya.demo import run_demo

    run_demo(as_json)


@main.command()
@as_json
@says_errors
def status(as_json: bool) -> None:
    """What is stored: versions, sizes, what waits for checks, what was rejected."""
    from assets_defs.workspace import Workspace
    from tsuya.report import slot_report, status_table

    store = Workspace.of_checkout().store
    reports = [slot_report(store, slot) for slot in store.slots()]
    if as_json:
        click.echo(json.dumps({"assets": reports}))
    else:
        output().print(status_table(reports))


@main.command()
@click.argument("key")
@says_errors
def path(key: str) -> None:
    """Print the folder of KEY's current version, e.g. photo_fur/fur_photo/grass."""
    from assets_defs.workspace import Workspace
    from tsuya.keys import parse_key

    click.echo(Workspace.of_checkout().store.folder(parse_key(key)))


@main.command()
@click.argument("key")
@says_errors
def rollback(key: str) -> None:
    """Make the good version before KEY's current one current again."""
    from assets_defs.workspace import Workspace
    from tsuya.keys import parse_key

    click.echo(Workspace.of_checkout().store.rollback(parse_key(key)))


@main.command()
@as_json
def doctor(as_json: bool) -> None:
    """Check what the project needs of this machine, and draw one picture."""
    from assets_defs.workspace import Workspace
    from tsuya.doctor import examine
    from tsuya.gallery import PICTURES

    Workspace.of_checkout()
    findings = examine(PICTURES / "doctor.png")
    if as_json:
        click.echo(json.dumps({"findings": [vars(finding) for finding in findings]}))
    for finding in findings if not as_json else ():
        click.echo(f"{'ok  ' if finding.met else 'FAIL'} {finding.requirement}: {finding.found}")
    sys.exit(0 if all(finding.met for finding in findings) else 1)


@main.command()
@click.option("--port", type=click.IntRange(1, 65_535), help="Default: the first free from 3000.")
@says_errors
def ui(port: int | None) -> None:
    """Open the graph in the web UI; one for each data folder."""
    from tsuya.web_ui import serve

    serve(port)


if __name__ == "__main__":
    main()
