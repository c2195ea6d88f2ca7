"""GLSL from the files in ``shaders/``: functions by file, and the stage's shaders made of them.

A file holds a few functions, or a shader of the stage, whose name ends in ``_vertex.glsl`` or
``_fragment.glsl``. It names the files whose functions it calls in lines ``#include "NAME.glsl"``.
All are written so that GLSL 3.30 and GLSL ES 3.00 (WebGL 2) both take them: without a version, a
precision and a ``main``, which are for whoever includes them. What is a number of Python's in one
picture is a name in capitals in the file.

Of a loop between ``#pragma unroll_loop_start`` and ``#pragma unroll_loop_end`` (three.js's lines)
the body is written out for each ``i``: software renderers read much faster at constant indices.
Who does not know the lines has the loop.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

SHADERS = Path(__file__).parent / "shaders"
"""The folder of the files."""

Value = bool | int | float | Sequence[float]
"""What a name in capitals stands for: 1 or 0, an integer, a float, or floats between commas."""

_INCLUDE = re.compile(r'^[ \t]*#include[ \t]+"([^"\n]*)"[ \t]*$', re.MULTILINE)
_LOOP = re.compile(
    r"^[ \t]*#pragma unroll_loop_start\n"
    r"[ \t]*for \(int i = 0; i < (\w+); i\+\+\) \{\n(.*?)[ \t]*\}\n"
    r"[ \t]*#pragma unroll_loop_end$",
    re.MULTILINE | re.DOTALL,
)


@dataclass(frozen=True)
class Shader:
    """GLSL put into VTK's shaders: code by the name of its tag, e.g. ``"Color::Impl"``.

    The code stands where VTK's own for that tag stood; a ``//VTK::…`` line inside keeps VTK's.
    """

    vertex: Mapping[str, str] = field(default_factory=dict)
    fragment: Mapping[str, str] = field(default_factory=dict)


def shader_source(name: str, **values: Value) -> str:
    """The text of a file of ``shaders/``, before it the files that it includes, each once.

    values: what names in capitals stand for. Raises FileNotFoundError for a file that is not there,
    and ValueError for files that include each other, for a value that no line uses, and for floats
    that are not finite.

    >>> shader_source("fur_fragment.glsl").count("float depthCode(float alpha)")
    1
    >>> text = shader_source("fur_fragment.glsl", CODE_STEPS=3.0, COLUMNS=True)
    >>> text.splitlines()[:2]
    ['#define CODE_STEPS 3.0', '#define COLUMNS 1']
    """
    return _sources([name], values)[0]


def surface_shader(vertex: str, fragment: str, **values: Value) -> Shader:
    """The shader of a surface on the stage, of two files of ``shaders/``.

    The vertex shader's file has a function ``void placeVertex()``, called after VTK has set
    ``gl_Position`` from ``vertexMC``. The fragment shader's has ``vec3 surfaceColour()``, linear:
    the albedo of a surface that is lit, the radiance of any other. Both declare all that they use,
    but for ``vertexMC`` and ``MCDCMatrix``. values: as of ``shader_source``, for either. Raises
    FileNotFoundError and ValueError as it.

    >>> shader = surface_shader("painted_vertex.glsl", "painted_fragment.glsl")
    >>> sorted(shader.vertex), shader.vertex["CustomEnd::Impl"]
    (['Camera::Dec', 'CustomEnd::Impl'], 'placeVertex();')
    """
    for_vertices, for_fragments = _sources([vertex, fragment], values)
    return Shader(
        vertex={
            "Camera::Dec": f"//VTK::Camera::Dec\n{for_vertices}",
            "CustomEnd::Impl": "placeVertex();",
        },
        fragment={
            # The file declares its uniforms and textures itself.
            "CustomUniforms::Dec": "",
            "TMap::Dec": for_fragments,
            # ``surface`` has no ambient colour that would come on top.
            "Color::Impl": "//VTK::Color::Impl\n  diffuseColor = surfaceColour();\n",
        },
    )


def _sources(names: Sequence[str], values: Mapping[str, Value]) -> list[str]:
    texts = [_with_included(name, (), set()) for name in names]
    written = {name: _written(name, value) for name, value in values.items()}
    for name in values:
        if not any(_uses(text, name) for text in texts):
            raise ValueError(f"{name}: found in no line of {' and '.join(names)}.")
    return [_with_values(text, written) for text in texts]


def _with_values(text: str, written: Mapping[str, str]) -> str:
    known = {name: value for name, value in written.items() if _uses(text, name)}
    defined = "".join(f"#define {name} {value}\n" for name, value in known.items())
    return defined + _LOOP.sub(lambda loop: _unrolled(loop, known), text)


def _uses(text: str, name: str) -> bool:
    return re.search(rf"\b{re.escape(name)}\b", text) is not None


def _with_included(name: str, users: tuple[str, ...], included: set[str]) -> str:
    """The text of a file with those before it that are not included yet; ``users`` include it."""
    path = SHADERS / name
    if path.parent != SHADERS or not path.is_file():
        asked = f", which {users[-1]} includes," if users else ""
        raise FileNotFoundError(f"shader {name}{asked} is not in {SHADERS}.")
    if name in users:
        raise ValueError(f"shaders include each other: {' > '.join((*users, name))}.")
    if name in included:
        return ""
    included.add(name)
    return _INCLUDE.sub(
        lambda line: _with_included(line[1], (*users, name), included), path.read_text("ascii")
    )


def _written(name: str, value: Value) -> str:
    if isinstance(value, Sequence):
        return ", ".join(_written(name, float(part)) for part in value)
    if not math.isfinite(value):
        raise ValueError(f"{name} is {value}; expected a finite number.")
    number = repr(float(value)) if isinstance(value, float) else repr(operator.index(value) * 1)
    return f"({number})" if value < 0 else number


def _unrolled(loop: re.Match[str], values: Mapping[str, str]) -> str:
    count, body = loop.groups()
    return "".join(
        "  {\n" + re.sub(r"\bi\b", str(number), body) + "  }\n"
        for number in range(int(values.get(count, count)))
    )
