"""How the code is built, read from its syntax trees: circles of imports, sizes, arguments."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

CHECKOUT = Path(__file__).resolve().parent.parent
PACKAGES = ("pipelines", "storage", "assets_defs", "tsuya", "benchmarks", "docs")


class Largest(NamedTuple):
    """The largest of its kind, and which it is."""

    size: int
    where: str


def modules() -> dict[str, Path]:
    """Files of all packages by dotted name; a package's ``__init__`` by the package's."""
    found = {}
    for package in PACKAGES:
        for path in sorted((CHECKOUT / package).rglob("*.py")):
            parts = path.relative_to(CHECKOUT).with_suffix("").parts
            name = ".".join(parts).removesuffix(".__init__")
            found[name] = path
    return found


def import_circles() -> list[list[str]]:
    """Groups of modules that import each other, directly or through others.

    Every import counts, one inside a function and one for a type checker, too.
    """
    files = modules()
    graph = {name: _imported(path, files) - {name} for name, path in files.items()}
    return [group for group in _strongly_connected(graph) if len(group) > 1]


def longest_module() -> Largest:
    """The module with the most lines."""
    sizes = ((len(path.read_text().splitlines()), name) for name, path in modules().items())
    return Largest(*max(sizes))


def most_positional() -> Largest:
    """The function with the most arguments that may be given by position."""
    sizes = (
        (len(node.args.posonlyargs) + len(node.args.args), f"{name}.{node.name}")
        for name, node in _functions()
    )
    return Largest(*max(sizes))


def longest_asset_body() -> Largest:
    """The asset's function with the most lines of statements: no docstring, comment, blank line."""
    sizes = (
        (_statement_lines(name, node), f"{name}.{node.name}")
        for name, node in _functions()
        if any(_is_asset(decorator) for decorator in node.decorator_list)
    )
    return Largest(*max(sizes))


def _imported(path: Path, files: dict[str, Path]) -> set[str]:
    """Names of the project's modules that a file imports; a name in a package, the package's."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            inside = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= inside & files.keys()
            if not inside <= files.keys():
                found.add(node.module)
    return found & files.keys()


def _functions() -> Iterator[tuple[str, ast.FunctionDef]]:
    for name, path in modules().items():
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef):
                yield name, node


def _is_asset(decorator: ast.expr) -> bool:
    """Whether a decorator is ``SYSTEM.asset(…)``."""
    return (
        isinstance(decorator, ast.Call)
        and isinstance(decorator.func, ast.Attribute)
        and decorator.func.attr == "asset"
    )


def _statement_lines(name: str, node: ast.FunctionDef) -> int:
    lines = modules()[name].read_text().splitlines()
    body = node.body[1:] if ast.get_docstring(node) is not None else node.body
    if not body:
        return 0
    texts = (line.strip() for line in lines[body[0].lineno - 1 : body[-1].end_lineno])
    return sum(1 for text in texts if text and not text.startswith("#"))


def _strongly_connected(graph: dict[str, set[str]]) -> list[list[str]]:
    """Tarjan's algorithm (1972)."""
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    groups: list[list[str]] = []

    def visit(node: str) -> None:
        order[node] = low[node] = len(order)
        stack.append(node)
        for beyond in graph[node]:
            if beyond not in order:
                visit(beyond)
                low[node] = min(low[node], low[beyond])
            elif beyond in stack:
                low[node] = min(low[node], order[beyond])
        if low[node] == order[node]:
            start = stack.index(node)
            groups.append(sorted(stack[start:]))
            del stack[start:]

    for node in graph:
        if node not in order:
            visit(node)
    return groups
