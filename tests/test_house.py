"""The architecture, held: no circles, small modules, few arguments, thin assets, floors apart."""

from __future__ import annotations

import ast
import os
import subprocess
import sys

import pytest

from assets_defs.systems import SYSTEMS
from benchmarks import structure


def test_no_module_imports_one_that_imports_it() -> None:
    assert structure.import_circles() == []


def test_circles_are_found_through_others_and_inside_functions(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = tmp_path_factory.mktemp("house")
    for name, text in {
        "a": "import pipelines.b",
        "b": "def late() -> None:\n    from pipelines.c import thing\n",
        "c": "from pipelines import a\n\nthing = 1\n",
        "d": "from pipelines.a import x\n",
    }.items():
        path = root / "pipelines" / f"{name}.py"
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
    monkeypatch.setattr(structure, "CHECKOUT", root)
    assert structure.import_circles() == [["pipelines.a", "pipelines.b", "pipelines.c"]]


def test_modules_functions_and_assets_are_small() -> None:
    assert structure.longest_module().size <= 400, structure.longest_module()
    assert structure.most_positional().size <= 8, structure.most_positional()
    assert structure.longest_asset_body().size <= 20, structure.longest_asset_body()


def test_every_assets_body_was_measured() -> None:
    declared = sum(len(system.plans) for system in SYSTEMS.values())
    measured = [
        node
        for _, node in structure._functions()
        if any(structure._is_asset(decorator) for decorator in node.decorator_list)
    ]
    assert len(measured) == declared


FORBIDDEN = {
    "pipelines": {"storage", "assets_defs", "tsuya", "benchmarks", "docs", "dagster", "zarr"},
    "storage": {"pipelines", "assets_defs", "tsuya", "benchmarks", "docs"},
    "assets_defs": {"tsuya", "benchmarks", "docs"},
}


def test_floors_know_only_what_they_stand_on() -> None:
    wrong = []
    for name, path in structure.modules().items():
        for node in ast.walk(ast.parse(path.read_text())):
            imported = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.module:
                imported = [node.module]
            for other in imported:
                if other.partition(".")[0] in FORBIDDEN.get(name.partition(".")[0], ()):
                    wrong.append((name, other))
    assert wrong == []


def test_no_system_and_no_instrument_imports_a_system() -> None:
    wrong = []
    files = structure.modules()
    for name, path in files.items():
        package, _, inside = name.partition(".")
        own = inside.partition(".")[0]
        if package not in ("pipelines", "assets_defs") or not inside or own == "systems":
            continue
        for other in structure._imported(path, files):
            there, _, room = other.partition(".")
            system = room.partition(".")[0]
            if there == package and system in SYSTEMS and system != own:
                wrong.append((name, other))
    assert wrong == []


@pytest.mark.parametrize(
    "statement",
    [
        "import assets_defs.systems",
        "import tsuya.cli, tsuya.run_command, tsuya.report, tsuya.keys",
        "import tsuya; tsuya.load, tsuya.open",
        *(f"import assets_defs.{system}.datasets" for system in SYSTEMS),
    ],
)
def test_what_needs_no_dagster_imports_none(statement: str) -> None:
    code = f"{statement}\nimport sys; print('dagster' in sys.modules, 'torch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]


def test_tests_of_one_system_run_in_one_process(request: pytest.FixtureRequest) -> None:
    """Else each process compiles and materialises everything again: five minutes of CPU."""
    if "PYTEST_XDIST_WORKER" not in os.environ:
        pytest.skip("the tests run in one process anyway")
    assert request.node.nodeid.rpartition("@")[2] == __file__
