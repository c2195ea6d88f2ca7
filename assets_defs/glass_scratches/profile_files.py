"""Cross-sections of scratches: built-in ones, and users' files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from assets_defs.glass_scratches.photograph_files import is_photograph
from assets_defs.sources import Source

if TYPE_CHECKING:
    from pipelines.glass_scratches.tables.scans import Measured


def load_profile(source: Source, settings: Mapping[str, Any]) -> Measured:
    """A cross-section with the settings of ``scratch_profile``, the built-in one for a photograph,
    which tells none; what was mended or left out of a user's file is in its notes. Raises
    ValueError, BadInput for one that is none."""
    from pipelines.glass_scratches.tables.profiles import built_in_profile
    from pipelines.glass_scratches.tables.scans import Measured, measured_profile
    from storage.readers.profiles import read_profile

    if source.path is None or is_photograph(source):
        width, depth = settings["profile_width"], settings["profile_depth"]
        return Measured(built_in_profile(settings["shape"], width, depth), ())
    read = read_profile(source.path, settings.get("step"))
    level = settings.get("level", False)
    made = measured_profile(read.points, read.gaps, source.name, level=level)
    return made._replace(notes=(*read.notes, *made.notes))
