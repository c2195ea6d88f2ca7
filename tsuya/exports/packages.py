"""A package itself, and its frames."""

from __future__ import annotations

from pathlib import Path

from storage.packages import Package
from tsuya.exports.format import ALL_SYSTEMS, Format, Notes


def write_package_file(package: Package, target: Path) -> Notes:
    """The package as it is."""
    target.write_bytes(package.whole())
    return ()


def write_frames(package: Package, target: Path) -> Notes:
    """The stage's frames in linear light, a half-float EXR a view, in a folder.

    Raises ValueError for a package without views.
    """
    from tsuya.picture_files import write_picture

    views = package.meta["views"]
    if not views:
        raise ValueError(f"{package.name} has no views; expected a package with some.")
    for view in views:
        write_picture(package.picture(view["picture"]), target / view["name"], "exr")
    return ("The frames are of 8 bits; `tsuya pictures KEY --as exr` has floats where there are.",)


FORMATS = (
    Format("tsuya", ALL_SYSTEMS, ".tsuya", "the package (docs/packages.md)", write_package_file),
    Format("frames", ALL_SYSTEMS, "", "the stage's frames, linear EXR", write_frames),
)
