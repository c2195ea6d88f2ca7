"""The SSDF graph at its smallest, planted regressions, users' files, bad input."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import tsuya
from assets_defs.launcher import Request
from assets_defs.sources import Source
from assets_defs.ssdf_lighting.datasets import decoder_of
from assets_defs.ssdf_lighting.graph import SSDF
from pipelines.geometry import shapes
from pipelines.light import built_in_environments
from pipelines.ssdf_lighting import figures, scene
from pipelines.ssdf_lighting.compression import (
    bits_file,
    compact,
    lookup,
    shared_basis,
    triangle_clusters,
)
from pipelines.ssdf_lighting.compression import decoder as decoder_module
from pipelines.ssdf_lighting.compression.compact_file import from_bytes
from pipelines.ssdf_lighting.compression.compact_memory import (
    cluster_bases,
    pack,
    vertex_distances,
)
from pipelines.ssdf_lighting.compression.decoder import Decoder
from pipelines.ssdf_lighting.distances import refined, visibility
from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights
from pipelines.ssdf_lighting.drawing import (
    bounced_light,
    finishes,
    frames,
    live_parts,
    viewpoints,
)
from pipelines.ssdf_lighting.light import environment_fit, fit_quality, interreflection
from pipelines.ssdf_lighting.light.spherical_gaussians import rotated
from storage.packages import read_package
from tests.assets_defs.regressions import Regression, assert_check_finds

SCENE = {"scene": "teapot"}
SKY = {"environment": "sky"}
KEYS = SCENE | SKY
TINY = {"width": 64, "frames": 1, "reference_samples": 16}


@pytest.fixture(scope="module")
def good(house: Any) -> Any:
    """The house with the teapot under the sky made once."""
    house.launcher.launch(Request(SSDF, [KEYS], preset="test"))
    return house


def _open(house: Any, asset: str, keys: dict[str, str]) -> Any:
    return house.workspace.store.open(SSDF.slot(asset, keys))


def test_every_asset_is_current_and_has_passed_every_check(good: Any) -> None:
    store = good.workspace.store
    for plan in SSDF.plans.values():
        slot = SSDF.slot(plan.name, {name: KEYS[name] for name in plan.by})
        verdicts = store.verdicts(slot, store.current(slot))
        assert set(verdicts) == {check.name for check in plan.checks}
        assert all(verdict["passed"] for verdict in verdicts.values())


def test_the_stored_file_decodes_to_the_matrix(good: Any) -> None:
    matrix = _open(good, "ssdf_matrix", SCENE)["distances"].values
    stored = _open(good, "ssdf_basis", SCENE)
    memory = pack(from_bytes(stored["file"].values.tobytes()))
    assert decoder_of(stored).resident_bytes == stored["bytes_memory"]
    bases = cluster_bases(memory)
    rows = range(0, len(matrix), 97)
    found = np.stack([vertex_distances(memory, bases, row) for row in rows])
    errors = stored["vertex_rmse"].values[list(rows)]
    assert np.sqrt(((found - matrix[list(rows)]) ** 2).mean()) < 2.0 * errors.max()
    assert stored["bytes_file"] < 0.02 * matrix.nbytes


def test_what_is_stored_is_loaded_as_the_systems_own_objects(good: Any) -> None:
    store = good.workspace.root / "store"
    matrix = tsuya.open("ssdf_lighting/ssdf_matrix/teapot", store)["distances"].values
    basis = tsuya.load("ssdf_lighting/ssdf_basis/teapot", store)
    rows, stored = (
        np.arange(0, len(matrix), 50),
        tsuya.open("ssdf_lighting/ssdf_basis/teapot", store),
    )
    off = (basis.distances(rows) - matrix[rows]) * root_weights(matrix.shape[1])
    errors = np.sqrt((off.astype(np.float64) ** 2).mean(axis=1))
    np.testing.assert_allclose(errors, stored["vertex_rmse"].values[rows], rtol=1e-3)
    seen = tsuya.load("ssdf_lighting/visibility/teapot", store)
    np.testing.assert_array_equal(seen, matrix > 0)
    lit = tsuya.load("ssdf_lighting/scene_mesh/teapot", store)
    clusters = tsuya.load("ssdf_lighting/triangle_clusters/teapot", store)
    assert len(lit.vertices) == len(clusters.vertex) == len(matrix)
    assert len(lit.triangles) == len(clusters.triangle)
    assert tsuya.load("ssdf_lighting/environment_lights/sky", store).axes.shape == (6, 3)


@pytest.mark.slow
def test_the_papers_form_and_a_byte_budget(make_house: Any) -> None:
    house = make_house()
    paper = {"coding": "paper", "values": 12, "space": "positions", "edges": "samples"}
    house.launcher.launch(Request(SSDF, [SCENE], "test", paper))
    made = _open(house, "ssdf_basis", SCENE)
    assert made["vectors"].shape == (24 * 12, 1024)
    assert made["bytes_memory"] == decoder_of(made).resident_bytes
    house.launcher.launch(Request(SSDF, [SCENE], "test", paper | {"contribution": 0.8}))
    by_contribution = _open(house, "ssdf_basis", SCENE)
    assert len(by_contribution["vectors"]) != 24 * 12
    budget = {"coding": "compact", "file_budget": 20_000}
    house.launcher.launch(Request(SSDF, [SCENE], "test", budget))
    small = _open(house, "ssdf_basis", SCENE)
    assert 18_000 < int(small["bytes_file"]) <= 20_000


@pytest.mark.slow
def test_bits_go_through_to_the_package(make_house: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    house = make_house()
    house.launcher.launch(Request(SSDF, [KEYS], "test", TINY | {"coding": "bits"}))
    made, matrix = (_open(house, name, SCENE) for name in ("ssdf_basis", "ssdf_matrix"))
    coded = bits_file.bits_from_bytes(made["file"].values.tobytes())
    seen = matrix["distances"].values > 0.0
    np.testing.assert_array_equal(coded.visible, seen)
    rows, decoder = np.arange(0, len(seen), 50), decoder_of(made)
    off = decoder.distances_in(rows, 32) - matrix["distances"].values[rows]
    errors = np.sqrt((((off * root_weights(1024)).astype(np.float64)) ** 2).mean(axis=1))
    np.testing.assert_allclose(errors, made["vertex_rmse"].values[rows], rtol=1e-3)
    assert made["bytes_memory"] == decoder.resident_bytes
    # A package holds the compact form, as far off as what is rebuilt.
    file = _open(house, "lit_package", KEYS)["file"].values.tobytes()
    packed = Decoder.of_file(read_package(file, "lit.tsuya").array("ssdf").tobytes())
    away = (packed.distances(rows) - matrix["distances"].values[rows]) * root_weights(1024)
    rmse = np.sqrt((away.astype(np.float64) ** 2).mean())
    assert 0.7 * float(made["rmse"]) < rmse < 1.3 * float(made["rmse"])
    # Distances that are rebuilt wrongly are found.
    decoder_module._rebuilt.cache_clear()
    off_by = Regression(
        "rmse", bits_file, "rebuilt_distances", lambda right, seen: right(seen) + 0.15, SCENE
    )
    assert_check_finds(house, SSDF, off_by, monkeypatch)
    decoder_module._rebuilt.cache_clear()


@pytest.mark.slow
def test_the_overview_lays_environments_side_by_side(good: Any) -> None:
    for name in ("lamps", "uniform"):
        good.launcher.launch(Request(SSDF, [SCENE | {"environment": name}], "test", TINY))
    good.launcher.launch(Request(SSDF, [KEYS], "test", TINY))
    assert SSDF.overview is not None
    pictures = SSDF.overview(good.workspace.store, list(good.workspace.store.slots()))
    assert pictures["teapot-turning-light"].shape == (1, 96, 128, 3)
    good.launcher.launch(Request(SSDF, [KEYS], "test"))


# ---- users' files ----------------------------------------------------------------------------


def _write_scene(path: Path, *, scale: float = 1.0, shift: float = 0.0) -> None:
    """A ball over a ground, in two materials; one triangle twice, one turned, one without area."""
    ball, ground = shapes.sphere(12), shapes.square(8)
    points = np.concatenate([ball.vertices * 0.4 + [0, 0, 0.5], ground.vertices * 4.0])
    points = points * scale + shift
    faces = np.concatenate([ball.triangles, ground.triangles + len(ball.vertices)]) + 1
    faces[5] = faces[5][::-1]
    lines = ["mtllib things.mtl\n"]
    lines += [f"v {x} {y} {z}\n" for x, y, z in points]
    lines.append("usemtl red\n")
    lines += [f"f {a} {b} {c}\n" for a, b, c in faces[: len(ball.triangles)]]
    lines.append("f {} {} {}\n".format(*faces[0]))
    lines.append("f {0} {0} {1}\n".format(*faces[0]))
    lines.append("usemtl ground\n")
    lines += [f"f {a} {b} {c}\n" for a, b, c in faces[len(ball.triangles) :]]
    path.write_text("".join(lines))
    path.with_name("things.mtl").write_text(
        "newmtl red\nKd 0.7 0.1 0.1\nKs 0.04 0.04 0.04\nNs 80\nnewmtl ground\nKd 0.5 0.5 0.5\n"
    )


def test_a_scene_and_an_environment_of_the_users(make_house: Any) -> None:
    house = make_house()
    inbox = house.workspace.inbox("ssdf_lighting")
    inbox.mkdir(parents=True)
    _write_scene(inbox / "things.obj")
    light = np.full((32, 64, 3), 0.2, np.float32)
    light[8:10, 40:44] = 30.0
    assert cv2.imwrite(str(inbox / "hall.hdr"), light)
    keys = {"scene": "things-obj", "environment": "hall-hdr"}
    made = house.launcher.launch(Request(SSDF, [keys], "test", TINY))
    assert {outcome.state for outcome in made} == {"made"}
    mesh = _open(house, "scene_mesh", {"scene": "things-obj"})
    notes = " ".join(mesh.attrs["notes"])
    for words in (
        "the same corners",
        "less than three corners",
        "turned over",
        "open along 32 border edges",
    ):
        assert words in notes
    assert np.allclose(mesh["albedo"].values[0], [0.7, 0.1, 0.1])
    assert np.linalg.norm(mesh["vertices"].values, axis=1).max() <= 1.0 + 1e-9


@pytest.mark.slow
def test_a_scene_far_away_and_a_kilometre_wide_sees_the_same(make_house: Any) -> None:
    house = make_house()
    inbox = house.workspace.inbox("ssdf_lighting")
    inbox.mkdir(parents=True)
    _write_scene(inbox / "here.obj")
    _write_scene(inbox / "there.obj", scale=1000.0, shift=250_000.0)
    keys = [{"scene": f"{name}-obj"} for name in ("here", "there")]
    house.launcher.launch(Request(SSDF, keys, "test"))
    here, there = (_open(house, "ssdf_matrix", key)["distances"].values for key in keys)
    assert here.shape == there.shape
    assert np.mean(np.abs(here - there) > 1e-2) < 0.005


# ---- planted regressions ---------------------------------------------------------------------


def _flipped(right: Callable[..., Any], *arguments: Any) -> Any:
    return -right(*arguments)


def _smaller(right: Callable[..., Any], *arguments: Any) -> Any:
    made = right(*arguments)
    return made._replace(vertices=made.vertices * 0.95)


def _mirrored(right: Callable[..., Any], *arguments: Any) -> Any:
    return right(*arguments)[:, ::-1]


def _leaking(right: Callable[..., Any], *arguments: Any) -> Any:
    seen = right(*arguments)
    seen[:, ::20] = True
    return seen


def _longer(right: Callable[..., Any], *arguments: Any) -> Any:
    return right(*arguments) * np.float32(1.3)


def _unsigned(right: Callable[..., Any], *arguments: Any) -> Any:
    return np.abs(right(*arguments))


def _without_thin_parts(right: Callable[..., Any], *arguments: Any) -> Any:
    found = right(*arguments)
    return found._replace(starts=0 * found.starts)


def _elsewhere(right: Callable[..., Any], *arguments: Any) -> Any:
    found = right(*arguments)
    return found._replace(crossings=-found.crossings)


def _gaps(right: Callable[..., Any], *arguments: Any) -> Any:
    made = right(*arguments)
    return made._replace(triangle=made.triangle * 2)


def _shuffled(right: Callable[..., Any], *arguments: Any) -> Any:
    made = right(*arguments)
    return made._replace(triangle=np.random.default_rng(0).permutation(made.triangle))


def _shrunk(right: Callable[..., Any], *arguments: Any) -> Any:
    found = right(*arguments)
    return found._replace(vectors=found.vectors * np.float32(0.9))


def _asked_for(factor: float) -> Callable[..., Any]:
    return lambda right, basis, cluster, rmse: right(basis, cluster, factor * rmse)


def _half_the_errors(right: Callable[..., Any], *arguments: Any) -> Any:
    error = right(*arguments)
    return error._replace(vertex_rmse=error.vertex_rmse / 2)


def _raised(right: Callable[..., Any], *arguments: Any) -> Any:
    return right(*arguments) + np.float32(0.03)


def _stepping(right: Callable[..., Any], tables: Any, vertices: Any, axes: Any) -> Any:
    steps = (tables.cluster[vertices] % 2 * 0.05).astype(np.float32)
    return right(tables, vertices, axes) + steps[:, None]


def _uneven(right: Callable[..., Any], *arguments: Any) -> Any:
    made = right(*arguments)
    odd = np.arange(len(made.centre))[:, None] % 2
    return made._replace(centre=np.rint(made.centre * (1.0 + 0.1 * odd)).astype(np.int32))


def _bright(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    fit = right(*arguments, **options)
    return fit._replace(lights=fit.lights._replace(amplitudes=fit.lights.amplitudes * 1.01))


def _upside_down(right: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    return right(*arguments, **options)[::-1]


def _turned(right: Callable[..., Any], radiance: Any, *arguments: Any, **options: Any) -> Any:
    fit = right(radiance, *arguments, **options)
    turned = rotated(fit.lights, 70.0)
    return fit._replace(lights=turned, errors=fit_quality.fit_errors(turned, radiance))


def _wrong_probe(right: Callable[..., Any], radiance: Any) -> Any:
    return right(np.roll(radiance, radiance.shape[1] // 3, axis=1))


def _half_factors(right: Callable[..., Any], *arguments: Any) -> Any:
    made = right(*arguments)
    return made._replace(steps=made.steps / 2)


def _darkness(right: Callable[..., Any], factors: Any, direct: Any) -> Any:
    return right(factors, 0 * direct)


def _without_colours(right: Callable[..., Any], *arguments: Any) -> Any:
    made = right(*arguments)
    return made._replace(materials=made.materials._replace(albedo=0 * made.materials.albedo))


def _without_red(right: Callable[..., Any], materials: Any) -> Any:
    return right(materials._replace(albedo=materials.albedo * [0.7, 1.0, 1.0]))


def _far_camera(right: Callable[..., Any], *arguments: Any) -> Any:
    camera = right(*arguments)
    target = np.array(camera.target)
    away = target + 1.5 * (np.array(camera.position) - target)
    return type(camera)(tuple(away), camera.target, camera.up, camera.view_angle)


REGRESSIONS = (
    Regression("normal_error", scene, "creased_normals", _flipped, SCENE),
    Regression("area", scene, "make_scene", _smaller, SCENE),
    Regression("reflectance", scene, "make_scene", _without_colours, SCENE),
    Regression("visibility_error", visibility, "visible_directions", _mirrored, SCENE),
    Regression("visible_share", visibility, "visible_directions", _leaking, SCENE),
    Regression("distance_error", refined, "distances_to_arcs", _longer, SCENE),
    Regression("sign_error", refined, "refined_distances", _unsigned, SCENE),
    Regression("missed_share", refined, "thin_outlines", _without_thin_parts, SCENE),
    Regression("made_up_share", refined, "thin_outlines", _elsewhere, SCENE),
    Regression("unused", triangle_clusters, "clusters_by_distance", _gaps, SCENE),
    Regression("compactness", triangle_clusters, "clusters_by_distance", _shuffled, SCENE),
    Regression("basis_error", shared_basis, "right_singular_vectors", _shrunk, SCENE),
    Regression("over_budget", compact, "quantise_to_rmse", _asked_for(1.5), SCENE),
    Regression("sampled_rmse", figures, "compression_errors", _half_the_errors, SCENE),
    Regression("rmse", compact, "quantise_to_rmse", _asked_for(1.09), SCENE),
    Regression("byte_share", compact, "quantise_to_rmse", _asked_for(0.5), SCENE),
    Regression("wrong_visibility", Decoder, "distances", _raised, SCENE),
    Regression("seam_ratio", compact, "quantise_to_rmse", _uneven, SCENE),
    Regression("flux_error", environment_fit, "fit_lights", _bright, SKY),
    Regression("closure_error", interreflection, "bounce_factors", _half_factors, SCENE),
    Regression("shadowed_error", environment_fit, "fit_lights", _turned, SKY),
    Regression("tone_error", environment_fit, "fit_lights", _turned, SKY),
    Regression("share_from_above", built_in_environments, "sky", _upside_down, SKY),
    Regression("relit_psnr", lookup, "resident_along", _stepping, KEYS),
    Regression("probe_psnr", frames, "ProbeSource", _wrong_probe, KEYS),
    Regression("reflected_light", bounced_light, "bounced", _darkness, KEYS),
    Regression("colour_error", finishes, "_material_rows", _without_red, KEYS),
    Regression("coverage", viewpoints, "scene_camera", _far_camera, KEYS),
    Regression(
        "mean_brightness",
        frames,
        "exposed",
        lambda right, radiance, scale: right(radiance, 0.5 * scale),
        KEYS,
    ),
    Regression(
        "mismatches", live_parts, "halfs", lambda right, radiance: right(radiance * 1.001), KEYS
    ),
)


def test_every_check_has_a_planted_regression() -> None:
    names = {check.name for plan in SSDF.plans.values() for check in plan.checks}
    assert {regression.check for regression in REGRESSIONS} == names


@pytest.mark.parametrize("regression", REGRESSIONS, ids=lambda regression: regression.check)
def test_a_planted_regression_fails_its_check_and_the_last_good_version_stays(
    good: Any, regression: Regression, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert_check_finds(good, SSDF, regression, monkeypatch)


# ---- bad input -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"coding": "paper", "values": 2000}, r"teapot: values is 2000; expected at most 1024"),
        ({"rmse": 0.007}, r"teapot: rmse is 0\.007; expected at least 1\.5 times shared_error"),
        ({"rmse": 0.0}, r"'rmse' is 0\.0; input should be greater than 0"),
        ({"directions": 1000}, r"directions is 1000; expected the square of an even number"),
        ({"byte_budget": 100_000}, r"teapot: the SSDFs of 1\d+ vertices and 1024 directions need"),
        ({"lights": 25}, r"'lights' is 25; input should be less than or equal to 24"),
        ({"segments": 2}, r"'segments' is 2; input should be greater than or equal to 4"),
        ({"contribution": 1.5}, r"'contribution' is 1\.5; input should be less than or equal to 1"),
    ],
)
def test_bad_settings_are_refused_before_any_work(
    good: Any, given: dict[str, Any], sentence: str
) -> None:
    store = good.workspace.store
    before = {slot: store.pointer(slot) for slot in store.slots()}
    with pytest.raises(ValueError, match=sentence) as refused:
        good.launcher.launch(Request(SSDF, [KEYS], "test", given=given))
    assert len(str(refused.value).splitlines()) == 1
    assert {slot: store.pointer(slot) for slot in store.slots()} == before


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("nan.obj", "v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n", r"nan\.obj: .*nan"),
        ("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", r"line\.obj: no triangle has an area"),
        ("point.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", r"point\.obj: all vertices are at"),
        ("lost.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", r"lost\.obj: .*9"),
        ("empty.obj", "", r"empty\.obj: "),
    ],
)
def test_bad_scenes_are_refused_before_any_work(
    good: Any, name: str, content: str, sentence: str
) -> None:
    inbox = good.workspace.inbox("ssdf_lighting")
    inbox.mkdir(parents=True, exist_ok=True)
    (inbox / name).write_text(content)
    with pytest.raises(ValueError, match=sentence) as refused:
        good.launcher.launch(Request(SSDF, [{"scene": Source.of(inbox / name).key}], "test"))
    assert len(str(refused.value).splitlines()) == 1
    (inbox / name).unlink()


@pytest.mark.parametrize(
    ("value", "sentence"),
    [(np.nan, r"sky\.exr: .*no number in 32 of 512"), (0.0, r"sky\.exr: .*all black")],
)
def test_an_environment_with_bad_radiance_is_refused(
    good: Any, value: float, sentence: str
) -> None:
    import OpenEXR

    inbox = good.workspace.inbox("ssdf_lighting")
    inbox.mkdir(parents=True, exist_ok=True)
    light = np.zeros((16, 32, 3), np.float32)
    light[3] = value
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"RGB": light}) as file:
        file.write(str(inbox / "sky.exr"))
    with pytest.raises(ValueError, match=sentence):
        good.launcher.launch(Request(SSDF, [{"environment": "sky-exr"}], "test"))
    (inbox / "sky.exr").unlink()


def test_a_square_environment_is_refused(good: Any) -> None:
    inbox = good.workspace.inbox("ssdf_lighting")
    inbox.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(inbox / "square.hdr"), np.ones((16, 16, 3), np.float32))
    with pytest.raises(ValueError, match=r"square\.hdr: .*16 x 16"):
        good.launcher.launch(Request(SSDF, [{"environment": "square-hdr"}], "test"))
    (inbox / "square.hdr").unlink()
