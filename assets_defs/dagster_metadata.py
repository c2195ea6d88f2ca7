"""What an asset says of itself, as metadata of the web UI: thumbnails, tables."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import dagster as dg

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MOST_BYTES = 100_000
_WIDEST = 512


def dagster_metadata(metadata: Mapping[str, Any]) -> dict[str, Any]:
    """An asset's metadata as Dagster takes them: lists of rows become tables, arrays thumbnails."""
    return {name: _shown(value) for name, value in metadata.items()}


def _shown(value: Any) -> Any:
    if isinstance(value, list):
        return _table(value)
    if hasattr(value, "shape") and len(value.shape) >= 2:
        return thumbnail(value)
    return value


def thumbnail(picture: NDArray[np.uint8]) -> dg.MarkdownMetadataValue:
    """A picture (y, x) or (y, x, 3) as a Markdown data URI of at most 100 kB."""
    from PIL import Image

    image = Image.fromarray(picture)
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
