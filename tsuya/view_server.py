"""``tsuya view``: the viewer's page and packages, served to this machine alone.

The address holds a random token, so that no other page can guess it; answers forbid the page to
ask any other host for anything. Packages are read by ranges.
"""

from __future__ import annotations

import os
import secrets
import socket
import sys
import threading
import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import click

from assets_defs.picture_links import HOST
from assets_defs.viewer_files import HEADERS, PAGE_FILES, VIEWER
from storage.errors import StoreError
from storage.versions import Slot, VersionedStore
from tsuya.console import SetUpError
from tsuya.keys import parse_key
from tsuya.packages import SUFFIX, package_slot, package_slots

if TYPE_CHECKING:
    from starlette.applications import Starlette
    from starlette.requests import Request
    from starlette.responses import Response


@dataclass(frozen=True)
class Offered:
    """A package that the page can open: a file, or a package of the store."""

    key: str
    place: Path | Slot


def offered_packages(store: VersionedStore, keys: Sequence[str]) -> list[Offered]:
    """What keys and paths name; without any, all packages of the store.

    Raises ValueError for what is no key, for a path that is no file, and for a store without
    packages; NoVersionError for a key without a current version.
    """
    if not keys:
        slots = package_slots(store)
        if not slots:
            raise ValueError("the store holds no package; expected some: run `tsuya demo` before.")
        return [Offered(str(slot), slot) for slot in slots]
    return [_offered(store, key) for key in keys]


def _offered(store: VersionedStore, key: str) -> Offered:
    path = Path(key)
    if path.is_file():
        return Offered(path.name, path.resolve())
    if key.endswith(SUFFIX):
        raise ValueError(f"{key} is not there; expected a {SUFFIX} file, or a key.")
    slot = package_slot(parse_key(key))
    store.folder(slot)
    return Offered(str(slot), slot)


def page_folder() -> Path:
    """The folder of the built page. Raises SetUpError where it has not been built."""
    if not all((VIEWER / name).is_file() for name in PAGE_FILES):
        raise SetUpError(f"{VIEWER} holds no page; expected the built viewer: run `make setup`.")
    return VIEWER


def view_app(
    store: VersionedStore, offered: Sequence[Offered], token: str, kept: Path
) -> Starlette:
    """The application: everything lies below ``/TOKEN/``.

    kept: a folder for packages of the store while they are served. Raises SetUpError.
    """
    from starlette.applications import Starlette
    from starlette.exceptions import HTTPException
    from starlette.middleware import Middleware
    from starlette.middleware.trustedhost import TrustedHostMiddleware
    from starlette.responses import FileResponse, JSONResponse
    from starlette.routing import Mount, Route

    page = page_folder()
    reading = threading.Lock()

    def show_file(request: Request) -> Response:
        name = request.path_params.get("name", next(iter(PAGE_FILES)))
        if name not in PAGE_FILES:
            raise HTTPException(404)
        return FileResponse(page / name, headers=HEADERS)

    def list_packages(request: Request) -> Response:
        listed = [
            {"key": each.key, "file": f"packages/{number}{SUFFIX}"}
            for number, each in enumerate(offered)
        ]
        return JSONResponse({"packages": listed}, headers=HEADERS)

    def show_package(request: Request) -> Response:
        number = request.path_params["number"]
        if number >= len(offered):
            raise HTTPException(404)
        place = offered[number].place
        if isinstance(place, Slot):
            try:
                with reading:
                    place = _kept(store, place, kept / f"{number}{SUFFIX}")
            except StoreError as error:
                click.echo(str(error), err=True)
                raise HTTPException(404) from error
        if not place.is_file():
            raise HTTPException(404)
        return FileResponse(place, headers=HEADERS, media_type="application/octet-stream")

    inside = [
        Route("/", show_file),
        Route("/packages.json", list_packages),
        Route(f"/packages/{{number:int}}{SUFFIX}", show_package),
        Route("/{name}", show_file),
    ]
    # A page elsewhere whose name was made to point here asks with its own name.
    trusted = Middleware(TrustedHostMiddleware, allowed_hosts=[HOST, "localhost"])
    return Starlette(routes=[Mount(f"/{token}", routes=inside)], middleware=[trusted])


def _kept(store: VersionedStore, slot: Slot, path: Path) -> Path:
    """A package of the store as a file, which answers by ranges."""
    if not path.is_file():
        beside = path.with_suffix(".part")
        beside.write_bytes(store.open(slot)["file"].values.tobytes())
        beside.replace(path)
    return path


def serve(store: VersionedStore, keys: Sequence[str]) -> None:
    """Serve packages until Ctrl-C; prints the address, and opens a browser where there is one.

    Raises as ``offered_packages``, and SetUpError where the viewer has not been built.
    """
    import uvicorn

    offered = offered_packages(store, keys)
    token = secrets.token_urlsafe(16)
    with TemporaryDirectory(prefix="tsuya-view-") as kept, socket.socket() as listener:
        app = view_app(store, offered, token, Path(kept))
        listener.bind((HOST, 0))
        listener.listen()
        address = f"http://{HOST}:{listener.getsockname()[1]}/{token}/"
        click.echo(f"Viewer: {address} (Ctrl-C ends it)", err=True)
        if _has_screen():
            threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
        config = uvicorn.Config(
            app, log_level="critical", access_log=False, timeout_graceful_shutdown=1
        )
        try:
            uvicorn.Server(config).run(sockets=[listener])
        except KeyboardInterrupt:
            return


def _has_screen() -> bool:
    """Whether a browser would have a window; without one, Python would start one of text."""
    if sys.platform in ("darwin", "win32"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
