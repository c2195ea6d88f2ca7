"""Pictures in the web UI: every one is there, in full size, too, and stays within bounds."""

from __future__ import annotations

import base64
import http.client
import io
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import dagster as dg
import numpy as np
import pytest
from PIL import Image

from assets_defs.dagster_assets import _materialise
from assets_defs.dagster_metadata import dagster_metadata
from assets_defs.picture_links import (
    KEEP,
    PictureLinks,
    forget_pictures,
    note_picture_port,
    picture_folder,
    picture_port,
)
from assets_defs.picture_server import PictureServer
from assets_defs.system import NOTES
from assets_defs.workspace import Workspace
from storage.versions import Slot
from tsuya import web_ui

NOISE = np.random.default_rng(5).integers(0, 256, (200, 300, 3), dtype=np.uint8)


def _file_of(workspace: Workspace, address: str) -> Path:
    host, _, path = address.removeprefix("http://").partition("/")
    assert host == f"127.0.0.1:{picture_port(workspace)}"
    return picture_folder(workspace) / path


def _materialised(tmp_path: Path, pictures: Any, metadata: Any) -> dict[str, Any]:
    """What an asset with these pictures and metadata says of itself."""
    empty: Any = SimpleNamespace(
        name="asset",
        by=("photo",),
        inputs=(),
        schema=SimpleNamespace(system="system", number=1),
        code="",
        checks=(),
        pictures=lambda dataset: pictures,
        function=lambda: (SimpleNamespace(assign_attrs=lambda record: None), metadata),
    )
    system: Any = SimpleNamespace(
        name="system",
        resolve=lambda *given, **named: SimpleNamespace(model_dump=lambda mode: {}, files=dict),
        source_of=lambda *given: None,
        slot=lambda asset, keys: Slot("system", asset, keys["photo"]),
    )
    context: Any = SimpleNamespace(
        partition_key="grass",
        run=SimpleNamespace(run_id="r", tags={}),
        instance=SimpleNamespace(add_run_tags=lambda run, tags: None),
        resources=SimpleNamespace(workspace=Workspace(tmp_path), progress=lambda what, done: None),
        log=SimpleNamespace(debug=print),
    )
    config: Any = SimpleNamespace(model_dump=dict)
    return dict(_materialise(system, empty, context, config, {}).metadata)


def test_a_figure_called_like_a_picture_does_not_hide_it(tmp_path: Path) -> None:
    shown = _materialised(tmp_path, {"frames": NOISE}, {"frames": 6, "coverage": 0.5})
    assert (shown["frames"].value, shown["coverage"].value) == (6, 0.5)
    assert shown["picture: frames"].value.startswith("![picture](data:image/jpeg;base64,")
    assert isinstance(shown["full size: frames"], dg.UrlMetadataValue)


def test_notes_are_a_list_in_the_web_ui_where_there_are_some() -> None:
    shown = dagster_metadata({NOTES: ("3 texels were filled.", "1 layer was left out.")})
    assert shown[NOTES].value == "- 3 texels were filled.\n- 1 layer was left out."
    assert dagster_metadata({NOTES: ()}) == {}


@pytest.mark.parametrize("name", ["picture: frames", "full size: frames"])
def test_a_name_that_pictures_have_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(ValueError, match="expected another name"):
        dagster_metadata({name: 6})
    with pytest.raises(dg.Failure, match="expected another name"):
        _materialised(tmp_path, {"frames": NOISE}, {name: 6})


def test_a_moving_picture_is_shown_by_its_first_frame_and_moves_in_full_size(
    tmp_path: Path,
) -> None:
    frames = np.stack([np.full((40, 60, 3), level, np.uint8) for level in (0, 128, 255)])
    shown = _materialised(tmp_path, {"turn": frames}, {})
    data = shown["picture: turn"].value.partition("base64,")[2].rstrip(")")
    assert np.asarray(Image.open(io.BytesIO(base64.b64decode(data)))).max() == 0
    moving = Image.open(_file_of(Workspace(tmp_path), shown["full size: turn"].value))
    for number, frame in enumerate(frames):
        moving.seek(number)
        np.testing.assert_array_equal(np.asarray(moving.convert("RGB")), frame)


def test_the_same_picture_keeps_its_address_and_old_ones_go(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    links = PictureLinks(workspace, Slot("system", "asset", "grass"))
    first = links.keep("a b", NOISE)
    other = links.keep("other", NOISE)
    addresses = []
    for shift in range(KEEP):
        changed = np.roll(NOISE, shift + 1, axis=0)
        addresses.append(links.keep("a b", changed))
        time.sleep(0.002)
        if shift < KEEP - 1:
            assert links.keep("a b", NOISE) == first
    kept = set(picture_folder(workspace).rglob("*.*"))
    assert len(kept) == KEEP + 1
    assert _file_of(workspace, addresses[-1]) in kept
    assert _file_of(workspace, addresses[0]) not in kept
    assert {_file_of(workspace, first), _file_of(workspace, other)} <= kept


def test_pictures_go_with_what_they_are_of(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    slots = [Slot("s", "a", name) for name in ("stored", "removed", "being-written")]
    files = [_file_of(workspace, PictureLinks(workspace, slot).keep("x", NOISE)) for slot in slots]
    workspace.store.files(slots[0]).version_folder("20260101T000000000000-01234567").mkdir(
        parents=True
    )
    for file in files[:2]:
        os.utime(file.parent, (1, 1))
    assert forget_pictures(workspace) == 1
    assert [file.is_file() for file in files] == [True, False, True]


def test_a_full_disk_ends_no_run_for_a_picture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, data: bytes) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    address = PictureLinks(Workspace(tmp_path), Slot("s", "a", "p")).keep("x", NOISE)
    assert address.startswith("http://127.0.0.1:")


def test_the_port_belongs_to_the_folder_until_another_is_noted(tmp_path: Path) -> None:
    one, two = Workspace(tmp_path / "one"), Workspace(tmp_path / "two")
    assert picture_port(one) == picture_port(Workspace(tmp_path / "one")) != picture_port(two)
    note_picture_port(one, 12345)
    assert picture_port(one) == 12345


# ---- the server ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[PictureServer]:
    root = tmp_path_factory.mktemp("served")
    folder = root / "full_size" / "s" / "a" / "p"
    folder.mkdir(parents=True)
    (folder / "x.png").write_bytes(b"picture")
    (folder / "x.txt").write_bytes(b"text")
    (root / "secret.png").write_bytes(b"secret")
    (folder / "out.png").symlink_to(root / "secret.png")
    listener = socket.socket()
    listener.bind(("127.0.0.1", 0))
    with PictureServer(root / "full_size", listener) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server
        server.shutdown()


def _answer(
    server: PictureServer, path: str, method: str = "GET", host: str | None = None
) -> tuple[int, bytes]:
    port = server.server_address[1]
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=5)
    connection.putrequest(method, path, skip_host=True)
    connection.putheader("Host", host or f"127.0.0.1:{port}")
    connection.endheaders()
    answer = connection.getresponse()
    return answer.status, answer.read()


def test_a_picture_is_served(server: PictureServer) -> None:
    assert _answer(server, "/s/a/p/x.png") == (200, b"picture")
    assert _answer(server, "/s/a/p/x.png", "HEAD") == (200, b"")
    assert server.server_address[0] == "127.0.0.1"


@pytest.mark.parametrize(
    ("path", "method", "host", "status"),
    [
        ("/s/a/p/../../../../secret.png", "GET", None, 404),
        ("/%2e%2e/secret.png", "GET", None, 404),
        ("//secret.png", "GET", None, 404),
        ("/s/a/p/out.png", "GET", None, 404),
        ("/s/a/p/x.txt", "GET", None, 404),
        ("/s/a/p", "GET", None, 404),
        ("/", "GET", None, 404),
        ("/%00.png", "GET", None, 404),
        ("/s/a/p/x.png", "POST", None, 501),
        ("/s/a/p/x.png", "DELETE", None, 501),
        ("/s/a/p/x.png", "GET", "evil.example:80", 403),
    ],
)
def test_nothing_else_is(
    server: PictureServer, path: str, method: str, host: str | None, status: int
) -> None:
    answered, data = _answer(server, path, method, host)
    assert answered == status
    assert b"secret" not in data


def test_the_server_starts_beside_the_web_ui_and_ends_with_it(tmp_path: Path) -> None:
    """In a process that becomes another one, as `tsuya ui` does; at a port that it had to find."""
    workspace = Workspace(tmp_path)
    taken = socket.socket()
    taken.bind(("127.0.0.1", 0))
    taken.listen()
    port = taken.getsockname()[1]
    note_picture_port(workspace, port)
    code = (
        "import os, pathlib, sys; from tsuya.web_ui import _serve_pictures;"
        "from assets_defs.workspace import Workspace;"
        "_serve_pictures(Workspace(pathlib.Path(sys.argv[1])));"
        "os.execv('/bin/sleep', ['sleep', '60'])"
    )
    became = subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], cwd=web_ui.CHECKOUT)
    try:
        _wait(lambda: picture_port(workspace) != port)
        # The address that is written from now on is the one that answers.
        address = PictureLinks(workspace, Slot("s", "a", "p")).keep("x", NOISE)
        path = "/" + address.removeprefix("http://").partition("/")[2]
        served: Any = SimpleNamespace(server_address=("127.0.0.1", picture_port(workspace)))
        _wait(lambda: _answer(served, path)[0] == 200)
    finally:
        became.kill()
        became.wait()
        taken.close()
    _wait(lambda: _is_refused(picture_port(workspace)))


def _is_refused(port: int) -> bool:
    with socket.socket() as caller:
        return caller.connect_ex(("127.0.0.1", port)) != 0


def _wait(happens: Any, seconds: float = 20.0) -> None:
    until = time.monotonic() + seconds
    while True:
        try:
            if happens():
                return
        except OSError:
            pass
        assert time.monotonic() < until
        time.sleep(0.05)
