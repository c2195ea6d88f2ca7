"""What a live picture of scratched glass is made of."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from pipelines.drawing.colour import luminance
from pipelines.geometry.solid_shapes import plate
from pipelines.geometry.triangle_tree import triangle_tree
from pipelines.glass_scratches.drawing.frames import object_cameras
from pipelines.glass_scratches.drawing.live_parts import half_radiance, reference_views
from pipelines.glass_scratches.drawing.stage_view import (
    LAMP_COLOUR,
    LAMP_EDGE,
    Lamp,
    ScratchedActor,
    corners_apart,
    draw_scratched,
    environment_lights,
    lamp_radiance,
)
from pipelines.glass_scratches.tables.bsdf_table import BsdfTable
from pipelines.light.built_in_environments import lamps, uniform
from pipelines.light.environment_maps import solid_angles, texel_directions
from pipelines.light.environment_sampling import EnvironmentSampler, make_environment_sampler

FIXTURE = Path(__file__).parents[4] / "viewer" / "tests" / "glass_scratches_lights.json"
BINS, INDEX = 16, 1.5


def lights_fixture() -> dict[str, Any]:
    """An environment, its lights, a lamp: what the viewer's tests compare with."""
    light = make_environment_sampler(np.round(lamps(16), 4))
    (power, towards), through = environment_lights(light)
    soft = cv2.resize(np.asarray(light.radiance), (12, 6), interpolation=cv2.INTER_AREA)
    lamp = {
        "edge": list(LAMP_EDGE),
        "colour": list(LAMP_COLOUR),
        "radiance": lamp_radiance(Lamp((0.0, 0.0, 1.0), 3.0), light).tolist(),
    }
    return {
        "height": 16,
        "radiance": [round(float(value), 4) for value in light.radiance.ravel()],
        "power": [round(float(value), 7) for value in power.ravel()],
        "towards": [round(float(value), 7) for value in towards.ravel()],
        "through": through,
        "lamp": lamp,
        "soft": {"rows": 6, "radiance": [round(float(value), 6) for value in soft.ravel()]},
        "tree": _tree(),
    }


def _tree() -> dict[str, list[float]]:
    """Triangles, a normal at each corner, and their tree."""
    solid = plate(1.5, 1.1, 0.05)
    sides = np.asarray(solid.vertices)[solid.triangles]  # whose middles are often equal
    rng = np.random.default_rng(6)
    places = np.concatenate([sides, rng.normal(size=(25, 3, 3))]).round(3).astype(np.float32)
    normals = rng.normal(size=places.shape).round(3).astype(np.float32)
    tree = triangle_tree(places, normals)
    count = int(tree.nodes[0, 0, 3])
    values = {
        "places": places,
        "normals": normals,
        "nodes": tree.nodes.reshape(-1)[: 8 * count],
        "corners": tree.corners.reshape(-1)[: 24 * len(places)],
    }
    return {name: [float(value) for value in each.ravel()] for name, each in values.items()}


def test_the_viewers_values_are_todays() -> None:
    """Written by ``python -m tests.pipelines.glass_scratches.drawing.test_live_parts``."""
    stored, made = json.loads(FIXTURE.read_text()), lights_fixture()
    assert stored.keys() == made.keys()
    for name in ("radiance", "power", "towards", "through"):
        assert np.allclose(stored[name], made[name], rtol=1e-6, atol=1e-6), name
    assert np.allclose(stored["lamp"]["radiance"], made["lamp"]["radiance"], rtol=1e-6)
    assert np.allclose(stored["soft"]["radiance"], made["soft"]["radiance"], rtol=1e-6, atol=1e-6)
    assert stored["tree"] == made["tree"]


def test_an_environment_of_halfs_has_the_same_light() -> None:
    radiance = lamps(64)
    for rows in (64, 16):
        halfs = half_radiance(radiance, rows)
        assert halfs.dtype == np.float16
        assert halfs.shape == (rows, 2 * rows, 3)
        sums = [
            (each.astype(np.float64) * solid_angles(len(each))[:, None, None]).sum()
            for each in (radiance, halfs)
        ]
        assert np.isclose(*sums, rtol=0.02)


def test_halfs_of_an_environment_are_round() -> None:
    """Off by at most half of the last bit that is kept; and small as a PNG for it."""
    radiance = np.exp(np.random.default_rng(4).normal(size=(32, 64, 3))).astype(np.float32)
    halfs = half_radiance(radiance, 32)
    assert np.abs(halfs.astype(np.float64) / radiance - 1).max() < 2.0**-8 + 2.0**-11
    assert (halfs.view(np.uint16) % 8 == 0).all()


def test_an_environment_too_bright_for_halfs_is_scaled_as_a_whole() -> None:
    radiance = np.full((8, 16, 3), 2.0, np.float32)
    radiance[2, 3] = 1e6
    halfs = half_radiance(radiance, 8).astype(np.float64)
    assert 65000 < halfs.max() <= 65504
    assert np.isclose(halfs[0, 0, 0] / halfs.max(), 2e-6, rtol=1e-2)


# ---- the lamp --------------------------------------------------------------------------------


def test_a_lamps_irradiance_is_what_was_asked_for() -> None:
    """Integrated over directions, texel by texel, over that of the even environment."""
    light = make_environment_sampler(uniform(8, 3.0))
    radiance = luminance(lamp_radiance(Lamp((0.0, 0.0, 1.0), 5.0), light))
    cosine = texel_directions(4096)[:128, 0, 2]
    shares = np.clip((cosine - LAMP_EDGE[0]) / (LAMP_EDGE[1] - LAMP_EDGE[0]), 0, 1)
    steradians = (shares * cosine * solid_angles(4096)[:128] * 8192).sum()
    assert np.isclose(radiance * steradians / (np.pi * 3.0), 5.0, rtol=2e-3)


def covered_plate(*, keeps: bool) -> ScratchedActor:
    """A plate that one layer covers all over, whose table is the same to all sides."""
    ratio = INDEX if keeps else INDEX**2  # straight on
    leans = np.array([0.0, 1.0]) if keeps else np.zeros(1)
    rho = np.full((len(leans), 2 * BINS, 2 * BINS), np.pi / 2 / (1 + ratio))
    across = rho[:, None].astype(np.float32)
    table = BsdfTable(rho, 0 * rho, 0 * rho[..., 0], across, leans, keeps, INDEX)
    coverage = np.ones((1, 8, 8), np.float32)
    return ScratchedActor(plate(1.5, 1.1, 0.05), coverage, np.zeros(1), table, tile=1.0)


@pytest.fixture(scope="module")
def rough() -> tuple[ScratchedActor, EnvironmentSampler]:
    """Walls that forget the lean, in a dim even environment."""
    return covered_plate(keeps=False), make_environment_sampler(uniform(8))


def _middle(drawn_with: tuple[ScratchedActor, EnvironmentSampler], lamp: Lamp | None) -> float:
    actor, light = drawn_with
    camera = object_cameras(plate(1.5, 1.1, 0.05))[0]
    drawn = draw_scratched(actor, light, camera, width=16, height=16, supersampling=1, lamp=lamp)
    return float(luminance(drawn[8, 8, :3]))


def test_a_lamp_in_front_is_shown_by_the_table(
    rough: tuple[ScratchedActor, EnvironmentSampler],
) -> None:
    """2 rho / pi² E: of irradiance as the environment's, the part that comes from outside."""
    lit = _middle(rough, Lamp((0.0, -1.0, 0.0), 2.0)) - _middle(rough, None)
    assert np.isclose(lit, 2.0 / (1 + INDEX**2), rtol=0.01)


def test_a_lamp_behind_comes_through_a_face(
    rough: tuple[ScratchedActor, EnvironmentSampler],
) -> None:
    """Of its light 1 - F comes in, which étendue spreads as outside."""
    without = _middle(rough, None)
    straight = _middle(rough, Lamp((0.0, 1.0, 0.0), 2.0)) - without
    leaning = _middle(rough, Lamp((0.0, 0.5, 0.75**0.5), 2.0)) - without
    assert np.isclose(straight, 2.0 / (1 + INDEX**2) * 0.96, rtol=0.01)
    bent = np.cos(np.arcsin(np.sin(np.pi / 3) / INDEX))
    across = (0.5 - INDEX * bent) / (0.5 + INDEX * bent)
    along = (INDEX * 0.5 - bent) / (INDEX * 0.5 + bent)
    through = 1 - (across**2 + along**2) / 2
    assert np.isclose(leaning / straight, 0.5 * through / 0.96, rtol=0.01)


@pytest.mark.parametrize(("keeps", "least"), [(True, 0.99), (False, 0.95)])
def test_an_even_environment_comes_back(keeps: bool, least: float) -> None:
    """But for what the face behind reflects of lights, 9 % of a part of 1 / (1 + n²)."""
    seen = _middle((covered_plate(keeps=keeps), make_environment_sampler(uniform(8))), None)
    assert least < seen < 1.01


def test_reference_views_differ_by_distance_and_by_the_lamp(
    rough: tuple[ScratchedActor, EnvironmentSampler],
) -> None:
    far, close, lit = reference_views(plate(1.5, 1.1, 0.05), *rough, 0.35, 24)
    assert [view.name for view in (far, close, lit)] == ["far", "close", "lamp"]
    assert close.camera == lit.camera
    assert close.lamp is None
    assert lit.frame.mean() > close.frame.mean() + 5
    assert (far.frame != close.frame).any()


def test_corners_apart_stand_outwards() -> None:
    places, shading, facing = corners_apart(plate(1.5, 1.1, 0.05))
    assert places.shape == shading.shape == facing.shape == (36, 3)
    assert (np.einsum("ij,ij->i", places, facing) > 0).all()
    assert np.allclose(np.linalg.norm(facing, axis=1), 1)


if __name__ == "__main__":
    FIXTURE.write_text(json.dumps(lights_fixture()) + "\n")
