"""All cases, one kind of file after the other."""

from __future__ import annotations

from benchmarks.captures.case import Case

CASES: tuple[Case, ...] = ()
