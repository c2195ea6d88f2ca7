"""Small packages of fur, without a store."""

from __future__ import annotations

import numpy as np

from assets_defs.photo_fur import package as assets
from pipelines.geometry.shapes import sphere
from pipelines.photo_fur.attenuation import Tails
from pipelines.photo_fur.laid_fur import Hair
from pipelines.photo_fur.laying import Body, Piece, choose_patches
from pipelines.photo_fur.packed_fur import Laid, PackedFur, packed_fur
from pipelines.photo_fur.photograph import FurPhotograph, fur_photograph
from pipelines.photo_fur.shells import make_shell_mesh
from pipelines.photo_fur.stage_view import Fill, Look
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


def packed_tufts(layers: int = 6, thickness: float = 0.15) -> PackedFur:
    """Tufts on a sphere, laid along the way from nose to tail, shorter above."""
    mesh = make_shell_mesh(sphere(16), layers, thickness=thickness, repeats=0.4)
    backwards = np.array([1.0, 0.3, 0.0])
    along = backwards - mesh.normals * (mesh.normals @ backwards)[:, None]
    tangents = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-6)
    hair = Hair(tangents, 0.75 - 0.25 * mesh.normals[:, 2])
    body = Body(mesh.vertices[-1], mesh.triangles, tangents, mesh.normals)
    random = np.random.default_rng(5)
    piece = Piece(random.uniform(0.3, 0.5, (20, 2)), random.uniform(-3, 3, 20))
    patches = choose_patches(body, piece, spacing=0.5)
    return packed_fur(tufts(), mesh, Laid(hair, backwards, patches, 0.5, 1.2), 90)


def fur_package(
    look: Look = "full",
    fill: Fill = "columns",
    tails: Tails = "end layers",
    layers: int = 6,
    width: int = 160,
) -> Package:
    """Tufts on a sphere, with its reference views."""
    settings = assets.FurPackageSettings(
        look=look, fill=fill, tails=tails, view_width=width, poster_width=64
    )
    sources = [Source("tufts", "CC0-1.0"), Source("sphere", "CC0-1.0")]
    contents = assets.package_contents(settings, packed_tufts(layers), sources, [], look)
    return read_package(write_package(PACKAGE, contents), "tufts.tsuya")
