"""A street of random billboards as a package, as long as a test wants it."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, NamedTuple

import numpy as np

from pipelines.street_billboards.billboards import Billboards
from pipelines.street_billboards.live_tiles import live_tiles, tile_textures
from pipelines.street_billboards.reference_views import (
    SUPERSAMPLING,
    drawn_views,
    lens_of,
    reference_views,
)
from pipelines.street_billboards.street_model import StreetModel
from pipelines.street_billboards.textures.atlases import pack_pages
from pipelines.street_billboards.textures.texture_tables import CompressedTextures
from storage.packages import Contents, Source, View, write_package
from storage.packages.street_billboards import PACKAGE
from tests.pipelines.street_billboards.compressed_street import random_textures, scattered

SIZE = (160, 100)
_FOCAL = 110.0


class MadeStreet(NamedTuple):
    """A package, and what it was made of."""

    content: bytes
    billboards: Billboards
    textures: CompressedTextures
    tiles: int


def street_package(
    metres: float, billboards_a_metre: float = 4.0, *, tile_metres: float = 24.0, **textures: Any
) -> MadeStreet:
    """A street along x with billboards on both sides of a way that is driven through its middle.

    textures: as ``random_textures``. The stage draws its reference views.
    """
    rng = np.random.default_rng(5)
    count = int(metres * billboards_a_metre)
    centre = np.column_stack(
        [
            np.sort(rng.uniform(0.0, metres, count)),
            rng.choice([-1.0, 1.0], count) * rng.uniform(2.5, 6.0, count),
            rng.uniform(0.2, 4.0, count),
        ]
    )
    billboards = scattered(count)._replace(centre=centre, voxel=centre)
    made = random_textures(billboards.turns, **textures)
    way = np.arange(0.0, metres + 0.1, 3.0)
    poses = np.tile(np.eye(4), (len(way), 1, 1))
    poses[:, :3, :3] = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    poses[:, :3, 3] = np.column_stack([way, np.zeros_like(way), np.full_like(way, 1.9)])
    sky = np.full((16, 32, 3), 0.3, np.float32) * np.linspace(1, 2, 16)[:, None, None]
    street = StreetModel(billboards, pack_pages(made), made, sky.astype(np.float32))
    tiles = live_tiles(billboards, made, poses[:, :3, 3], tile_metres)
    lens = np.array([[_FOCAL, 0, (SIZE[0] - 1) / 2], [0, _FOCAL, (SIZE[1] - 1) / 2], [0, 0, 1.0]])
    views = reference_views(street, poses, lens_of(lens, SIZE, SIZE[0]))
    shown = [("billboards", poses[len(poses) // 2])]
    views += drawn_views(street, shown, lens_of(lens, SIZE, SIZE[0]), billboards=True)
    values: dict[str, Any] = {
        "tile_billboards": np.array([len(tile.rows) for tile in tiles], np.uint32),
        "tile_stretch": np.array([tile.stretch for tile in tiles], np.float32),
        "tile_box": np.stack([tile.box for tile in tiles]),
        "path": poses.astype(np.float32),
        "path_held_out": (np.arange(len(way)) % 5 == 2).astype(np.uint8),
        "sky": sky.astype(np.float16),
        "poster": views[0].frame,
        "input": views[1].frame,
        **{f"reference_{number}": view.frame for number, view in enumerate(views)},
    }
    for number, tile in enumerate(tiles):
        parts = {"billboard": tile.rows.astype(np.uint32), **tile_textures(tile)}
        values |= {f"tile_{number:03d}/{name}": part for name, part in parts.items()}
    parameters = {
        "colour": made.colour,
        "detail_side": tiles[0].page.detail.side,
        "tint_side": tiles[0].page.tint.side,
        "detail_tiles": max(tile.page.detail.most_tiles for tile in tiles),
        "tint_tiles": max(tile.page.tint.most_tiles for tile in tiles),
        "view_angle": views[0].camera.view_angle,
        "leaf": 0.8,
    }
    told = [
        View(
            view.name,
            f"reference_{number}",
            *SIZE,
            SUPERSAMPLING,
            asdict(view.camera),
            {"show": "billboards" if view.billboards else "street", "path": False},
        )
        for number, view in enumerate(views)
    ]
    contents = Contents("street of squares", [Source("random")], values, parameters, told)
    return MadeStreet(write_package(PACKAGE, contents), billboards, made, len(tiles))
