"""What moves on the terminal while work goes on: bars that never stand still."""

from __future__ import annotations

import click
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    SpinnerColumn,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
)


class Display:
    """A bar for each system and one for the asset at work, on standard error.

    The wheel and the clock turn while an asset says nothing. Not a terminal: one line for every
    asset instead.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._bars = Progress(
            SpinnerColumn(),
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
        self.stop()

    def stop(self) -> None:
        """Take the bars away."""
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
