"""What lies in an inbox: which items there are, their keys, their contents, what is odd."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import socket
from pathlib import Path

import pytest

from assets_defs.sources import NOTES, Found, Source, by_key, look_into

ENDINGS = {"photo": (".png", ".jpg"), "mesh": (".obj", ".ply")}


def _write(path: Path, text: str = "") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def _look(inbox: Path, *folders: str) -> Found:
    return look_into(inbox, ENDINGS | dict.fromkeys(folders, ()), folders)


def _keys(found: Found, dimension: str, inbox: Path) -> dict[str, str]:
    sources = by_key(found.items[dimension]).items()
    return {key: str(source.path and source.path.relative_to(inbox)) for key, source in sources}


def _scene(folder: Path, name: str = "hall.obj") -> Path:
    """An OBJ with its library and a texture."""
    _write(folder / "hall.mtl", "newmtl paint\nmap_Kd tex/wall.png\n")
    _write(folder / "tex" / "wall.png", "picture")
    return _write(folder / name, "mtllib hall.mtl\nv 0 0 0\n")


# ---- items and keys --------------------------------------------------------------------------


def test_files_are_items_and_hidden_or_unfinished_ones_are_passed_over(tmp_path: Path) -> None:
    for name in ("fur.png", "Fell.JPG", "thing.ply"):
        _write(tmp_path / name)
    for name in ("._fur.png", ".fur.png", "~$fur.png", "fur.png.part", "fur.png.crdownload"):
        _write(tmp_path / name)
    for name in ("fur.png~", NOTES):
        _write(tmp_path / name)
    (tmp_path / "copy.tmp").mkdir()
    found = _look(tmp_path)
    assert [path.name for path in found.items["photo"]] == ["Fell.JPG", "fur.png"]
    assert [path.name for path in found.items["mesh"]] == ["thing.ply"]
    assert found.oddities == {}
    assert _look(tmp_path / "nowhere") == Found({"photo": [], "mesh": []})


def test_names_that_differ_anyhow_have_keys_that_differ_for_any_disk(tmp_path: Path) -> None:
    names = ["fur.png", "Fur.png", "FUR.png", "fur.PNG", "fur.jpg", "f u r.png", "f_u r.png"]
    names += ["fur\n.png", "für.png", "fu\u0308r.png", "fur.a.png", "fur-a.png", "x" * 200 + ".png"]
    for name in names:
        _write(tmp_path / name)
    keys = _keys(_look(tmp_path), "photo", tmp_path)
    assert len({key.casefold() for key in keys}) == len(names)
    assert all(re.fullmatch(r"[a-z0-9_-]{1,64}", key) for key in keys)
    assert keys["fur-png"] == "fur.png"


@pytest.mark.parametrize("folder", ["hall.obj", "hall", "anything"])
def test_a_folder_with_one_file_and_its_companions_is_this_file(
    tmp_path: Path, folder: str
) -> None:
    _scene(tmp_path / folder)
    _write(tmp_path / folder / ".DS_Store")
    # A texture beside the scene is its companion, not a photograph.
    _write(tmp_path / folder / "hall.mtl", "newmtl paint\nmap_Kd wall.png\n")
    _write(tmp_path / folder / "wall.png")
    for dimensions in ((), ("drive",)):
        found = _look(tmp_path, *dimensions)
        assert found.oddities == {}
        assert _keys(found, "mesh", tmp_path) == {"hall-obj": f"{folder}/hall.obj"}
        assert found.items["photo"] == []
        assert all(found.items[name] == [] for name in dimensions)


def test_a_folder_of_the_files_own_name_is_this_file_whatever_else_is_in_it(tmp_path: Path) -> None:
    _scene(tmp_path / "hall.obj")
    _write(tmp_path / "hall.obj" / "other.obj")
    assert _keys(_look(tmp_path), "mesh", tmp_path) == {"hall-obj": "hall.obj/hall.obj"}


def test_other_folders_are_items_where_there_are_such_and_odd_elsewhere(tmp_path: Path) -> None:
    _write(tmp_path / "avenue.v2" / "transforms.json")
    _write(tmp_path / "two" / "a.obj")
    _write(tmp_path / "two" / "b.obj")
    found = _look(tmp_path, "drive")
    assert [path.name for path in found.items["drive"]] == ["avenue.v2", "two"]
    assert Source.of(tmp_path / "avenue.v2").key.startswith("avenue-v2-folder-")
    found = _look(tmp_path)
    assert set(found.oddities) == {"avenue.v2", "two"}
    assert "a.obj, b.obj" in found.oddities["two"]
    assert "one file (.png, .jpg, .obj, .ply)" in found.oddities["avenue.v2"]


def test_files_of_one_name_in_different_folders_have_different_keys(tmp_path: Path) -> None:
    for folder in ("a", "b", "hall.obj"):
        _scene(tmp_path / folder)
    keys = _keys(_look(tmp_path), "mesh", tmp_path)
    assert keys["hall-obj"] == "hall.obj/hall.obj"
    assert sorted(keys.values()) == ["a/hall.obj", "b/hall.obj", "hall.obj/hall.obj"]
    shutil.rmtree(tmp_path / "hall.obj")
    _write(tmp_path / "hall.obj")
    again = _keys(_look(tmp_path), "mesh", tmp_path)
    assert {key for key in again if key != "hall-obj"} == set(keys) - {"hall-obj"}
    assert again["hall-obj"] == "hall.obj"


def test_what_a_scene_refers_to_is_no_oddity_and_no_item(tmp_path: Path) -> None:
    _scene(tmp_path)
    found = _look(tmp_path)
    assert found.oddities == {}
    assert found.items["photo"] == []
    (tmp_path / "hall.obj").unlink()
    assert set(_look(tmp_path).oddities) == {"hall.mtl"}


def test_oddities_are_told_alone_and_stop_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    inbox = tmp_path / "inbox"
    _write(inbox / "fur.png")
    _write(tmp_path / "outside.png")
    (inbox / "away.png").symlink_to("nowhere.png")
    (inbox / "out.png").symlink_to(tmp_path / "outside.png")
    (inbox / "circle.png").symlink_to("circle2.png")
    (inbox / "circle2.png").symlink_to("circle.png")
    (inbox / "alias.png").symlink_to("fur.png")
    _write(inbox / "read me")
    _write(inbox / "fur.webp")
    os.mkfifo(inbox / "pipe.png")
    monkeypatch.chdir(inbox)
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind("socket.png")
        found = _look(inbox)
    assert [path.name for path in found.items["photo"]] == ["alias.png", "fur.png"]
    assert found.oddities.keys() == {
        *("away.png", "out.png", "circle.png", "circle2.png", "pipe.png", "socket.png"),
        *("read me", "fur.webp"),
    }
    for name, sentence in found.oddities.items():
        assert sentence.startswith(f"{name}: ")
        assert "expected" in sentence
    assert "link to nowhere.png" in found.oddities["away.png"]
    assert str(tmp_path / "outside.png") in found.oddities["out.png"]
    assert ".webp; expected one of .png, .jpg, .obj, .ply" in found.oddities["fur.webp"]


def test_a_licence_beside_a_model_is_no_item_where_text_files_are(tmp_path: Path) -> None:
    endings = {"setting": (".csv", ".txt"), "object": (".obj",)}
    _write(tmp_path / "vase" / "licence.txt", "free")
    _write(tmp_path / "vase" / "vase.obj", "v 0 0 0\n")
    _write(tmp_path / "groove" / "groove.txt", "0 0\n")
    found = look_into(tmp_path, endings, ())
    assert found.items["object"] == [tmp_path / "vase" / "vase.obj"]
    assert found.items["setting"] == [tmp_path / "groove" / "groove.txt"]
    assert not found.oddities


def test_an_inbox_that_is_itself_a_link_holds_its_items(tmp_path: Path) -> None:
    _write(tmp_path / "big disk" / "fur.png")
    (tmp_path / "big disk" / "alias.png").symlink_to(tmp_path / "big disk" / "fur.png")
    (tmp_path / "inbox").symlink_to("big disk")
    found = _look(tmp_path / "inbox")
    assert len(found.items["photo"]) == 2
    assert found.oddities == {}


# ---- contents and fingerprints ---------------------------------------------------------------


def test_a_plain_files_fingerprint_is_the_hash_of_its_bytes(tmp_path: Path) -> None:
    path = _write(tmp_path / "fur.png", "fur")
    assert Source.of(path).fingerprint == hashlib.sha256(b"fur").hexdigest()
    assert Source("grass", None).fingerprint == "built-in:grass"


def test_companions_count_and_a_copy_with_them_has_the_same_fingerprint(tmp_path: Path) -> None:
    scene = Source.of(_scene(tmp_path / "a"))
    assert [name for name, _ in scene.contents()] == ["", "hall.mtl", "tex/wall.png"]
    shutil.copytree(tmp_path / "a", tmp_path / "b")
    (tmp_path / "b" / "hall.obj").rename(tmp_path / "b" / "hall-12345678.obj")
    assert Source.of(tmp_path / "b" / "hall-12345678.obj").fingerprint == scene.fingerprint
    before = scene.fingerprint
    for name in ("hall.mtl", "tex/wall.png"):
        path = tmp_path / "a" / name
        text = path.read_text()
        path.write_text(text + " ")
        assert scene.fingerprint != before
        path.write_text(text)
        assert scene.fingerprint == before


def test_a_folder_with_links_has_the_fingerprint_of_its_copy(tmp_path: Path) -> None:
    _write(tmp_path / "elsewhere" / "deep" / "1.png", "one")
    _write(tmp_path / "drive" / "0.png", "zero")
    (tmp_path / "drive" / "more").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "drive" / "same.png").symlink_to("0.png")
    (tmp_path / "drive" / "more too").symlink_to("more")
    (tmp_path / "link").symlink_to("drive")
    shutil.copytree(tmp_path / "drive", tmp_path / "copy")
    names = [name for name, _ in Source.of(tmp_path / "link").contents()]
    assert names == ["0.png", "more/deep/1.png", "more too/deep/1.png", "same.png"]
    prints = {Source.of(tmp_path / name).fingerprint for name in ("drive", "copy", "link")}
    assert len(prints) == 1


@pytest.mark.parametrize(
    ("target", "words"),
    [
        ("nowhere", "link to nowhere, which leads nowhere"),
        ("loop", "link to loop, which leads nowhere"),
        (".", "a folder that it lies in itself"),
        ("../..", "a folder that it lies in itself"),
        ("../beside", "a folder that it lies in itself"),
    ],
)
def test_links_to_nowhere_and_circles_are_refused(tmp_path: Path, target: str, words: str) -> None:
    _write(tmp_path / "drive" / "below" / "0.png")
    (tmp_path / "drive" / "below" / "loop").symlink_to(target)
    (tmp_path / "drive" / "beside").mkdir()
    (tmp_path / "drive" / "beside" / "back").symlink_to("../below")
    with pytest.raises(ValueError, match=r"loop|back") as refusal:
        Source.of(tmp_path / "drive").contents()
    assert words in str(refusal.value)
    with pytest.raises(ValueError, match="link"):
        _ = Source.of(tmp_path / "drive").fingerprint


def test_links_out_of_the_inbox_are_refused_below_it_too(tmp_path: Path) -> None:
    inbox = tmp_path / "inbox"
    _write(tmp_path / "secret.png")
    _write(inbox / "drive" / "0.png")
    (inbox / "drive" / "1.png").symlink_to("0.png")
    source = Source.of(inbox / "drive")
    assert len(source.contents(inbox)) == 2
    (inbox / "drive" / "2.png").symlink_to(tmp_path / "secret.png")
    with pytest.raises(ValueError, match=r"2\.png: is a link to .*outside"):
        source.contents(inbox)
    assert len(source.contents()) == 3


def test_what_is_neither_file_nor_folder_is_refused(tmp_path: Path) -> None:
    _write(tmp_path / "drive" / "0.png")
    os.mkfifo(tmp_path / "drive" / "pipe")
    with pytest.raises(ValueError, match="pipe: is neither a file nor a folder"):
        Source.of(tmp_path / "drive").contents()
