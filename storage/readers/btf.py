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
from storage.readers.btf_photographs import ExrColours, open_photographs
from storage.readers.btf_ubo2014 import open_ubo2014
from storage.readers.opening import first_bytes, unreadable

__all__ = ["ExrColours", "MeasuredBTF", "open_btf"]

_EXPECTED = "a zip or folder of BTF photographs, or a .btf file of UBO2014"
_OTHER_ARCHIVES = (
    (b"Rar!", "a RAR archive"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive"),
    (b"\x1f\x8b", "a gzip file"),
    (b"BZh", "a bzip2 file"),
    (b"\xfd7zXZ", "an xz file"),
)


def open_btf(
    path: str | PathLike[str],
    crop: tuple[int, int, int, int] | None = None,
    exr_colours: ExrColours = "auto",
) -> MeasuredBTF:
    """Open a measured BTF and check all of its names and headers.

    ``path``: a zip or a folder of photographs named by their directions (UBO2003 and ATRIUM: JPEG,
    Radiance; UTIA: PNG, EXR), a folder of such zips or with a ``.btf`` file, or a ``.btf`` file of
    UBO2014. ``crop``: left, top, width, height in pixels of the photographs as they lie in their
    files; only the crop is kept, whole files are decoded for it. ``exr_colours``: what R, G, B of
    EXR files hold, "rgb", "xyz", or "auto": what their chromaticities say, else by their names and
    values.

    A zip or folder needs the same lights for every view; where more than half of the 81 x 81 pairs
    of those databases are there and nothing else, all of them are expected. Directions are the
    names' nominal ones.

    Raises BadInput, naming the file and the field, for a path that is missing, encrypted, cut
    short or something else, for missing pairs, for two different files of a pair, for sizes and
    formats that differ or cannot be read, and for a crop that is empty or sticks out. Pixels are
    first looked at when :meth:`MeasuredBTF.read` decodes them, those of one photograph aside.
    """
    # Absolute: a pickled copy may be read from another working directory.
    file = Path(os.path.abspath(path))
    if file.is_dir():
        inside = _only_btf_file(file)
        if inside is None:
            return open_photographs(file, crop, exr_colours)
        file = inside
    start = first_bytes(file, 6, _EXPECTED, largest=None)
    if start.startswith(b"!"):
        return open_ubo2014(file, crop)
    if start.startswith(b"PK"):
        return open_photographs(file, crop, exr_colours)
    for signature, kind in _OTHER_ARCHIVES:
        if start.startswith(signature):
            raise BadInput(file, "format", kind, f"{_EXPECTED}: unpack it to a folder")
    raise BadInput(file, "format", "unknown" if start else "unknown (the file is empty)", _EXPECTED)


def _only_btf_file(folder: Path) -> Path | None:
    """The file of UBO2014 in a folder that holds one."""
    try:
        found = [file for file in folder.iterdir() if file.suffix.lower() == ".btf"]
    except OSError as error:
        raise unreadable(folder, error, _EXPECTED) from error
    return found[0] if len(found) == 1 else None
