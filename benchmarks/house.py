"""Figures of the house: how fast commands start, how the code is built, that nothing changed.

`docs/architecture.md` says what each one means. What ``results/contents.json`` lists is made at
preset `test` in a store of its own, and the content hashes are compared with those listed. They
hold for the processor that the list names: another one may round differently.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks import structure
from benchmarks.contents import compared, contents

KEPT = Path(__file__).parent / "results" / "contents.json"
_BEST_OF = 5
_BASIS = "ssdf_lighting/ssdf_basis/teapot"
_DEFINITIONS = "from assets_defs.definitions import build_definitions; build_definitions()"
_MAKE_ALL = """
import json, sys
from assets_defs.launcher import Request
from assets_defs.partitions import keys_of_partition
from assets_defs.systems import SYSTEMS
from tsuya.keys import parse_key
from tsuya.session import launch_all, open_session

wanted = {}
for slot in map(parse_key, json.loads(sys.argv[1])):
    by = SYSTEMS[slot.system].plans[slot.asset].by
    keys = keys_of_partition(slot.partition, by, separator=".")
    wanted.setdefault(slot.system, []).append(keys)
with open_session() as session:
    requests = [Request(SYSTEMS[name], keys, "test") for name, keys in wanted.items()]
    failures = launch_all(session, requests).failures
    assert not failures, failures
"""


def run() -> dict[str, Any]:
    """All figures."""
    circles = structure.import_circles()
    longest, most = structure.longest_module(), structure.most_positional()
    body = structure.longest_asset_body()
    figures: dict[str, Any] = {
        "import_circles": len(circles),
        "longest_module": longest.size,
        "most_positional": most.size,
        "longest_asset_body": body.size,
        "the_largest": {
            "circles": circles,
            "module": longest.where,
            "positional": most.where,
            "asset_body": body.where,
        },
        "examples_run": _examples_run(),
    }
    with tempfile.TemporaryDirectory() as folder:
        environment = _environment(Path(folder))
        figures |= _made_and_compared(Path(folder), environment)
        figures |= _starting(environment)
    return figures


def _starting(environment: dict[str, str]) -> dict[str, float]:
    """CPU seconds of whole processes, best of five."""
    commands = {
        "python_cpu_s": ["-c", "pass"],
        "import_definitions_cpu_s": ["-c", _DEFINITIONS],
        "cli_help_cpu_s": ["-m", "tsuya", "--help"],
        "status_cpu_s": ["-m", "tsuya", "status"],
        "load_cpu_s": ["-c", f"import tsuya; tsuya.load({_BASIS!r})"],
    }
    return {
        name: min(_cpu_seconds(command, environment) for _ in range(_BEST_OF))
        for name, command in commands.items()
    }


def _made_and_compared(folder: Path, environment: dict[str, str]) -> dict[str, Any]:
    """Everything made at preset `test`, against the list that is kept."""
    kept = json.loads(KEPT.read_text())
    seconds = _cpu_seconds(["-c", _MAKE_ALL, json.dumps(list(kept["contents"]))], environment)
    made = contents(folder / "data" / "store")
    return {
        "make_all_cpu_s": seconds,
        "contents_machine": kept["machine"],
        **compared(kept["contents"], made),
    }


def _examples_run() -> int:
    """Public functions whose docstring has an example, all of which pass."""
    from tests.pipelines.examples import found_examples, run_examples

    examples = found_examples()
    run_examples(examples)
    return len(examples)


def _environment(folder: Path) -> dict[str, str]:
    (folder / "dagster").mkdir()
    (folder / "dagster" / "dagster.yaml").write_text("telemetry: {enabled: false}\n")
    places = {"DAGSTER_HOME": str(folder / "dagster"), "TSUYA_DATA": str(folder / "data")}
    return os.environ | places


def _cpu_seconds(command: Sequence[str], environment: dict[str, str]) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, *command],
        env=environment,
        check=True,
        cwd=structure.CHECKOUT,
        stdout=subprocess.DEVNULL,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
