"""`tsuya remove`: what goes, what stays, and what a kill in between leaves."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import dagster as dg
import pytest
from click.testing import CliRunner, Result

from assets_defs.workspace import Workspace
from storage.versions import Slot
from tsuya import remove as remove_module
from tsuya.cli import main
from tsuya.remove import find

VERSION = "20240101T000000000000-01234567"
FUR = ("fur_photo", "attenuation", "shell_stack")


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two photographs and a mesh of the user's, all made, and a built-in photograph."""
    (tmp_path / "dagster").mkdir()
    (tmp_path / "dagster" / "dagster.yaml").write_text("telemetry: {enabled: false}\n")
    monkeypatch.setenv("DAGSTER_HOME", str(tmp_path / "dagster"))
    monkeypatch.setenv("TSUYA_DATA", str(tmp_path / "data"))
    inbox = tmp_path / "data" / "inbox" / "photo_fur"
    for name in ("fox.jpg", "hen.jpg", "tent.obj/tent.obj", "tent.obj/tent.mtl"):
        path = inbox / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(name)
    for photo in ("fox-jpg", "hen-jpg", "grass"):
        for asset in FUR:
            _store(tmp_path, asset, photo)
        _store(tmp_path, "fur_frames", f"teapot.{photo}")
    _store(tmp_path, "shell_mesh", "tent-obj")
    _store(tmp_path, "fur_frames", "tent-obj.fox-jpg")
    with dg.DagsterInstance.get() as instance:
        instance.add_dynamic_partitions("photo_fur_photo", ["fox-jpg", "hen-jpg", "grass"])
        instance.add_dynamic_partitions("photo_fur_mesh", ["tent-obj", "teapot"])
    return tmp_path


def _store(home: Path, asset: str, partition: str) -> None:
    files = Workspace(home / "data").store.files(Slot("photo_fur", asset, partition))
    folder = files.version_folder(VERSION)
    folder.mkdir(parents=True)
    (folder / "zarr.json").write_text("{}")


def _remove(*arguments: str, answer: str = "") -> Result:
    return CliRunner().invoke(main, ["remove", *arguments], input=answer)


def _lies(home: Path) -> set[str]:
    """Slots and files of the inbox, but for what is out of it and not deleted yet."""
    slots = {str(slot) for slot in Workspace(home / "data").store.slots()}
    inbox = home / "data" / "inbox"
    return slots | {str(p.relative_to(inbox)) for p in inbox.rglob("[!.]*") if p.is_file()}


def _partitions() -> set[str]:
    with dg.DagsterInstance.get() as instance:
        names = ("photo_fur_photo", "photo_fur_mesh")
        return {key for name in names for key in instance.get_dynamic_partitions(name)}


FOX = {
    "photo_fur/fox.jpg",
    *(f"photo_fur/{asset}/fox-jpg" for asset in FUR),
    "photo_fur/fur_frames/teapot.fox-jpg",
    "photo_fur/fur_frames/tent-obj.fox-jpg",
}


def test_an_item_goes_with_all_that_was_made_of_it_and_nothing_else(home: Path) -> None:
    before, partitions = _lies(home), _partitions()
    said = _remove("photo_fur/fox-jpg", answer="n\n")
    assert said.exit_code == 0
    assert "Nothing was removed" in said.stdout
    assert _lies(home) == before
    listed = said.stdout.splitlines()[1:-2]
    assert len(listed) == len(FOX) + 1
    assert all(any(name in line for line in listed) for name in FOX)
    assert _partitions() == partitions
    said = _remove("photo_fur/fox-jpg", answer="y\n")
    assert said.exit_code == 0, said.output
    assert _lies(home) == before - FOX
    assert _partitions() == partitions - {"fox-jpg"}
    # Nothing is left behind, hidden or not.
    left = {path.name for path in (home / "data").rglob("*")}
    assert not any("fox" in name or name.startswith(".") for name in left)
    again = _remove("photo_fur/fox-jpg", "--yes")
    assert again.exit_code == 2
    assert "no such item of yours; expected one of hen-jpg, tent-obj" in again.stderr


def test_a_mesh_goes_with_its_folder_and_the_frames_of_it(home: Path) -> None:
    before = _lies(home)
    assert _remove("photo_fur/tent-obj", "--yes").exit_code == 0
    gone = {f"photo_fur/tent.obj/tent.{ending}" for ending in ("obj", "mtl")}
    gone |= {"photo_fur/shell_mesh/tent-obj", "photo_fur/fur_frames/tent-obj.fox-jpg"}
    assert _lies(home) == before - gone
    assert not (home / "data" / "inbox" / "photo_fur" / "tent.obj").exists()


def test_a_built_in_item_stays_and_its_versions_go(home: Path) -> None:
    before, partitions = _lies(home), _partitions()
    said = _remove("photo_fur/grass", "--yes")
    assert "grass itself is built in and stays" in said.stdout
    assert _lies(home) == before - {
        "photo_fur/fur_frames/teapot.grass",
        *(f"photo_fur/{asset}/grass" for asset in FUR),
    }
    assert _partitions() == partitions
    said = _remove("photo_fur/grass", "--yes")
    assert said.exit_code == 2
    assert "built in, and nothing of it is stored" in said.stderr


@pytest.mark.parametrize("key", ["fox-jpg", "photo_fur", "nothing/fox", "photo_fur/fur_photo/fox"])
def test_a_key_that_names_no_item_says_what_it_expects(home: Path, key: str) -> None:
    before = _lies(home)
    said = _remove(key, "--yes")
    assert said.exit_code == 2
    assert "expected SYSTEM/ITEM with one of" in said.stderr
    assert _lies(home) == before


def test_no_answer_removes_nothing(home: Path) -> None:
    before = _lies(home)
    assert _remove("photo_fur/fox-jpg").exit_code == 1
    assert _lies(home) == before


def test_a_link_goes_and_what_it_points_to_stays(home: Path) -> None:
    inbox = home / "data" / "inbox" / "photo_fur"
    (inbox / "alias.jpg").symlink_to("fox.jpg")
    before = _lies(home)
    assert _remove("photo_fur/alias-jpg", "--yes").exit_code == 0
    assert _lies(home) == before - {"photo_fur/alias.jpg"}


class _KilledError(BaseException):
    """The process ends here."""


@pytest.mark.parametrize("survived", [0, 1, 4, 6, 7])
def test_a_killed_removal_is_gone_on_with(
    home: Path, monkeypatch: pytest.MonkeyPatch, survived: int
) -> None:
    """Killed before one of its steps: a rename for the file and each slot, the partition, the
    deletions."""
    before, partitions = _lies(home), _partitions()
    steps = []

    def dying(step: Any) -> Any:
        def wrapped(*arguments: Any, **options: Any) -> Any:
            if len(steps) >= survived:
                raise _KilledError
            steps.append(step)
            return step(*arguments, **options)

        return wrapped

    with monkeypatch.context() as patch:
        patch.setattr(remove_module.os, "rename", dying(os.rename))
        patch.setattr(remove_module.shutil, "rmtree", dying(remove_module.shutil.rmtree))
        deletion = dying(dg.DagsterInstance.delete_dynamic_partition)
        patch.setattr(dg.DagsterInstance, "delete_dynamic_partition", deletion)
        with pytest.raises(_KilledError):
            CliRunner().invoke(main, ["remove", "photo_fur/fox-jpg", "--yes"])
    left = _lies(home)
    # Nothing of others was touched, and nothing is half there.
    assert before - FOX <= left <= before
    if survived:
        assert "photo_fur/fox.jpg" not in left
    # While anything is left, the same command finds it.
    if left & FOX or "fox-jpg" in _partitions():
        assert _remove("photo_fur/fox-jpg", "--yes").exit_code == 0
    else:
        assert _remove("photo_fur/hen-jpg", "--yes").exit_code == 0
    assert "fox-jpg" not in _partitions()
    assert not _lies(home) & FOX
    assert not list((home / "data" / "store").rglob(".removed-*"))
    assert partitions - _partitions() <= {"fox-jpg", "hen-jpg"}


def test_what_a_killed_first_run_left_goes_too(home: Path) -> None:
    workspace = Workspace(home / "data")
    work = workspace.store.root / "photo_fur" / "shell_stack" / "teal-jpg" / "work"
    work.mkdir(parents=True)
    (workspace.store.root / "photo_fur" / "fur_photo" / "Neuer Ordner").mkdir()
    with dg.DagsterInstance.get() as instance:
        assert [slot.asset for slot in find("photo_fur/teal-jpg", workspace, instance).slots] == [
            "shell_stack"
        ]
    assert _remove("photo_fur/teal-jpg", "--yes").exit_code == 0
    assert not work.parent.exists()
