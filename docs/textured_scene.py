"""A scene with textures, all made by code: planks, bricks, a ball of tiles and a golden one.

Written as OBJ with a material library and PNG files beside it, as people have them; ``make docs``
lights it in a workspace of its own for ``pictures/ssdf-textures.jpg``.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import gaussian_filter

from pipelines.geometry import shapes

FloatArray = NDArray[np.float64]

_SIDE = 1024  # texels
_SHOWN = Path(__file__).parent / "pictures" / "ssdf-textures.jpg"
_SETTINGS = [text for given in ("edge=0.04", "width=720", "frames=1") for text in ("--set", given)]
_LIBRARY = """newmtl planks
Kd 1 1 1
Ks 0.04 0.04 0.04
map_Kd planks.png
map_Pr planks-roughness.png
norm planks-normals.png
newmtl bricks
Kd 1 1 1
Ks 0.03 0.03 0.03
map_Kd bricks.png
map_Pr bricks-roughness.png
norm bricks-normals.png
newmtl tiles
Kd 1 1 1
Ks 0.05 0.05 0.05
map_Kd tiles.png
map_Pr tiles-roughness.png
norm tiles-normals.png
newmtl gold
Kd 0.93 0.66 0.28
Pm 1
map_Pr gold-roughness.png
norm gold-normals.png
"""


def write_textured_scene(path: Path) -> None:
    """Write the OBJ to a path, and its library and pictures beside it."""
    textures = {"planks": _planks, "bricks": _bricks, "tiles": _tiles, "gold": _gold}
    for number, (name, make) in enumerate(textures.items()):
        colour, roughness, heights = make(np.random.default_rng(number))
        if name != "gold":
            _save(path.parent / f"{name}.png", colour)
        _save(path.parent / f"{name}-roughness.png", np.repeat(roughness[..., None], 3, axis=2))
        _save(path.parent / f"{name}-normals.png", _normals(heights) / 2 + 0.5)
    path.with_suffix(".mtl").write_text(_LIBRARY)
    ball = shapes.sphere(48)
    flat = shapes.square(1)
    parts = (
        ("planks", flat.vertices * [3.2, 3.2, 0], flat.triangles, flat.uvs * 1.8),
        ("bricks", _upright(flat.vertices), flat.triangles, flat.uvs * [1.6, 0.6]),
        ("tiles", ball.vertices * 0.5 + [-0.45, -0.1, 0.5], ball.triangles, _around(ball.uvs)),
        ("gold", ball.vertices * 0.36 + [0.6, -0.55, 0.36], ball.triangles, _around(ball.uvs)),
    )
    path.write_text("\n".join(_lines(path.with_suffix(".mtl").name, parts)) + "\n")


def _lines(
    library: str, parts: tuple[tuple[str, FloatArray, NDArray[np.integer], FloatArray], ...]
) -> list[str]:
    lines, first = [f"mtllib {library}"], 1
    for name, vertices, triangles, uvs in parts:
        lines.append(f"o {name}\nusemtl {name}")
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
        lines += [f"vt {u:.6f} {v:.6f}" for u, v in uvs]
        corners = triangles + first
        lines += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in corners]
        first += len(vertices)
    return lines


def _upright(square: FloatArray) -> FloatArray:
    """A wall behind: 3.2 wide, 1.2 high, facing -y."""
    return np.stack([square[:, 0] * 3.2, np.full(len(square), 0.8), (square[:, 1] + 0.5) * 1.2], 1)


def _around(uvs: FloatArray) -> FloatArray:
    low, high = uvs.min(axis=0), uvs.max(axis=0)
    placed: FloatArray = (uvs - low) / (high - low) * [4, 2]
    return placed


# ---- textures: colour in linear light, roughness, heights in texels ------------------------------

_Made = tuple[FloatArray, FloatArray, FloatArray]


def _grid() -> tuple[FloatArray, FloatArray]:
    y, x = (np.indices((_SIDE, _SIDE)) + 0.5) / _SIDE
    return x, y


def _noise(rng: np.random.Generator, across: float, along: float) -> FloatArray:
    """Even noise of mean 0 and deviation 1 that repeats, blurred by so many texels."""
    found = gaussian_filter(rng.standard_normal((_SIDE, _SIDE)), (across, along), mode="wrap")
    even: FloatArray = found / found.std()
    return even


def _planks(rng: np.random.Generator) -> _Made:
    x, y = _grid()
    row = np.floor(y * 6).astype(int)
    column = np.floor(x + row * 0.37).astype(int) % 2
    tone = rng.uniform(0.55, 1.15, (6, 2))[row, column]
    across, along = y * 6 % 1, (x + row * 0.37) % 1
    gap = np.clip(
        np.minimum(np.minimum(across, 1 - across) * 28, np.minimum(along, 1 - along) * 90), 0, 1
    )
    grain = 0.6 * _noise(rng, 1.2, 40) + 0.4 * _noise(rng, 3, 120)
    colour = np.array([0.36, 0.2, 0.1]) * (tone * (1 + 0.16 * grain))[..., None]
    colour = colour * (0.15 + 0.85 * gap)[..., None]
    return colour, 0.5 + 0.06 * grain + 0.3 * (1 - gap), 3 * gap + 0.25 * grain


def _bricks(rng: np.random.Generator) -> _Made:
    x, y = _grid()
    row = np.floor(y * 10).astype(int)
    shifted = x * 5 + 0.5 * (row % 2)
    column = np.floor(shifted).astype(int) % 5
    across, along = y * 10 % 1, shifted % 1
    rough = 0.012 * _noise(rng, 4, 4)
    edge = np.minimum(np.minimum(across, 1 - across), np.minimum(along, 1 - along) * 2) + rough
    brick = np.clip((edge - 0.07) * 16, 0, 1)
    tone = rng.uniform(0.6, 1.2, (10, 5, 1))[row, column]
    hue = np.array([0.36, 0.11, 0.065]) + rng.uniform(-0.02, 0.03, (10, 5, 3))[row, column]
    stain = 1 + 0.12 * _noise(rng, 6, 6)[..., None]
    mortar = np.array([0.42, 0.39, 0.35]) * (1 + 0.08 * _noise(rng, 1, 1)[..., None])
    colour = mortar + (hue * tone * stain - mortar) * brick[..., None]
    return colour, 0.92 - 0.12 * brick, 8 * brick + 0.5 * _noise(rng, 2, 2)


def _tiles(rng: np.random.Generator) -> _Made:
    x, y = _grid()
    across, along = y * 8 % 1, x * 8 % 1
    dark = (np.floor(x * 8) + np.floor(y * 8)) % 2
    edge = np.minimum(np.minimum(across, 1 - across), np.minimum(along, 1 - along))
    tile = np.clip((edge - 0.03) * 22, 0, 1)
    glaze = 1 + 0.06 * _noise(rng, 12, 12)[..., None]
    colour = np.where(dark[..., None] > 0, [0.03, 0.09, 0.16], [0.72, 0.7, 0.62]) * glaze
    colour = 0.2 + (colour - 0.2) * tile[..., None]
    return colour, 0.9 - 0.62 * tile, 7 * tile + 0.15 * _noise(rng, 20, 20)


def _gold(rng: np.random.Generator) -> _Made:
    hammered = _noise(rng, 22, 22)
    worn = np.clip(0.5 + 0.5 * _noise(rng, 60, 60), 0, 1)
    return np.ones((_SIDE, _SIDE, 3)), 0.32 + 0.3 * worn, 7 * hammered


def _normals(heights: FloatArray) -> FloatArray:
    """Unit normals of heights in texels, along u, along v (upwards) and outwards."""
    down, right = ((np.roll(heights, -1, axis) - np.roll(heights, 1, axis)) / 2 for axis in (0, 1))
    normals = np.stack([-right, down, np.ones_like(heights)], axis=-1)
    unit: FloatArray = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
    return unit


def _save(path: Path, values: FloatArray) -> None:
    """Colours are sRGB codes; of roughness and normals the values themselves."""
    held = np.clip(values, 0, 1)
    if "-" not in path.stem:
        held = np.where(held <= 0.0031308, 12.92 * held, 1.055 * held ** (1 / 2.4) - 0.055)
    Image.fromarray(np.rint(held * 255).astype(np.uint8)).save(path)


def main() -> None:
    """Make the page's picture: as lit by the two built-in environments."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_textured_scene(folder / "courtyard.obj")
        home = folder / "dagster"
        home.mkdir()
        shutil.copy(Path(".dagster") / "dagster.yaml", home)
        places = {"TSUYA_DATA": str(folder / "data"), "DAGSTER_HOME": str(home)}
        command = str(Path(sys.executable).with_name("tsuya"))
        scene = ("--scene", str(folder / "courtyard.obj"))
        run = [command, "run", "ssdf_lighting", *scene, *_SETTINGS]
        subprocess.run(run, check=True, env=os.environ | places)
        made = folder / "pictures" / "ssdf_lighting"
        lit = [
            Image.open(made / f"relit_frames-{light}.courtyard-obj-lit.png").convert("RGB")
            for light in ("sky", "lamps")
        ]
        beside = Image.new("RGB", (sum(shot.width for shot in lit) + 10, lit[0].height), "white")
        beside.paste(lit[0], (0, 0))
        beside.paste(lit[1], (lit[0].width + 10, 0))
        beside.save(_SHOWN, quality=88, optimize=True)


if __name__ == "__main__":
    main()
