"""Dagster's history, the one that the web UI shows, opened for a command."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import dagster as dg
import sqlalchemy.exc
import yaml
from dagster._core.instance.ref import InstanceRef

from tsuya.console import SetUpError

_NOT_CAPTURED = {
    "compute_logs": {
        "module": "dagster._core.storage.noop_compute_log_manager",
        "class": "NoOpComputeLogManager",
    }
}
"""Dagster would take the terminal's file descriptors for its logs: the bars would end in a file."""


def dagster_home() -> Path:
    """The folder of Dagster's history. Raises SetUpError where there is none that can be used."""
    given = os.environ.get("DAGSTER_HOME")
    if not given:
        raise SetUpError("DAGSTER_HOME is not set; expected a folder: run `make setup`.")
    home = Path(given)
    if not home.is_absolute():
        raise SetUpError(f"DAGSTER_HOME is {given!r}; expected an absolute path.")
    if not home.is_dir():
        raise SetUpError(f"DAGSTER_HOME is {given!r}; expected a folder: run `make setup`.")
    return home


@contextmanager
def open_history() -> Iterator[dg.DagsterInstance]:
    """The instance that the web UI shows, with the terminal left alone. Raises SetUpError."""
    home = dagster_home()
    try:
        instance = dg.DagsterInstance.from_ref(
            InstanceRef.from_dir(str(home), overrides=_NOT_CAPTURED)
        )
        instance.get_runs_count()
    except (yaml.YAMLError, dg.DagsterError) as error:
        said = " ".join(str(error).split())[:200]
        raise SetUpError(
            f"{home / 'dagster.yaml'}: cannot be used ({said}); expected what `make setup` writes: "
            "remove .venv/set-up and run it again."
        ) from error
    except (sqlalchemy.exc.DatabaseError, sqlite3.DatabaseError, OSError) as error:
        said = " ".join(str(getattr(error, "orig", error)).split())[:200]
        raise SetUpError(
            f"{home / 'history'}: Dagster's history cannot be read ({said}); expected its "
            "databases: move the folder away and a new history begins; versions are not touched."
        ) from error
    with instance:
        yield instance
