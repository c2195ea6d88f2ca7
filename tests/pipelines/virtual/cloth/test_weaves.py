"""The built-in cloths: whole, periodic, seeded and different."""

from __future__ import annotations

import subprocess
import sys
from typing import NamedTuple

import numpy as np
import pytest

from pipelines.light.directions import unit_vectors
from pipelines.virtual.cloth.gonioreflectometer import Gonioreflectometer
from pipelines.virtual.cloth.weaves import MATERIALS, Cloth, make_cloth

ANGLES = np.radians([(0, 0), (30, 0), (45, 100), (60, 225), (75, 310)])


class Measured(NamedTuple):
    """A cloth, its measuring, and photographs of every angle under every angle."""

    cloth: Cloth
    gonio: Gonioreflectometer
    photos: np.ndarray  # (views, lights, y, x, 3)


_LARGE = {"silk", "twill"}


@pytest.fixture(
    scope="module",
    params=[pytest.param(m, marks=pytest.mark.slow if m in _LARGE else ()) for m in MATERIALS],
)
def measured(request: pytest.FixtureRequest) -> Measured:
    cloth = make_cloth(request.param, 3)
    gonio = Gonioreflectometer(cloth, ANGLES, (48, 48), samples=4)
    return Measured(cloth, gonio, np.stack([gonio.photographs(view) for view in ANGLES]))


def test_mesh_is_sound(measured: Measured) -> None:
    cloth = measured.cloth
    count = len(cloth.vertices)
    assert cloth.triangles.dtype == np.int32
    assert cloth.triangles.min() == 0
    assert cloth.triangles.max() == count - 1
    for field, columns in (
        ("vertices", 3), ("normals", 3), ("fibres", 3), ("albedo", 3), ("specular", 3),
        ("roughness", 2),
    ):  # fmt: skip
        values = getattr(cloth, field)
        assert values.shape == (count, columns)
        assert values.dtype == np.float32
        assert np.isfinite(values).all()
    for vectors in (cloth.normals, cloth.fibres):
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=-1), 1, atol=1e-5)
    assert cloth.albedo.min() >= 0
    assert cloth.albedo.max() < 1
    assert cloth.roughness.min() > 0.05
    # Triangles and vertices agree on what is outside.
    a, b, c = (cloth.vertices[cloth.triangles[:, k]].astype(np.float64) for k in range(3))
    face = np.cross(b - a, c - a)
    agree = np.einsum("ij,ij->i", face, cloth.normals[cloth.triangles].sum(axis=1)) > 0
    assert agree[np.linalg.norm(face, axis=1) > 1e-9].mean() > 0.995


def test_looks_like_cloth_from_everywhere(measured: Measured) -> None:
    """Sane brightness, texture, no fireflies, and a seam like any other place."""
    photos = measured.photos
    assert np.isfinite(photos).all()
    assert photos.min() >= 0
    assert np.quantile(photos, 0.99) < 1.5
    assert photos.max() < 12
    above = photos[0, 0].mean(axis=-1)
    assert 0.05 < above.mean() < 0.6
    assert 0.1 < above.std() / above.mean() < 1
    every = photos.reshape(len(ANGLES) ** 2, -1)
    assert (every.max(axis=1) < 40 * every.mean(axis=1) + 0.05).all()
    across = abs(photos - np.roll(photos, 1, axis=-2)).mean(axis=(0, 1, 2, 4))
    down = abs(photos - np.roll(photos, 1, axis=-3)).mean(axis=(0, 1, 3, 4))
    for steps in (across, down):
        assert steps[0] < 1.2 * steps[1:].max()


def test_no_view_passes_through(measured: Measured) -> None:
    for towards in unit_vectors([*ANGLES, (1.3, 0.4), (1.39, 3.0)]):
        points = measured.gonio._seen(measured.gonio._places, towards)
        assert (points.corner >= 0).all()


def test_mean_is_reciprocal(measured: Measured) -> None:
    """mean(i -> o) / cos_i = mean(o -> i) / cos_o: Helmholtz, for the whole tile.

    Not to the last per cent: the smooth normals of shading are not the triangles' own.
    """
    scaled = measured.photos.mean(axis=(2, 3, 4)) / np.cos(ANGLES[:, 0])  # [view, light]
    np.testing.assert_allclose(scaled, scaled.T, rtol=0.06)
    assert scaled.max() / scaled.min() > 1.3  # there is something to exchange


def test_seeded() -> None:
    for name in ("silk", "corduroy"):
        one, same, other = (make_cloth(name, seed) for seed in (1, 1, 2))
        for a, b in zip(one, same, strict=True):
            np.testing.assert_array_equal(a, b)
        assert not np.array_equal(one.vertices, other.vertices)


def test_unknown_material_is_named() -> None:
    with pytest.raises(ValueError, match=r"felt.*silk"):
        make_cloth("felt", 0)


def test_names_are_at_hand_without_heavy_modules() -> None:
    code = (
        "import sys; import pipelines.virtual.cloth.weaves as m; assert m.MATERIALS; "
        "print([n for n in ('numba', 'open3d', 'scipy', 'torch') if n in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
