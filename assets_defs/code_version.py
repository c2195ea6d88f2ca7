"""Code versions that nobody has to remember to raise.

An asset's code version is the hash of its own function, of the functions and constants (numbers,
texts, tuples of them) that it names in its module or in its system's package, and of every module
of `pipelines`, `storage.packages` and `storage.readers` that it imports, directly or through
others; a shader that a module names counts like a module. The hash is over syntax trees without
docstrings: a comment or a docstring changes no version.

What a file says is worked out once and kept beside the bytecode, by the hash of the file's bytes:
a process that finds nothing changed parses nothing.
"""

from __future__ import annotations

import ast
import atexit
import functools
import hashlib
import importlib
import inspect
import json
import os
import re
import sys
import textwrap
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

PROJECT = Path(__file__).resolve().parent.parent
SHADERS = PROJECT / "pipelines" / "drawing" / "shaders"
_HASHED_PACKAGES = ("pipelines", "storage.btf_file", "storage.packages", "storage.readers")
_DIGITS = 16
_KEPT = (
    Path(__file__).parent
    / "__pycache__"
    / (
        "code-{}-{}.json".format(*sys.version_info[:2])  # trees differ between Python's versions
    )
)
_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"', re.MULTILINE)


class Code(NamedTuple):
    """What a version needs to know of a function or of a whole file."""

    digest: str
    """Hash of the syntax tree without docstrings."""
    names: tuple[str, ...]
    """Names that stand in it; of a whole file: none."""
    reaches: tuple[str, ...]
    """What it imports of the hashed packages, modules or not, and shaders that it names."""
    from_assets: tuple[str, ...]
    """``module:name`` of what it imports from modules of assets."""


def code_version(*functions: Callable[..., Any]) -> str:
    """Hash of the functions' sources and of the project's numerics and readers below them."""
    own: dict[str, str] = {}
    modules: set[str] = set()
    for function in functions:
        _gather(function, own, modules)
    parts = [f"{name}:{text}" for name, text in sorted(own.items())]
    parts += [f"{name}:{_module(name).digest}" for name in sorted(modules)]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:_DIGITS]


def _gather(function: Callable[..., Any], own: dict[str, str], modules: set[str]) -> None:
    """Add a function, the functions of its module that it names, and the modules it reaches."""
    function = inspect.unwrap(function)
    name = f"{function.__module__}.{function.__qualname__}"
    if name in own:
        return
    code = _function(function)
    own[name] = code.digest
    for module in code.reaches:
        modules |= _reached(module)
    named = {word: function.__globals__.get(word) for word in code.names}
    for imported in code.from_assets:
        module, _, word = imported.partition(":")
        if _is_near(module, function.__module__):
            named[word] = getattr(importlib.import_module(module), word, None)
    for word, value in named.items():
        home = getattr(value, "__name__" if inspect.ismodule(value) else "__module__", None)
        if isinstance(home, str) and home.startswith(_HASHED_PACKAGES):
            modules |= _reached(home)
        elif inspect.isfunction(value) and _is_near(home, function.__module__):
            _gather(value, own, modules)
        elif inspect.ismodule(value) and _is_near(home, function.__module__):
            whole = _module(value.__name__)
            own[value.__name__] = whole.digest
            modules.update(*(_reached(module) for module in whole.reaches))
        elif _is_constant(value):
            own[f"{function.__module__}.{word}"] = repr(value)


def _is_near(home: str | None, module: str) -> bool:
    """Whether a function's home is the module itself, or one of its system's package."""
    package = module.rpartition(".")[0]
    own_package = package.count(".") > 0 and str(home).startswith(f"{package}.")
    return home == module or own_package


def _is_constant(value: object) -> bool:
    if isinstance(value, tuple):
        return all(_is_constant(part) for part in value)
    return isinstance(value, int | float | str | bytes)


@functools.cache
def _reached(name: str) -> frozenset[str]:
    """A module or shader and all that it reaches; nothing where the name is neither's."""
    reached: set[str] = set()
    waiting = [name]
    while waiting:
        module = waiting.pop()
        if module not in reached and _path(module) is not None:
            reached.add(module)
            waiting.extend(_module(module).reaches)
    return frozenset(reached)


# ---- what files say ------------------------------------------------------------------------------


@functools.cache
def _module(name: str) -> Code:
    path = _path(name)
    assert path is not None, name
    return _file(path)[""]


def _function(function: Callable[..., Any]) -> Code:
    file = getattr(sys.modules.get(function.__module__), "__file__", None)
    found = _file(Path(file)).get(function.__qualname__) if file else None
    # One that is made inside another function, or is no function of a file at all.
    return found or _code(ast.parse(textwrap.dedent(inspect.getsource(function))))


@functools.cache
def _file(path: Path) -> dict[str, Code]:
    """Code of a file, under the empty name, and of its functions by name."""
    data = path.read_bytes()
    digest = hashlib.sha256(data).hexdigest()
    kept = _kept().get(str(path))
    if kept is None or kept[0] != digest:
        text = data.decode()
        codes = {"": _shader(text)} if path.suffix == ".glsl" else _codes(ast.parse(text))
        _kept()[str(path)] = kept = (digest, codes)
        _keep()
    return kept[1]


def _codes(tree: ast.Module) -> dict[str, Code]:
    functions = {node.name: _code(node) for node in tree.body if isinstance(node, ast.FunctionDef)}
    return {"": _code(tree)._replace(names=(), from_assets=()), **functions}


def _code(tree: ast.AST) -> Code:
    digest = hashlib.sha256(_dump(tree).encode()).hexdigest()
    nodes = list(ast.walk(tree))
    names = dict.fromkeys(node.id for node in nodes if isinstance(node, ast.Name))
    texts = [str(node.value) for node in nodes if isinstance(node, ast.Constant)]
    shaders = [text for text in texts if text.endswith(".glsl")]
    reaches = tuple(dict.fromkeys([*_imports(tree), *shaders]))
    from_assets = (
        f"{node.module}:{alias.name}"
        for node in nodes
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("assets_defs.")
        for alias in node.names
    )
    return Code(digest, tuple(names), reaches, tuple(from_assets))


def _shader(text: str) -> Code:
    plain = _COMMENT.sub("", text)
    lines = "\n".join(line.strip() for line in plain.splitlines() if line.strip())
    includes = tuple(_INCLUDE.findall(plain))
    return Code(hashlib.sha256(lines.encode()).hexdigest(), (), includes, ())


def _imports(tree: ast.AST) -> Iterator[str]:
    """Dotted names that a tree imports of the hashed packages: modules, or what is in them."""
    for node in ast.walk(tree):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        for name in names:
            if name.startswith(_HASHED_PACKAGES):
                yield name


@functools.cache
def _path(name: str) -> Path | None:
    base = PROJECT.joinpath(*name.split("."))
    for path in (SHADERS / name, base.with_suffix(".py"), base / "__init__.py"):
        if path.is_file():
            return path
    return None


def _dump(tree: ast.AST) -> str:
    # All bare constants go, not the first one: fields have docstrings too, and a tree that is kept
    # must give the same text when it is dumped again.
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [line for line in node.body if not _is_bare_constant(line)]
    return ast.dump(tree)


def _is_bare_constant(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


# ---- what is kept between processes --------------------------------------------------------------


@functools.cache
def _kept() -> dict[str, tuple[str, dict[str, Code]]]:
    """What earlier processes worked out, by path: the file's hash and its codes."""
    try:
        return {
            path: (digest, {name: _read(code) for name, code in codes.items()})
            for path, (digest, codes) in json.loads(_KEPT.read_text()).items()
        }
    except (OSError, ValueError, TypeError, AttributeError):
        return {}  # none yet, or not ours: all of it can be worked out again


def _read(code: Sequence[Any]) -> Code:
    digest, *lists = code
    return Code(digest, *(tuple(words) for words in lists))


@functools.cache
def _keep() -> None:
    """Have what is known written at the end of the process, once."""
    atexit.register(_write)


def _write() -> None:
    """Where nothing can be written, the next process works it out again."""
    beside = _KEPT.with_name(f".{_KEPT.name}.{os.getpid()}")
    try:
        _KEPT.parent.mkdir(exist_ok=True)
        beside.write_text(json.dumps({p: k for p, k in _kept().items() if Path(p).is_file()}))
        os.replace(beside, _KEPT)
    except OSError:
        beside.unlink(missing_ok=True)
