"""docs/street.md lists the formats that are read, in their own words."""

from __future__ import annotations

from pathlib import Path

from storage.readers.drives.formats import FORMATS

PAGE = Path(__file__).parents[3] / "docs" / "street.md"


def test_the_page_lists_every_format() -> None:
    page = PAGE.read_text(encoding="utf-8")
    for one in FORMATS:
        assert f"| {one.name} | `{one.known_by}` | {one.sentence} |" in page
