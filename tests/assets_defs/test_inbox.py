"""The inbox: what the command line takes in, and what the sensor makes of what lies there."""

from __future__ import annotations

import json
import os
import shutil
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import dagster as dg
import numpy as np
import pytest

from assets_defs import inbox as inbox_module
from assets_defs.inbox import inbox_sensor
from assets_defs.neural_btf.graph import BTF
from assets_defs.settings import Settings
from assets_defs.sources import NOTES, Source
from assets_defs.ssdf_lighting.graph import SSDF
from assets_defs.system import Dimension, System
from assets_defs.taking_in import take_in
from assets_defs.workspace import Workspace
from storage.readers.scenes import read_scene
from storage.schemas import schemas_of
from storage.versions import Slot
from tests.storage.readers.btf_writers import FIFTEEN, write_ubo2003_zip


@pytest.fixture
def instance() -> Iterator[dg.DagsterInstance]:
    with dg.DagsterInstance.ephemeral() as opened:
        yield opened


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    return Workspace(tmp_path / "data")


def _write(path: Path, text: str = "") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def _files(folder: Path) -> dict[str, tuple[bytes, int]]:
    return {
        str(path.relative_to(folder)): (path.read_bytes(), path.stat().st_mtime_ns)
        for path in folder.rglob("*")
        if path.is_file()
    }


# ---- what the command line takes in ----------------------------------------------------------


def _no_check(source: Source, settings: Mapping[str, Any]) -> None:
    """Anything will do."""


def _toy(
    check: Callable[[Source, Mapping[str, Any]], object] = _no_check, name: str = "toy"
) -> System:
    """A system of files and folders, whose check is the test's."""
    system = System(
        name,
        "Toy",
        (
            Dimension("thing", ("ball",), ("ball",), "ball", (".txt", ".obj"), check),
            Dimension("drive", ("city",), ("city",), "city", (), check, folders=True),
        ),
    )
    for dimension, schema in zip(("thing", "drive"), schemas_of("photo_fur"), strict=False):
        declare = system.asset(schema, by=(dimension,), settings=Settings, from_source=True)
        declare(lambda: None)
    return system


TOY = _toy()


@pytest.mark.parametrize("given", ["avenue/", "./avenue", "avenue/.", "avenue/../avenue", "link/"])
def test_a_folder_is_known_the_first_time_however_it_is_written(
    workspace: Workspace,
    instance: dg.DagsterInstance,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    given: str,
) -> None:
    _write(tmp_path / "avenue" / "images" / "0.png", "0")
    (tmp_path / "link").symlink_to("avenue")
    monkeypatch.chdir(tmp_path)
    dimension = TOY.dimension("drive")
    key = take_in(Path(given), TOY, dimension, {}, workspace, instance)
    assert key == ("link-folder" if "link" in given else "avenue-folder")
    assert key in TOY.sources("drive", workspace.inbox("toy"))
    assert instance.get_dynamic_partitions("toy_drive") == [key]
    before = _files(workspace.root)
    assert take_in(Path(given), TOY, dimension, {}, workspace, instance) == key
    assert _files(workspace.root) == before
    assert [file for file, _ in before.values()] == [b"0"]


def test_the_current_folder_and_dots_in_names(
    workspace: Workspace,
    instance: dg.DagsterInstance,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    keys = set()
    for name, text in (("avenue.v2", "a"), ("avenue.v3", "b"), ("a.png", "c"), ("v.1.obj", "d")):
        _write(tmp_path / name / "0.png", text)
        monkeypatch.chdir(tmp_path / name)
        here = Path("../" + name) if name == "a.png" else Path()
        key = take_in(here, TOY, TOY.dimension("drive"), {}, workspace, instance)
        source = TOY.source("drive", key, workspace.inbox("toy"))
        assert source.name == name
        keys.add(key)
    assert len(keys) == 4
    monkeypatch.chdir(tmp_path / "a.png")
    (tmp_path / "a.png" / "below").mkdir()
    monkeypatch.chdir("below")
    # Another content now: `..` is the folder, and it has one more, empty, folder in it.
    assert take_in(Path(".."), TOY, TOY.dimension("drive"), {}, workspace, instance) in keys


def test_links_in_what_is_given_are_followed_and_copied_once(
    workspace: Workspace, instance: dg.DagsterInstance, tmp_path: Path
) -> None:
    """A measured BTF whose views are on another disk, linked; the reader sees one folder."""
    noise = np.random.default_rng(3).integers(0, 256, (225, 4, 4, 3), dtype=np.uint8)
    write_ubo2003_zip(tmp_path / "wolle.zip", noise, FIFTEEN, FIFTEEN)
    shutil.unpack_archive(tmp_path / "wolle.zip", tmp_path / "disk")
    photographs = [path for path in (tmp_path / "disk").rglob("*") if path.is_file()]
    for path in photographs:
        linked = tmp_path / "wolle" / path.relative_to(tmp_path / "disk")
        linked.parent.mkdir(parents=True, exist_ok=True)
        linked.symlink_to(path)
    material = BTF.dimension("material")
    key = take_in(tmp_path / "wolle", BTF, material, {}, workspace, instance)
    assert key == "wolle-folder"
    copied = workspace.inbox("neural_btf") / "wolle"
    assert not any(path.is_symlink() for path in copied.rglob("*"))
    assert {p.relative_to(copied): p.read_bytes() for p in copied.rglob("*.jpg")} == {
        p.relative_to(tmp_path / "disk"): p.read_bytes() for p in photographs
    }
    before = _files(workspace.root)
    assert take_in(tmp_path / "wolle", BTF, material, {}, workspace, instance) == key
    # The same without links is the same.
    shutil.rmtree(tmp_path / "wolle")
    (tmp_path / "disk").rename(tmp_path / "wolle")
    assert take_in(tmp_path / "wolle", BTF, material, {}, workspace, instance) == key
    assert _files(workspace.root) == before


@pytest.mark.parametrize("target", ["nowhere", "bad", "..", "../other"])
def test_links_to_nowhere_and_circles_are_refused_before_anything_is_copied(
    workspace: Workspace, instance: dg.DagsterInstance, tmp_path: Path, target: str
) -> None:
    _write(tmp_path / "avenue" / "0.png")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "back").symlink_to("../avenue")
    (tmp_path / "avenue" / "bad").symlink_to(target)
    with pytest.raises(ValueError, match=r"^(bad|back): is a link to .*; expected") as refusal:
        take_in(tmp_path / "avenue", TOY, TOY.dimension("drive"), {}, workspace, instance)
    assert "\n" not in str(refusal.value)
    assert not workspace.root.exists()
    assert instance.get_dynamic_partitions("toy_drive") == []


def _scene(folder: Path, colour: str, name: str = "hall.obj") -> Path:
    """A triangle whose colour is in a library beside it."""
    _write(folder / "hall.mtl", f"newmtl paint\nKd {colour}\nmap_Kd tex/wall.png\n")
    _write(folder / "tex" / "wall.png", f"picture of {colour}")
    triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl paint\nf 1 2 3\n"
    return _write(folder / name, f"mtllib hall.mtl\n{triangle}")


def test_scenes_are_taken_in_with_their_materials_and_apart(
    workspace: Workspace, instance: dg.DagsterInstance, tmp_path: Path
) -> None:
    dimension = SSDF.dimension("scene")
    inbox = workspace.inbox("ssdf_lighting")

    def taken(path: Path) -> Source:
        key = take_in(path, SSDF, dimension, {}, workspace, instance)
        return SSDF.source("scene", key, inbox)

    red = taken(_scene(tmp_path / "a", "1 0 0"))
    assert red.key == "hall-obj"
    assert red.name == "hall.obj"
    # The same OBJ, byte for byte, with another library of the same name.
    blue = taken(_scene(tmp_path / "b", "0 0 1"))
    other = taken(_scene(tmp_path / "a", "1 0 0", "other.obj"))
    assert len({red.key, blue.key, other.key}) == 3
    for source, albedo in ((red, (1, 0, 0)), (blue, (0, 0, 1)), (other, (1, 0, 0))):
        assert source.path is not None
        assert read_scene(source.path).materials[0].albedo == albedo
    before = _files(workspace.root)
    assert len([name for name in before if name.endswith("tex/wall.png")]) == 3
    assert taken(tmp_path / "a" / "hall.obj").key == red.key
    assert taken(tmp_path / "b" / "hall.obj").key == blue.key
    assert taken(tmp_path / "a" / "other.obj").key == other.key
    assert _files(workspace.root) == before
    # An edited library is another scene.
    assert taken(_scene(tmp_path / "b", "0 1 0")).key not in (red.key, blue.key)
    # In the inbox there are three scenes, nothing else and nothing odd.
    found = SSDF.found(inbox)
    assert len(found.items["scene"]) == 4
    assert found.items["environment"] == []
    assert found.oddities == {}


def test_a_library_from_another_folder_travels_to_where_it_is_found(
    workspace: Workspace, instance: dg.DagsterInstance, tmp_path: Path
) -> None:
    _scene(tmp_path / "shared", "1 0 0")
    triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl paint\nf 1 2 3\n"
    hall = _write(tmp_path / "a" / "hall.obj", f"mtllib ../shared/hall.mtl\n{triangle}")
    dimension = SSDF.dimension("scene")
    key = take_in(hall, SSDF, dimension, {}, workspace, instance)
    source = SSDF.source("scene", key, workspace.inbox("ssdf_lighting"))
    shutil.rmtree(tmp_path / "shared")
    assert source.path is not None
    assert read_scene(source.path).materials[0].albedo == (1, 0, 0)


def test_a_link_to_a_scene_is_taken_in_with_what_is_beside_the_scene(
    workspace: Workspace, instance: dg.DagsterInstance, tmp_path: Path
) -> None:
    _scene(tmp_path / "disk", "1 0 0")
    (tmp_path / "mine.obj").symlink_to(tmp_path / "disk" / "hall.obj")
    dimension = SSDF.dimension("scene")
    for _ in range(2):
        key = take_in(tmp_path / "mine.obj", SSDF, dimension, {}, workspace, instance)
        assert key == "mine-obj"
    source = SSDF.source("scene", key, workspace.inbox("ssdf_lighting"))
    assert source.path is not None
    assert not source.path.is_symlink()
    assert read_scene(source.path).materials[0].albedo == (1, 0, 0)


def test_without_its_library_a_scene_is_taken_in_alone(
    workspace: Workspace, instance: dg.DagsterInstance, tmp_path: Path
) -> None:
    hall = _scene(tmp_path / "a", "1 0 0")
    (tmp_path / "a" / "hall.mtl").unlink()
    take_in(hall, SSDF, SSDF.dimension("scene"), {}, workspace, instance)
    assert list(_files(workspace.inbox("ssdf_lighting"))) == ["hall.obj"]


def test_two_companions_of_one_name_are_refused_and_leave_nothing(
    workspace: Workspace, instance: dg.DagsterInstance, tmp_path: Path
) -> None:
    for folder in ("a", "b"):
        _scene(tmp_path / folder, "1 0 0")
    hall = _write(tmp_path / "c" / "hall.obj", "mtllib ../a/hall.mtl\nmtllib ../b/hall.mtl\n")
    with pytest.raises(ValueError, match=r"hall\.obj: refers to two files named hall\.mtl"):
        take_in(hall, TOY, TOY.dimension("thing"), {}, workspace, instance)
    assert not workspace.root.exists()


def test_a_folder_of_the_users_keeps_its_key_when_a_file_of_the_name_is_taken_in(
    workspace: Workspace, instance: dg.DagsterInstance, tmp_path: Path
) -> None:
    inbox = workspace.inbox("ssdf_lighting")
    _scene(inbox / "mine", "1 0 0")
    dimension = SSDF.dimension("scene")
    key = take_in(_scene(tmp_path, "0 0 1"), SSDF, dimension, {}, workspace, instance)
    assert key != "hall-obj"
    assert SSDF.source("scene", "hall-obj", inbox).path == inbox / "mine" / "hall.obj"
    key = take_in(_scene(tmp_path, "1 0 0"), SSDF, dimension, {}, workspace, instance)
    assert key == "hall-obj"


@pytest.mark.parametrize("name", [".fur.txt", "~fur.txt", "avenue.part"])
def test_names_that_the_inbox_passes_over_are_refused(
    workspace: Workspace, instance: dg.DagsterInstance, tmp_path: Path, name: str
) -> None:
    folder = name == "avenue.part"
    _write(tmp_path / name / "0.png" if folder else tmp_path / name, "")
    dimension = TOY.dimension("drive" if folder else "thing")
    with pytest.raises(ValueError, match="hidden or unfinished"):
        take_in(tmp_path / name, TOY, dimension, {}, workspace, instance)


def test_a_folder_where_a_file_is_expected_says_so(
    workspace: Workspace, instance: dg.DagsterInstance, tmp_path: Path
) -> None:
    (tmp_path / "fur.txt").mkdir()
    with pytest.raises(ValueError, match=r"fur\.txt: it is a folder; expected one of \.txt, \.obj"):
        take_in(tmp_path / "fur.txt", TOY, TOY.dimension("thing"), {}, workspace, instance)
    path = _write(tmp_path / "avenue.zip")
    with pytest.raises(ValueError, match=r"ending is '\.zip'; expected one of a folder"):
        take_in(path, TOY, TOY.dimension("drive"), {}, workspace, instance)


def test_a_full_disk_is_one_sentence_and_what_was_killed_is_swept(
    workspace: Workspace,
    instance: dg.DagsterInstance,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    left = workspace.inbox("toy") / ".abc.part"
    _write(left / "half.obj")
    os.utime(left, (0, 0))
    path = _write(tmp_path / ("long" * 60 + ".txt"), "a")

    def full(*arguments: Any) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(shutil, "copyfile", full)
        with pytest.raises(ValueError, match="No space left on device"):
            take_in(path, TOY, TOY.dimension("thing"), {}, workspace, instance)
    assert list(workspace.inbox("toy").iterdir()) == []
    # Two contents under the longest name that a disk allows.
    keys = {take_in(path, TOY, TOY.dimension("thing"), {}, workspace, instance)}
    path.write_text("b")
    keys.add(take_in(path, TOY, TOY.dimension("thing"), {}, workspace, instance))
    assert len(keys) == 2


# ---- the sensor ------------------------------------------------------------------------------


class Daemon:
    """What Dagster's daemon does with the sensor: ticks, one after the other."""

    def __init__(
        self, instance: dg.DagsterInstance, workspace: Workspace, *systems: System
    ) -> None:
        @dg.op
        def nothing() -> None:
            """Not run here."""

        @dg.job
        def launch() -> None:
            nothing()

        self.sensor = inbox_sensor(launch, {system.name: system for system in systems}, workspace)
        self.instance, self.workspace, self.cursor = instance, workspace, None

    def tick(self) -> list[str]:
        """One tick; the keys that runs are requested for."""
        context = dg.build_sensor_context(instance=self.instance, cursor=self.cursor)
        result = self.sensor.evaluate_tick(context)
        self.cursor = result.cursor
        for request in result.dynamic_partitions_requests or ():
            if isinstance(request, dg.DeleteDynamicPartitionsRequest):
                for key in request.partition_keys:
                    self.instance.delete_dynamic_partition(request.partitions_def_name, key)
            else:
                self.instance.add_dynamic_partitions(
                    request.partitions_def_name, list(request.partition_keys)
                )
        configs = [run.run_config["ops"]["launch_graph"]["config"] for run in result.run_requests]
        keys = [config["partitions"][0] for config in configs]
        return sorted(key for chosen in keys for key in chosen.values() if key not in BUILTIN)

    def partitions(self, name: str = "toy_thing") -> set[str]:
        """Dynamic partitions, without the built-in ones."""
        return set(self.instance.get_dynamic_partitions(name)) - BUILTIN

    def notes(self, system: str = "toy") -> list[str]:
        """The lines about single items."""
        file = self.workspace.inbox(system) / NOTES
        return file.read_text().splitlines()[2:] if file.exists() else []


BUILTIN = {"ball", "city"}


def _settle(folder: Path, day: int = 1) -> None:
    """Let everything in a folder lie still since a day long ago."""
    for path in (folder, *folder.rglob("*")):
        os.utime(path, (day * 86_400, day * 86_400), follow_symlinks=False)


def _refuse_bad(source: Source, settings: Mapping[str, Any]) -> None:
    assert source.path is not None
    if source.path.is_file() and "bad" in source.path.read_text():
        raise ValueError(f"{source.name}: content is bad; expected something good.")


PICKY = _toy(_refuse_bad)


def test_oddities_of_one_system_stop_neither_it_nor_the_others(
    workspace: Workspace, instance: dg.DagsterInstance, tmp_path: Path
) -> None:
    other = _toy(name="other")
    toy, its = workspace.inbox("toy"), workspace.inbox("other")
    _write(toy / "good.txt")
    _write(its / "good.txt")
    _write(toy / "._x.txt")
    _write(tmp_path / "outside.txt")
    (toy / "dangling.txt").symlink_to("nowhere")
    (toy / "circle.txt").symlink_to("circle.txt")
    (toy / "out.txt").symlink_to(tmp_path / "outside.txt")
    (toy / "alias.txt").symlink_to("good.txt")
    _write(toy / "drive" / "0.png")
    (toy / "drive" / "loop").symlink_to(".")
    os.mkfifo(toy / "pipe.txt")
    _write(toy / "bad\nname \udcff.webp")
    _settle(workspace.root)
    daemon = Daemon(instance, workspace, _toy(), other)
    assert daemon.tick() == ["alias-txt", "good-txt", "good-txt"]
    assert daemon.partitions() == {"alias-txt", "good-txt"}
    assert daemon.partitions("toy_drive") == set()
    notes = daemon.notes()
    assert [line.partition(":")[0] for line in notes] == [
        *("bad?name ?.webp", "circle.txt", "dangling.txt", "drive", "out.txt", "pipe.txt"),
    ]
    assert notes[3].startswith("drive: loop: is a link to .")
    assert daemon.notes("other") == []
    written = (toy / NOTES).stat().st_mtime_ns
    assert daemon.tick() == []
    assert (toy / NOTES).stat().st_mtime_ns == written
    # What is put right is made, and its line goes; then the notes.
    (toy / "drive" / "loop").unlink()
    for name in ("dangling.txt", "circle.txt", "out.txt", "pipe.txt", "bad\nname \udcff.webp"):
        (toy / name).unlink()
    _write(toy / "dangling.txt", "a")
    _settle(toy)
    assert daemon.tick() == ["dangling-txt", "drive-folder"]
    assert not (toy / NOTES).exists()


def test_an_inbox_that_cannot_be_looked_at_stops_no_other_and_forgets_nothing(
    workspace: Workspace, instance: dg.DagsterInstance, monkeypatch: pytest.MonkeyPatch
) -> None:
    toy, other = _toy(), _toy(name="other")
    for name in ("toy", "other"):
        _write(workspace.inbox(name) / "a.txt")
    _settle(workspace.root)
    daemon = Daemon(instance, workspace, toy, other)
    assert daemon.tick() == ["a-txt", "a-txt"]
    _write(workspace.inbox("other") / "b.txt")
    _settle(workspace.inbox("other"))

    def away(inbox: Path) -> Any:
        raise ValueError(f"{inbox}: cannot be read (Stale file handle).")

    with monkeypatch.context() as patch:
        patch.setattr(toy, "found", away)
        assert daemon.tick() == ["b-txt"]
    assert daemon.partitions() == {"a-txt"}
    assert daemon.tick() == []


def test_a_refused_item_has_no_partition_until_it_is_good(
    workspace: Workspace, instance: dg.DagsterInstance
) -> None:
    inbox = workspace.inbox("toy")
    _write(inbox / "fox.txt", "bad")
    _write(inbox / "hen.txt", "good")
    _settle(inbox)
    daemon = Daemon(instance, workspace, PICKY)
    assert daemon.tick() == ["hen-txt"]
    assert daemon.partitions() == {"hen-txt"}
    assert daemon.notes() == ["fox.txt: content is bad; expected something good."]
    assert daemon.tick() == []
    _write(inbox / "fox.txt", "better")
    assert daemon.tick() == []  # still on its way
    _settle(inbox)
    assert daemon.tick() == ["fox-txt"]
    assert daemon.partitions() == {"hen-txt", "fox-txt"}
    assert daemon.notes() == []


def test_what_was_refused_is_looked_at_again_by_another_process_or_with_other_rights(
    workspace: Workspace, instance: dg.DagsterInstance
) -> None:
    inbox = workspace.inbox("toy")
    _write(inbox / "fox.txt", "bad")
    _settle(inbox)
    old = Daemon(instance, workspace, PICKY)
    assert old.tick() == []
    still = Daemon(instance, workspace, PICKY)
    still.cursor = old.cursor
    assert still.tick() == []
    assert still.notes() == ["fox.txt: content is bad; expected something good."]
    new = Daemon(instance, workspace, _toy())  # with a reader that has learnt to read it
    new.cursor = still.cursor
    assert new.tick() == ["fox-txt"]
    assert new.notes() == []
    (inbox / "fox.txt").chmod(0o600)
    assert still.tick() == []
    assert new.tick() == ["fox-txt"]


def test_what_was_refused_and_is_then_registered_by_the_command_line_is_left_to_it(
    workspace: Workspace, instance: dg.DagsterInstance
) -> None:
    """`--set crop=…` may make a photograph usable that is refused as a whole."""
    _write(workspace.inbox("toy") / "fox.txt", "bad")
    _settle(workspace.root)
    daemon = Daemon(instance, workspace, PICKY)
    assert daemon.tick() == []
    instance.add_dynamic_partitions("toy_thing", ["fox-txt"])
    for _ in range(2):
        assert daemon.tick() == []
        assert daemon.partitions() == {"fox-txt"}
        assert daemon.notes() == []


def test_an_item_whose_key_is_taken_by_another_is_made_under_its_new_one(
    workspace: Workspace, instance: dg.DagsterInstance
) -> None:
    inbox = workspace.inbox("toy")
    _scene(inbox / "mine", "1 0 0")
    _settle(inbox)
    daemon = Daemon(instance, workspace, _toy())
    assert daemon.tick() == ["hall-obj"]
    _write(inbox / "hall.obj", "v 0 0 0")
    _settle(inbox)
    made = daemon.tick()
    assert len(made) == 2
    assert set(made) == daemon.partitions()
    assert daemon.tick() == []


def test_a_partition_of_what_became_bad_goes_unless_something_is_stored(
    workspace: Workspace, instance: dg.DagsterInstance
) -> None:
    inbox = workspace.inbox("toy")
    for name in ("stored.txt", "never.txt"):
        _write(inbox / name, "good")
    _settle(inbox)
    daemon = Daemon(instance, workspace, PICKY)
    assert daemon.tick() == ["never-txt", "stored-txt"]
    _store(workspace, PICKY, "stored-txt")
    for name in ("stored.txt", "never.txt"):
        _write(inbox / name, "bad now")
    _settle(inbox)
    assert daemon.tick() == []
    assert daemon.partitions() == {"stored-txt"}
    assert len(daemon.notes()) == 2


def _store(workspace: Workspace, system: System, key: str) -> Slot:
    """A stored version that was made of an item."""
    slot = system.slot("fur_photo", {"thing": key})
    folder = workspace.store.files(slot).version_folder("20240101T000000000000-01234567")
    _write(folder / "zarr.json", "{}")
    return slot


def test_the_partition_of_what_is_gone_goes_unless_something_is_stored(
    workspace: Workspace, instance: dg.DagsterInstance
) -> None:
    inbox = workspace.inbox("toy")
    for name in ("stored.txt", "never.txt"):
        _write(inbox / name, "one")
    _settle(inbox)
    daemon = Daemon(instance, workspace, _toy())
    daemon.tick()
    _store(workspace, TOY, "stored-txt")
    for name in ("stored.txt", "never.txt"):
        (inbox / name).unlink()
    assert daemon.tick() == []
    assert daemon.partitions() == {"stored-txt"}
    # Other content under both names, later: both are made, the command line knows of neither.
    for name in ("stored.txt", "never.txt"):
        _write(inbox / name, "another")
    _settle(inbox)
    assert daemon.tick() == ["never-txt", "stored-txt"]


def test_what_is_removed_and_dropped_again_is_another_request(
    workspace: Workspace, instance: dg.DagsterInstance
) -> None:
    inbox = workspace.inbox("toy")
    daemon = Daemon(instance, workspace, _toy())
    keys = []
    for _ in range(2):
        _write(inbox / "a.txt", "one")
        os.utime(inbox / "a.txt", (1e9, 1e9))
        context = dg.build_sensor_context(instance=instance, cursor=daemon.cursor)
        (request,) = daemon.sensor.evaluate_tick(context).run_requests or ()
        keys.append(request.run_key)
        daemon.tick()
        (inbox / "a.txt").unlink()
        daemon.tick()
    assert keys[0] != keys[1]


def test_an_edited_library_makes_a_scene_again(
    workspace: Workspace, instance: dg.DagsterInstance
) -> None:
    inbox = workspace.inbox("toy")
    _scene(inbox, "1 0 0")
    _scene(inbox / "flat.obj", "1 0 0", "flat.obj")
    _settle(inbox)
    daemon = Daemon(instance, workspace, _toy())
    assert daemon.tick() == ["flat-obj", "hall-obj"]
    assert daemon.partitions("toy_drive") == set()
    assert daemon.tick() == []
    for folder, key in ((inbox, "hall-obj"), (inbox / "flat.obj", "flat-obj")):
        _write(folder / "hall.mtl", "newmtl paint\nKd 0 0 0.5\nmap_Kd tex/wall.png\n")
        assert daemon.tick() == []
        _settle(folder / "hall.mtl", day=2)
        assert daemon.tick() == [key]


def test_what_is_still_on_its_way_is_left_alone(
    workspace: Workspace, instance: dg.DagsterInstance
) -> None:
    inbox = workspace.inbox("toy")
    _write(inbox / "a.txt", "half")
    _write(inbox / "tomorrow.txt")
    _write(inbox / "drive" / "0.png")
    _write(inbox / "no.webp")
    _settle(inbox)
    os.utime(inbox / "tomorrow.txt", (time.time() + 86_400, time.time() + 86_400))
    (inbox / "a.txt").touch()
    _write(inbox / "drive" / "1.png")
    (inbox / "no.webp").touch()
    daemon = Daemon(instance, workspace, _toy())
    assert daemon.tick() == ["tomorrow-txt"]
    assert daemon.notes() == []
    _settle(inbox)
    assert daemon.tick() == ["a-txt", "drive-folder", "tomorrow-txt"]
    assert len(daemon.notes()) == 1


def test_what_changes_or_vanishes_while_it_is_looked_at_is_for_the_next_look(
    workspace: Workspace, instance: dg.DagsterInstance
) -> None:
    inbox = workspace.inbox("toy")

    def meddle(source: Source, settings: Mapping[str, Any]) -> None:
        if source.key == "goes-txt" and source.path:
            source.path.unlink()
            raise ValueError("goes.txt: it is missing.")
        if source.key == "grows-txt" and source.path and source.path.stat().st_size < 5:
            source.path.write_text("more")
            raise ValueError("grows.txt: it ends early.")

    for name in ("goes.txt", "grows.txt", "lies.txt"):
        _write(inbox / name, "a")
    _settle(inbox)
    daemon = Daemon(instance, workspace, _toy(meddle))
    assert daemon.tick() == ["lies-txt"]
    assert daemon.notes() == []
    _write(inbox / "grows.txt", "whole")
    _settle(inbox / "grows.txt")
    assert daemon.tick() == ["grows-txt"]
    assert daemon.partitions() == {"lies-txt", "grows-txt"}


def test_a_check_that_breaks_refuses_its_item_only(
    workspace: Workspace, instance: dg.DagsterInstance
) -> None:
    def broken(source: Source, settings: Mapping[str, Any]) -> None:
        if source.key == "b-txt":
            raise RuntimeError("the decoder\nfell over")

    for name in ("a.txt", "b.txt", "c.txt"):
        _write(workspace.inbox("toy") / name)
    _settle(workspace.root)
    daemon = Daemon(instance, workspace, _toy(broken))
    assert daemon.tick() == ["a-txt", "c-txt"]
    assert daemon.notes() == ["b.txt: it cannot be read (RuntimeError: the decoder?fell over)."]


def test_a_long_check_goes_on_beside_the_ticks(
    workspace: Workspace, instance: dg.DagsterInstance, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inbox_module, "CHECK_SECONDS", 0.2)
    may_end, asked = threading.Event(), []

    def slow(source: Source, settings: Mapping[str, Any]) -> None:
        asked.append(source.key)
        if source.key == "b-txt":
            may_end.wait(30)

    for name in ("a.txt", "b.txt", "c.txt"):
        _write(workspace.inbox("toy") / name)
    _settle(workspace.root)
    daemon = Daemon(instance, workspace, _toy(slow))
    started = time.monotonic()
    assert daemon.tick() == ["a-txt"]
    assert daemon.tick() == []
    assert time.monotonic() - started < 5.0
    may_end.set()
    assert daemon.tick() == ["b-txt", "c-txt"]
    assert asked == ["a-txt", "b-txt", "c-txt"]
    assert daemon.partitions() == {"a-txt", "b-txt", "c-txt"}


def test_a_tick_over_what_lies_still_reads_nothing(
    workspace: Workspace, instance: dg.DagsterInstance, monkeypatch: pytest.MonkeyPatch
) -> None:
    inbox = workspace.inbox("toy")
    _scene(inbox, "1 0 0")
    _write(inbox / "bad.txt", "bad")
    _settle(inbox)
    daemon = Daemon(instance, workspace, PICKY)
    assert daemon.tick() == ["hall-obj"]

    def no_reading(*arguments: Any, **options: Any) -> Any:
        raise AssertionError("a file was read")

    notes = daemon.notes()
    monkeypatch.setattr(Path, "read_bytes", no_reading)
    monkeypatch.setattr(PICKY.dimension("thing").check, "__code__", no_reading.__code__)
    assert daemon.tick() == []
    monkeypatch.undo()
    assert daemon.notes() == notes


def test_the_cursor_of_an_earlier_kind_makes_nothing_again(
    workspace: Workspace, instance: dg.DagsterInstance
) -> None:
    _write(workspace.inbox("toy") / "a.txt")
    _settle(workspace.root)
    instance.add_dynamic_partitions("toy_thing", ["a-txt"])
    daemon = Daemon(instance, workspace, PICKY)
    daemon.cursor = json.dumps({"toy/a.txt": "1:2"})
    assert daemon.tick() == []
    assert daemon.partitions() == {"a-txt"}


def test_a_registration_that_was_lost_is_made_again(
    workspace: Workspace, instance: dg.DagsterInstance
) -> None:
    _write(workspace.inbox("toy") / "a.txt")
    _settle(workspace.root)
    daemon = Daemon(instance, workspace, PICKY)
    daemon.tick()
    instance.delete_dynamic_partition("toy_thing", "a-txt")
    assert daemon.tick() == []
    assert daemon.partitions() == {"a-txt"}
