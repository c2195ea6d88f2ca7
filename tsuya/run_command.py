"""``tsuya run SYSTEM``: one option a dimension, from what the system declares."""

from __future__ import annotations

import itertools
import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from assets_defs.settings import PRESETS
from assets_defs.sources import Source
from assets_defs.system import Dimension, System
from storage.readers.bad_input import shortened
from tsuya.console import says_errors
from tsuya.settings_table import setting_rows

if TYPE_CHECKING:
    from tsuya.session import Session


def run_command(system: System) -> click.Command:
    """The command of a system."""
    options: list[click.Parameter] = [
        click.Option(
            [f"--{dimension.name}"],
            multiple=True,
            help=f"{_what_may_be_given(dimension)}; may be repeated. "
            f"Default: {', '.join(dimension.examples)}.",
            shell_complete=_complete_item(dimension),
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
            shell_complete=_complete_setting(system),
        ),
        click.Option(["--force"], is_flag=True, help="Also make what is current."),
        click.Option(["--json", "as_json"], is_flag=True, help="Print one JSON object."),
    ]

    @says_errors
    def launch(
        preset: str | None, settings: Sequence[str], force: bool, as_json: bool, **items: Any
    ) -> None:
        _launch(system, items, preset, settings, force=force, as_json=as_json)

    return _RunCommand(
        system.name, callback=launch, params=options, help=f"{system.title}.", system=system
    )


class _RunCommand(click.Command):
    """A command whose help ends with the system's settings."""

    def __init__(self, name: str, *, system: System, **options: Any) -> None:
        super().__init__(name, **options)
        self._system = system

    def format_epilog(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """List the settings below the options."""
        with formatter.section("Settings, for --set"):
            formatter.write_dl(
                [
                    (f"{row.name} {row.values}", f"{row.meaning} (default {row.default})")
                    for row in setting_rows(self._system)
                ],
                col_max=44,
            )


def _launch(
    system: System,
    items: Mapping[str, Sequence[str]],
    preset: str | None,
    settings: Sequence[str],
    *,
    force: bool,
    as_json: bool,
) -> None:
    from assets_defs.launcher import Request, ask_before_work, check_settings
    from tsuya.gallery import write_overviews, write_pictures
    from tsuya.session import launch_all, open_session, report

    with open_session() as session:
        given = _fields(settings)
        check_settings(system, preset, given)  # before a file is copied
        found = {
            dimension.name: [
                _source(item, system, dimension, session)
                for item in items[dimension.name] or dimension.examples
            ]
            for dimension in system.dimensions
        }
        inbox = session.workspace.inbox(system.name)
        known = {key for name in found for key in system.sources(name, inbox)}
        for sources in itertools.product(*found.values()):
            # Before a file is copied. What is known has settings of its own; the launch asks it.
            if any(source.path and source.key not in known for source in sources):
                ask_before_work(system, dict(zip(found, sources, strict=True)), preset, given)
        chosen = {
            dimension.name: [
                _key(source, system, dimension, given, session) for source in found[dimension.name]
            ]
            for dimension in system.dimensions
        }
        request = Request(system, system.cross_product(chosen), preset, given, force)
        launched = launch_all(session, [request])
        slots = [outcome.slot for outcome in launched.outcomes]
        store, folder = session.workspace.store, session.workspace.pictures
        paths = [*write_pictures(store, slots, folder), *write_overviews(store, slots, folder)]
    report(session, launched, paths, as_json)


def _complete_item(dimension: Dimension) -> Callable[..., list[CompletionItem]]:
    """The shell's completion of an item: built-in ones, then files."""

    def complete(
        context: click.Context, parameter: click.Parameter, begun: str
    ) -> list[CompletionItem]:
        known = [CompletionItem(key) for key in dimension.builtin if key.startswith(begun)]
        has_files = bool(dimension.suffixes) or dimension.folders
        return [*known, *([CompletionItem(begun, type="file")] if has_files else ())]

    return complete


def _complete_setting(system: System) -> Callable[..., list[CompletionItem]]:
    """The shell's completion of ``FIELD=``."""

    def complete(
        context: click.Context, parameter: click.Parameter, begun: str
    ) -> list[CompletionItem]:
        rows = setting_rows(system)
        return [
            CompletionItem(f"{row.name}=", help=row.meaning)
            for row in rows
            if row.name.startswith(begun)
        ]

    return complete


def _what_may_be_given(dimension: Dimension) -> str:
    folders = ", a folder" if dimension.folders else ""
    file = (
        f"A file ({', '.join(dimension.suffixes)}){folders} or one of "
        if dimension.suffixes
        else ""
    )
    return f"{file}{', '.join(dimension.builtin)}{', a number' if dimension.numbers else ''}"


def _source(item: str, system: System, dimension: Dimension, session: Session) -> Source:
    """A built-in or registered item, or a file that is not in the inbox yet."""
    inbox = session.workspace.inbox(system.name)
    known = system.sources(dimension.name, inbox)
    if item in known or not (dimension.suffixes or dimension.folders):
        return system.source(dimension.name, item, inbox)
    if not os.path.exists(item):  # False, unlike Path's, for names too long to be one
        raise ValueError(
            f"{shortened(item)}: no such {dimension.name}; expected a file or one of "
            f"{', '.join(known)}."
        )
    return Source.of(Path(item))


def _key(
    source: Source,
    system: System,
    dimension: Dimension,
    given: Mapping[str, Any],
    session: Session,
) -> str:
    """The key of an item; a file is taken into the inbox."""
    from assets_defs.taking_in import take_in

    inbox = session.workspace.inbox(system.name)
    if source.path is None or source.path.is_relative_to(inbox):
        return source.key
    return take_in(source.path, system, dimension, given, session.workspace, session.instance)


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
