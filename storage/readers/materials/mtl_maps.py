"""Lines of material libraries that name a texture: options, then a file."""

from __future__ import annotations

from pathlib import Path

from storage.readers.bad_input import shortened
from storage.readers.materials.description import Map, Placing
from storage.readers.materials.material import Wrap
from storage.readers.opening import number, whole_file
from storage.readers.references import file_beside

_LARGEST_TEXTURE = 256 << 20  # bytes
_LARGEST_NUMBER = 1e6
_Options = dict[str, list[float] | list[str]]
_WORDS = {"-blendu": 1, "-blendv": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1, "-type": 1}
"""Options with a word after them."""
_NUMBERS = {"-o": 3, "-s": 3, "-t": 3, "-mm": 2, "-bm": 1, "-boost": 1, "-texres": 1}
"""Options with so many numbers after them, or fewer."""


def read_map(library: Path, rest: str) -> tuple[Map | None, list[str]]:
    """The texture that the rest of a line names, with its options, or None for one that is
    missing; and what is to be said. Names may have spaces; they count from the library's folder.

    Raises ValueError for a line without a name.
    """
    options, name = _split(rest)
    there = file_beside(library, name)
    if there is None and (words := name.split()):
        # Options that nobody knows, or a comment behind the name.
        tails = [" ".join(words[start:]) for start in range(1, len(words))]
        heads = [" ".join(words[:end]) for end in range(len(words) - 1, 0, -1)]
        found = [(text, file_beside(library, text)) for text in (*tails, *heads)]
        there = next((path for _, path in found if path is not None), None)
    if not name:
        raise ValueError("the name of a texture")
    if there is None:
        return None, [f"its texture {shortened(name)} is missing"]
    notes = []
    if any(options.get("-t", [0.0])):
        notes.append(f"the turbulence of its texture {shortened(there.name)} is not used")
    if options.get("-imfchan", ["l"]) != ["l"]:
        notes.append(f"the choice of a channel of {shortened(there.name)} is not used")
    (su, sv), (ou, ov) = _pair(options, "-s", 1.0, 1.0), _pair(options, "-o", 0.0, 0.0)
    wrap: Wrap = "clamp" if options.get("-clamp") == ["on"] else "repeat"
    file = there
    return (
        Map(
            file,
            file.name,
            lambda: whole_file(file, "a texture", _LARGEST_TEXTURE),
            Placing(0, (su, 0.0, ou, 0.0, sv, ov)),
            (wrap, wrap),
            _pair(options, "-mm", 0.0, 1.0),
            _pair(options, "-bm", 1.0, 1.0)[0],
        ),
        notes,
    )


def _pair(options: _Options, key: str, first: float, second: float) -> tuple[float, float]:
    """The first two numbers of an option, those that are missing by default."""
    given = [float(value) for value in options.get(key, [])]
    found = [*given[:2], *(first, second)[len(given) :]]
    return found[0], found[1]


def _split(rest: str) -> tuple[_Options, str]:
    """The options of a line and what is left of it, the name."""
    options: _Options = {}
    rest = rest.strip()
    while rest:
        word, _, after = rest.partition(" ")
        option = word.lower()
        if option in _WORDS:
            value, _, rest = after.strip().partition(" ")
            options[option] = [value.lower()]
        elif option in _NUMBERS:
            rest, values = after.strip(), list[float]()
            while len(values) < _NUMBERS[option]:
                word, _, after = rest.partition(" ")
                try:
                    found = number(word)
                    if not abs(found) <= _LARGEST_NUMBER:
                        break
                    values.append(found)
                except ValueError:
                    break
                rest = after.strip()
            options[option] = values
        else:
            break
        rest = rest.strip()
    return options, rest.strip('"')
