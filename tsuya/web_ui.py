"""``tsuya ui``: the web UI with its daemon, once for each data folder, at a free port.

Beside it a small server answers the web UI's links to pictures of full size.
"""

from __future__ import annotations

import fcntl
import os
import socket
import subprocess
import sys
from pathlib import Path

import click

from assets_defs.picture_links import note_picture_port, picture_folder, picture_port
from assets_defs.workspace import CHECKOUT, Workspace
from tsuya.console import SetUpError, dagster_home

FIRST_PORT = 3000
_HOST = "127.0.0.1"
_TRIED = 100


def serve(port: int | None) -> None:
    """Become ``dg dev`` at ``port``, or at the first free one; say where it is.

    Where one runs already on the same data, say so and end: two daemons would launch everything
    twice. Raises SetUpError for a port that is in use and where ``make setup`` has not been run.
    """
    workspace = Workspace.of_checkout()
    root = workspace.root
    home = dagster_home()
    root.mkdir(parents=True, exist_ok=True)
    with (root / "ui.lock").open("a+") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            lock.seek(0)
            click.echo(f"The web UI of {root} runs already: {lock.read().strip()}")
            return
        address = f"http://{_HOST}:{_free_port(port)}"
        lock.truncate(0)
        lock.write(f"{address}\n")
        lock.flush()
        click.echo(f"Web UI: {address} (Ctrl-C ends it)", err=True)
        sys.stderr.flush()
        _serve_pictures(workspace)
        # The lock lives as long as the process that this one becomes.
        os.set_inheritable(lock.fileno(), True)
        os.environ["VIRTUAL_ENV"] = sys.prefix  # else dg warns of an environment not activated
        os.chdir(home)  # a .env beside it would win over the environment
        program = str(Path(sys.executable).with_name("dg"))
        place = ["--host", _HOST, "--port", address.rpartition(":")[2]]
        loaded = ["--workspace", str(CHECKOUT / "workspace.yaml")]
        os.execv(program, [program, "dev", "--use-active-venv", *place, *loaded])


def _serve_pictures(workspace: Workspace) -> None:
    """Start the server of pictures; it ends with this process, also when that is another program.

    Where the data folder's port is in use, it has another one from now on.
    """
    own = picture_port(workspace)
    for number in (own, 0):
        listener = socket.socket()
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((_HOST, number))
        except OSError:
            listener.close()
            continue
        with listener:
            bound = listener.getsockname()[1]
            if bound != own:
                note_picture_port(workspace, bound)
            told = [str(picture_folder(workspace)), str(listener.fileno()), str(os.getpid())]
            subprocess.Popen(
                [sys.executable, "-m", "assets_defs.picture_server", *told],
                cwd=CHECKOUT,
                pass_fds=[listener.fileno()],
                stdin=subprocess.DEVNULL,
            )
        return


def _free_port(port: int | None) -> int:
    """The port asked for, or the first free one from 3000. Raises SetUpError."""
    tried = range(FIRST_PORT, FIRST_PORT + _TRIED) if port is None else (port,)
    for number in tried:
        with socket.socket() as listener:
            # As the server asks for it: a port whose last connection is just closing is free.
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                listener.bind((_HOST, number))
            except OSError:
                continue
            return number
    raise SetUpError(
        f"port {tried[0]} is in use; expected a free one: leave out --port to have one found."
        if port is not None
        else f"ports {tried[0]} to {tried[-1]} are in use; expected a free one: give --port."
    )
