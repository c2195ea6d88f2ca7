"""Small packages of fur, without a store."""

from __future__ import annotations

import numpy as np

from assets_defs.photo_fur import package as assets
from pipelines.geometry.shapes import sphere
from pipelines.photo_fur.attenuation import Tails
from pipelines.photo_fur.live_parts import FurScene
from pipelines.photo_fur.photograph import FurPhotograph, fur_photograph
from pipelines.photo_fur.shells import make_shell_mesh
from pipelines.photo_fur.stage_view import Fill
from storage.packages import Package, Source, read_package, write_package
from storage.packages.photo_fur import PACKAGE

SHAPE = (24, 40)


def tufts(seed: int = 0, shape: tuple[int, int] = SHAPE) -> FurPhotograph:
    """Smooth random tufts, dark between them, and a hole where nothing grows."""
    from scipy.ndimage import gaussian_filter

    random = np.random.default_rng(seed)
    height = gaussian_filter(random.random(shape), 1.5, mode="wrap")
    height = (height - height.min()) / np.ptp(height)
    colour = np.array([0.8, 0.55, 0.3]) * (0.06 + 0.94 * height[..., None] ** 2)
    opaque = np.ones(shape, bool)
    opaque[4:8, 5:9] = False
    photograph = fur_photograph(np.where(opaque[..., None], colour, 0).astype(np.float32))
    return photograph._replace(opaque=opaque)


def fur_package(
    fill: Fill = "columns", tails: Tails = "end layers", layers: int = 6, width: int = 160
) -> Package:
    """Tufts on a sphere, with its reference views."""
    mesh = make_shell_mesh(sphere(16), layers, thickness=0.15, repeats=0.4)
    scene = FurScene(tufts(), mesh, tails)
    settings = assets.FurPackageSettings(fill=fill, tails=tails, view_width=width, poster_width=64)
    sources = [Source("tufts", "CC0-1.0"), Source("sphere", "CC0-1.0")]
    contents = assets._contents(settings, scene, sources, [], [])
    return read_package(write_package(PACKAGE, contents), "tufts.tsuya")
