"""What an asset says of itself, as metadata of the web UI: thumbnails, tables."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import dagster as dg

from assets_defs.system import NOTES

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

PICTURE = "picture: "
FULL_SIZE = "full size: "
LIVE_VIEW = "live view"
MOST_BYTES = 100_000
_WIDEST = 512


def dagster_metadata(metadata: Mapping[str, Any]) -> dict[str, Any]:
    """An asset's metadata as Dagster takes them: lists of rows become tables, arrays thumbnails.

    Raises ValueError for a name that is kept for pictures.
    """
    for name in metadata:
        if name.startswith((PICTURE, FULL_SIZE)) or name == LIVE_VIEW:
            raise ValueError(f"metadata {name!r} is named like a picture; expected another name.")
    shown = {name: _shown(value) for name, value in metadata.items() if name != NOTES}
    if metadata.get(NOTES):
        shown[NOTES] = dg.MetadataValue.md("\n".join(f"- {note}" for note in metadata[NOTES]))
    return shown


def picture_metadata(
    pictures: Mapping[str, NDArray[np.uint8]], link: Callable[[str, NDArray[np.uint8]], str]
) -> dict[str, Any]:
    """A thumbnail of each picture, and what ``link`` says of where it is in full size.

    Their names are no other metadata's: a figure may be called like the picture that it is of.
    """
    shown: dict[str, Any] = {}
    for name, picture in pictures.items():
        shown[PICTURE + name] = thumbnail(picture)
        shown[FULL_SIZE + name] = dg.MetadataValue.url(link(name, picture))
    return shown


def live_view_metadata(address: str | None) -> dict[str, Any]:
    """The link to a package's live view, where it is a package."""
    return {LIVE_VIEW: dg.MetadataValue.url(address)} if address else {}


def _shown(value: Any) -> Any:
    if isinstance(value, list):
        return _table(value)
    if hasattr(value, "shape") and len(value.shape) >= 2:
        return thumbnail(value)
    return value


def thumbnail(picture: NDArray[np.uint8]) -> dg.MarkdownMetadataValue:
    """A picture (y, x) or (y, x, 3) as a Markdown data URI of at most 100 kB.

    Of a moving one (frame, y, x, 3) the first frame.
    """
    from PIL import Image

    image = Image.fromarray(picture if picture.ndim < 4 else picture[0])
    side = _WIDEST
    while True:
        small = image.copy()
        small.thumbnail((side, side))
        file = io.BytesIO()
        small.convert("RGB").save(file, "JPEG", quality=85)
        if file.tell() <= MOST_BYTES * 3 // 4:
            break
        side = side * 3 // 4
    data = base64.b64encode(file.getvalue()).decode()
    return dg.MetadataValue.md(f"![picture](data:image/jpeg;base64,{data})")


def _table(rows: Sequence[Mapping[str, int | float | str]]) -> dg.TableMetadataValue:
    """Rows of equal columns as a table; fractions with four digits that count."""
    shown = [
        {
            name: float(f"{cell:.4g}") if isinstance(cell, float) else cell
            for name, cell in row.items()
        }
        for row in rows
    ]
    return dg.MetadataValue.table(records=[dg.TableRecord(row) for row in shown])
