"""Examples in docstrings say what happens; pages of notebooks run."""

from __future__ import annotations

import ast
import runpy
from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import pytest

from tests.pipelines.examples import found_examples, run_examples

PAGES = sorted((Path(__file__).parents[2] / "docs" / "notebooks").glob("*.py"))
MOST_LINES = 15


def test_examples_of_docstrings_come_true() -> None:
    examples = found_examples()
    assert len(examples) >= 30
    run_examples(examples)


def test_there_is_a_page_for_every_system() -> None:
    from storage.schemas import systems

    assert {page.stem for page in PAGES} == set(systems())


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_is_short_and_uses_numerics_only(page: Path) -> None:
    text = page.read_text()
    said = str(ast.get_docstring(ast.parse(text), clean=False))
    lines = [line.strip() for line in text.replace(f'"""{said}"""', "").splitlines()]
    assert sum(1 for line in lines if line and not line.startswith("#")) <= MOST_LINES
    imported = {
        (node.module if isinstance(node, ast.ImportFrom) else node.names[0].name).partition(".")[0]
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Import | ast.ImportFrom)
    }
    assert "pipelines" in imported
    assert imported.isdisjoint({"storage", "assets_defs", "tsuya", "dagster"})


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_shows_a_picture(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    matplotlib.use("agg")
    shown: list[list[Any]] = []
    monkeypatch.setattr(
        plt, "show", lambda *_, **__: shown.append([axes.images for axes in plt.gcf().axes])
    )
    runpy.run_path(str(page))
    pictures = [image.get_array() for axes in shown for images in axes for image in images]
    plt.close("all")
    assert pictures, "nothing was shown"
    assert all(picture.std() > 1e-3 for picture in pictures), "an empty picture was shown"
