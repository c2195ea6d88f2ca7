"""The decoder on the stage against torch and NumPy, and the cloth that it is drawn on."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from assets_defs.workspace import CHECKOUT
from pipelines.drawing.glsl import Shader, shader_source
from pipelines.drawing.stage import Stage, orbit, surface, texture
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.decoder_arrays import (
    HIDDEN,
    STUDENT_HIDDEN,
    decode_in_numpy,
    direction_inputs_of_vectors,
)
from pipelines.neural_btf.hanging_cloth import hanging_cloth, surroundings
from pipelines.neural_btf.latent_texture import level_sizes
from pipelines.neural_btf.live_parts import (
    HOME,
    cloth_sights,
    decoded_cloth,
    home_exposure,
    input_picture,
    reference_views,
    scenery_of,
    unit_light,
)
from pipelines.neural_btf.network import Decoder, decoder_arrays
from pipelines.neural_btf.stage_view import (
    Showing,
    decoder_vectors,
    draw_cloth,
    latent_texels,
    weight_texels,
)

SIZE = (48, 36)
LIGHT = unit_light((-0.6, -0.7, 0.5))
MOST = 2e-6
"""Float32 in another order of sums; colours are up to 1."""
MOST_DRAWN = 2e-5
"""Places are interpolated in float32; from texel to texel these latents differ by units."""


def bright_decoder(hidden: int, latents: int = 8) -> dict[str, NDArray[np.float32]]:
    """Random weights, brightened so that most of what they say is positive."""
    arrays = {
        name: values.copy() for name, values in decoder_arrays(Decoder(hidden, latents)).items()
    }
    arrays["weight_4"] = arrays["weight_4"] * np.float32(6.0)
    arrays["bias_4"] = arrays["bias_4"] + np.float32(0.4)
    return arrays


def btf(shared: bool, *, seed: int = 0, channels: int = 8) -> CompressedBtf:
    """All that a compressed BTF can have, at random: 5 x 6 texels, coarser levels, parallax."""
    import torch

    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    latents = rng.normal(size=(7 if shared else 30, channels)).astype(np.float32)
    return CompressedBtf(
        bright_decoder(HIDDEN, channels),
        latents,
        rng.integers(7, size=30).astype(np.int32) if shared else None,
        1.7,
        height=5,
        width=6,
        mips=tuple(
            rng.normal(size=(rows * columns, channels)).astype(np.float32)
            for rows, columns in level_sizes(5, 6)[1:]
        ),
        parallax=rng.normal(0, 0.8, (9, 2)).astype(np.float32),
        least=0.3,
        largest=0.5,
        student=bright_decoder(STUDENT_HIDDEN, channels),
    )


def decoded_by_the_stage(
    made: CompressedBtf, latents: Any, light: Any, view: Any
) -> NDArray[np.float32]:
    """What `btf_decoder.glsl` says of latents (n, 8) and unit vectors (n, 3), (n, 3)."""
    rows = np.zeros((4, len(latents), 4), np.float32)
    rows[0], rows[1], rows[2, :, :3], rows[3, :, :3] = latents[:, :4], latents[:, 4:], light, view
    at = "texelFetch(inputs, ivec2(int(gl_FragCoord.x), {}), 0)"
    first, last, lit, seen = (at.format(row) for row in range(4))
    code = (
        f"  vec4 latents[2];\n  latents[0] = {first};\n  latents[1] = {last};\n"
        f"  diffuseColor = decodedColour(latents, {lit}.xyz, {seen}.xyz);\n"
    )
    source = shader_source(
        "btf_decoder.glsl", VECTORS=decoder_vectors(made.decoder), LATENT_VECTORS=2
    )
    shader = Shader(
        fragment={
            "CustomUniforms::Dec": "",
            "TMap::Dec": f"uniform sampler2D inputs;\n{source}",
            "Color::Impl": f"//VTK::Color::Impl\n{code}",
        }
    )
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * [len(latents), 1.0, 1.0]
    textures = {"inputs": rows, "weights": weight_texels(made.decoder)}
    square = surface(
        corners,
        [[0, 1, 2], [0, 2, 3]],
        textures={
            name: texture(np.ascontiguousarray(values[::-1]), interpolate=False)
            for name, values in textures.items()
        },
        shader=shader,
        lit=False,
    )
    with Stage(len(latents), 1) as stage:
        stage.add(square)
        stage.look(orbit((0, 0, 0), 5, azimuth=-90, elevation=90, height=1))
        return stage.radiance()[0, :, :3]


def upper_directions(count: int, seed: int) -> NDArray[np.float64]:
    found = np.random.default_rng(seed).normal(size=(count, 3))
    found[:, 2] = np.abs(found[:, 2])
    return found / np.linalg.norm(found, axis=1, keepdims=True)


@pytest.mark.parametrize("student", [False, True])
def test_the_shader_decodes_as_torch_and_numpy_do(student: bool) -> None:
    whole, count = btf(shared=False), 30
    made = whole.by_student() if student else whole
    light, view = upper_directions(count, 1), upper_directions(count, 2)
    found = decoded_by_the_stage(made, made.latents, light, view)
    inputs = direction_inputs_of_vectors(light, view)
    in_numpy = [
        decode_in_numpy(made.decoder, made.latents[n : n + 1], inputs[n : n + 1])[0, 0]
        for n in range(count)
    ]
    assert np.ptp(in_numpy) > 0.5
    np.testing.assert_allclose(found, in_numpy, atol=MOST)
    plain = replace(made, parallax=None, least=-np.inf, largest=np.inf)
    by_torch = plain.radiance(np.arange(count), light, view) / made.alpha
    np.testing.assert_allclose(found, by_torch, atol=MOST)
    swapped = plain.radiance(np.arange(count), view, light) / made.alpha
    assert np.abs(found - swapped).max() > 0.01


def written_decoder(hidden: int) -> dict[str, NDArray[np.float32]]:
    """A decoder that a formula has, so that the viewer's test has the same."""
    sizes = (12, hidden, hidden, hidden, 3)
    arrays: dict[str, NDArray[Any]] = {}
    for layer in range(1, 5):
        row, column = np.indices((sizes[layer], sizes[layer - 1]))
        weight = 0.25 * np.sin(1.0 + 5.0 * layer + 1.7 * row + 0.9 * column * column)
        bias = 0.2 * np.cos(3.0 * layer + 1.1 * np.arange(sizes[layer]))
        arrays |= {f"weight_{layer}": weight, f"bias_{layer}": bias}
    return {name: values.astype(np.float32) for name, values in arrays.items()}


def test_the_viewers_test_knows_what_numpy_decodes() -> None:
    stored = json.loads((CHECKOUT / "viewer" / "tests" / "neural_btf.json").read_text())
    latents, light, view = (np.array(stored[key]) for key in ("latents", "light", "view"))
    inputs = direction_inputs_of_vectors(light, view)
    for hidden, key in ((HIDDEN, "colour"), (STUDENT_HIDDEN, "student_colour")):
        arrays = written_decoder(hidden)
        for n, colour in enumerate(stored[key]):
            found = decode_in_numpy(arrays, latents[n : n + 1], inputs[n : n + 1])[0, 0]
            np.testing.assert_allclose(found, colour, atol=1e-5)
        assert np.ptp(stored[key]) > 0.5


def test_weights_and_latents_are_all_in_the_texels() -> None:
    made = btf(shared=False)
    texels = weight_texels(made.decoder)
    assert texels.shape == (82, 109, 4)
    assert np.count_nonzero(texels) == 24_383
    assert texels[27 + 5, 17, 2] == made.decoder["weight_2"][22, 17]
    assert texels[81, 108, 1] == made.decoder["bias_4"][1]
    student = weight_texels(bright_decoder(STUDENT_HIDDEN))
    assert student.shape == (34, 45, 4)
    many = np.arange(8 * 1500, dtype=np.float32).reshape(1500, 8)
    lines = latent_texels(many)
    assert lines.shape == (2, 2048, 4)
    assert np.array_equal(lines.reshape(-1, 8)[:1500], many)


def apart(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    """Largest difference of two pictures, but for a pixel in a hundred: on the rod's silhouette."""
    return float(np.quantile(np.abs(one - other).max(axis=-1), 0.99))


@pytest.mark.parametrize(("shared", "tiles"), [(True, 1.0), (False, 9.0)])
def test_the_cloth_is_as_torch_decodes_it(shared: bool, tiles: float) -> None:
    made = btf(shared)
    scenery = scenery_of(made)
    showing = Showing(LIGHT, tiles, 0.8)
    drawn = draw_cloth(scenery, showing, HOME, width=SIZE[0], height=SIZE[1])
    assert apart(drawn, decoded_cloth(scenery, showing, HOME, SIZE)) < MOST_DRAWN
    if tiles == 1.0:
        return
    other = showing._replace(light=unit_light((0.9, -0.4, 0)))
    nulls = {
        "light": decoded_cloth(scenery, other, HOME, SIZE),
        "no parallax": decoded_cloth(
            scenery._replace(btf=replace(made, parallax=None)), showing, HOME, SIZE
        ),
        "no mips": decoded_cloth(scenery._replace(btf=replace(made, mips=())), showing, HOME, SIZE),
        "no bounds": decoded_cloth(
            scenery._replace(btf=replace(made, least=-9.0, largest=9.0)), showing, HOME, SIZE
        ),
        "student": decoded_cloth(scenery._replace(btf=made.by_student()), showing, HOME, SIZE),
    }
    for name, null in nulls.items():
        assert apart(drawn, null) > 0.01, name


@pytest.mark.parametrize("channels", [8, 22])
def test_a_student_draws_as_torch_decodes_it(channels: int) -> None:
    scenery = scenery_of(btf(shared=False, channels=channels).by_student())
    showing = Showing(LIGHT, 3.0, 0.8)
    drawn = draw_cloth(scenery, showing, HOME, width=SIZE[0], height=SIZE[1])
    assert apart(drawn, decoded_cloth(scenery, showing, HOME, SIZE)) < MOST_DRAWN


def test_a_pixels_footprint_is_what_lies_between_its_neighbours() -> None:
    scenery = scenery_of(btf(shared=False))._replace(around=None)
    size = (192, 144)
    sights = cloth_sights(scenery, Showing(LIGHT, 3.0, 1.0), HOME, size)
    places = np.full((size[1], size[0], 2), np.nan)
    places[sights.seen] = sights.places
    right, down = (
        (places[1:-1, 2:] - places[1:-1, :-2]) / 2,
        (places[2:, 1:-1] - places[:-2, 1:-1]) / 2,
    )
    area = np.abs(right[..., 0] * down[..., 1] - right[..., 1] * down[..., 0])
    found = np.full((size[1], size[0]), np.nan)
    found[sights.seen] = sights.footprint
    ratio = found[1:-1, 1:-1] / np.sqrt(area)
    ratio = ratio[np.isfinite(ratio)]
    assert len(ratio) > 0.2 * size[0] * size[1]
    assert np.quantile(np.abs(ratio - 1), 0.9) < 0.05
    # Its null: pixels see more of the material where it is seen from a side.
    assert np.quantile(sights.footprint, 0.95) > 1.2 * np.quantile(sights.footprint, 0.05)
    twice = cloth_sights(scenery, Showing(LIGHT, 6.0, 1.0), HOME, size)
    np.testing.assert_allclose(twice.footprint, 2 * sights.footprint, rtol=2e-3, atol=1e-6)


def test_the_back_of_the_cloth_is_lit_from_behind() -> None:
    scenery = scenery_of(btf(shared=False))
    behind = orbit((0.0, 0.0, 0.0), 4.0, 90.0, 5.0)
    means = [
        decoded_cloth(scenery._replace(around=None), Showing(light, 2.0, 1.0), behind, SIZE)
        for light in ((0.0, 1.0, 0.0), (0.0, -1.0, 0.0))
    ]
    drawn = draw_cloth(
        scenery._replace(around=None),
        Showing((0.0, 1.0, 0.0), 2.0, 1.0),
        behind,
        width=SIZE[0],
        height=SIZE[1],
    )
    assert apart(drawn, means[0]) < MOST_DRAWN
    assert means[0][..., :3].mean() > 10 * means[1][..., :3].mean()


def test_the_cloth_hangs_and_its_vectors_are_the_surfaces() -> None:
    cloth = hanging_cloth(0.5)
    corners = cloth.vertices[cloth.triangles].astype(np.float64)
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    assert (facing[:, 1] < 0).all()
    means = cloth.normals[cloth.triangles].mean(axis=1)
    assert np.sum(facing * means, axis=1).min() > 0.97
    np.testing.assert_allclose(np.linalg.norm(cloth.tangents, axis=1), 1, atol=1e-6)
    assert (cloth.tangents[:, 0] > 0.4).all()
    # The material keeps its shape: as far along u as along v, within what folds stretch.
    size = np.ptp(cloth.places, axis=0)
    assert size[0] == pytest.approx(1.0)
    assert size[1] == pytest.approx(0.9 / 0.5, rel=1e-5)


def test_the_room_is_around_the_cloth() -> None:
    room, cloth = surroundings(), hanging_cloth(1.0)
    assert np.linalg.norm(room.vertices, axis=1).max() > 3 * np.linalg.norm(HOME.position)
    assert (room.radiance > 0).all()
    assert room.radiance.max() < 1
    assert len(room.vertices) == len(room.radiance)
    assert room.triangles.max() < len(room.vertices)
    assert np.abs(cloth.vertices).max() < 1.2


def test_reference_views_show_the_light_that_they_name() -> None:
    scenery = scenery_of(btf(shared=True))
    exposure = home_exposure(scenery, 2.0)
    views = reference_views(scenery, 2.0, exposure, 32)
    assert [view.frame.shape for view in views] == [(24, 32, 3)] * 3
    for view in views:
        showing = Showing(view.light, view.tiles, exposure)
        decoded = decoded_cloth(scenery, showing, view.camera, (64, 48))[..., :3]
        decoded = decoded.reshape(24, 2, 32, 2, 3).mean(axis=(1, 3))
        codes = 255 * np.where(
            decoded <= 0.0031308,
            12.92 * decoded,
            1.055 * np.maximum(decoded, 1e-9) ** (1 / 2.4) - 0.055,
        )
        apart = np.abs(np.clip(codes, 0, 255) - view.frame).max(axis=-1)
        assert np.quantile(apart, 0.96) <= 0.51
    assert np.abs(views[0].frame.astype(float) - views[1].frame).mean() > 2


def test_a_photograph_is_shown_large() -> None:
    photograph = np.random.default_rng(0).random((12, 20, 3)).astype(np.float32)
    shown = input_picture(photograph)
    assert shown.shape == (22 * 12, 22 * 20, 3)
    assert (shown[:22, :22] == shown[0, 0]).all()
