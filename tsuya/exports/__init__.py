"""What packages can be turned into for other programs: a module a family of formats.

Each module has ``FORMATS``. A format reads a package and nothing else, so that whoever got a
`.tsuya` file can export it, too.
"""

from __future__ import annotations

import importlib
import pkgutil

from tsuya.exports.format import Format

__all__ = ["Format", "find_format", "formats"]


def formats(system: str | None = None) -> tuple[Format, ...]:
    """All formats, or those that a system's packages can be written as, by name."""
    modules = (
        importlib.import_module(f"{__name__}.{found.name}")
        for found in pkgutil.iter_modules(__path__)
    )
    found = [each for module in modules for each in getattr(module, "FORMATS", ())]
    fitting = [each for each in found if system is None or system in each.systems]
    return tuple(sorted(fitting, key=lambda each: each.name))


def find_format(name: str, system: str) -> Format:
    """The format of a name for a system. Raises ValueError that lists those there are."""
    fitting = formats(system)
    for each in fitting:
        if each.name == name:
            return each
    known = ", ".join(each.name for each in fitting)
    raise ValueError(f"--to is {name!r}, which {system} has not; expected one of {known}.")
