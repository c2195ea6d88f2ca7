"""`tsuya export`: which formats there are, where files go, what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from assets_defs.packages import package_dataset
from assets_defs.workspace import Workspace
from storage.packages import read_package, write_package
from storage.packages.conformance import SMALL, small_contents
from storage.readers.bad_input import BadInput
from storage.schemas import find_schema
from storage.versions import Slot
from tsuya.export_command import export, format_lines
from tsuya.exports import formats
from tsuya.exports.format import ALL_SYSTEMS
from tsuya.packages import find_package, package_asset, package_slots

PACKAGE = write_package(replace(SMALL, system="photo_fur"), small_contents())


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    return Workspace(tmp_path / "data")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "My fur.tsuya"
    path.write_bytes(PACKAGE)
    return path


def test_every_system_has_formats_of_its_own() -> None:
    assert {system for each in formats() for system in each.systems} == set(ALL_SYSTEMS)
    names = [each.name for each in formats()]
    for system in ALL_SYSTEMS:
        own = [each.name for each in formats(system)]
        assert len(own) == len(set(own))
        assert {"tsuya", "frames"} < set(own) <= set(names)
    assert len(format_lines("photo_fur")) == len(formats("photo_fur"))


def test_a_package_is_written_as_it_is(workspace: Workspace, file: Path) -> None:
    ((path, notes),) = export(workspace, [str(file)], "tsuya", None)
    assert path == workspace.exports / "photo_fur" / path.name
    assert path.suffix == ".tsuya"
    assert path.read_bytes() == PACKAGE
    assert not notes
    assert [each.name for each in path.parent.iterdir()] == [path.name]


@pytest.mark.reads_back("frames")
def test_frames_are_linear_light(workspace: Workspace, file: Path, tmp_path: Path) -> None:
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    ((folder, notes),) = export(workspace, [str(file)], "frames", tmp_path / "frames")
    assert "8 bits" in notes[0]
    (path,) = folder.iterdir()
    code = small_contents().values["reference_front"][0, 0, 0] / 255
    linear = ((code + 0.055) / 1.055) ** 2.4
    read = np.array(mitsuba.Bitmap(str(path)))
    assert read.shape == (8, 8, 3)
    assert np.allclose(read, linear, rtol=1e-3)


def test_what_was_there_is_replaced(workspace: Workspace, file: Path, tmp_path: Path) -> None:
    folder = tmp_path / "frames"
    folder.mkdir()
    (folder / "old.exr").write_bytes(b"old")
    export(workspace, [str(file)], "frames", folder)
    assert [each.name for each in folder.iterdir()] == ["front.exr"]


def test_what_was_there_stays_where_nothing_new_can_be_written(
    workspace: Workspace, file: Path, tmp_path: Path
) -> None:
    target = tmp_path / "kept.tsuya"
    target.write_bytes(b"kept")
    file.write_bytes(b"cut" + PACKAGE[:100])
    with pytest.raises(BadInput, match="no whole zip"):
        export(workspace, [str(file)], "tsuya", target)
    without_views = replace(small_contents(), views=())
    file.write_bytes(write_package(replace(SMALL, system="photo_fur"), without_views))
    with pytest.raises(ValueError, match="has no views"):
        export(workspace, [str(file)], "frames", target)
    assert target.read_bytes() == b"kept"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["My fur.tsuya", "kept.tsuya"]


def test_an_unknown_format_is_refused_with_those_there_are(
    workspace: Workspace, file: Path
) -> None:
    with pytest.raises(ValueError, match=r"--to is 'obj', .*; expected .*tsuya"):
        export(workspace, [str(file)], "obj", None)


def test_several_packages_do_not_go_into_one_file(
    workspace: Workspace, file: Path, tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match="--out is one path"):
        export(workspace, [str(file), str(file)], "tsuya", tmp_path / "one.tsuya")


def test_keys_name_packages(workspace: Workspace) -> None:
    system = "photo_fur"
    asset = package_asset(system)
    slot = Slot(system, asset, "teapot.grass")
    dataset = find_schema(system, asset).conform(package_dataset(PACKAGE))
    record = {"recipe": "r", "lineage": "l", "checks": [], "settings": {}, "inputs": []}
    workspace.store.write(slot, dataset, record)
    assert package_slots(workspace.store) == [slot]
    for key in (str(slot), f"{system}/fur_frames/teapot.grass"):
        package = find_package(workspace.store, key)
        assert package.whole() == PACKAGE
        assert package.name == "photo_fur-teapot.grass.tsuya"
    ((path, _),) = export(workspace, [str(slot)], "tsuya", None)
    assert read_package(path).meta["title"] == small_contents().title
