"""BTF databases: UBO2003, ATRIUM, UTIA and UBO2014 files to blocks of linear photographs.

None of the databases may be redistributed: users bring their own copies. Which layout a file has
is decided by its content and by the names inside, never by its suffix.
"""

from __future__ import annotations

import os
from os import PathLike
from pathlib import Path

from storage.readers.bad_input import BadInput
from storage.readers.btf_measured import MeasuredBTF
from storage.readers.btf_photographs import open_photographs
from storage.readers.btf_ubo2014 import open_ubo2014
from storage.readers.opening import first_bytes

__all__ = ["MeasuredBTF", "open_btf"]

_EXPECTED = "a zip or folder of BTF photographs, or a .btf file of UBO2014"


def open_btf(
    path: str | PathLike[str], crop: tuple[int, int, int, int] | None = None
) -> MeasuredBTF:
    """Open a measured BTF and check all of its names and headers.

    ``path``: a zip or a folder of photographs named by their directions (UBO2003 and ATRIUM: JPEG,
    Radiance; UTIA: PNG, EXR), or a ``.btf`` file of UBO2014. ``crop``: left, top, width, height in
    pixels of the upright photographs; only the crop is kept, whole files are decoded for it.

    A zip or folder needs the same lights for every view; where more than half of the 81 x 81 pairs
    of those databases are there and nothing else, all of them are expected. Directions are the
    names' nominal ones.

    Raises BadInput, naming the file and the field, for a path that is missing, encrypted, cut
    short or something else, for missing or double pairs, for sizes, depths and formats that differ
    or are not those of a database, and for a crop that is empty or sticks out. Pixels are first
    looked at when :meth:`MeasuredBTF.read` decodes them.
    """
    # Absolute: a pickled copy may be read from another working directory.
    file = Path(os.path.abspath(path))
    if file.is_dir():
        return open_photographs(file, crop)
    start = first_bytes(file, 4, _EXPECTED, largest=None)
    if start.startswith(b"!"):
        return open_ubo2014(file, crop)
    if start in (b"PK\3\4", b"PK\5\6"):  # a member, or the directory of an empty zip
        return open_photographs(file, crop)
    raise BadInput(file, "format", "unknown" if start else "unknown (the file is empty)", _EXPECTED)
