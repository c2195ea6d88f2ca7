"""Packages as plug-ins of Mitsuba 3 with a scene that renders.

`tsuya_btf.py` and `tsuya_scratches.py` are the plug-ins: each is copied as it is and needs nothing
of Tsuya. `render.py` goes with them.
"""

from __future__ import annotations

from pathlib import Path

from storage.packages import Package
from tsuya.exports.format import Format, Notes


def _write_btf(package: Package, target: Path) -> Notes:
    from tsuya.exports.mitsuba.btf import write_btf

    return write_btf(package, target)


def _write_scratches(package: Package, target: Path) -> Notes:
    from tsuya.exports.mitsuba.scratches import write_scratches

    return write_scratches(package, target)


FORMATS = (
    Format("mitsuba", ("neural_btf",), "", "a BSDF of Mitsuba 3, with a scene", _write_btf),
    Format(
        "mitsuba", ("glass_scratches",), "", "a BSDF of Mitsuba 3, with a scene", _write_scratches
    ),
)
