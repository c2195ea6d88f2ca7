"""The command line, ``tsuya``: make, look, go back, examine.

Exit codes: 0 done, 1 a run or a check failed, 2 what was given cannot be used, 130 interrupted.
Commands import what they need when they are called: help comes at once, and only what launches
imports Dagster.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import click
from click.shell_completion import CompletionItem

from tsuya.console import output, says_errors
from tsuya.interruption import EXIT_CODE

as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")


@click.group()
@click.version_option(package_name="tsuya")
def main() -> None:
    """Appearance measurements to compact assets and pictures."""


def start() -> None:
    """The console script: ``main``, and an end that keeps the exit code of an interruption.

    What was interrupted still holds arrays of Open3D when the process ends; Open3D then counts them
    as leaks, and its own exit code would take the place of ours.
    """
    try:
        main()
    except SystemExit as end:
        if end.code != EXIT_CODE:
            raise
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(EXIT_CODE)


class _Systems(click.Group):
    """``tsuya run SYSTEM``: the systems are imported when their names are asked for."""

    def list_commands(self, context: click.Context) -> list[str]:
        from assets_defs.systems import SYSTEMS

        return list(SYSTEMS)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        from assets_defs.systems import SYSTEMS
        from tsuya.run_command import run_command

        return run_command(SYSTEMS[name]) if name in SYSTEMS else None


class _SystemName(click.ParamType):
    """A system's name; the systems are imported when one is asked for."""

    name = "system"

    def convert(
        self, value: str, parameter: click.Parameter | None, context: click.Context | None
    ) -> str:
        """The name, or an error that lists the names there are."""
        from storage.schemas import systems

        if value not in systems():
            self.fail(f"{value!r} is no system; expected one of {', '.join(systems())}.")
        return value

    def shell_complete(
        self, context: click.Context, parameter: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """The systems' names."""
        from storage.schemas import systems

        return [CompletionItem(name) for name in systems() if name.startswith(incomplete)]


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
    from tsuya.report import file_notes, slot_report, status_notes, status_table

    store = Workspace.of_checkout().store
    reports = [slot_report(store, slot) for slot in store.slots()]
    if as_json:
        click.echo(json.dumps({"assets": reports}))
    else:
        output().print(status_table(reports))
        for note in (*file_notes(reports), *status_notes(reports)):
            click.echo(note)


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
@click.argument("key")
@click.option("--yes", is_flag=True, help="Do not ask.")
@says_errors
def remove(key: str, yes: bool) -> None:
    """Remove KEY, an item like photo_fur/fox-jpg: its file, all that was made of it."""
    from tsuya.remove import remove as remove_item

    remove_item(key, ask=not yes)


@main.command()
@click.argument("key")
@click.option(
    "--as",
    "ending",
    type=click.Choice(("png", "exr", "webp", "mp4")),
    default="png",
    show_default=True,
    help="EXR is linear; WebP and MP4 are for what moves.",
)
@says_errors
def pictures(key: str, ending: str) -> None:
    """Write KEY's pictures again, full size, under pictures/, and print their paths."""
    from assets_defs.workspace import Workspace
    from tsuya.console import shown_path
    from tsuya.gallery import write_pictures_as
    from tsuya.keys import parse_key

    workspace = Workspace.of_checkout()
    slot = parse_key(key)
    for path in write_pictures_as(workspace.store, slot, ending, workspace.pictures):
        click.echo(shown_path(path))


@main.command()
@click.argument("keys", metavar="[KEY]…", nargs=-1)
@click.option("--to", "name", metavar="FORMAT", help="Left out: the formats there are.")
@click.option("--out", type=click.Path(path_type=Path), help="Default: below exports/.")
@says_errors
def export(keys: tuple[str, ...], name: str | None, out: Path | None) -> None:
    """Write KEY's package, or a .tsuya file, for another program, and print the path."""
    from assets_defs.workspace import Workspace
    from tsuya.console import shown_path
    from tsuya.export_command import export as export_packages
    from tsuya.export_command import format_lines
    from tsuya.packages import find_package

    workspace = Workspace.of_checkout()
    if name is None:
        system = find_package(workspace.store, keys[0]).system if keys else None
        click.echo("\n".join(format_lines(system)))
        return
    for path, notes in export_packages(workspace, keys, name, out):
        click.echo(shown_path(path))
        for note in notes:
            click.echo(f"  {note}")


@main.command()
@click.argument("key", required=False)
@as_json
@says_errors
def verify(key: str | None, as_json: bool) -> None:
    """Check every stored byte, of KEY or of everything; put what is damaged out of use."""
    from assets_defs.workspace import Workspace
    from storage.verification import verify_slot
    from tsuya.keys import parse_key

    store = Workspace.of_checkout().store
    slots = [parse_key(key)] if key else list(store.slots())
    found = []
    for slot in slots:
        for finding in verify_slot(store, slot):
            found.append(finding)
            if not as_json:
                click.echo(finding)
    if as_json:
        click.echo(json.dumps({"slots": len(slots), "damaged": [str(each) for each in found]}))
    else:
        again = " Run again to make it anew: `tsuya run SYSTEM`." if found else ""
        click.echo(f"{len(slots)} slots verified, {len(found)} damaged.{again}")
    sys.exit(1 if found else 0)


@main.command()
@click.argument("system", type=_SystemName())
@says_errors
def settings(system: str) -> None:
    """What can be set of a SYSTEM: type, range, default and meaning."""
    from assets_defs.systems import SYSTEMS
    from tsuya.settings_table import settings_table

    output().print(settings_table(SYSTEMS[system]))


@main.command()
@click.argument("shell", type=click.Choice(("bash", "zsh", "fish")))
def completion(shell: str) -> None:
    """Print what completes commands, items and settings: eval "$(tsuya completion bash)"."""
    from click.shell_completion import get_completion_class

    found = get_completion_class(shell)
    assert found is not None
    click.echo(found(main, {}, "tsuya", "_TSUYA_COMPLETE").source())


@main.command()
@click.option(
    "--drive",
    type=click.Path(exists=True, path_type=Path),
    help="What a film or a folder of photographs is good for, instead.",
)
@click.option("--focal", type=float, help="Of the drive: its focal length, pixels.")
@as_json
@says_errors
def doctor(drive: Path | None, focal: float | None, as_json: bool) -> None:
    """Check what the project needs of this machine, and draw one picture."""
    from assets_defs.workspace import Workspace
    from tsuya.doctor import examine

    if drive is not None:
        from tsuya.drive_doctor import examine_drive

        findings = examine_drive(drive, focal)
    else:
        findings = examine(Workspace.of_checkout().pictures / "doctor.png")
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


@main.command()
@click.argument("keys", nargs=-1, metavar="[KEY]...")
@says_errors
def view(keys: tuple[str, ...]) -> None:
    """Show packages live in the browser: KEYs, .tsuya files, or all of the store."""
    from assets_defs.workspace import Workspace
    from tsuya.view_server import serve

    serve(Workspace.of_checkout().store, keys)


if __name__ == "__main__":
    main()
