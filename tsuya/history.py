"""Dagster's history, the one that the web UI shows, opened for a command."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager

import dagster as dg
import sqlalchemy.exc
import yaml
from dagster._core.instance.ref import InstanceRef

from tsuya.console import SetUpError, dagster_home

_NOT_CAPTURED = {
    "compute_logs": {
        "module": "dagster._core.storage.noop_compute_log_manager",
        "class": "NoOpComputeLogManager",
    }
}
"""Dagster would take the terminal's file descriptors for its logs: the bars would end in a file."""


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
