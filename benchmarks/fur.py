"""Figures of the fur system: exactness from above, cost against the usual shells, overheads."""

from __future__ import annotations

import functools
import json
import os
import random
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from assets_defs.workspace import CHECKOUT
from benchmarks.fur_asset import asset_figures
from benchmarks.fur_laying import laying_figures
from benchmarks.fur_oblique import oblique_figures
from benchmarks.fur_pelts import calibrated_ends, depth_figures, judged_pelts, segmentation_figures
from pipelines.drawing.colour import decode_srgb, encode_srgb, luminance
from pipelines.drawing.glsl import Shader
from pipelines.drawing.stage import Light, Stage, orbit, surface, texture
from pipelines.geometry import shapes
from pipelines.photo_fur.attenuation import (
    CALIBRATED_ENDS,
    fit_attenuation,
    layer_of,
    make_shell_stack,
)
from pipelines.photo_fur.figures import depth_rank_correlation
from pipelines.photo_fur.frames import (
    BACKGROUND,
    SQUARE_VIEWS,
    draw_frames,
    stretched,
    view_cameras,
)
from pipelines.photo_fur.photograph import FurPhotograph, fur_photograph
from pipelines.photo_fur.ray_cast import Square, aslant_rmse, cast_square
from pipelines.photo_fur.shells import ShellMesh, make_shell_mesh
from pipelines.photo_fur.stage_view import Fill, fur_surface, fur_texture
from pipelines.virtual.pelt.hairs import GOLDEN
from pipelines.virtual.pelt.pelt import make_pelt
from storage.readers.photographs import builtin_photograph

LAYERS = 15
TAIL = 0.005
WINDOW = (640, 480)
FRAMES = 41
PELT = {"size": 512, "hairs": 16_000, "samples": 24}
SEEDS = (0, 1, 2)


def run(scale: str) -> dict[str, Any]:
    """All figures, keyed as the documentation names them; at scale paper with more pelts and less
    noise, and the depths that the calibration finds anew."""
    whole = scale == "paper"
    console = Console(stderr=True)
    figures: dict[str, Any] = {}
    steps: Sequence[tuple[str, Callable[[], dict[str, Any]]]] = (
        ("from aside", _aslant),
        ("depth on the virtual pelt", _depth),
        ("pelts never seen", lambda: _pelts(whole)),
        ("laid over bodies", lambda: laying_figures(_pelt())),
        ("as a package holds it", lambda: asset_figures(_pelt())),
        ("seen from aside", lambda: oblique_figures(GOLDEN, 7, 32 if whole else 8)),
        ("photograph to masks", _derive),
        ("frames against the usual shells", _frames),
        ("frames a second", _speeds),
        ("import", _import),
        ("demo's overhead", _demo),
    )
    for name, measure in steps:
        started = time.perf_counter()
        figures |= measure()
        console.print(f"{name}: {time.perf_counter() - started:.0f} s", highlight=False)
    return figures


# ---- exactness -------------------------------------------------------------------------------


def _photograph(name: str) -> FurPhotograph:
    return fur_photograph(builtin_photograph(name).radiance, tail=TAIL)


def _aslant() -> dict[str, Any]:
    """The square from aside against a ray caster, worst of the photographs; the null has each
    pixel at another one's depth."""
    errors, nulls = {}, {}
    for name in ("grass", "chelsea"):
        photo = _photograph(name)
        errors[name] = _from_aside(photo, photo)
        shuffled = np.random.default_rng(0).permutation(photo.luminance.ravel())
        other = photo._replace(luminance=shuffled.reshape(photo.luminance.shape))
        nulls[name] = _from_aside(other, photo)
    return {
        "aslant_rmse": max(errors.values()),
        "aslant_rmse_each": errors,
        "aslant_rmse_null": min(nulls.values()),
    }


def _from_aside(drawn: FurPhotograph, cast: FurPhotograph) -> float:
    size = cast.luminance.shape
    mesh = stretched(make_shell_mesh(shapes.square(32), 8, thickness=0.05), size[1] / size[0])
    frames = draw_frames(drawn, mesh, SQUARE_VIEWS, size=(size[0], size[1]), supersampling=2)
    camera = view_cameras(SQUARE_VIEWS, mesh.vertices.reshape(-1, 3), size[1] / size[0])[-1]
    square = Square(cast, mesh, "columns", "end layers")
    return aslant_rmse(frames.pictures[-1], cast_square(square, camera, (size[0], size[1]), 2))


def _depth() -> dict[str, Any]:
    """Rank correlation of darkness with the depth."""
    correlations = []
    for seed in SEEDS:
        pelt = make_pelt(PELT["size"], PELT["hairs"], PELT["samples"], seed)
        grey = luminance(pelt.radiance)
        correlations.append(depth_rank_correlation(grey, pelt.depth))
    return {
        "depth_rank_correlation": statistics.mean(correlations),
        "depth_rank_correlation_seeds": correlations,
    }


def _pelts(whole: bool) -> dict[str, Any]:
    """Depth and segmentation on four kinds of pelts."""
    pelts = judged_pelts(4 if whole else 3, 64 if whole else 32)
    figures = depth_figures(pelts) | segmentation_figures(pelts)
    return figures | (calibrated_ends(64) if whole else {})


@functools.cache
def _pelt() -> FurPhotograph:
    """The built-in pelt."""
    pelt = make_pelt(PELT["size"], PELT["hairs"], PELT["samples"], 0)
    return fur_photograph(pelt.radiance, ends=CALIBRATED_ENDS)


def _derive() -> dict[str, Any]:
    """A 512 x 512 photograph's luminance to 15 masks; median of 11."""
    grey = luminance(builtin_photograph("grass").radiance)

    def derive() -> None:
        make_shell_stack(grey, fit_attenuation(grey, tail=TAIL), LAYERS, tails="end layers")

    return {"derive_ms": 1000 * statistics.median(_time(derive) for _ in range(11))}


# ---- drawing ---------------------------------------------------------------------------------


def _teapot(segments: int) -> ShellMesh:
    return make_shell_mesh(shapes.teapot(segments), LAYERS, thickness=0.06)


def _ours(photo: FurPhotograph, mesh: ShellMesh, fill: Fill) -> Any:
    image = fur_texture(photo, LAYERS, tails="end layers")
    return fur_surface(
        mesh.vertices,
        mesh.normals,
        mesh.triangles,
        mesh.uvs,
        image,
        photo.attenuation,
        fill=fill,
        wrap="mirrored",
        interpolate=False,
        lit=True,
    )


def _layer_images(photo: FurPhotograph, fill: Fill) -> list[NDArray[np.uint8]]:
    """What the usual shells keep: an RGBA8 texture a layer that says where there is hair."""
    layer = layer_of(photo.luminance, photo.attenuation, LAYERS, tails="end layers")
    colours = decode_srgb(np.rint(encode_srgb(photo.radiance) * 255) / 255)
    images = []
    for number in range(1, LAYERS + 1):
        shown = layer == number if fill == "bands" else layer <= number
        step = np.exp(photo.attenuation.coefficient / LAYERS * (layer.astype(float) - number))
        codes = np.rint(encode_srgb(colours * np.minimum(step, 1.0)[..., None]) * 255)
        images.append(np.dstack([codes, shown * 255]).astype(np.uint8))
    return images


def _usual(photo: FurPhotograph, mesh: ShellMesh, fill: Fill) -> tuple[list[Any], list[Any]]:
    """A texture and a draw a layer, tips first as ours; everything else as ours."""
    shader = Shader(
        vertex={
            "TCoord::Dec": "in vec2 uv; out vec2 uvOut;",
            "TCoord::Impl": "uvOut = uv;",
        },
        fragment={
            "TCoord::Dec": "in vec2 uvOut;",
            "Color::Impl": """//VTK::Color::Impl
  vec4 texel = texture(photograph, uvOut);
  if (texel.a < 0.5) discard;
  ambientColor = vec3(0.0);
  diffuseColor = texel.rgb;
""",
        },
    )
    textures = [
        texture(image, wrap="mirrored", interpolate=False, srgb=True)
        for image in _layer_images(photo, fill)
    ]
    actors = [
        surface(
            vertices,
            mesh.triangles,
            normals=mesh.normals,
            attributes={"uv": mesh.uvs},
            textures={"photograph": image},
            shader=shader,
        )
        for vertices, image in zip(mesh.vertices, textures, strict=True)
    ]
    return actors, textures


def _frames() -> dict[str, Any]:
    """Both sides on one stage, frames in turns; the medians' ratio. Their pictures must agree."""
    photo = _photograph("grass")
    mesh = _teapot(33)
    ours_bytes = fur_texture(photo, LAYERS, tails="end layers").nbytes
    usual_bytes = sum(image.nbytes for image in _layer_images(photo, "columns"))
    figures: dict[str, Any] = {
        "vertices": len(mesh.normals),
        "layers": LAYERS,
        "texture_bytes": ours_bytes,
        "texture_bytes_usual": usual_bytes,
        "texture_bytes_ratio": ours_bytes / usual_bytes,
    }
    fills: tuple[tuple[Fill, str], ...] = (("columns", ""), ("bands", "_bands"))
    for fill, suffix in fills:
        with Stage(*WINDOW, background=BACKGROUND) as stage:
            ours = [_ours(photo, mesh, fill)]
            usual, textures = _usual(photo, mesh, fill)
            stage.light(Light())
            stage.add(*ours, *usual)
            stage.look(_view(mesh))
            pictures = {}
            times: dict[str, list[float]] = {"ours": [], "usual": [], "uploading": []}

            def draw(side: str, stage: Stage = stage, textures: list[Any] = textures) -> None:
                if side == "uploading":
                    for image in textures:
                        image.Modified()
                        image.GetInput().Modified()
                stage.draw()

            for turn in range(FRAMES + 1):
                # In random order: no side always follows the one that fills the caches.
                for side in random.Random(turn).sample(list(times), len(times)):
                    for actor in ours:
                        actor.SetVisibility(side == "ours")
                    for actor in usual:
                        actor.SetVisibility(side != "ours")
                    spent = _time(lambda side=side: draw(side))  # type: ignore[misc]
                    if turn:
                        times[side].append(spent)
                    else:
                        pictures[side] = stage.frame().astype(int)
            medians = {side: statistics.median(spent) for side, spent in times.items()}
            step = int(np.abs(pictures["ours"] - pictures["usual"]).max())
        figures |= {
            f"frame_ratio{suffix}": medians["ours"] / medians["usual"],
            f"upload_frame_ratio{suffix}": medians["ours"] / medians["uploading"],
            f"frame_ms{suffix}": 1000 * medians["ours"],
            f"frame_largest_step{suffix}": step,
        }
    return figures


def _speeds() -> dict[str, Any]:
    photo = _photograph("grass")
    figures: dict[str, Any] = {}
    for name, segments in (("fps_teapot", 8), ("fps_large", 33)):
        mesh = _teapot(segments)
        with Stage(*WINDOW, background=BACKGROUND) as stage:
            stage.light(Light())
            stage.add(_ours(photo, mesh, "columns"))
            stage.look(_view(mesh))
            stage.draw()
            figures[name] = 1 / statistics.median(_time(stage.draw) for _ in range(FRAMES))
            figures[f"vertices_{name.removeprefix('fps_')}"] = len(mesh.normals)
            figures["renderer"] = stage.renderer_name
    return figures | {"window": list(WINDOW)}


def _view(mesh: ShellMesh) -> Any:
    skin = mesh.vertices[-1].astype(np.float64)
    x, y, z = (skin.min(axis=0) + skin.max(axis=0)) / 2
    radius = float(np.linalg.norm(skin - (x, y, z), axis=1).max()) + mesh.thickness
    return orbit((x, y, z), radius / np.sin(np.radians(15)), -60.0, 22.0)


# ---- overheads -------------------------------------------------------------------------------


def _import() -> dict[str, Any]:
    code = "import time; t = time.perf_counter(); import assets_defs.entry; "
    code += "print(time.perf_counter() - t)"
    spent = [
        float(subprocess.check_output([sys.executable, "-c", code], cwd=CHECKOUT)) for _ in range(5)
    ]
    return {"import_definitions_s": min(spent)}


def _demo() -> dict[str, Any]:
    """The demo's fur with an empty store and history, in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder) / "dagster"
        home.mkdir()
        (home / "dagster.yaml").write_text("telemetry: {enabled: false}\n")
        surroundings = os.environ | {
            "DAGSTER_HOME": str(home),
            "TSUYA_DATA": str(Path(folder) / "data"),
        }
        command = [str(Path(sys.executable).parent / "tsuya"), "run", "photo_fur"]
        command += ["--preset", "demo", "--json"]
        started = time.perf_counter()
        done = subprocess.run(command, env=surroundings, check=True, capture_output=True, text=True)
        wall = time.perf_counter() - started
    report = json.loads(done.stdout.splitlines()[-1])
    steps = sum(asset["seconds"] for asset in report["assets"])
    return {"demo_s": wall, "demo_steps_s": steps, "demo_overhead_ratio": 1 - steps / wall}


def _time(function: Callable[[], object]) -> float:
    started = time.perf_counter()
    function()
    return time.perf_counter() - started
