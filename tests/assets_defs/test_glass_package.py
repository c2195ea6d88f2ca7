"""The package of a scratched glass: its light, its sources, what it is made of."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import xarray as xr

from assets_defs.glass_scratches.frames import FrameSettings, environment
from assets_defs.glass_scratches.graph import SCRATCHES
from assets_defs.glass_scratches.package import GlassPackageSettings, light_of
from assets_defs.launcher import Request
from pipelines.light.environment_maps import mean_radiance
from storage.packages import read_package

SMALL = GlassPackageSettings(environment_rows=16, view_size=32)


@pytest.fixture
def studio(tmp_path: Path) -> Path:
    light = np.full((24, 48, 3), 0.1, np.float32)
    light[6, 20] = [9.0, 6.0, 3.0]
    path = tmp_path / "studio.hdr"
    assert cv2.imwrite(str(path), light)
    return path


def _made_with(environment: str, **others: float) -> list[dict[str, Any]]:
    settings = FrameSettings(environment=environment, **others)  # type: ignore[arg-type]
    return [{"asset": "glass_frames", "settings": settings.model_dump()}]


def _frames(name: str, rows: int = 64) -> xr.Dataset:
    """What `light_of` reads of the frames."""
    radiance = environment(FrameSettings(environment=name, light_rows=rows)).radiance
    return xr.Dataset({"exposure": ((), 1.5), "surroundings": ("channel", mean_radiance(radiance))})


def test_built_in_environments_keep_their_names() -> None:
    light = light_of(SMALL, _made_with("sky", tile=0.4, light_rows=64), _frames("sky"))
    assert list(light.environments) == ["sky", "room", "lamps"]
    assert light.exposure == 1.5
    assert light.source == "sky"
    assert light.tile == 0.4
    assert {halfs.shape for halfs in light.environments.values()} == {(16, 32, 3)}


def test_a_users_environment_is_packed_by_its_light_and_named(studio: Path) -> None:
    light = light_of(SMALL, _made_with(str(studio)), _frames(str(studio)))
    assert list(light.environments) == ["own", "room", "lamps", "sky"]
    assert light.source == "studio.hdr"
    own = light.environments["own"].astype(np.float32)
    assert own.shape == (16, 32, 3)
    assert np.isclose(own.mean(), cv2.imread(str(studio), -1).mean(), rtol=0.01)


def test_an_environment_that_has_changed_is_refused(studio: Path) -> None:
    frames = _frames(str(studio))
    assert cv2.imwrite(str(studio), np.full((24, 48, 3), 0.7, np.float32))
    with pytest.raises(ValueError, match=r"studio\.hdr has changed .*: run glass_frames again"):
        light_of(SMALL, _made_with(str(studio)), frames)


def test_a_package_tells_sources_figures_lineage_and_views(house: Any) -> None:
    keys = {"setting": "setting-2", "object": "plate"}
    given = {"size": 32, "samples": 2, "lights": 1, "moving_size": 32, "environment_rows": 16}
    house.launcher.launch(Request(SCRATCHES, [keys], "test", given))
    dataset = house.workspace.store.open(SCRATCHES.slot("glass_package", keys))
    package = read_package(dataset["file"].values.tobytes())
    meta = package.meta
    assert meta["title"] == "setting-2 on plate"
    assert [source["name"] for source in meta["source"]] == ["setting-2", "plate", "room"]
    assert {step["asset"] for step in meta["lineage"]} == set(SCRATCHES.plans) - {"glass_package"}
    figures = {figure["name"]: figure for figure in meta["figures"]}
    assert 0 <= figures["Light that the table loses, at most"]["value"] < 1e-6
    assert np.isclose(figures["Part of the light that walls do not keep, mean"]["value"], 1.0)
    table = house.workspace.store.open(SCRATCHES.slot("scratch_table", {"setting": "setting-2"}))
    assert np.allclose(package.array("table"), table["rho"], rtol=1e-3, atol=1e-6)
    assert package.array("leans").tolist() == [0.0]
    assert package.parameter("keeps_lean") is False
    poster = package.picture("poster").astype(float)
    assert poster.shape == (480, 640, 3)
    assert poster.std() > 10
    assert [view["name"] for view in meta["views"]] == ["far", "close", "lamp"]
    shown = house.workspace.store.open(SCRATCHES.slot("glass_frames", keys))
    assert meta["parameters"]["exposure"]["value"] == float(shown["exposure"])
    lamp = meta["views"][2]["state"]
    assert lamp["lamp"] == 3.0
    assert np.isclose(np.linalg.norm(lamp["light"]), 1.0)
    power, towards = package.array("lights_room")
    assert np.allclose(np.linalg.norm(towards, axis=1), 1, atol=1e-6)
    assert (power >= 0).all()
