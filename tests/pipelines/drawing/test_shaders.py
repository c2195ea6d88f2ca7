"""Shaders: both dialects of GLSL take each file, files are found and included once, and functions
that NumPy has, too, give its numbers when the stage calls them."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import pipelines
from pipelines.drawing import glsl
from pipelines.drawing.colour import decode_srgb
from pipelines.drawing.glsl import SHADERS, Shader, shader_source, surface_shader
from pipelines.drawing.stage import Stage, orbit, surface, texture
from pipelines.geometry.triangle_tree import TREE_WIDTH, triangle_tree
from pipelines.light.directions import stereographic_of_vectors
from pipelines.photo_fur.laid_fur import constants
from pipelines.ssdf_lighting.distances.edge_share import edge_share
from pipelines.ssdf_lighting.distances.octahedral import directions_of, square_of
from pipelines.street_billboards.textures.view_directions import fan_position

FILES = sorted(path.name for path in SHADERS.iterdir())
FUNCTIONS = [name for name in FILES if not name.endswith(("_vertex.glsl", "_fragment.glsl"))]
FOR_OTHERS = {"lit_distances.glsl", "octahedral.glsl"}
"""No picture of the stage needs them: they are for who draws without it, and tested here."""

_STREET: dict[str, Any] = {
    "HEADER_COLUMNS": 3,
    "VIEW_COLUMNS": 5,
    "MASK_COLUMNS": 2,
    "SHOW_BILLBOARDS": False,
    "YCOCG": True,
    "NEUTRAL": [0.0, 128.0, 128.0],
    "DETAIL_TILES": 4,
    "DETAIL_SIDE": 32,
    "DETAIL_COLUMNS": 7,
    "DETAIL_SIZE": [0.2, 0.1],
    "TINT_TILES": 2,
    "TINT_SIDE": 16,
    "TINT_COLUMNS": 7,
    "TINT_SIZE": [0.2, 0.1],
}
_RGB = {"YCOCG": False, "NEUTRAL": [0.0, 0.0, 0.0], "TINT_SIDE": 32}
_CITY: dict[str, Any] = {
    "LEVEL_BIAS": -0.75,
    "ELEVATION_BOX": [-20.0, -6.0, 60.0, 23.0],
    "ELEVATION_ROWS": [0.01, 0.99],
}
_GLASS: dict[str, Any] = {
    "LAYERS": 3,
    "ANGLES": [0.0, 1.5, -0.25],
    "LIGHTS": 64,
    "EYE": [1.0, -2.0, 1e-7],
    "EVENTS": 8,
    "NEAREST": 1e-4,
    "INDEX": 1.5,
    "BINS": 64,
    "LEANS": 3,
    "LEAN_VALUES": [0.0, 0.5, 1.0],
    "KEEPS": True,
    "TREE_WIDTH": 512,
    "TILE": 0.35,
    "THROUGH": 0.7,
    "TO_SKY": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
    "BRIGHTNESS": 0.7,
    "LAMP": [0.0, 0.0, 1.0],
    "LAMP_EDGE": [0.996, 0.998],
    "LAMP_RADIANCE": [3.0, 2.0, 1.0],
    "COVERED_A": [1.0, 1.0, 0.0, 1.0],
    "COVERED_B": [1.0, 1.0, 1.0, 1.0],
    "STRENGTH": 0.5,
}
_LATENTS: dict[str, Any] = {
    "LATENT_VECTORS": 6, "TEXELS": [48, 32], "LEVELS": 7, "PARALLAX": [0.1] * 18,
}  # fmt: skip
_FUNCTION_VALUES: dict[str, Any] = {
    **_GLASS, **_LATENTS, "VECTORS": 27, "LEAST_VIEW": 0.05, "SIDE": 64, "LIGHTS": 5,
}  # fmt: skip
CONSTANTS: dict[str, tuple[str, ...]] = {
    "btf_decoder.glsl": ("VECTORS", "LATENT_VECTORS"),
    "btf_latents.glsl": ("LATENT_VECTORS", "TEXELS", "LEVELS", "PARALLAX"),
    "lit_lobes.glsl": ("LEAST_VIEW",),
    "ssdf_lookup.glsl": ("SIDE",),
    "lit_distances.glsl": ("LEAST_VIEW", "SIDE", "LIGHTS"),
    "scratch_table.glsl": ("BINS", "LEANS", "LEAN_VALUES", "KEEPS", "INDEX"),
    "triangle_tree.glsl": ("TREE_WIDTH",),
}
"""Names in capitals of files of functions."""
_LIT: dict[str, Any] = {"TEXTURED": False, "MATT_HALF": 1024.0, "EDGES_FETCHED": False}
_FETCHED: dict[str, Any] = {"EDGES_FETCHED": True, "EDGE_ROWS": 3}
_GLOSSY: dict[str, Any] = {
    "LIGHTS": 24,
    "EDGES": 12,
    "GLOSS": True,
    "LEAST_VIEW": 0.05,
    "GLOSS_COLUMNS": 64,
}
_TEXTURED: dict[str, Any] = {
    "TEXTURED": True,
    "COLOUR_MAP": True,
    "SURFACE_MAP": True,
    "NORMAL_MAP": True,
    "LEAST_SLOPE": 0.05,
    "MOST_SPECULAR": 0.99,
}
_FUR_SHELL: dict[str, Any] = {
    "CODE_STEPS": 25.0,
    "DECAY": 0.3,
    "THICKNESS": 0.1,
    "LAYERS": 10.0,
    "SKY": 0.2,
    "HEADLIGHT": 0.4,
    "LAMP": 0.8,
    "LAMP_TOWARDS": [0.0, 0.6, 0.8],
}
_FUR_LAID: dict[str, Any] = {
    **{name: value for name, value in _FUR_SHELL.items() if name != "CODE_STEPS"},
    **{"CODES": 250.0, "MIDDLE": 0.5, "WIND": 0.4, "MOMENT": 1.5, "GUST": 3.0},
    **constants(),
}
_GRID: dict[str, Any] = {
    "GRID_START": [0.05, 0.02],
    "GRID_END": [1.0, 0.99],
    "GRID_STEPS": [12.0, 5.0],
}
_CLOTH: dict[str, Any] = {
    **_LATENTS,
    "LEAST": 0.0,
    "LARGEST": 1.0,
    "TILES": 4.0,
    "LIGHT": [0.0, -1.0, 0.0],
    "EYE": [1.0, -4.0, 0.5],
    "SCALE": 1.5,
}
STAGES: list[tuple[str, dict[str, Any]]] = [
    ("painted", {}),
    *(
        ("btf_cloth", _CLOTH | {"VECTORS": vectors, "PLACES": places})
        for vectors, places in ((27, False), (11, False), (27, True))
    ),
    *(("fur", {"CODE_STEPS": 25.0, "DECAY": 0.3, "COLUMNS": columns}) for columns in (True, False)),
    *(("fur_shell", _FUR_SHELL | {"COLUMNS": columns}) for columns in (True, False)),
    ("fur_laid", _FUR_LAID),
    ("scratched_glass", _GLASS),
    ("scratched_glass", _GLASS | {"KEEPS": False, "LEANS": 1, "LEAN_VALUES": [0.0]}),
    ("scratched_glass", _GLASS | {"LAYERS": 1, "ANGLES": [0.5]}),
    ("lit", _LIT | {"LIGHTS": 5, "EDGES": 2, "GLOSS": False}),
    ("lit", _LIT | _GLOSSY),
    ("lit", _LIT | _GLOSSY | _FETCHED),
    ("lit", _LIT | _TEXTURED | {"LIGHTS": 5, "EDGES": 2, "GLOSS": False}),
    ("lit", _LIT | _TEXTURED | _GLOSSY | _GRID),
    ("street", _STREET),
    ("street", _STREET | _RGB),
    ("street", _STREET | {"SHOW_BILLBOARDS": True}),
    ("street", _STREET | {"DETAIL_TILES": 0}),
    ("street", _STREET | {"TINT_TILES": 0}),
    ("decoded_tiles", {"COLUMNS": 12}),
    *(
        ("city", _CITY | {"GLOSS": gloss, "STAINED": stained, "BENT": bent})
        for gloss in (True, False)
        for stained in (True, False)
        for bent in (True, False)
    ),
]
"""Shaders of the stage with values for all names in capitals."""

_GIVEN = "in vec4 vertexMC;\nuniform mat4 MCDCMatrix;\n"
_PRECISION = "precision highp float;\nprecision highp int;\nprecision highp sampler2D;\n"
_DIALECTS = {
    "150": "#version 150\n",  # VTK's
    "330": "#version 330 core\n",
    "300 es": f"#version 300 es\n{_PRECISION}",
}
_VERTEX_MAIN = "void main() {\n  gl_Position = MCDCMatrix * vertexMC;\n  placeVertex();\n}\n"
_FRAGMENT_MAIN = "out vec4 drawn;\nvoid main() {\n  drawn = vec4(surfaceColour(), 1.0);\n}\n"


# ---- dialects --------------------------------------------------------------------------------


def compiled(folder: Path, sources: dict[str, str]) -> None:
    """Compile and link sources by the ending of their files' names."""
    tool = shutil.which("glslangValidator") or shutil.which("glslang")
    if tool is None:
        pytest.skip("no GLSL compiler: sudo apt-get install glslang-tools")
    for ending, source in sources.items():
        (folder / f"shader.{ending}").write_text(source)
    files = [f"shader.{ending}" for ending in sources]
    done = subprocess.run([tool, "-l", *files], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("dialect", _DIALECTS)
@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_file_of_functions_compiles_in_both_kinds_of_shaders(
    name: str, dialect: str, tmp_path: Path
) -> None:
    values = {constant: _FUNCTION_VALUES[constant] for constant in CONSTANTS.get(name, ())}
    source = _DIALECTS[dialect] + shader_source(name, **values)
    compiled(
        tmp_path,
        {
            "vert": f"{source}void main() {{\n  gl_Position = vec4(0.0);\n}}\n",
            "frag": f"{source}out vec4 drawn;\nvoid main() {{\n  drawn = vec4(0.0);\n}}\n",
        },
    )


@pytest.mark.parametrize("dialect", _DIALECTS)
@pytest.mark.parametrize("number", range(len(STAGES)))
def test_a_shader_of_the_stage_compiles_and_its_two_halves_fit(
    number: int, dialect: str, tmp_path: Path
) -> None:
    name, values = STAGES[number]
    shader = surface_shader(f"{name}_vertex.glsl", f"{name}_fragment.glsl", **values)
    vertex = shader.vertex["Camera::Dec"].removeprefix("//VTK::Camera::Dec\n")
    header = _DIALECTS[dialect]
    compiled(
        tmp_path,
        {
            "vert": header + _GIVEN + vertex + _VERTEX_MAIN,
            "frag": header + shader.fragment["TMap::Dec"] + _FRAGMENT_MAIN,
        },
    )


def test_the_compiler_refuses_what_one_dialect_lacks(tmp_path: Path) -> None:
    """Else the tests above would say nothing."""
    source = "float half_of(int n) {\n  return 0.5 * n;\n}\nvoid main() {}\n"
    compiled(tmp_path, {"vert": _DIALECTS["330"] + source})
    with pytest.raises(AssertionError, match="wrong operand types"):
        compiled(tmp_path, {"vert": _DIALECTS["300 es"] + source})


# ---- files -----------------------------------------------------------------------------------


def python_files() -> Iterator[tuple[Path, ast.Module]]:
    for path in sorted(Path(pipelines.__path__[0]).rglob("*.py")):
        yield path, ast.parse(path.read_text())


def texts(tree: ast.Module) -> Iterator[str]:
    """All texts of a module but docstrings."""
    bare = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in bare:
            yield node.value


def test_each_file_is_needed_and_each_that_is_named_is_there() -> None:
    named = {text for _, tree in python_files() for text in texts(tree) if text.endswith(".glsl")}
    assert named <= set(FILES)
    assert named == {f"{name}_{half}.glsl" for name, _ in STAGES for half in ("vertex", "fragment")}
    needed, waiting = set[str](), [*named, *FOR_OTHERS]
    while waiting:
        name = waiting.pop()
        if name not in needed:
            needed.add(name)
            waiting += re.findall(r'#include "(.*)"', (SHADERS / name).read_text())
    assert needed == set(FILES)


def test_no_module_holds_glsl() -> None:
    found = [
        f"{path.name}: {text.strip().splitlines()[0]}"
        for path, tree in python_files()
        for text in texts(tree)
        if re.search(r"\b(texelFetch|[iu]?vec[234]|mat[34]|sampler2D|gl_[A-Z]\w+)\b", text)
    ]
    assert found == []


def test_what_is_included_stands_once_before_its_user() -> None:
    text = shader_source("scratched_glass_fragment.glsl")
    assert "#include" not in text
    assert text.count("const float PI") == 1
    users = ("float placeAcross(", "vec2 equirectangularPlace(", "vec3 surfaceColour(")
    assert all(text.count(user) == 1 for user in users)
    assert all(text.index("const float PI") < text.index(user) for user in users)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder of shaders."""
    monkeypatch.setattr(glsl, "SHADERS", tmp_path)
    return tmp_path


def test_a_file_that_is_not_there_is_named(folder: Path) -> None:
    (folder / "one.glsl").write_text('#include "two.glsl"\n')
    (folder / "two.glsl").write_text('// Calls it.\n  #include "three.glsl"\n')
    with pytest.raises(FileNotFoundError, match=r"shader four.glsl is not in "):
        shader_source("four.glsl")
    with pytest.raises(FileNotFoundError, match=r"three.glsl, which two.glsl includes, is not in "):
        shader_source("one.glsl")
    with pytest.raises(FileNotFoundError, match=r"shader \.\./one.glsl is not in "):
        shader_source("../one.glsl")


def test_files_that_include_each_other_are_refused(folder: Path) -> None:
    (folder / "one.glsl").write_text('#include "two.glsl"\n')
    (folder / "two.glsl").write_text('#include "one.glsl"\n')
    with pytest.raises(ValueError, match=r"each other: one.glsl > two.glsl > one.glsl"):
        shader_source("one.glsl")


def test_values_are_defined_where_they_are_used(folder: Path) -> None:
    (folder / "one.glsl").write_text("float a = A; float b = B;\n")
    (folder / "two.glsl").write_text("vec2 c = vec2(C); bool b = B == 1;\n")
    assert shader_source("one.glsl", A=-1.5, B=7).splitlines()[:2] == [
        "#define A (-1.5)",
        "#define B 7",
    ]
    shader = surface_shader("two.glsl", "one.glsl", A=np.float64(1e-7), B=True, C=[0.5, -2.0])
    assert "#define B 1\n#define C 0.5, (-2.0)\nvec2 c" in shader.vertex["Camera::Dec"]
    assert shader.fragment["TMap::Dec"].startswith("#define A 1e-07\n#define B 1\nfloat a")
    with pytest.raises(ValueError, match=r"C: found in no line of one.glsl"):
        shader_source("one.glsl", A=1.0, B=2, C=[3.0, 4.0])
    with pytest.raises(ValueError, match=r"D: found in no line of two.glsl and one.glsl"):
        surface_shader("two.glsl", "one.glsl", D=1)
    with pytest.raises(ValueError, match=r"A is nan; expected a finite number"):
        shader_source("one.glsl", A=float("nan"))


def test_marked_loops_are_written_out(folder: Path) -> None:
    (folder / "one.glsl").write_text(
        "#pragma unroll_loop_start\n  for (int i = 0; i < COUNT; i++) {\n"
        "    if (given[i] > 0) {\n      sum += i;\n    }\n  }\n#pragma unroll_loop_end\n"
        "for (int i = 0; i < COUNT; i++) {\n  sum++;\n}\n"
    )
    text = shader_source("one.glsl", COUNT=3)
    assert [f"given[{n}] > 0" in text and f"sum += {n};" in text for n in range(4)] == [
        *(True, True, True, False)
    ]
    assert "#pragma" not in text
    assert text.endswith("for (int i = 0; i < COUNT; i++) {\n  sum++;\n}\n")


# ---- functions -------------------------------------------------------------------------------


def evaluated(
    file: str,
    expression: str,
    given: NDArray[np.floating],
    *,
    before: str = "",
    pictures: dict[str, NDArray[np.float32]] | None = None,
    **values: Any,
) -> NDArray[np.float32]:
    """A vec3 of GLSL for each row of (n, k), k <= 4, which it has under the name ``given``;
    ``before``: statements; ``pictures`` of floats, row 0 at v = 0, and ``values`` of the file."""
    rows = np.zeros((1, len(given), 4), np.float32)
    rows[0, :, : given.shape[1]] = given
    shader = Shader(
        fragment={
            "TCoord::Dec": f"//VTK::TCoord::Dec\n{shader_source(file, **values)}",
            "Color::Impl": "//VTK::Color::Impl\n"
            "  vec4 given = texelFetch(inputs, ivec2(gl_FragCoord.xy), 0);\n"
            f"{before}  diffuseColor = {expression};\n",
        }
    )
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [len(given), 1.0, 1.0]
    square = surface(
        corners,
        [[0, 1, 2], [0, 2, 3]],
        textures={
            name: texture(np.ascontiguousarray(picture[::-1]), interpolate=False)
            for name, picture in {"inputs": rows, **(pictures or {})}.items()
        },
        shader=shader,
        lit=False,
    )
    with Stage(len(given), 1) as stage:
        stage.add(square)
        stage.look(orbit((0, 0, 0), 5, azimuth=-90, elevation=90, height=1))
        return stage.radiance()[0, :, :3]


def directions(count: int, *, seed: int = 0) -> NDArray[np.float32]:
    found = np.random.default_rng(seed).normal(size=(count, 3))
    return (found / np.linalg.norm(found, axis=1, keepdims=True)).astype(np.float32)


def test_octahedral_map() -> None:
    given = directions(500)
    places = evaluated("octahedral.glsl", "vec3(octahedralPlace(3.0 * given.xyz), 0.0)", given)
    np.testing.assert_allclose(places[:, :2], square_of(given), atol=1e-6)
    square = np.random.default_rng(1).uniform(-1, 1, (500, 2)).astype(np.float32)
    found = evaluated("octahedral.glsl", "octahedralDirection(given.xy)", square)
    np.testing.assert_allclose(found, directions_of(square), atol=1e-6)


def test_stereographic_plane() -> None:
    given = directions(500)
    given[:, 2] = np.abs(given[:, 2])
    places = evaluated("stereographic.glsl", "vec3(stereographicPlace(given.xyz), 0.0)", given)
    np.testing.assert_allclose(places[:, :2], stereographic_of_vectors(given), atol=1e-6)
    back = evaluated("stereographic.glsl", "stereographicDirection(given.xy)", places[:, :2])
    np.testing.assert_allclose(back, given, atol=1e-6)


def test_visible_share_of_a_gaussian() -> None:
    d, sharpness = np.meshgrid(np.linspace(-3.0, 3.0, 61), [0.1, 1.0, 9.0, 80.0, 900.0])
    given = np.stack([d.ravel(), np.sqrt(1 + sharpness.ravel())], axis=1)
    found = evaluated("sg_visibility.glsl", "vec3(visibleShare(given.x, given.y))", given)
    expected = edge_share(d, sharpness).ravel()
    assert np.ptp(expected) > 0.99
    np.testing.assert_allclose(found[:, 0], expected, atol=2e-5)


def test_srgb_codes() -> None:
    given = np.linspace(0, 1, 256)[:, None].repeat(3, axis=1)
    found = evaluated("srgb.glsl", "linearFromSrgb(given.rgb)", given)
    np.testing.assert_allclose(found, decode_srgb(given), atol=2e-6)


def test_bits() -> None:
    words = np.random.default_rng(2).integers(0, 2**32, 200, dtype=np.uint64)
    words >>= np.random.default_rng(3).integers(0, 32, 200, dtype=np.uint64)
    words[:4] = [0, 1, 2**31, 2**32 - 1]
    given = np.stack([words & 0xFFFF, words >> np.uint64(16)], axis=1)
    word = "uint(given.x) | (uint(given.y) << 16)"
    counts = f"vec3(countOnes({word}), highestOne({word}), lowestOne({word}))"
    found = evaluated("bits.glsl", counts, given)
    for number, row in zip(words.tolist(), found, strict=True):
        lowest = (number & -number).bit_length() - 1 if number else 32
        assert row.tolist() == [number.bit_count(), number.bit_length() - 1, lowest]


def test_fan_and_the_views_beside_a_viewer() -> None:
    rng = np.random.default_rng(4)
    given = np.column_stack([rng.normal(size=(300, 3)), rng.integers(0, 60, 300)])
    found = evaluated("view_fan.glsl", "vec3(fanPosition(given.xyz, given.w))", given)[:, 0]
    expected = fan_position(given, given[:, 3].astype(int))
    apart = (found - expected + 30) % 60 - 30
    np.testing.assert_allclose(apart, 0, atol=1e-4)
    for stored in ([7], [0, 31], [2, 3, 11, 30], list(range(32))):
        position = rng.uniform(-14.5, 45.5, 100)
        word = sum(1 << number for number in stored)
        rows = np.column_stack([position, np.full((100, 2), [word & 0xFFFF, word >> 16])])
        call = "viewsBeside(uint(given.y) | (uint(given.z) << 16), given.x)"
        views = evaluated("view_fan.glsl", f"vec3({call}.lower, {call}.upper, {call}.part)", rows)
        between = np.interp(position, stored, np.arange(len(stored)))
        np.testing.assert_allclose(views[:, 0] + views[:, 2], between, atol=1e-4)
        assert set(views[:, 1] - views[:, 0]) <= {0.0, 1.0}


def test_fresnel() -> None:
    """By the amplitudes' ratios of the two angles (Hecht, Optics, section 4.6)."""
    ratio, cosine = np.meshgrid([1 / 1.5, 1.5, 1 / 1.8], np.linspace(0.01, 0.999, 60))
    given = np.stack([cosine.ravel(), ratio.ravel()], axis=1)
    found = evaluated("fresnel.glsl", "vec3(fresnel(given.x, given.y), 0.0)", given)
    incoming, sine = np.arccos(given[:, 0]), np.sin(np.arccos(given[:, 0])) * given[:, 1]
    total = sine >= 1.0
    outgoing = np.arcsin(np.minimum(sine, 1.0))
    across = np.sin(incoming - outgoing) / np.sin(incoming + outgoing)
    along = np.tan(incoming - outgoing) / np.tan(incoming + outgoing)
    expected = np.where(total, 1.0, (across**2 + along**2) / 2)
    assert total.any()
    np.testing.assert_allclose(found[:, 0], expected, atol=2e-5)
    np.testing.assert_allclose(found[:, 1], np.where(total, 0.0, np.cos(outgoing)), atol=2e-4)


def test_a_ray_meets_the_first_triangle_of_the_tree() -> None:
    """All triangles asked one by one, by Cramer's rule."""
    rng = np.random.default_rng(5)
    places = (rng.normal(size=(90, 1, 3)) + 0.4 * rng.normal(size=(90, 3, 3))).astype(np.float32)
    tree = triangle_tree(places, places)
    rays = directions(600)
    call = (
        "  float distance;\n  vec2 place;\n  int met = firstTriangle("
        "tree, corners, vec3(0.1, 0.2, 0.3), given.xyz, 1e-4, distance, place);\n"
    )
    found = evaluated(
        "triangle_tree.glsl",
        "vec3(met, distance, place.x)",
        rays,
        before=call,
        pictures={"tree": tree.nodes, "corners": tree.corners},
        TREE_WIDTH=TREE_WIDTH,
    )
    a, b, c = np.moveaxis(places[tree.order].astype(float), 1, 0)
    sides = np.stack([b - a, c - a, np.zeros_like(a)], axis=-1)
    matrices = np.broadcast_to(sides, (len(rays), *sides.shape)).copy()
    matrices[..., 2] = -rays[:, None]
    u, v, distance = np.moveaxis(
        np.linalg.solve(matrices, ([0.1, 0.2, 0.3] - a)[None, ..., None])[..., 0], -1, 0
    )
    distance[(u < 0) | (v < 0) | (u + v > 1) | (distance < 1e-4)] = np.inf
    first = np.argmin(distance, axis=1)
    hit = np.isfinite(distance.min(axis=1))
    assert 100 < hit.sum() < 590
    same = found[:, 0] == np.where(hit, first, -1)
    assert same.mean() > 0.99  # others pass within a rounding of an edge
    both = same & hit
    rows = np.arange(len(rays))[both], first[both]
    np.testing.assert_allclose(found[both, 1], distance[rows], rtol=1e-4)
    np.testing.assert_allclose(found[both, 2], u[rows], atol=1e-3)
