"""Code versions that nobody has to remember to raise.

An asset's code version is the hash of its own function, of the functions and constants (numbers,
texts, tuples of them) that it names in its module or in its system's package, and of every module
of `pipelines` and of `storage.readers` that it imports, directly or through others. The hash is
over syntax trees without docstrings: a comment or a docstring changes no version.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import inspect
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeGuard

PROJECT = Path(__file__).resolve().parent.parent
_HASHED_PACKAGES = ("pipelines", "storage.readers")
_DIGITS = 16


def code_version(*functions: Callable[..., Any]) -> str:
    """Hash of the functions' sources and of the project's numerics and readers below them."""
    own: dict[str, str] = {}
    modules: set[str] = set()
    for function in functions:
        _gather(function, own, modules)
    parts = [f"{name}:{text}" for name, text in sorted(own.items())]
    parts += [f"{name}:{_dump(_tree(name))}" for name in sorted(modules)]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:_DIGITS]


def _gather(function: Callable[..., Any], own: dict[str, str], modules: set[str]) -> None:
    """Add a function, the functions of its module that it names, and the modules it reaches."""
    name = f"{function.__module__}.{function.__qualname__}"
    if name in own:
        return
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    own[name] = _dump(tree)
    for module in _imports(tree):
        modules |= _reached(module)
    for node in ast.walk(tree):
        value = inspect.unwrap(function).__globals__.get(node.id) if _is_name(node) else None
        home = getattr(value, "__name__" if inspect.ismodule(value) else "__module__", None)
        if isinstance(home, str) and home.startswith(_HASHED_PACKAGES):
            modules |= _reached(home)
        elif inspect.isfunction(value) and _is_near(home, function.__module__):
            _gather(value, own, modules)
        elif _is_name(node) and _is_constant(value):
            own[f"{function.__module__}.{node.id}"] = repr(value)


def _is_near(home: str | None, module: str) -> bool:
    """Whether a function's home is the module itself, or one of its system's package."""
    package = module.rpartition(".")[0]
    own_package = package.count(".") > 0 and str(home).startswith(f"{package}.")
    return home == module or own_package


def _is_name(node: ast.AST) -> TypeGuard[ast.Name]:
    return isinstance(node, ast.Name)


def _is_constant(value: object) -> bool:
    if isinstance(value, tuple):
        return all(_is_constant(part) for part in value)
    return isinstance(value, int | float | str | bytes)


def _imports(tree: ast.AST) -> Iterator[str]:
    """Dotted names of the hashed packages' modules that a tree imports."""
    for node in ast.walk(tree):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        for name in names:
            if name.startswith(_HASHED_PACKAGES) and _path(name) is not None:
                yield name


def _reached(name: str) -> set[str]:
    reached: set[str] = set()
    waiting = [name]
    while waiting:
        module = waiting.pop()
        if module not in reached:
            reached.add(module)
            waiting.extend(_imports(_tree(module)))
    return reached


def _path(name: str) -> Path | None:
    base = PROJECT.joinpath(*name.split("."))
    for path in (base.with_suffix(".py"), base / "__init__.py"):
        if path.is_file():
            return path
    return None


@functools.cache
def _tree(name: str) -> ast.Module:
    path = _path(name)
    assert path is not None
    return ast.parse(path.read_text())


def _dump(tree: ast.Module) -> str:
    # All bare constants go, not the first one: fields have docstrings too, and a tree that is kept
    # must give the same text when it is dumped again.
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [line for line in node.body if not _is_bare_constant(line)]
    return ast.dump(tree)


def _is_bare_constant(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
