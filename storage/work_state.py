"""State of long work (a training run), kept so that a killed process can go on."""

from __future__ import annotations

import os
import shutil
from dataclasses import dataclass
from pathlib import Path

from storage.zarr_files import disk_error


@dataclass(frozen=True)
class WorkState:
    """One file, replaced atomically. It belongs to a recipe: other settings start afresh."""

    folder: Path
    recipe: str

    def read(self) -> bytes | None:
        """What was kept last for this recipe; None where nothing was."""
        try:
            return self._path.read_bytes()
        except FileNotFoundError:
            return None

    def keep(self, state: bytes) -> None:
        """Replace what was kept, for this recipe and any other. Raises StoreError, StoreFullError.

        A process killed meanwhile leaves the old state whole.
        """
        beside = self._path.with_suffix(".part")
        try:
            if not self._path.exists():  # what is here belongs to work that nobody will go on with
                shutil.rmtree(self.folder, ignore_errors=True)
            self.folder.mkdir(parents=True, exist_ok=True)
            with beside.open("wb") as file:
                file.write(state)
                file.flush()
                os.fsync(file.fileno())
            os.replace(beside, self._path)
        except OSError as error:
            beside.unlink(missing_ok=True)
            raise disk_error(error, self._path) from error

    @property
    def _path(self) -> Path:
        return self.folder / f"{self.recipe}.state"
