"""The shader against the same picture in NumPy, which shares only the lobes' tables with it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

from pipelines.drawing.colour import to_8bit
from pipelines.drawing.stage import Camera, Stage, orbit
from pipelines.geometry.shapes import sphere, square
from pipelines.ssdf_lighting.drawing.numpy_view import DistancesAt, render_numpy
from pipelines.ssdf_lighting.drawing.stage_view import MOST_LIGHTS, LitActor, draw_lit
from pipelines.ssdf_lighting.light.shading import Materials
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights
from pipelines.ssdf_lighting.scene import LitMesh

SIZE = (96, 72)
MATERIALS = Materials(
    np.array([[0.5, 0.3, 0.2], [0.4, 0.4, 0.45]]), np.array([0.06, 0.0]), np.array([0.25, 0.3])
)
NEAR = orbit((0.0, 0.0, 0.7), 6.0, -60.0, 25.0)


class Scene(NamedTuple):
    """A sphere on a floor."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    normals: NDArray[np.float64]
    objects: NDArray[np.int64]


@pytest.fixture(scope="module")
def scene() -> Scene:
    ball, floor = sphere(16), square(12)
    return Scene(
        np.concatenate([ball.vertices + np.array([0, 0, 1]), floor.vertices * 6]),
        np.concatenate([ball.triangles, floor.triangles + len(ball.vertices)]),
        np.concatenate([ball.normals, floor.normals]),
        np.repeat([0, 1], [len(ball.vertices), len(floor.vertices)]),
    )


def lights(count: int, seed: int = 0) -> Lights:
    rng = np.random.default_rng(seed)
    axes = rng.normal(size=(count, 3))
    axes[:, 2] = np.abs(axes[:, 2])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    return Lights(axes, np.exp(rng.uniform(0, 5, count)), rng.uniform(0.05, 0.5, (count, 3)))


def distances(scene: Scene) -> DistancesAt:
    """To the horizon, and for the floor to the sphere's rim, whichever is nearer."""
    towards = np.array([0.0, 0.0, 1.0]) - scene.vertices
    far = np.linalg.norm(towards, axis=1)
    radius = np.where(scene.objects == 1, np.arcsin(1 / np.maximum(far, 1.0)), -np.pi)

    def at(axes: NDArray[np.float32]) -> NDArray[np.float64]:
        height = np.einsum("vlc,vc->vl", axes, scene.normals)
        nearness = np.einsum("vlc,vc->vl", axes, towards / far[:, None])
        rim = np.arccos(np.clip(nearness, -1, 1)) - radius[:, None]
        return np.minimum(np.arcsin(np.clip(height, -1, 1)), rim)

    return at


def check_equal(drawn: NDArray[np.float32], expected: NDArray[np.float64]) -> None:
    """Within one 8-bit code, and 0.001 of the radiance of 1, but at the borders of things."""
    shown = expected[..., 3] > 0
    inside = binary_erosion(shown, iterations=2)
    assert inside.mean() > 0.4
    assert np.mean(drawn[..., 3] != expected[..., 3]) < 0.002
    codes = [to_8bit(p[..., :3].astype(np.float32)).astype(int) for p in (drawn, expected)]
    difference = np.abs(codes[0] - codes[1]).max(axis=-1)[inside]
    assert np.mean(difference > 1) < 0.002  # where the sphere ends before the floor
    error = np.abs(drawn - expected)[inside][difference <= 1]
    assert error.max() < 0.004
    assert np.sqrt(np.mean(error**2)) < 0.001


def numpy_picture(scene: Scene, look: Lights, camera: Camera) -> NDArray[np.float64]:
    return render_numpy(LitMesh(*scene, MATERIALS), distances(scene), look, camera, SIZE)


@pytest.mark.parametrize("count", [1, 5, 16, MOST_LIGHTS])
def test_the_shader_shows_what_numpy_computes(scene: Scene, count: int) -> None:
    look = lights(count)
    actor = LitActor(LitMesh(*scene, MATERIALS), look)
    assert len(actor.actors) == 2
    drawn = draw_lit(SIZE, actor, NEAR, look, distances(scene))
    check_equal(drawn, numpy_picture(scene, look, NEAR))


def test_nothing_of_an_earlier_frame_stays(scene: Scene) -> None:
    """Other lights, wider and elsewhere, and another view, on the same stage."""
    actor = LitActor(LitMesh(*scene, MATERIALS), lights(6, seed=1))
    parallel = orbit((0.0, 0.0, 0.7), 8.0, 30.0, 40.0, height=3.5)
    with Stage(*SIZE) as stage:
        stage.add(*actor.actors)
        for number, camera in ((1, NEAR), (2, parallel), (1, parallel)):
            look = lights(6, seed=number)
            drawn = draw_lit(stage, actor, camera, look, distances(scene))
            check_equal(drawn, numpy_picture(scene, look, camera))


def test_reflected_light_is_added(scene: Scene) -> None:
    look = lights(5)
    mesh = LitMesh(*scene, MATERIALS)
    reflected = 0.3 + 0.2 * np.sin(3 * scene.vertices)
    actor = LitActor(mesh, look)
    actor.show_bounced(reflected)
    drawn = draw_lit(SIZE, actor, NEAR, look, distances(scene))
    expected = render_numpy(mesh, distances(scene), look, NEAR, SIZE, reflected)
    check_equal(drawn, expected)
    assert np.abs(expected - numpy_picture(scene, look, NEAR)).max() > 0.1
    with pytest.raises(ValueError, match="bounced light: found shape"):
        actor.show_bounced(reflected[1:])


def test_hidden_sky_is_seen(scene: Scene) -> None:
    """The picture depends on each distance: half of them off, and it is another one."""
    look, at = lights(5), distances(scene)
    for first in (0, 4, 5, 9):

        def moved(axes: NDArray[np.float32], first: int = first) -> NDArray[np.float64]:
            d = np.array(at(axes), np.float64)
            d[:, first] -= 1.0
            return d

        actor = LitActor(LitMesh(*scene, MATERIALS), look)
        drawn = draw_lit(SIZE, actor, NEAR, look, moved)
        expected = render_numpy(LitMesh(*scene, MATERIALS), moved, look, NEAR, SIZE)
        check_equal(drawn, expected)
        assert np.abs(expected - numpy_picture(scene, look, NEAR)).max() > 0.002


def test_what_does_not_fit_is_refused(scene: Scene) -> None:
    with pytest.raises(ValueError, match="there are 25 lights; expected 1 to 24"):
        LitActor(LitMesh(*scene, MATERIALS), lights(25))
    with pytest.raises(ValueError, match="object_of_vertex: found 0 to 2, expected rows of 2"):
        LitActor(LitMesh(*scene._replace(objects=scene.objects * 2), MATERIALS), lights(3))
    actor = LitActor(LitMesh(*scene, MATERIALS), lights(3))
    with pytest.raises(ValueError, match="there are 4 lights; expected 3"):
        actor.relight(NEAR, lights(4), distances(scene))
    with pytest.raises(ValueError, match="distances: found shape"):
        actor.relight(NEAR, lights(3), lambda axes: np.zeros(axes.shape[:1]))
