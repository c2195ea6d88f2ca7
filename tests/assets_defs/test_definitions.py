"""What Dagster sees: the graph's shape, the schedule, the sensor, the IO manager's events."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import dagster as dg
import numpy as np
import pytest
from PIL import Image

from assets_defs.glass_scratches.graph import SCRATCHES
from assets_defs.inbox import SETTLED_SECONDS
from assets_defs.launcher import Request
from assets_defs.neural_btf.graph import BTF
from assets_defs.partitions import partition_key
from assets_defs.photo_fur.graph import FUR
from assets_defs.sources import NOTES, Source
from assets_defs.ssdf_lighting.graph import SSDF
from assets_defs.street_billboards.graph import STREET
from assets_defs.system import System
from assets_defs.systems import SYSTEMS
from storage.schemas import schemas_of
from storage.versions import Slot
from tests.storage.readers.btf_writers import FIFTEEN, write_ubo2003_zip


def test_dagster_validates_the_workspace(tmp_path: Path) -> None:
    checkout = Path(__file__).parents[2]
    done = subprocess.run(
        [
            str(Path(sys.executable).parent / "dagster"),
            *("definitions", "validate", "-w", "workspace.yaml"),
        ],
        cwd=checkout,
        env=os.environ | {"DAGSTER_HOME": str(tmp_path), "TSUYA_DATA": str(tmp_path / "data")},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "PreviewWarning" not in done.stderr


def test_importing_the_definitions_imports_nothing_heavy() -> None:
    heavy = ("xarray", "zarr", "dask", "pyvista", "vtkmodules", "open3d", "scipy", "skimage")
    heavy += ("torch", "sklearn", "numba", "cv2", "matplotlib")
    code = f"import sys, assets_defs.entry; print([m for m in {heavy} if m in sys.modules])"
    checkout = Path(__file__).parents[2]
    printed = subprocess.check_output([sys.executable, "-c", code], cwd=checkout, text=True)
    assert printed.strip() == "[]"


def _parents(house: Any, system: System) -> dict[str, set[str]]:
    graph = house.definitions.get_repository_def().asset_graph
    nodes = {name: graph.get(dg.AssetKey([system.name, name])) for name in system.plans}
    return {name: {key.path[-1] for key in node.parent_keys} for name, node in nodes.items()}


def test_the_graph_has_the_papers_shape(house: Any) -> None:
    graph = house.definitions.get_repository_def().asset_graph
    assert _parents(house, FUR) == {
        "fur_photo": set(),
        "attenuation": {"fur_photo"},
        "shell_stack": {"fur_photo", "attenuation"},
        "shell_mesh": set(),
        "lie_field": {"shell_mesh"},
        "fur_patches": {"fur_photo", "shell_mesh", "lie_field"},
        "fur_frames": {"fur_photo", "attenuation", "shell_mesh", "lie_field", "fur_patches"},
        "fur_package": {"fur_photo", "attenuation", "shell_mesh", "lie_field", "fur_patches"},
    }
    assert _parents(house, BTF) == {
        "btf_images": set(),
        "abrdf_matrix": {"btf_images"},
        "abrdf_clusters": {"btf_images", "abrdf_matrix"},
        "neural_btf": {"abrdf_matrix", "abrdf_clusters"},
        "compressed_btf": {"abrdf_matrix", "abrdf_clusters", "neural_btf"},
        "restored_images": {"btf_images", "abrdf_matrix", "compressed_btf"},
        "cloth_frames": {"btf_images", "compressed_btf"},
        "rate_distortion": {"abrdf_matrix", "abrdf_clusters", "neural_btf", "compressed_btf"},
        "btf_package": {"compressed_btf", "restored_images"},
    }
    assert _parents(house, SCRATCHES) == {
        "scratch_profile": set(),
        "scratch_table_2d": {"scratch_profile"},
        "scratch_table": {"scratch_table_2d"},
        "scratch_photo": set(),
        "scratch_layers": {"scratch_photo"},
        "glass_object": set(),
        "glass_frames": {"scratch_table_2d", "scratch_table", "scratch_layers", "glass_object"},
        "glass_package": set(SCRATCHES.plans) - {"glass_package", "scratch_photo"},
    }
    assert _parents(house, SSDF) == {
        "scene_mesh": set(),
        "visibility": {"scene_mesh"},
        "ssdf_matrix": {"scene_mesh", "visibility"},
        "triangle_clusters": {"scene_mesh", "ssdf_matrix"},
        "ssdf_basis": {"scene_mesh", "ssdf_matrix", "triangle_clusters"},
        "bounce_factors": {"scene_mesh", "visibility"},
        "environment_lights": set(),
        "relit_frames": {
            "scene_mesh",
            "ssdf_matrix",
            "triangle_clusters",
            "ssdf_basis",
            "bounce_factors",
            "environment_lights",
        },
        "lit_package": {
            "scene_mesh",
            "triangle_clusters",
            "ssdf_basis",
            "bounce_factors",
            "environment_lights",
            "relit_frames",
        },
    }
    assert _parents(house, STREET) == {
        "drive_poses": set(),
        "drive_frames": {"drive_poses"},
        "depth_maps": {"drive_frames"},
        "street_points": {"drive_frames", "depth_maps"},
        "billboards": {"drive_frames", "street_points"},
        "view_textures": {"drive_frames", "depth_maps", "street_points", "billboards"},
        "eigen_textures": {"billboards", "view_textures"},
        "texture_atlases": {"drive_frames", "billboards", "eigen_textures"},
        "street_frames": {
            "drive_frames",
            "depth_maps",
            "billboards",
            "eigen_textures",
            "texture_atlases",
        },
        "street_package": {
            "drive_frames",
            "depth_maps",
            "billboards",
            "eigen_textures",
            "texture_atlases",
            "street_frames",
        },
    }
    for system in SYSTEMS.values():
        assert [plan.schema for plan in system.plans.values()] == list(schemas_of(system.name))
        for plan in system.plans.values():
            node = graph.get(dg.AssetKey([system.name, plan.name]))
            assert node.group_name == system.name
            assert node.owners
            assert node.kinds >= {"zarr"}
            assert "| variable |" in (node.description or "")
            assert node.partitions_def is not None
            assert node.code_version == plan.code
            columns = node.metadata["dagster/column_schema"].columns
            assert [column.name for column in columns] == list(plan.schema.variables)


def test_every_check_blocks_and_knows_its_partitions(house: Any) -> None:
    graph = house.definitions.get_repository_def().asset_graph
    expected = {
        (system.name, plan.name, check.name)
        for system in SYSTEMS.values()
        for plan in system.plans.values()
        for check in plan.checks
    }
    found = {(*key.asset_key.path, key.name) for key in graph.asset_check_keys}
    assert found == expected
    for key in graph.asset_check_keys:
        spec = graph.get_check_spec(key)
        assert spec.blocking
        assert spec.partitions_def == graph.get(key.asset_key).partitions_def


def test_a_materialisation_tells_version_size_data_version_and_picture(house: Any) -> None:
    house.launcher.launch(Request(FUR, [{"photo": "grass"}], "test"))
    slot = Slot("photo_fur", "fur_photo", "grass")
    record = house.workspace.store.record(slot)
    event = house.instance.get_latest_materialization_event(dg.AssetKey(["photo_fur", "fur_photo"]))
    metadata = event.asset_materialization.metadata
    assert metadata["version"].value == record["version"]
    assert metadata["bytes in memory"].value == record["array_bytes"]
    assert Path(metadata["folder"].value) == house.workspace.store.folder(slot)
    assert metadata["settings"].value == record["settings"]
    assert metadata["picture: photograph"].value.startswith("![picture](data:image/jpeg;base64,")
    assert len(metadata["picture: photograph"].value) < 100_000
    assert event.asset_materialization.tags["dagster/data_version"] == record["content"]


def test_a_run_that_names_no_settings_repeats_those_of_the_current_version(house: Any) -> None:
    """What the UI's Materialize button and an asset backfill do."""
    house.launcher.launch(Request(FUR, [{"photo": "grass"}], "test", {"layers": 5}))
    job = house.definitions.get_repository_def().get_job("photo_fur_photo")
    done = job.execute_in_process(instance=house.instance, partition_key="grass")
    assert done.success
    store = house.workspace.store
    slots = [Slot("photo_fur", name, "grass") for name in ("attenuation", "shell_stack")]
    assert [store.record(slot)["settings"]["layers"] for slot in slots] == [5, 5]
    # Nothing was skipped, although all of it was current.
    made = {event.asset_key.path[-1] for event in done.get_asset_materialization_events()}
    assert made == {"fur_photo", "attenuation", "shell_stack"}


def test_the_schedule_makes_again_what_was_made(house: Any) -> None:
    keys = {"photo": "grass", "mesh": "square"}
    house.launcher.launch(Request(FUR, [keys], "test"))
    (schedule,) = house.definitions.schedules
    assert schedule.default_status == dg.DefaultScheduleStatus.RUNNING
    context = dg.build_schedule_context(
        instance=house.instance, repository_def=house.definitions.get_repository_def()
    )
    request = schedule.evaluate_tick(context).run_requests[0]
    before = _materialisations(house)
    job = house.definitions.get_repository_def().get_job("launch")
    assert job.execute_in_process(run_config=request.run_config, instance=house.instance).success
    after = _materialisations(house)
    assert after["fur_frames"] == before["fur_frames"] + 1
    assert after["fur_photo"] == before["fur_photo"] + 1


def test_what_has_lost_its_file_is_not_made_again(dropped: Any) -> None:
    (path,) = dropped.workspace.inbox("photo_fur").iterdir()
    key = Source.of(path).key
    dropped.launcher.launch(Request(FUR, [{"photo": key}, {"photo": "grass"}], "test"))
    assert {"photo": key} in FUR.stored_partitions(dropped.workspace)
    path.unlink()
    assert FUR.stored_partitions(dropped.workspace) == [{"photo": "grass"}] * 3


def _materialisations(house: Any) -> dict[str, int]:
    counts = {}
    for name in FUR.plans:
        events = house.instance.fetch_materializations(dg.AssetKey(["photo_fur", name]), limit=1000)
        counts[name] = len(events.records)
    return counts


# ---- the inbox -------------------------------------------------------------------------------


@pytest.fixture
def dropped(make_house: Any) -> Any:
    """A house of its own with a photograph in the inbox, settled."""
    house = make_house()
    inbox = house.workspace.inbox("photo_fur")
    inbox.mkdir(parents=True)
    noise = np.random.default_rng(2).integers(0, 256, (80, 80, 3), dtype=np.uint8)
    path = inbox / "Mein Fell.png"
    Image.fromarray(noise).save(path)
    _settle(path)
    return house


def _settle(path: Path, seconds: float = SETTLED_SECONDS + 1) -> None:
    past = time.time() - seconds
    os.utime(path, (past, past))


def _tick(house: Any, cursor: str | None) -> dg.SensorResult:
    sensor = next(each for each in house.definitions.sensors if each.name == "inbox")
    context = dg.build_sensor_context(
        instance=house.instance,
        cursor=cursor,
        repository_def=house.definitions.get_repository_def(),
    )
    result = sensor.evaluate_tick(context)
    for request in result.dynamic_partitions_requests:
        house.instance.add_dynamic_partitions(request.partitions_def_name, request.partition_keys)
    return result


def test_a_dropped_photograph_is_registered_and_its_run_makes_frames(dropped: Any) -> None:
    tick = _tick(dropped, None)
    (request,) = tick.run_requests
    photos = dropped.instance.get_dynamic_partitions("photo_fur_photo")
    (key,) = set(photos) - set(FUR.dimension("photo").builtin)
    assert key.startswith("mein-fell-")
    assert set(dropped.instance.get_dynamic_partitions("photo_fur_mesh")) == set(
        FUR.dimension("mesh").builtin
    )
    config = request.run_config["ops"]["launch_graph"]["config"]
    assert config["partitions"] == [{"photo": key, "mesh": FUR.dimension("mesh").default}]
    job = dropped.definitions.get_repository_def().get_job("launch")
    done = job.execute_in_process(run_config=request.run_config, instance=dropped.instance)
    assert done.success
    keys = {"photo": key, "mesh": FUR.dimension("mesh").default}
    assert dropped.workspace.store.current(FUR.slot("fur_frames", keys))
    runs = {run.job_name for run in dropped.instance.get_runs()}
    assert {FUR.job_name(by) for by in FUR.grains()} <= runs
    assert partition_key(keys) == f"{keys['mesh']}|{key}"
    # The same file again: nothing.
    assert _tick(dropped, tick.cursor).run_requests == []


def test_a_changed_file_is_made_again_and_one_on_its_way_is_left_alone(dropped: Any) -> None:
    first = _tick(dropped, None)
    (path,) = dropped.workspace.inbox("photo_fur").iterdir()
    path.touch()
    moving = _tick(dropped, first.cursor)
    assert moving.run_requests == []
    _settle(path, 60)
    settled = _tick(dropped, moving.cursor)
    assert len(settled.run_requests) == 1
    assert settled.run_requests[0].run_key != first.run_requests[0].run_key


def test_a_file_that_the_command_line_registered_is_not_run_twice(dropped: Any) -> None:
    (path,) = dropped.workspace.inbox("photo_fur").iterdir()
    key = next(k for k, s in FUR.sources("photo", path.parent).items() if s.path == path)
    dropped.instance.add_dynamic_partitions("photo_fur_photo", [key])
    tick = _tick(dropped, None)
    assert tick.run_requests == []
    assert json.loads(tick.cursor)


def test_a_dropped_file_that_is_no_photograph_is_named_and_not_run(make_house: Any) -> None:
    house = make_house()
    inbox = house.workspace.inbox("photo_fur")
    inbox.mkdir(parents=True)
    (inbox / "broken.png").write_bytes(b"\x89PNG\r\n\x1a\n truncated")
    _settle(inbox / "broken.png")
    assert _tick(house, None).run_requests == []
    assert "broken.png: content is truncated" in (inbox / NOTES).read_text()
    assert "broken-png" not in house.instance.get_dynamic_partitions("photo_fur_photo")


@pytest.mark.parametrize("kind", ["zip", "folder"])
def test_a_dropped_btf_is_registered_and_requested(
    make_house: Any, tmp_path: Path, kind: str
) -> None:
    house = make_house()
    inbox = house.workspace.inbox("neural_btf")
    inbox.mkdir(parents=True)
    noise = np.random.default_rng(3).integers(0, 256, (225, 4, 4, 3), dtype=np.uint8)
    write_ubo2003_zip(tmp_path / "wolle.zip", noise, FIFTEEN, FIFTEEN)
    if kind == "zip":
        shutil.copyfile(tmp_path / "wolle.zip", inbox / "wolle.zip")
    else:
        shutil.unpack_archive(tmp_path / "wolle.zip", inbox / "wolle")
    inside = list(inbox.rglob("*"))
    for path in inside:
        _settle(path)
    tick = _tick(house, None)
    (request,) = tick.run_requests
    materials = set(house.instance.get_dynamic_partitions("neural_btf_material"))
    assert materials - set(BTF.dimension("material").builtin) == {f"wolle-{kind}"}
    clusters = house.instance.get_dynamic_partitions("neural_btf_clusters")
    assert set(clusters) == set(BTF.dimension("clusters").builtin)
    config = request.run_config["ops"]["launch_graph"]["config"]
    assert config["system"] == "neural_btf"
    assert config["partitions"] == [{"material": f"wolle-{kind}", "clusters": "none"}]
    # The same again: nothing. One file that changes is another BTF, once it has settled.
    assert _tick(house, tick.cursor).run_requests == []
    changed = next(path for path in inside if path.is_file())
    changed.touch()
    assert _tick(house, tick.cursor).run_requests == []
    _settle(changed, SETTLED_SECONDS + 0.5)
    assert len(_tick(house, tick.cursor).run_requests) == 1


def test_the_asset_page_is_up_to_date() -> None:
    """`make docs` makes it; the schemas and checks are the truth."""
    from docs.assets import PAGE, asset_page

    assert PAGE.read_text() == asset_page()
