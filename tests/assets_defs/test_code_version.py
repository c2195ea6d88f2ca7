"""Code versions of a small project written for the test: what changes them and what must not."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from assets_defs import code_version as module
from assets_defs.code_version import code_version
from assets_defs.system import System

FILES = {
    "assets_defs/fur.py": '''"""Assets of the fur."""

from pipelines import shells
from pipelines.limits import SIZES
from pipelines.medium import LAYERS, Medium, decay
from storage.schemas import FUR

THICKNESS = 0.5


def unused() -> int:
    return 1


def offset(height: float) -> float:
    return scaled(height) + 1


def scaled(height: float) -> float:
    return 2 * height


def stack(height: float) -> float:
    """Make the stack."""
    from pipelines.late import finish

    # All of it.
    total = offset(height) * THICKNESS + decay(height) + shells.count() + LAYERS + len(SIZES)
    return finish(total, Medium(1.0)) + FUR


def plain() -> int:
    return 3


def figure(height: float) -> float:
    return height
''',
    "assets_defs/street/points.py": (
        "from assets_defs.pictures import table\n"
        "from assets_defs.street import whole\n"
        "from assets_defs.street.datasets import cloud\n\n\n"
        "def points() -> int:\n"
        "    from assets_defs.street.late import inside\n\n"
        "    return cloud() + table() + whole.total() + inside()\n"
    ),
    "assets_defs/street/late.py": "def inside() -> int:\n    return 11\n",
    "assets_defs/street/whole.py": "def total() -> int:\n    return 12\n",
    "assets_defs/street/datasets.py": "def cloud() -> int:\n    return 6\n",
    "assets_defs/pictures.py": "def table() -> int:\n    return 9\n",
    "pipelines/medium.py": '''"""The medium."""

from dataclasses import dataclass

import pipelines.deep.power as power

LAYERS = 8
"""How many."""


@dataclass
class Medium:
    """A medium."""

    brightest: float
    """Imax."""

    def twice(self) -> float:
        """Two times."""
        return 2 * self.brightest


class Shape:
    """A shape."""

    ...


def decay(height: float) -> float:
    """Decay."""
    return power.power(height)
''',
    "pipelines/deep/power.py": "def power(value: float) -> float:\n    return value**2\n",
    "pipelines/limits.py": 'SIZES = ("small", ("large", 7))\n',
    "pipelines/shells.py": "def count() -> int:\n    return 3\n",
    "pipelines/late.py": (
        "from storage.readers.files import suffix\n\n\n"
        "def finish(total: float, medium: object) -> float:\n    return total + suffix()\n"
    ),
    "pipelines/drawn.py": 'def draw() -> str:\n    return "outer.glsl"\n',
    "pipelines/drawing/shaders/outer.glsl": (
        '#include "inner.glsl"\nfloat outer() { return 2.0 * inner(); }\n'
    ),
    "pipelines/drawing/shaders/inner.glsl": "// Half.\nfloat inner() { return 0.5; }\n",
    "pipelines/stranger.py": "def strange() -> int:\n    return 5\n",
    "storage/readers/files.py": "def suffix() -> int:\n    return 4\n",
    "storage/schemas.py": "FUR = 1\n",
}
STACK = "print(code_version(fur.stack))"

Version = Callable[..., str]


@pytest.fixture
def version(tmp_path: Path) -> Version:
    """Code version of the small project's `stack` with replacements (file, old, new) made."""
    for package in (
        *("assets_defs", "assets_defs/street", "pipelines", "pipelines/deep"),
        *("pipelines/drawing", "pipelines/drawing/shaders"),
        *("storage", "storage/readers"),
    ):
        (tmp_path / package).mkdir()
        (tmp_path / package / "__init__.py").touch()
    source = Path(module.__file__).read_text()
    (tmp_path / "assets_defs" / "code_version.py").write_text(source)

    def run(*replacements: tuple[str, str, str], script: str = STACK) -> str:
        files = dict(FILES)
        for name, old, new in replacements:
            assert files[name].count(old) == 1, (name, old)
            files[name] = files[name].replace(old, new)
        for name, text in files.items():
            (tmp_path / name).write_text(text)
        code = "from assets_defs import fur\nfrom assets_defs.code_version import code_version\n"
        # -B: a module changed within the same second would be read from its bytecode.
        done = subprocess.run(
            [sys.executable, "-I", "-B", "-c", f"import sys; sys.path[:0] = ['.']\n{code}{script}"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    return run


SAME: Mapping[str, tuple[str, str, str]] = {
    "comment in the asset": ("assets_defs/fur.py", "# All of it.", "# Most of it."),
    "docstring of the asset": ("assets_defs/fur.py", '"""Make the stack."""', '"""Stack."""'),
    "docstring gone": ("assets_defs/fur.py", '    """Make the stack."""\n', ""),
    "layout": ("assets_defs/fur.py", "offset(height) * THICKNESS", "(offset(height)*THICKNESS)"),
    "function that the asset does not name": ("assets_defs/fur.py", "return 1\n", "return 2\n"),
    "other asset": ("assets_defs/fur.py", "return 3", "return 4"),
    "docstring of a module": ("pipelines/medium.py", "The medium.", "Some medium."),
    "docstring of a function below": ("pipelines/medium.py", "Decay.", "It decays."),
    "docstring of a class below": ("pipelines/medium.py", "A medium.", "The medium"),
    "docstring of a method below": ("pipelines/medium.py", '        """Two times."""\n', ""),
    "docstring of a field": ("pipelines/medium.py", '"""Imax."""', '"""I at the tips."""'),
    "docstring of a constant": ("pipelines/medium.py", '"""How many."""\n', ""),
    "module that nobody imports": ("pipelines/stranger.py", "5", "6"),
    "module of another package": ("storage/schemas.py", "1", "1  # one"),
}
OTHER: Mapping[str, tuple[str, str, str]] = {
    "body": ("assets_defs/fur.py", "decay(height) + shells", "decay(height) - shells"),
    "default": ("assets_defs/fur.py", "def stack(height: float)", "def stack(height: float = 2)"),
    "helper": ("assets_defs/fur.py", "scaled(height) + 1", "scaled(height) + 2"),
    "helper's helper": ("assets_defs/fur.py", "2 * height", "3 * height"),
    "constant of its own module": ("assets_defs/fur.py", "THICKNESS = 0.5", "THICKNESS = 0.6"),
    "constant below": ("pipelines/medium.py", "LAYERS = 8", "LAYERS = 9"),
    "constant alone below": ("pipelines/limits.py", "7", "8"),
    "function below": ("pipelines/medium.py", "power.power(height)", "power.power(-height)"),
    "class below": ("pipelines/medium.py", "2 * self", "3 * self"),
    "module below": ("pipelines/shells.py", "3", "4"),
    "module of a module": ("pipelines/deep/power.py", "value**2", "value**3"),
    "module imported when it runs": ("pipelines/late.py", "total +", "total -"),
    "reader below a module": ("storage/readers/files.py", "4", "5"),
}


def test_what_computes_nothing_else_changes_no_version(version: Version) -> None:
    before = version()
    changed = [name for name, replacement in SAME.items() if version(replacement) != before]
    assert changed == []


def test_every_change_of_what_is_computed_is_another_version(version: Version) -> None:
    versions = {"nothing": version()} | {name: version(change) for name, change in OTHER.items()}
    assert len(set(versions.values())) == len(versions), versions


def test_functions_of_the_systems_own_package_count_and_others_do_not(version: Version) -> None:
    script = "from assets_defs.street.points import points\nprint(code_version(points))"
    before = version(script=script)
    near = {
        "imported by name": ("assets_defs/street/datasets.py", "6", "7"),
        "imported when it runs": ("assets_defs/street/late.py", "11", "13"),
        "imported as a module": ("assets_defs/street/whole.py", "12", "13"),
    }
    far = ("assets_defs/pictures.py", "9", "10")
    versions = [before, *(version(change, script=script) for change in near.values())]
    assert len(set(versions)) == len(versions)
    assert version(far, script=script) == before


def test_shaders_count_and_their_comments_do_not(version: Version) -> None:
    script = "from pipelines.drawn import draw\nprint(code_version(draw))"
    before = version(script=script)
    comment = ("pipelines/drawing/shaders/inner.glsl", "// Half.", "// A half.")
    inner = ("pipelines/drawing/shaders/inner.glsl", "0.5", "0.25")
    outer = ("pipelines/drawing/shaders/outer.glsl", "2.0", "3.0")
    assert version(comment, script=script) == before
    assert len({before, version(inner, script=script), version(outer, script=script)}) == 3


def test_a_version_does_not_depend_on_what_was_asked_before(version: Version) -> None:
    script = """
first = code_version(fur.stack)
code_version(fur.plain), code_version(fur.figure, fur.stack)
again = code_version(fur.stack)
assert first == again, (first, again)
print(first)
"""
    assert version(script=script) == version()


def test_the_figures_of_an_asset_count_and_their_order_does_not(version: Version) -> None:
    script = """
from assets_defs.fur import figure, plain, stack
print(code_version(stack, figure) == code_version(figure, stack) == code_version(stack))
print(code_version(figure), code_version(plain), code_version(figure, plain))
"""
    same, apart = version(script=script).splitlines()
    assert same == "False"
    assert len(set(apart.split())) == 3
    assert version(script=script.replace(" == code_version(stack))", ")")).startswith("True")


def test_a_version_is_a_short_hexadecimal_hash() -> None:
    found = code_version(code_version)
    assert len(found) == 16
    assert int(found, 16) >= 0
    assert found == code_version(code_version)


def test_assets_of_the_graph_have_versions_of_their_own() -> None:
    from assets_defs.systems import SYSTEMS

    system: System
    for system in SYSTEMS.values():
        codes = [plan.code for plan in system.plans.values()]
        assert len(set(codes)) == len(codes)
