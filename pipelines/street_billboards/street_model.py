"""A street as it is drawn."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.street_billboards.billboards import Billboards
from pipelines.street_billboards.textures.atlases import Page
from pipelines.street_billboards.textures.texture_tables import CompressedTextures


class StreetModel(NamedTuple):
    """All that a street is drawn from."""

    billboards: Billboards
    pages: list[Page]
    """Of the textures."""
    textures: CompressedTextures
    """The same, for the processor's decoder."""
    sky: NDArray[np.float32]
    """Radiance, equirectangular (``sky.sky_map``)."""
