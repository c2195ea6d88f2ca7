"""Drives: what the cameras of one car photographed, from files of whichever program.

`formats` lists what is understood and finds which it is; a module a format turns files into a
`Recording` (`recordings`): photographs with their cameras, times, lenses and poses, as the files
have them. `drive` makes of it what the street is built from, and refuses what is no drive;
`pixels` decodes the photographs of one instant, through `lenses` to pinholes.
"""

from __future__ import annotations

from storage.readers.drives.drive import read_drive
from storage.readers.drives.driven import Drive
from storage.readers.drives.pixels import frame_notes, read_frame, read_masks

__all__ = ["Drive", "frame_notes", "read_drive", "read_frame", "read_masks"]
