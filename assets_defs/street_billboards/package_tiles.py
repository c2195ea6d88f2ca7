"""Tiles of road, out of a package."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pipelines.street_billboards.live_tiles import LiveTile
    from storage.packages import Package


def tiles_of(package: Package) -> list[LiveTile]:
    """A package's tiles."""
    from pipelines.street_billboards.live_tiles import tile_of

    stretches, boxes = package.array("tile_stretch"), package.array("tile_box")
    sides = (int(package.parameter("detail_side")), int(package.parameter("tint_side")))
    tiles = []
    for number, (stretch, box) in enumerate(zip(stretches, boxes, strict=True)):
        folder = f"tile_{number:03d}/"
        names = [name for name in package.parts if name.startswith(folder)]
        values = {name.removeprefix(folder): package.value(name) for name in names}
        rows = values.pop("billboard")
        tiles.append(tile_of(rows, values, sides, (float(stretch[0]), float(stretch[1])), box))
    return tiles
