"""Pages that show packages live: one file that opens from disk, or a folder for a static host."""

from __future__ import annotations

import base64
import hashlib
import html
import json
from collections.abc import Sequence
from pathlib import Path

from storage.packages import Package
from storage.slugs import slug
from tsuya.exports.format import ALL_SYSTEMS, Format, Notes
from tsuya.packages import SUFFIX
from tsuya.view_server import PAGE_FILES, page_folder

LARGEST_PAGE = 32_000_000
"""Bytes of one file that people send each other, and that browsers open at once."""
_SCRIPT = '<script type="module" crossorigin src="./viewer.js"></script>'
_STYLE = '<link rel="stylesheet" crossorigin href="./viewer.css">'
_HEAD = "<head>"


def write_html(package: Package, target: Path) -> Notes:
    """The viewer and a package as one file, which opens by a double click.

    Raises SetUpError where the viewer has not been built.
    """
    page, script, style = _built()
    script = script.replace("</script", "<\\/script").replace("<!--", "<\\!--")
    content = base64.b64encode(package.whole()).decode()
    name = html.escape(_stem(package), quote=True)
    allowed = f"script-src {_hash(script)}; style-src {_hash(style)}; connect-src data: blob:"
    inside = (
        f'<script type="application/vnd.tsuya;base64" data-key="{name}">{content}</script>\n'
        f'<script type="module">{script}</script>'
    )
    page = _replaced(page, _STYLE, f"<style>{style}</style>")
    page = _replaced(page, _SCRIPT, inside)
    target.write_text(_restricted(page, allowed), encoding="utf-8")
    size = target.stat().st_size
    if size < LARGEST_PAGE:
        return ()
    return (
        f"The page is {size / 1e6:.0f} MB; expected under {LARGEST_PAGE / 1e6:.0f} MB to be sent "
        "and opened at ease: `--to site` reads what it shows piece by piece.",
    )


def write_site(packages: Sequence[Package], target: Path) -> Notes:
    """A folder for any static host: the gallery, and the packages as they are.

    Raises SetUpError where the viewer has not been built.
    """
    page, script, style = _built()
    (target / "packages").mkdir(parents=True)
    listed: list[dict[str, str]] = []
    for package in packages:
        stem = _stem(package)
        names = {each["key"] for each in listed}
        key = next(n for n in (stem, *(f"{stem}-{i}" for i in range(2, 10**6))) if n not in names)
        file = f"packages/{len(listed)}-{slug(key)}{SUFFIX}"
        (target / file).write_bytes(package.whole())
        listed.append({"key": key, "file": file})
    text = _restricted(page, "script-src 'self'; style-src 'self'; connect-src 'self'")
    for name, content in zip(PAGE_FILES, (text, script, style), strict=True):
        (target / name).write_text(content, encoding="utf-8")
    (target / "packages.json").write_text(json.dumps({"packages": listed}, indent=1))
    return ()


def _write_one(package: Package, target: Path) -> Notes:
    return write_site([package], target)


def _built() -> tuple[str, str, str]:
    """The page, its script and its style sheet."""
    page, script, style = ((page_folder() / name).read_text("utf-8") for name in PAGE_FILES)
    return page, script, style


def _stem(package: Package) -> str:
    return Path(package.name).name.removesuffix(SUFFIX)


def _hash(text: str) -> str:
    digest = hashlib.sha256(text.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"


def _restricted(page: str, allowed: str) -> str:
    """The page with a rule that lets it ask no other host for anything."""
    rule = f"default-src 'none'; {allowed}; img-src data: blob:; worker-src blob:; base-uri 'none'"
    meta = f'<meta http-equiv="Content-Security-Policy" content="{rule}">'
    return _replaced(page, _HEAD, f"{_HEAD}\n    {meta}")


def _replaced(page: str, old: str, new: str) -> str:
    before, found, after = page.partition(old)
    if not found:
        raise AssertionError(f"the built page has no {old}")
    return before + new + after


FORMATS = (
    Format("html", ALL_SYSTEMS, ".html", "a page that opens from disk, all inside", write_html),
    Format("site", ALL_SYSTEMS, "", "a folder for a static host", _write_one, write_site),
)
