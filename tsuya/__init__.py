"""What is stored, for notebooks and scripts; and what a person runs (`tsuya.cli`).

>>> import tsuya
>>> basis = tsuya.load("ssdf_lighting/ssdf_basis/teapot")   # doctest: +SKIP
>>> frames = tsuya.open("photo_fur/fur_frames/teapot.grass")["frames"]   # doctest: +SKIP

Neither imports Dagster.
"""

from tsuya.loading import load, open  # `tsuya.open`, as `gzip.open`

__all__ = ["load", "open"]
