"""The examples in the docstrings of `pipelines`, `storage` and `tsuya`."""

from __future__ import annotations

import doctest
import importlib

from benchmarks.structure import modules

PACKAGES = ("pipelines", "storage", "tsuya")
PLUG_INS = "tsuya.exports.mitsuba.tsuya_"
"""How modules begin that Mitsuba imports once it has a variant."""


def found_examples() -> list[doctest.DocTest]:
    """One for each docstring that has an example to run."""
    finder = doctest.DocTestFinder(exclude_empty=True)
    found = []
    for name in modules():
        if name.endswith("__main__") or name.startswith(PLUG_INS):
            continue
        if name.partition(".")[0] in PACKAGES:
            found += finder.find(importlib.import_module(name))
    return [test for test in found if any(_is_run(example) for example in test.examples)]


def _is_run(example: doctest.Example) -> bool:
    return not example.options.get(doctest.SKIP, False) and not example.source.startswith("import ")


def run_examples(examples: list[doctest.DocTest]) -> None:
    """Run all; raises AssertionError with what each wrong one printed."""
    runner = doctest.DocTestRunner(verbose=False, optionflags=doctest.NORMALIZE_WHITESPACE)
    said: list[str] = []
    for example in examples:
        runner.run(example, out=said.append)
    assert not said, "".join(said)
