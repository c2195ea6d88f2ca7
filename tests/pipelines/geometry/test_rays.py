"""Ray casting against closed forms and a brute-force search in float64."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipelines.geometry import rays
from pipelines.geometry.rays import build_scene, first_hits, occluded

OCTAHEDRON = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)])
OCTANTS = np.array([(x, y, z) for x in (0, 1) for y in (2, 3) for z in (4, 5)])


def moeller_trumbore(
    corners: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Distances (N, F), inf where a ray misses, and how far inside the edges the line passes."""
    edge1, edge2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(directions[:, None], edge2[None])
    determinant = np.einsum("nfk,fk->nf", p, edge1)
    s = origins[:, None] - corners[None, :, 0]
    u = np.einsum("nfk,nfk->nf", s, p) / determinant
    q = np.cross(s, edge1[None])
    v = np.einsum("nk,nfk->nf", directions, q) / determinant
    t = np.einsum("fk,nfk->nf", edge2, q) / determinant
    inside = np.minimum(np.minimum(u, v), 1 - u - v)
    return np.where((inside >= 0) & (t > 0), t, np.inf), np.where(t > 0, inside, -np.inf)


@pytest.fixture(scope="module")
def soup() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Forty random triangles and rays among them, exactly representable in float32."""
    rng = np.random.default_rng(7)
    corners = rng.uniform(-1, 1, (40, 3, 3)).astype(np.float32)
    origins = rng.uniform(-2, 2, (3000, 3)).astype(np.float32)
    directions = rng.normal(size=(3000, 3)).astype(np.float32)
    return corners, origins, directions


def test_first_hits_agree_with_brute_force(soup) -> None:
    corners, origins, directions = soup
    found = first_hits(
        build_scene(corners.reshape(-1, 3), np.arange(120).reshape(-1, 3)), origins, directions
    )
    distances, inside = moeller_trumbore(*(a.astype(np.float64) for a in soup))
    nearest, triangle = distances.min(axis=1), distances.argmin(axis=1)
    # Rays that graze an edge may go either way in float32.
    clear = (np.abs(inside) > 1e-4).all(axis=1)
    hit = np.isfinite(nearest)
    assert clear.mean() > 0.95
    assert 0.1 < hit[clear].mean() < 0.9

    expected = np.where(hit, triangle, -1)
    np.testing.assert_array_equal(found.triangle[clear], expected[clear])
    np.testing.assert_allclose(found.distance[clear], nearest[clear], rtol=1e-4, atol=1e-6)
    both = clear & hit
    from_weights = np.einsum("nc,nck->nk", found.barycentric, corners[found.triangle])[both]
    from_distance = (origins + nearest[:, None] * directions)[both]
    np.testing.assert_allclose(from_weights, from_distance, atol=2e-4)
    missed = clear & ~hit
    assert np.isinf(found.distance[missed]).all()
    assert (found.barycentric[missed] == 0).all()
    assert (found.distance.dtype, found.barycentric.dtype) == (np.float32, np.float32)


def test_occlusion_agrees_with_brute_force_up_to_the_farthest_distance(soup) -> None:
    corners, origins, directions = soup
    scene = build_scene(corners.reshape(-1, 3), np.arange(120).reshape(-1, 3))
    distances, inside = moeller_trumbore(*(a.astype(np.float64) for a in soup))
    nearest = distances.min(axis=1)
    for farthest in (0.25, 1.0, np.inf):
        close_call = np.isfinite(nearest) & np.isclose(nearest, farthest, atol=1e-4)
        clear = (np.abs(inside) > 1e-4).all(axis=1) & ~close_call
        blocked = occluded(scene, origins, directions, farthest=farthest)
        expected = np.isfinite(nearest) & (nearest <= farthest)
        np.testing.assert_array_equal(blocked[clear], expected[clear])


coordinate = st.floats(-1, 1, width=32).filter(lambda x: abs(x) > 1e-3)


@given(st.tuples(coordinate, coordinate, coordinate), st.floats(0.25, 4))
def test_octahedron_is_met_where_its_equation_says(towards, length) -> None:
    """|x| + |y| + |z| = 1, seen from its centre (its back faces) and from outside."""
    scene = build_scene(OCTAHEDRON, OCTANTS)
    unit = np.array(towards) / np.linalg.norm(towards)
    surface = 1 / np.abs(unit).sum()
    origins = np.array([(0, 0, 0), 3 * unit])
    directions = length * np.array([unit, -unit])
    found = first_hits(scene, origins, directions)
    np.testing.assert_allclose(found.distance * length, (surface, 3 - surface), rtol=1e-5)
    np.testing.assert_allclose(
        found.barycentric, [np.abs(unit) * surface] * 2, atol=1e-5
    )  # corners come in the order x, y, z


def test_one_origin_or_one_direction_serves_all_rays() -> None:
    scene = build_scene(OCTAHEDRON, OCTANTS)
    x = np.array([0.125, 0.25, 0.5, 2.0])
    down = first_hits(scene, np.stack([x, 0.1 + 0 * x, 5 + 0 * x], axis=-1), (0, 0, -1))
    np.testing.assert_allclose(down.distance, [4.225, 4.35, 4.6, np.inf], rtol=1e-6)
    fan = occluded(scene, (0, 0, 3), np.stack([x, 0 * x, 0 * x - 3], axis=-1))
    np.testing.assert_array_equal(fan, [True, True, True, False])


def test_results_do_not_depend_on_blocks(soup, monkeypatch) -> None:
    corners, origins, directions = soup
    scene = build_scene(corners.reshape(-1, 3), np.arange(120).reshape(-1, 3))
    whole = first_hits(scene, origins, directions)
    blocked = occluded(scene, origins, directions)
    monkeypatch.setattr(rays, "RAYS_PER_BLOCK", 7)
    for once, in_blocks in zip(whole, first_hits(scene, origins, directions), strict=True):
        np.testing.assert_array_equal(once, in_blocks)
    np.testing.assert_array_equal(blocked, occluded(scene, origins, directions))


def test_nothing_to_meet_and_nothing_to_ask() -> None:
    empty = build_scene(np.zeros((0, 3)), np.zeros((0, 3), int))
    assert first_hits(empty, np.zeros((2, 3)), (0, 0, 1)).triangle.tolist() == [-1, -1]
    assert occluded(empty, np.zeros((2, 3)), (0, 0, 1)).tolist() == [False, False]
    scene = build_scene(OCTAHEDRON, OCTANTS)
    assert first_hits(scene, np.zeros((0, 3)), np.zeros((0, 3))).barycentric.shape == (0, 3)
    assert occluded(scene, np.zeros((0, 3)), np.zeros((0, 3))).shape == (0,)


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        (np.zeros((4, 2)), [[0, 1, 2]], r"vertices.*\(4, 2\)"),
        (np.zeros((4, 3)), [0, 1, 2], r"triangles.*\(3,\)"),
        (np.zeros((4, 3)), [[0.0, 1.0, 2.0]], "triangles.*float64"),
        (np.zeros((4, 3)), [[0, 1, 4]], "4 vertices.*0 to 4"),
        (np.zeros((4, 3)), [[0, 1, -1]], "-1 to 1"),
        (np.full((4, 3), 1e39), [[0, 1, 2]], "finite"),
    ],
)
@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning")
def test_bad_meshes_are_refused(vertices, triangles, message) -> None:
    with pytest.raises(ValueError, match=message):
        build_scene(vertices, triangles)


@pytest.mark.parametrize(
    ("origins", "directions"),
    [
        (np.zeros((2, 3)), np.zeros((3, 3))),
        (np.zeros(3), np.zeros(3)),
        (np.zeros((2, 2)), np.zeros((2, 2))),
    ],
)
def test_bad_rays_are_refused(origins, directions) -> None:
    with pytest.raises(ValueError, match="rays: expected"):
        first_hits(build_scene(OCTAHEDRON, OCTANTS), origins, directions)
