"""Serves a data folder's pictures of full size and its live views: on this machine, to read.

`tsuya ui` starts it as a process of its own beside the web UI; it ends with its parent.
"""

from __future__ import annotations

import os
import socket
import sys
import threading
import time
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from assets_defs.picture_links import HOST
from assets_defs.viewer_files import HEADERS, found_viewer_file
from assets_defs.workspace import Workspace

_KINDS = {".png": "image/png", ".webp": "image/webp"}
_WATCH_SECONDS = 1.0


def found_picture(folder: Path, address: str) -> Path | None:
    """The picture that a request's path names; None where that is no picture below the folder."""
    root = folder.resolve()
    try:
        path = (root / unquote(urlsplit(address).path).lstrip("/")).resolve()
        if path.is_relative_to(root) and path.suffix in _KINDS and path.is_file():
            return path
    except (OSError, ValueError):  # a name that no file can have
        pass
    return None


class PictureServer(ThreadingHTTPServer):
    """Answers requests for the pictures below a folder."""

    daemon_threads = True

    def __init__(self, folder: Path, listener: socket.socket) -> None:
        super().__init__(listener.getsockname()[:2], _Handler, bind_and_activate=False)
        self.socket.close()
        self.socket = listener
        self.folder = folder
        self.server_activate()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing: a browser went away while it was answered."""


class _Handler(BaseHTTPRequestHandler):
    timeout = 10
    server: PictureServer

    def do_GET(self) -> None:
        data = self._head()
        if data is not None:
            self.wfile.write(data)

    def do_HEAD(self) -> None:
        self._head()

    def _head(self) -> bytes | None:
        """Send the head of an answer; the picture's bytes, if there is one."""
        # A page elsewhere whose name was made to point here asks with its own name.
        if self.headers.get("Host", "").rpartition(":")[0] not in (HOST, "localhost"):
            self.send_error(HTTPStatus.FORBIDDEN)
            return None
        workspace = Workspace(self.server.folder.parent)
        found = self._picture() or found_viewer_file(workspace, self.path)
        if found is None:
            self.send_error(HTTPStatus.NOT_FOUND, explain="Not kept any more, or never there.")
            return None
        data, kind = found
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        for name, value in HEADERS.items():
            self.send_header(name, value)
        self.end_headers()
        return data

    def _picture(self) -> tuple[bytes, str] | None:
        path = found_picture(self.server.folder, self.path)
        try:
            return (path.read_bytes(), _KINDS[path.suffix]) if path else None
        except FileNotFoundError:  # a newer one took its place just now
            return None

    def log_message(self, format: str, *arguments: object) -> None:
        """Say nothing: the terminal is the web UI's."""


def _end_with(parent: int) -> None:
    """Wait until the process that started this one is gone, then end."""
    while os.getppid() == parent:
        time.sleep(_WATCH_SECONDS)
    os._exit(0)


def main(folder: str, descriptor: str, parent: str) -> None:
    """Serve a folder at a bound socket, given by its descriptor, while the parent lives."""
    threading.Thread(target=_end_with, args=(int(parent),), daemon=True).start()
    with PictureServer(Path(folder), socket.socket(fileno=int(descriptor))) as server:
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            return


if __name__ == "__main__":
    main(*sys.argv[1:])
