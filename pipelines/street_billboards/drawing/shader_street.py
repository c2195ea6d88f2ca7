"""The street on the stage, its textures decoded in the shader (4.3).

A billboard is four vertices of one mesh, a page (see ``textures.atlases``) one draw call. The
vertex shader turns the billboard to the eye, finds the two stored views beside the viewer's
direction and blends their weights and means; the fragment shader looks at the mask's bits,
multiplies samples of the planes by the weights, converts colours, and hands on linear light. Only
the triangles of what is in view are sent, nearest first.

Textures are interpolated between the middles of texels and clamped at a tile's rim. The mask is a
bit a texel; between four middles the outline is where their interpolated bits are 0.5. A turning
billboard between two views has the nearer one's mask, as a blend of bits says that is >= 0.5.

The stage's own near plane is at a thousandth of the far one. The shader passes d + t + 4 vectors,
d and t the tiles that planes of a billboard reach into (three channels of 31 planes: 29): OpenGL
promises 16, drivers have 31 or more.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.glsl import Shader, surface_shader
from pipelines.drawing.graphics_driver import largest_texture
from pipelines.drawing.stage import surface, texture
from pipelines.street_billboards.billboards import Billboards
from pipelines.street_billboards.drawing.quads import QUAD, quads_in_view, send_quads
from pipelines.street_billboards.textures.atlases import MOST_TEXELS, Page, pack_pages
from pipelines.street_billboards.textures.texture_tables import SIDE, CompressedTextures


class ShaderStreet:
    """Billboards with textures that the shader decodes.

    textures: of the same b billboards, or as ``atlases.pack_pages`` packed them. most_texels: of a
    texture's side, where they are still to be packed; less where the driver has less.
    show_billboards: in colours of their own, with their rims. ``actors`` are for ``Stage.add``, one
    a page; nothing shows before ``look``. Raises ValueError as ``atlases.pack_pages``, and for
    pages that the driver cannot hold or of other billboards.
    """

    def __init__(
        self,
        billboards: Billboards,
        textures: CompressedTextures | Sequence[Page],
        *,
        most_texels: int = MOST_TEXELS,
        show_billboards: bool = False,
    ) -> None:
        most = largest_texture()
        if isinstance(textures, CompressedTextures):
            textures = pack_pages(textures, min(most_texels, most))
        self.pages = list(textures)
        _check_pages(self.pages, len(billboards.centre), most)
        self._billboards = billboards
        self._drawable = np.concatenate([np.empty(0, bool), *(p.has_views for p in self.pages)])
        self.actors = [_page_actor(billboards, page, show_billboards) for page in self.pages]

    def look(
        self,
        intrinsics: NDArray[np.floating],
        to_world: NDArray[np.floating],
        width: int,
        height: int,
    ) -> int:
        """Send the triangles of what a camera sees; how many billboards that are.

        intrinsics (3, 3) in pixels, to_world (4, 4). Raises ValueError where the principal point is
        not in the picture's middle.
        """
        seen = quads_in_view(self._billboards, self._drawable, intrinsics, to_world, width, height)
        for page, actor in zip(self.pages, self.actors, strict=True):
            first, last = page.billboards[0], page.billboards[-1]
            send_quads(actor, seen[(seen >= first) & (seen <= last)] - first)
        return len(seen)


def _check_pages(pages: Sequence[Page], count: int, most: int) -> None:
    found = sum(len(page.billboards) for page in pages)
    if found != count:
        raise ValueError(f"pages: found textures of {found} billboards; expected {count}.")
    sheets = [sheet for p in pages for sheet in (p.detail.texels, p.tint.texels, p.views, p.masks)]
    largest = max((max(sheet.shape[:2]) for sheet in sheets), default=0)
    if largest > most:
        raise ValueError(
            f"pages: found a texture of {largest} texels; expected {most} at most, which is what "
            "the graphics driver has."
        )


def page_headers(billboards: Billboards, page: Page) -> NDArray[np.float32]:
    """A page's billboards as `billboard.glsl` reads them: five texels each, (y, 5 columns, 4)."""
    rows = page.billboards
    geometry = np.zeros((len(rows), 3, 4), np.float32)
    geometry[:, 0, :3] = billboards.centre[rows]
    geometry[:, 1, :3] = billboards.half_s[rows]
    geometry[:, 2, :3] = billboards.half_t[rows]
    geometry[:, 0, 3] = billboards.fan[rows]
    geometry[:, 1, 3] = billboards.turns[rows]
    headers = np.concatenate([geometry, page.records], axis=1)
    columns = max(int(np.sqrt(len(rows))), 1)
    header_rows = -(-len(rows) // columns)
    sheet = np.zeros((header_rows * columns, 5, 4), np.float32)
    sheet[: len(rows)] = headers
    return sheet.reshape(header_rows, columns * 5, 4)


def _page_actor(billboards: Billboards, page: Page, show_billboards: bool) -> Any:
    headers = page_headers(billboards, page)
    images = {
        "headers": _fixed(headers),
        "views": _fixed(page.views),
        "masks": _fixed(page.masks),
    }
    for name, atlas in (("detail", page.detail), ("tint", page.tint)):
        if atlas.most_tiles:
            images[name] = _fixed(atlas.texels, interpolate=True)
            images[f"{name}Scales"] = _fixed(atlas.scales)
    actor = surface(
        _bounding_points(billboards, page.billboards),
        QUAD.reshape(-1, 3),
        textures=images,
        shader=_shader(page, headers.shape[1] // 5, show_billboards),
        lit=False,
    )
    send_quads(actor, np.empty(0, np.int64))
    return actor


def _bounding_points(billboards: Billboards, rows: NDArray[np.int64]) -> NDArray[np.float32]:
    """(4 p, 3): the shader places the vertices; but the stage takes its depths from these."""
    reach = np.hypot(
        np.linalg.norm(billboards.half_s[rows], axis=1),
        np.linalg.norm(billboards.half_t[rows], axis=1),
    )
    ends = np.array([-1.0, 1.0, -1.0, 1.0])[:, None]
    around = billboards.centre[rows][:, None] + ends * reach[:, None, None]
    return around.reshape(-1, 3).astype(np.float32)


def _fixed(image: NDArray[Any], *, interpolate: bool = False) -> Any:
    """A texture whose row 0 is at t = 0."""
    return texture(np.ascontiguousarray(image[::-1]), wrap="clamp", interpolate=interpolate)


def _shader(page: Page, header_columns: int, show_billboards: bool) -> Shader:
    is_ycocg = bool(page.flags[0, 1])
    values: dict[str, Any] = {}
    for name, atlas in (("DETAIL", page.detail), ("TINT", page.tint)):
        rows, columns, _ = atlas.scales.shape
        values |= {
            f"{name}_TILES": atlas.most_tiles,
            f"{name}_SIDE": atlas.side,
            f"{name}_COLUMNS": columns,
            f"{name}_SIZE": [1 / max(columns, 1), 1 / max(rows, 1)],
        }
    return surface_shader(
        "street_vertex.glsl",
        "street_fragment.glsl",
        HEADER_COLUMNS=header_columns,
        VIEW_COLUMNS=page.views.shape[1],
        MASK_COLUMNS=page.masks.shape[1] // SIDE,
        SHOW_BILLBOARDS=show_billboards,
        YCOCG=is_ycocg,
        NEUTRAL=[0.0, 128.0, 128.0] if is_ycocg else [0.0, 0.0, 0.0],
        **values,
    )
