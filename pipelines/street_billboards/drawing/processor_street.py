"""The street on the stage, its textures decoded on the processor: the paper's rival.

Each visible billboard is decoded before the frame and sent as a tile of RGBA8. The pictures agree
with those of :mod:`.shader_street`, because interpolating texels and adding planes can change
places; but decoded colours are rounded and clamped to 0 to 255 before they are interpolated, and
planes of a lower resolution are first sampled at the middles of 32 x 32 texels: between these the
rival cuts off what such a plane has of peaks (noise of 40 codes differs by up to 5, smooth planes
do not).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.glsl import surface_shader
from pipelines.drawing.graphics_driver import largest_texture
from pipelines.drawing.stage import surface, texture
from pipelines.street_billboards.billboards import Billboards, axes_facing
from pipelines.street_billboards.drawing.quads import QUAD, quads_in_view, send_quads
from pipelines.street_billboards.textures.atlases import MOST_TEXELS
from pipelines.street_billboards.textures.decoding import Decodable, decodable, decode_views
from pipelines.street_billboards.textures.texture_tables import SIDE, CompressedTextures
from pipelines.street_billboards.textures.view_directions import fan_position

_CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
"""(s, t) of a billboard's four vertices."""


class ProcessorStreet:
    """The same billboards; each visible one is decoded by ``look`` and sent as a tile of RGBA8.

    ``actors`` are for ``Stage.add``, one for each texture of ``most_texels`` (or less, where the
    driver has less) that the tiles of all billboards would fill.
    """

    def __init__(
        self,
        billboards: Billboards,
        textures: CompressedTextures,
        *,
        most_texels: int = MOST_TEXELS,
    ) -> None:
        self._billboards, self._textures = billboards, decodable(textures)
        self._drawable = np.diff(textures.first) > 0
        across = min(most_texels, largest_texture()) // SIDE
        count = len(billboards.centre)
        self._columns = min(max(int(np.ceil(np.sqrt(count))), 1), across)
        self._page = self._columns * across
        self._sheets = [_Tiles(self._columns) for _ in range(max(-(-count // self._page), 1))]
        self.actors = [sheet.actor for sheet in self._sheets]

    def look(
        self,
        intrinsics: NDArray[np.floating],
        to_world: NDArray[np.floating],
        width: int,
        height: int,
    ) -> int:
        """Decode and send what a camera sees, as ``ShaderStreet.look``."""
        seen = quads_in_view(self._billboards, self._drawable, intrinsics, to_world, width, height)
        eye = np.asarray(to_world, np.float64)[:3, 3]
        for number, sheet in enumerate(self._sheets):
            chosen = seen[number * self._page : (number + 1) * self._page]
            sheet.show(self._billboards, self._textures, chosen, eye)
        return len(seen)


class _Tiles:
    """One texture of decoded tiles and its quads."""

    def __init__(self, columns: int) -> None:
        self._columns = columns
        self._texels = np.zeros((0, 0, 4), np.uint8)
        self._image = texture(np.zeros((SIDE, columns * SIDE, 4), np.uint8), interpolate=True)
        self.actor = surface(
            np.zeros((4, 3)),
            QUAD.reshape(-1, 3),
            textures={"tiles": self._image},
            shader=surface_shader(
                "decoded_tiles_vertex.glsl", "decoded_tiles_fragment.glsl", COLUMNS=columns
            ),
            lit=False,
        )
        send_quads(self.actor, np.empty(0, np.int64))

    def show(
        self,
        billboards: Billboards,
        textures: Decodable,
        chosen: NDArray[np.int64],
        eye: NDArray[np.float64],
    ) -> None:
        """Decode the chosen billboards (k,) as seen from the eye (3,) and draw them."""
        from vtkmodules.util.numpy_support import numpy_to_vtk

        rows = max(-(-len(chosen) // self._columns), 1)
        shape = (rows * SIDE, self._columns * SIDE, 4)
        if self._texels.shape != shape:
            self._texels = np.zeros(shape, np.uint8)
        position = fan_position(eye - billboards.centre[chosen], billboards.fan[chosen])
        for row in range(rows):
            part = slice(row * self._columns, (row + 1) * self._columns)
            tiles = self._texels[row * SIDE : (row + 1) * SIDE]
            tiles = tiles.reshape(SIDE, self._columns, SIDE, 4).transpose(1, 0, 2, 3)
            count = len(chosen[part])
            decode_views(textures, chosen[part], position[part], tiles[:count])
        data = self._image.GetInput()
        data.SetDimensions(shape[1], shape[0], 1)
        data.GetPointData().SetScalars(numpy_to_vtk(self._texels.reshape(-1, 4), deep=False))
        data.Modified()
        mesh = self.actor.GetMapper().GetInput()
        mesh.points = _corners(billboards, chosen, eye)
        send_quads(self.actor, np.arange(len(chosen)))


def _corners(
    billboards: Billboards, chosen: NDArray[np.int64], eye: NDArray[np.float64]
) -> NDArray[np.float32]:
    """(4 k, 3), in metres."""
    centre, turns = billboards.centre[chosen], billboards.turns[chosen, None]
    row, column = axes_facing(centre, eye)
    half_s, half_t = billboards.half_s[chosen], billboards.half_t[chosen]
    half_s = np.where(turns, row * half_s[:, :1], half_s)
    half_t = np.where(turns, column * half_t[:, 2:], half_t)
    s, t = _CORNERS[:, :1], _CORNERS[:, 1:]
    places = centre[:, None] + s * half_s[:, None] + t * half_t[:, None]
    return places.reshape(-1, 3).astype(np.float32)
