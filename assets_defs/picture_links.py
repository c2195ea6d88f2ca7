"""Pictures in full size: files beside the store, each with an address that the web UI links to.

    <data>/full_size/<system>/<asset>/<partition>/<name>-<hash>.png

A file is called by what it shows, so what shows the same has the same address, also when it is
made again every night. The newest of each name stay, for as long as versions of the asset do.
`tsuya ui` serves the folder on this machine only (`assets_defs/picture_server.py`); the port
belongs to the data folder, so that a process that writes a picture knows its address without
asking, and the address stays valid.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import shutil
import time
import uuid
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from assets_defs.workspace import Workspace
from storage.slugs import slug
from storage.versions import KEEP_VERSIONS, LEAST_AGE_SECONDS, Slot

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

HOST = "127.0.0.1"
KEEP = KEEP_VERSIONS
"""So many pictures of one name stay, as many as versions."""
_FIRST_PORT, _PORTS = 20_000, 10_000
_MILLISECONDS_A_FRAME = 250


def picture_folder(workspace: Workspace) -> Path:
    """Where the pictures of full size lie."""
    return workspace.root / "full_size"


def picture_port(workspace: Workspace) -> int:
    """The port of the data folder: the one that was noted for it, else one by its path."""
    try:
        return int(_port_file(workspace).read_text())
    except (OSError, ValueError):
        path = str(workspace.root.resolve())
        return _FIRST_PORT + int(hashlib.sha256(path.encode()).hexdigest(), 16) % _PORTS


def note_picture_port(workspace: Workspace, port: int) -> None:
    """Have the data folder's pictures at another port from now on: its own is in use."""
    picture_folder(workspace).mkdir(parents=True, exist_ok=True)
    _replace(_port_file(workspace), str(port).encode())


def _port_file(workspace: Workspace) -> Path:
    return picture_folder(workspace) / "port"


@dataclass(frozen=True)
class PictureLinks:
    """The pictures of one asset's partition."""

    workspace: Workspace
    slot: Slot

    def keep(self, name: str, picture: NDArray[np.uint8]) -> str:
        """Write a picture (y, x, 3), or a moving one (frame, y, x, 3); returns its address."""
        data, ending = _encoded(picture)
        digits = hashlib.sha256(data).hexdigest()[:16]
        inside = Path(self.slot.system, self.slot.asset, self.slot.partition)
        folder = picture_folder(self.workspace) / inside
        path = folder / f"{slug(name)}-{digits}.{ending}"
        # A full disk is told where the version is written; a picture is not what a run fails for.
        with contextlib.suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            if path.is_file():
                path.touch()  # the newest again
            else:
                _replace(path, data)
            _bound(folder, path)
        address = f"{HOST}:{picture_port(self.workspace)}"
        return f"http://{address}/{inside.as_posix()}/{path.name}"


def forget_pictures(workspace: Workspace) -> int:
    """Delete the pictures of what is stored no more; of how many partitions.

    One that is young may be of a version that is being written.
    """
    gone = 0
    youngest = time.time() - LEAST_AGE_SECONDS
    for folder in picture_folder(workspace).glob("*/*/*"):
        slot = Slot(*folder.parts[-3:])
        if folder.stat().st_mtime < youngest and not workspace.store.versions(slot):
            shutil.rmtree(folder, ignore_errors=True)
            gone += 1
    return gone


def _bound(folder: Path, newest: Path) -> None:
    """Delete the older pictures of a name, and what a killed writer left."""
    stem = newest.stem.rpartition("-")[0]
    same = [path for path in folder.iterdir() if path.stem.rpartition("-")[0] == stem]
    same.sort(key=lambda path: (path == newest, path.stat().st_mtime_ns), reverse=True)
    for path in same[KEEP:]:
        path.unlink(missing_ok=True)


def _encoded(picture: NDArray[np.uint8]) -> tuple[bytes, str]:
    """A file's bytes and ending: PNG, or WebP of what moves. Both lose nothing."""
    from PIL import Image

    file = io.BytesIO()
    if picture.ndim < 4:
        Image.fromarray(picture).save(file, "PNG", compress_level=1)
        return file.getvalue(), "png"
    first, *others = (Image.fromarray(frame) for frame in picture)
    pace = _MILLISECONDS_A_FRAME
    first.save(
        file, "WEBP", save_all=True, append_images=others, duration=pace, loop=0, lossless=True
    )
    return file.getvalue(), "webp"


def _replace(path: Path, data: bytes) -> None:
    """Write aside and rename: a reader sees all of a file or none of it."""
    beside = path.with_name(f"{path.stem}.{uuid.uuid4().hex[:8]}.part")
    try:
        beside.write_bytes(data)
        os.replace(beside, path)
    except OSError:
        beside.unlink(missing_ok=True)
        raise
