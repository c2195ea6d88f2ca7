"""One drive, written down in every format by other programs or by hand, and read back.

``truth`` has its poses and pictures; a module a family of formats writes them as that format's
public description says, knowing nothing of the readers; ``comparing`` counts what comes back
otherwise.
"""

from __future__ import annotations

from benchmarks.written_drives.comparing import FORMS, format_mismatches

__all__ = ["FORMS", "format_mismatches"]
