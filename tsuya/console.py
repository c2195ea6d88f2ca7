"""How a command says what went wrong, and where it prints."""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tsuya.interruption import EXIT_CODE

if TYPE_CHECKING:
    from rich.console import Console


INTERRUPTED = "Interrupted: what was made stays; run again to go on."


class SetUpError(Exception):
    """The checkout is not set up, or not as a command needs it."""


def dagster_home() -> Path:
    """The folder of Dagster's history. Raises SetUpError where there is none that can be used."""
    given = os.environ.get("DAGSTER_HOME")
    if not given:
        raise SetUpError("DAGSTER_HOME is not set; expected a folder: run `make setup`.")
    home = Path(given)
    if not home.is_absolute():
        raise SetUpError(f"DAGSTER_HOME is {given!r}; expected an absolute path.")
    if not home.is_dir():
        raise SetUpError(f"DAGSTER_HOME is {given!r}; expected a folder: run `make setup`.")
    return home


def says_errors(command: Callable[..., None]) -> Callable[..., None]:
    """What went wrong as one sentence on stderr, and the exit code that belongs to it."""

    @functools.wraps(command)
    def wrapped(*arguments: Any, **options: Any) -> None:
        from storage.errors import StoreError

        try:
            command(*arguments, **options)
        except KeyboardInterrupt:
            fail(INTERRUPTED, EXIT_CODE)
        except (ValueError, StoreError, SetUpError) as error:
            fail(str(error), 2)

    return wrapped


def fail(sentence: str, code: int) -> None:
    """Say why on stderr and end."""
    click.echo(sentence, err=True)
    sys.exit(code)


def output() -> Console:
    """Standard output; a file or a pipe gets lines wide enough for the tables."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else 160)


def shown_path(path: Path) -> str:
    """A path as one would type it here."""
    here = Path.cwd()
    return str(path.relative_to(here) if path.is_relative_to(here) else path)
