"""The virtual gonioreflectometer against closed forms and the laws of light."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pipelines.light.directions import hemisphere_table, unit_vectors
from pipelines.virtual.cloth.fibre_brdf import fibre_brdf
from pipelines.virtual.cloth.gonioreflectometer import Gonioreflectometer
from pipelines.virtual.cloth.mesh import Cloth, cloth_of_tubes, cloth_sheet, join_cloths
from pipelines.virtual.cloth.yarns import smooth_noise, sweep

LIGHTS = np.radians([(0, 0), (30, 0), (45, 100), (60, 225), (75, 310)])


def surface(
    vertices: np.ndarray,
    triangles: np.ndarray,
    normals: np.ndarray,
    *,
    albedo: float = 1.0,
    specular: float = 0.0,
    fibre: tuple[float, float, float] = (1.0, 0.0, 0.0),
    roughness: tuple[float, float] = (0.5, 0.5),
) -> Cloth:
    count = len(vertices)

    def all_of(values: object, columns: int) -> np.ndarray:
        return np.broadcast_to(np.asarray(values, np.float32), (count, columns)).copy()

    return Cloth(
        vertices.astype(np.float32),
        triangles.astype(np.int32),
        normals.astype(np.float32),
        all_of(fibre, 3),
        all_of(albedo, 3),
        all_of(specular, 3),
        all_of(roughness, 2),
    )


def flat(cells: int = 1, **look: object) -> Cloth:
    axis = np.arange(cells + 1) / cells
    x, y = np.meshgrid(axis, axis, indexing="ij")
    points = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    up = np.broadcast_to([0.0, 0.0, 1.0], points.shape)
    return surface(points, grid_triangles(cells, cells), up, **look)


def grid_triangles(rows: int, columns: int) -> np.ndarray:
    a = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    b = a + columns + 1
    return np.stack([a, b, a + 1, b, b + 1, a + 1], axis=-1).reshape(-1, 3)


def groove(depth: float, *, cells: int = 1, albedo: float = 1.0) -> Cloth:
    """An endless V along y: from (0, depth) down to (1/2, 0) and up to (1, depth)."""
    slope = math.atan(2 * depth)
    axis = np.arange(cells + 1) / cells
    along, y = np.meshgrid(axis, axis, indexing="ij")
    walls = []
    for sign in (1, -1):
        x = 0.5 * along if sign > 0 else 0.5 + 0.5 * along
        z = depth * (1 - along) if sign > 0 else depth * along
        normal = np.array([sign * math.sin(slope), 0.0, math.cos(slope)])
        points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
        walls.append((points, np.broadcast_to(normal, points.shape)))
    triangles = grid_triangles(cells, cells)
    return surface(
        np.concatenate([w[0] for w in walls]),
        np.concatenate([triangles, triangles + len(walls[0][0])]),
        np.concatenate([w[1] for w in walls]),
        albedo=albedo,
    )


@pytest.fixture(scope="module")
def yarns() -> Cloth:
    """Three thick uneven yarns along x above a ground: small, but all that cloth has."""
    rng = np.random.default_rng(1)
    shape = (3, 60, 14)
    centres = np.zeros((3, 60, 3))
    centres[..., 0] = np.arange(60) / 60
    centres[..., 1] = (np.arange(3)[:, None] + 0.5) / 3
    centres[..., 1:] += 0.02 * smooth_noise(rng, (3, 60, 2), (5.0, 0.0))
    radii = 0.13 * (1 + 0.1 * smooth_noise(rng, shape, (3.0, 1.0)))
    tubes = sweep(centres, radii, period=(1.0, 0.0, 0.0), turns=2, flatness=0.7)
    tone = 0.5 + 0.1 * smooth_noise(rng, (3, 61, 14, 1), (3.0, 1.0, 0.0))
    tone[:, -1] = tone[:, 0]
    axis = np.arange(12) / 12
    grid = np.stack([*np.meshgrid(axis, axis, indexing="ij"), np.full((12, 12), -0.12)], axis=-1)
    return join_cloths(
        cloth_of_tubes(tubes, albedo=tone, specular=0.15, roughness=(0.2, 0.6)),
        cloth_sheet(grid, fibres=(0.0, 1.0, 0.0), albedo=0.3),
    )


# --------------------------------------------------------------------------------------------
# Flat samples


def test_flat_white_sample_reads_the_cosine() -> None:
    gonio = Gonioreflectometer(flat(), LIGHTS, (3, 5), samples=3)
    for view in LIGHTS:
        photos = gonio.photographs(view)
        assert photos.shape == (len(LIGHTS), 3, 5, 3)
        assert photos.dtype == np.float32
        expected = np.cos(LIGHTS[:, 0])[:, None, None, None]
        np.testing.assert_allclose(photos, np.broadcast_to(expected, photos.shape), rtol=1e-5)


@pytest.mark.parametrize("azimuth", [0.0, 90.0, 30.0])
def test_flat_glossy_sample_reads_its_brdf(azimuth: float) -> None:
    a = math.radians(azimuth)
    look = {"albedo": 0.3, "specular": 0.2, "roughness": (0.15, 0.6)}
    sample = flat(fibre=(math.cos(a), math.sin(a), 0.0), **look)
    gonio = Gonioreflectometer(sample, LIGHTS, (1, 1), samples=1)
    turn = np.array([[math.cos(a), -math.sin(a), 0], [math.sin(a), math.cos(a), 0], [0, 0, 1]])
    lights = unit_vectors(LIGHTS)
    for view in np.radians([(0, 0), (30, 180), (60, 45), (75, 130)]):
        f = fibre_brdf(
            lights @ turn, unit_vectors(view) @ turn,
            albedo=(0.3,) * 3, specular=(0.2,) * 3, roughness=(0.15, 0.6),
        )  # fmt: skip
        expected = np.pi * f * lights[:, 2:]
        np.testing.assert_allclose(gonio.photographs(view)[:, 0, 0], expected, rtol=1e-4)


def test_top_row_is_at_y_one_and_pictures_are_rectified() -> None:
    sample = flat(8)
    x, y = sample.vertices[:, 0], sample.vertices[:, 1]
    colours = np.stack([x, y, 0 * x], axis=-1)
    colours[x == 1, 0] = 0.0  # periodic: half a cell of the ramp is lost
    painted = sample._replace(albedo=colours.astype(np.float32))
    gonio = Gonioreflectometer(painted, LIGHTS[:1], (8, 8), samples=64)
    picture = gonio.photographs((0.0, 0.0))[0]
    centre = (np.arange(8) + 0.5) / 8
    np.testing.assert_allclose(picture[:, 3, 1], centre[::-1], atol=0.02)
    np.testing.assert_allclose(picture[2, :7, 0], centre[:7], atol=0.02)
    # The sample lies in the reference plane: seen from the side nothing moves.
    np.testing.assert_allclose(gonio.photographs(LIGHTS[4])[0], picture, atol=1e-5)
    raised = painted._replace(vertices=painted.vertices + np.float32((0, 0, 0.25)))
    higher = Gonioreflectometer(raised, LIGHTS[:1], (8, 8), samples=64)
    assert higher.reference == pytest.approx(0.25)
    np.testing.assert_allclose(higher.photographs(LIGHTS[4])[0], picture, atol=1e-4)


def test_counts_rays() -> None:
    gonio = Gonioreflectometer(flat(), LIGHTS, (4, 4), samples=2, bounces=0)
    assert gonio.rays == 0
    gonio.photographs((0.0, 0.0))
    assert gonio.rays == 4 * 4 * 2 * (1 + len(LIGHTS))


# --------------------------------------------------------------------------------------------
# A V-groove: shadows, masking, interreflection


def test_shadow_in_a_groove() -> None:
    depth, theta = 0.8, math.radians(55)
    slope = math.atan(2 * depth)
    columns = 64
    gonio = Gonioreflectometer(groove(depth), [(theta, 0.0)], (2, columns), 8, bounces=0)
    row = gonio.photographs((0.0, 0.0))[0, 0, :, 0]
    # The ridge at x = 1 shades the lit wall from here down to the bottom.
    edge = math.cos(theta) / (math.cos(theta) + 2 * depth * math.sin(theta))
    x = (np.arange(columns) + 0.5) / columns
    np.testing.assert_allclose(row[x < edge - 1 / columns], math.cos(theta - slope), rtol=1e-4)
    assert not row[x > edge + 1 / columns].any()
    assert row.mean() == pytest.approx(edge * math.cos(theta - slope), rel=0.01)


@pytest.mark.parametrize("view", [20.0, 40.0, 70.0])
def test_masking_in_a_groove(view: float) -> None:
    depth, light = 0.35, math.radians(25)
    slope, theta = math.atan(2 * depth), math.radians(view)
    gonio = Gonioreflectometer(groove(depth), [(light, 0.0)], (2, 128), 8, bounces=0)
    picture = gonio.photographs((theta, 0.0))[0]
    # Walls show as much of themselves as they face the view; none is in shadow.
    near, far = math.cos(theta - slope), max(math.cos(theta + slope), 0.0)
    lit = near * math.cos(light - slope) + far * math.cos(light + slope)
    assert picture.mean() == pytest.approx(lit / (near + far), rel=0.01)


def test_one_bounce_in_a_right_angle() -> None:
    """Form factor of a strip to the wall across the corner: (1 - s / sqrt(s^2 + w^2)) / 2."""
    albedo, cells, columns = 0.7, 48, 24
    sample = groove(0.5, cells=cells, albedo=albedo)
    photos = [
        Gonioreflectometer(sample, [(0.0, 0.0)], (24, columns), 4, bounces=b).photographs((0, 0))
        for b in (0, 1, 2)
    ]
    direct = albedo * math.cos(math.radians(45))
    np.testing.assert_allclose(photos[0], direct, rtol=1e-4)
    x = (np.arange(columns) + 0.5) / columns
    s, w = abs(x - 0.5) * math.sqrt(2), math.sqrt(0.5)
    expected = direct * albedo * (1 - s / np.hypot(s, w)) / 2
    found = (photos[1] - photos[0])[0, :, :, 0].mean(axis=0)
    inner = np.r_[0:11, 13:24]  # in the corner itself vertices lie in the other wall
    np.testing.assert_allclose(found[inner], expected[inner], rtol=0.05, atol=0.002)
    assert found.sum() == pytest.approx(expected.sum(), rel=0.02)
    assert photos[2].mean() > photos[1].mean() * 1.01


# --------------------------------------------------------------------------------------------
# Cloth: laws of light, periodicity, noise


def test_energy_and_bounces(yarns: Cloth) -> None:
    """White cloth sends back more with each bounce and never more than it receives."""
    light = np.radians([(40.0, 70.0)])
    spread = (np.arange(24) + 0.5) / 24  # cosine-distributed views up to 80 degrees
    theta = np.arcsin(np.sqrt(spread) * math.sin(math.radians(80)))
    views = np.stack([theta, np.arange(24) * math.pi * (3 - math.sqrt(5))], axis=-1)

    def reflected(albedo: float, specular: float, bounces: int) -> float:
        sample = yarns._replace(
            albedo=np.full_like(yarns.albedo, albedo),
            specular=np.full_like(yarns.specular, specular),
        )
        gonio = Gonioreflectometer(sample, light, (24, 24), samples=1, bounces=bounces)
        means = [gonio.photographs(v).mean() for v in views]
        return float(np.mean(means)) / math.cos(light[0, 0])

    assert reflected(0.5, 0.15, 1) < reflected(1, 0.15, 0) < reflected(1, 0.15, 1) <= 1
    matt = [reflected(1, 0, bounces) for bounces in (0, 1, 2, 20)]
    assert matt == sorted(matt)
    assert 0.93 < matt[-1] < 1.01  # all comes out in the end, but for vertices within yarns


def test_more_samples_converge(yarns: Cloth) -> None:
    def photograph(samples: int, seed: int) -> np.ndarray:
        gonio = Gonioreflectometer(yarns, LIGHTS[2:3], (24, 24), samples, seed, bounces=0)
        return gonio.photographs(LIGHTS[3])

    reference = photograph(256, 9)
    errors = [
        np.sqrt(np.mean([(photograph(n, s) - reference) ** 2 for s in (0, 1)])) for n in (1, 4, 16)
    ]
    assert errors[1] < errors[0] / 1.9
    assert errors[2] < errors[1] / 1.9
    assert photograph(16, 0).mean() == pytest.approx(reference.mean(), rel=0.01)


def test_cloth_has_no_seam(yarns: Cloth) -> None:
    """Where the tile begins makes no difference."""
    lights, view = LIGHTS[1:4], LIGHTS[4]

    def photograph(shift: tuple[float, float, float], seed: int) -> np.ndarray:
        moved = yarns._replace(vertices=yarns.vertices + np.float32(shift))
        return Gonioreflectometer(moved, lights, (32, 32), 16, seed, bounces=0).photographs(view)

    still, whole, half = (photograph(s, 0) for s in ((0, 0, 0), (2, -1, 0), (0.5, 0.25, 0)))
    assert (abs(whole - still) < 1e-3).mean() > 0.99  # float32 positions differ in the last bits
    back = np.roll(half, (8, -16), axis=(1, 2))
    noise = abs(photograph((0, 0, 0), 1) - still).mean()
    assert abs(back - still).mean() < 1.1 * noise
    edge = [abs(back - still)[:, :, c].mean() for c in (0, 15, 16, 31)]
    assert max(edge) < 2 * noise


def test_turned_cloth_turns_its_gloss(yarns: Cloth) -> None:
    def turned(v: np.ndarray) -> np.ndarray:
        return np.stack([-v[:, 1], v[:, 0], v[:, 2]], axis=-1)

    quarter = yarns._replace(
        vertices=turned(yarns.vertices), normals=turned(yarns.normals), fibres=turned(yarns.fibres)
    )
    turn = np.array([0.0, math.pi / 2])
    lights = np.radians([(30, 0), (30, 90), (60, 45)])
    still = Gonioreflectometer(yarns, lights, (48, 48), 4).photographs(lights[0])
    moved = Gonioreflectometer(quarter, lights + turn, (48, 48), 4).photographs(lights[0] + turn)
    np.testing.assert_allclose(moved.mean(axis=(1, 2)), still.mean(axis=(1, 2)), rtol=0.03)
    picture = np.rot90(still, axes=(1, 2))
    noise = abs(moved - picture).mean()
    assert noise < 0.35 * abs(moved - np.rot90(still, 3, axes=(1, 2))).mean()


def test_deterministic_in_any_order(yarns: Cloth) -> None:
    views = hemisphere_table(15)[[3, 12, 0]]
    one, two = (Gonioreflectometer(yarns, LIGHTS, (12, 10), 3, seed=4) for _ in range(2))
    first = [one.photographs(v) for v in views]
    second = [two.photographs(v) for v in views[::-1]][::-1]
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)
    other = Gonioreflectometer(yarns, LIGHTS, (12, 10), 3, seed=5)
    assert not np.array_equal(other.photographs(views[0]), first[0])


# --------------------------------------------------------------------------------------------
# Arguments


def test_says_what_is_wrong() -> None:
    with pytest.raises(ValueError, match=r"lights.*80.*85"):
        Gonioreflectometer(flat(), np.radians([(85.0, 0.0)]), (2, 2))
    with pytest.raises(ValueError, match="samples"):
        Gonioreflectometer(flat(), LIGHTS, (2, 2), samples=0)
    with pytest.raises(ValueError, match="size"):
        Gonioreflectometer(flat(), LIGHTS, (0, 2))
    with pytest.raises(ValueError, match="albedo"):
        Gonioreflectometer(flat()._replace(albedo=np.ones((2, 3), np.float32)), LIGHTS, (2, 2))
    with pytest.raises(ValueError, match="triangles"):
        Gonioreflectometer(flat()._replace(triangles=np.array([[0, 1, 9]])), LIGHTS, (2, 2))
    gonio = Gonioreflectometer(flat(), LIGHTS, (2, 2))
    with pytest.raises(ValueError, match="view"):
        gonio.photographs(np.radians((89.0, 0.0)))
