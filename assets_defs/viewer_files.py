"""The viewer's files, and the live views that the web UI links to.

    /view/<system>/<asset>/<partition>/                the page
    /view/<system>/<asset>/<partition>/packages.json   the one package that it shows
    /view/<system>/<asset>/<partition>/package.tsuya   the current version's bytes

`assets_defs/picture_server.py` answers for them; `tsuya view` serves the same page by itself.
"""

from __future__ import annotations

import json
from urllib.parse import quote, unquote, urlsplit

from assets_defs.picture_links import HOST, picture_port
from assets_defs.workspace import CHECKOUT, Workspace
from storage.errors import StoreError
from storage.versions import Slot

VIEWER = CHECKOUT / "viewer" / "dist"
"""The built page."""
PAGE_FILES = {
    "index.html": "text/html; charset=utf-8",
    "viewer.js": "text/javascript; charset=utf-8",
    "viewer.css": "text/css; charset=utf-8",
}
"""Its files, the page first, and what they are."""
PACKAGE_ASSET = "_package"
"""What names of package assets end with."""
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
        "connect-src 'self' blob: data:; worker-src blob:; base-uri 'none'; form-action 'none'; "
        "frame-ancestors 'none'"
    ),
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
"""What is sent with each file: the page may ask no other host for anything."""
_VIEW = "view"
_PACKAGE = "package.tsuya"


def live_view_address(workspace: Workspace, slot: Slot) -> str | None:
    """Where the web UI's live view of a slot is; None for what is no package."""
    if not slot.asset.endswith(PACKAGE_ASSET):
        return None
    inside = quote(f"{slot.system}/{slot.asset}/{slot.partition}")
    return f"http://{HOST}:{picture_port(workspace)}/{_VIEW}/{inside}/"


def found_viewer_file(workspace: Workspace, address: str) -> tuple[bytes, str] | None:
    """A file that a request's path names, and its type; None where that is none of these."""
    parts = unquote(urlsplit(address).path).split("/")
    if len(parts) != 6 or parts[:2] != ["", _VIEW] or not parts[3].endswith(PACKAGE_ASSET):
        return None
    slot, name = Slot(*parts[2:5]), parts[5] or next(iter(PAGE_FILES))
    if slot not in workspace.store.slots():
        return None
    if name == "packages.json":
        listed = {"packages": [{"key": str(slot), "file": _PACKAGE}]}
        return json.dumps(listed).encode(), "application/json"
    try:
        if name == _PACKAGE:
            content = workspace.store.open(slot)["file"].values.tobytes()
            return content, "application/octet-stream"
        return ((VIEWER / name).read_bytes(), PAGE_FILES[name]) if name in PAGE_FILES else None
    except (OSError, StoreError):  # collected just now, or not built
        return None
