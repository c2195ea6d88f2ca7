"""The one error of all readers."""

from __future__ import annotations

from os import PathLike, fspath
from pathlib import PurePath

MOST_QUOTED = 80
"""Characters of a file's content in a sentence."""


def shortened(text: str, most: int = MOST_QUOTED) -> str:
    """A text cut in its middle: names in a series differ at the end, sentences begin in front."""
    end = most // 4
    return text if len(text) <= most else f"{text[: most - end - 1]}…{text[-end:]}"


class BadInput(ValueError):  # noqa: N818 - read aloud: "raises BadInput"
    """A user's file cannot be used; the text is one sentence that says why.

    ``BadInput("in/fur.png", "width", "1 pixel", "at least 64 pixels")`` reads
    ``fur.png: width is 1 pixel; expected at least 64 pixels.`` All four parts stay available
    as attributes; ``file`` keeps the whole path. The name, the field and what was found are
    shortened: they may come from the file. Who puts a file's words into ``expected`` shortens them.
    """

    def __init__(self, file: str | PathLike[str], field: str, found: str, expected: str) -> None:
        self.file = fspath(file)
        self.field = shortened(field)
        self.found = shortened(found) or "empty"
        self.expected = expected
        name = shortened(PurePath(self.file).name or self.file)
        sentence = f"{name}: {self.field} is {self.found}; expected {expected}."
        # A line break or a control character in a file's name must not break the line of a log.
        super().__init__("".join(c if c.isprintable() else "?" for c in sentence))

    def __reduce__(self) -> tuple[type[BadInput], tuple[str, str, str, str]]:
        # The default would rebuild the error from its sentence alone and fail: errors travel
        # between worker processes.
        return BadInput, (self.file, self.field, self.found, self.expected)
