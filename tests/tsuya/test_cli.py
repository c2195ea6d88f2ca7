"""The command line as a person meets it: output, exit codes, JSON, a killed run."""

from __future__ import annotations

import json
import os
import random
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from PIL import Image

from assets_defs.systems import SYSTEMS
from assets_defs.workspace import Workspace
from storage.schemas import systems
from storage.zarr_files import open_dataset
from tsuya.cli import main
from tsuya.gallery import write_pictures
from tsuya.settings_table import setting_rows


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A Dagster home and a data folder that belong to this module."""
    root = tmp_path_factory.mktemp("home")
    (root / "dagster").mkdir()
    (root / "dagster" / "dagster.yaml").write_text("telemetry: {enabled: false}\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("DAGSTER_HOME", str(root / "dagster"))
        patch.setenv("TSUYA_DATA", str(root / "data"))
        yield root


def tsuya(*arguments: str) -> Result:
    return CliRunner().invoke(main, arguments)


@pytest.fixture(scope="module")
def made(home: Path) -> dict[str, Any]:
    """What one small run says."""
    result = tsuya(
        *("run", "photo_fur", "--photo", "grass", "--mesh", "square"),
        *("--preset", "test", "--json"),
    )
    assert result.exit_code == 0, result.output
    return dict(json.loads(result.stdout.splitlines()[-1]))


def test_a_run_reports_figures_sizes_and_versions(made: dict[str, Any], home: Path) -> None:
    assets = {asset["key"]: asset for asset in made["assets"]}
    assert set(assets) == {
        "photo_fur/fur_photo/grass",
        "photo_fur/attenuation/grass",
        "photo_fur/shell_stack/grass",
        "photo_fur/shell_mesh/square",
        "photo_fur/lie_field/square",
        "photo_fur/fur_patches/square.grass",
        "photo_fur/fur_frames/square.grass",
        "photo_fur/fur_package/square.grass",
    }
    frames = assets["photo_fur/fur_frames/square.grass"]
    assert frames["figures"]["aslant_rmse"] <= 0.005
    folder = Path(tsuya("path", "photo_fur/fur_frames/square.grass").stdout.strip())
    assert folder.name == frames["version"]
    assert frames["bytes"] == sum(p.stat().st_size for p in folder.rglob("*") if p.is_file())
    assert 0 < sum(asset["seconds"] for asset in assets.values()) <= made["seconds"]


def test_what_was_mended_is_said_and_stays_with_the_version(home: Path) -> None:
    egg = Path(__file__).parents[2] / "benchmarks/captures/files/obj_inside_out_closed.obj"
    given = ("run", "photo_fur", "--photo", "grass", "--preset", "test")
    plain = tsuya(*given, "--mesh", str(egg))
    assert plain.exit_code == 0, plain.output
    key = "photo_fur/shell_mesh/obj_inside_out_closed-obj"
    (note,) = (line for line in plain.stdout.splitlines() if line.startswith(f"{key}: "))
    assert "turned over" in note
    said = tsuya(*given, "--mesh", "obj_inside_out_closed-obj", "--json")
    reports = json.loads(said.stdout.splitlines()[-1])["assets"]
    (report,) = (report for report in reports if report["key"] == key)
    assert report["notes"] == [note.removeprefix(f"{key}: ")]
    assert note in tsuya("status").stdout.splitlines()
    assert tsuya("remove", "photo_fur/obj_inside_out_closed-obj", "--yes").exit_code == 0


def test_a_second_run_says_in_a_table_that_all_is_current(made: dict[str, Any]) -> None:
    result = tsuya("run", "photo_fur", "--photo", "grass", "--mesh", "square")
    assert result.exit_code == 0
    assert "0 made, 8 current already" in result.stdout
    assert "aslant_rmse" in result.stdout


def test_the_users_photograph_and_mesh_are_taken_in(
    made: dict[str, Any], home: Path, tmp_path: Path
) -> None:
    noise = np.random.default_rng(5).integers(0, 65536, (70, 90), dtype=np.uint16)
    Image.fromarray(noise).save(tmp_path / "deep.png")
    (tmp_path / "tent.obj").write_text(
        "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 0 0 2\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
    )
    result = tsuya(
        *("run", "photo_fur", "--photo", str(tmp_path / "deep.png")),
        *("--mesh", str(tmp_path / "tent.obj"), "--preset", "test"),
        *("--set", "thickness=0.1", "--set", "layers=6", "--set", "crop=[5, 2, 66, 64]", "--json"),
    )
    assert result.exit_code == 0, result.output
    assets = {a["key"]: a for a in json.loads(result.stdout.splitlines()[-1])["assets"]}
    assert assets["photo_fur/shell_mesh/tent-obj"]["settings"]["thickness"] == 0.1
    store = Workspace(home / "data").store
    slots = {str(slot): slot for slot in store.slots()}
    photo = store.open(slots["photo_fur/fur_photo/deep-png"])
    assert photo.attrs["name"] == "deep.png"
    assert dict(photo.sizes) == {"y": 64, "x": 66, "channel": 3}
    # 16 bits are kept: more luminances than 8 bits can tell apart.
    assert len(np.unique(photo["luminance"].values)) > 1000
    assert store.open(slots["photo_fur/shell_mesh/tent-obj"]).sizes["shell"] == 6


def test_a_mesh_stands_on_its_feet(made: dict[str, Any], home: Path, tmp_path: Path) -> None:
    """GLB has y up, by its standard; other formats are told with `up`."""
    import trimesh

    tower = trimesh.creation.box(extents=(1.0, 4.0, 1.0))
    heights = {}
    for name, more in (("tower.glb", ()), ("lying.ply", ()), ("told.ply", ("--set", "up=y"))):
        tower.export(tmp_path / name)
        result = tsuya(
            *("run", "photo_fur", "--photo", "grass", "--mesh", str(tmp_path / name)),
            *("--preset", "test", *more),
        )
        assert result.exit_code == 0, result.output
        folder = tsuya("path", f"photo_fur/shell_mesh/{name.replace('.', '-')}").stdout.strip()
        skin = open_dataset(Path(folder))["vertices"].values[-1]
        heights[name] = float(np.ptp(skin[:, 2]))
    assert heights == pytest.approx({"tower.glb": 4.0, "lying.ply": 1.0, "told.ply": 4.0})


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--photo", "nobody.png"), "nobody.png"),
        (("--photo", "grass", "--mesh", "square", "--set", "layers=0"), "layers"),
        (("--photo", "new.png", "--mesh", "square", "--set", "layers=1000"), "layers"),
        (("--photo", "new.png", "--mesh", "square", "--set", "crop=[9, 9, 99, 99]"), "crop"),
        (("--photo", "new.png", "--mesh", "square", "--set", "crop=all"), "crop"),
        (("--photo", "grass", "--mesh", "square", "--set", "thickness=-1"), "thickness"),
        (("--photo", "grass", "--mesh", "square", "--set", "colour=red"), "colour"),
        (("--photo", "grass", "--mesh", "square", "--set", "nothing"), "FIELD=VALUE"),
    ],
)
def test_what_cannot_be_used_is_one_sentence_and_exit_code_2(
    made: dict[str, Any], home: Path, tmp_path: Path, arguments: tuple[str, ...], words: str
) -> None:
    path = tmp_path / "new.png"
    noise = np.random.default_rng(6).integers(0, 256, (70, 70), dtype=np.uint8)
    Image.fromarray(noise).save(path)
    before = _files(home / "data")
    result = tsuya("run", "photo_fur", *(str(path) if a == "new.png" else a for a in arguments))
    assert result.exit_code == 2
    assert words in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert _files(home / "data") == before


def test_bad_files_are_refused_and_leave_nothing(
    made: dict[str, Any], home: Path, tmp_path: Path
) -> None:
    (tmp_path / "cut.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    (tmp_path / "points.ply").write_text("ply\nformat ascii 1.0\nelement vertex 0\nend_header\n")
    before = _files(home / "data")
    for option, name in (("--photo", "cut.png"), ("--mesh", "points.ply")):
        result = tsuya("run", "photo_fur", option, str(tmp_path / name))
        assert result.exit_code == 2
        assert name in result.stderr
        assert len(result.stderr.strip().splitlines()) == 1
    assert _files(home / "data") == before


@pytest.mark.slow
def test_a_btf_runs_in_two_columns(home: Path) -> None:
    result = tsuya(
        *("run", "neural_btf", "--material", "silk", "--clusters", "none", "--clusters", "20"),
        *("--preset", "test", "--json"),
    )
    assert result.exit_code == 0, result.output
    assets = {a["key"]: a for a in json.loads(result.stdout.splitlines()[-1])["assets"]}
    by_column = ("abrdf_clusters", "neural_btf", "compressed_btf", "restored_images")
    assert set(assets) == {f"neural_btf/{name}/silk" for name in ("btf_images", "abrdf_matrix")} | {
        f"neural_btf/{name}/{clusters}.silk"
        for name in (*by_column, "cloth_frames", "rate_distortion", "btf_package")
        for clusters in ("none", "20")
    }
    assert 1.0 < assets["neural_btf/restored_images/20.silk"]["figures"]["rmse_over_none"] <= 3.0
    assert "rmse_over_none" not in assets["neural_btf/restored_images/none.silk"]["figures"]
    made = _files(home / "data" / "store" / "neural_btf")
    for clusters in ("007", "0", "-3", "many"):
        result = tsuya("run", "neural_btf", "--material", "silk", f"--clusters={clusters}")
        assert result.exit_code == 2
        assert clusters in result.stderr
        assert "clusters" in result.stderr
        assert len(result.stderr.strip().splitlines()) == 1
    assert _files(home / "data" / "store" / "neural_btf") == made


def test_status_path_and_rollback(made: dict[str, Any], home: Path) -> None:
    assert "photo_fur/attenuation/grass" in tsuya("status").stdout
    before = json.loads(tsuya("status", "--json").stdout)["assets"]
    key = "photo_fur/attenuation/grass"
    version = next(asset["version"] for asset in before if asset["key"] == key)
    small = ("run", "photo_fur", "--photo", "grass", "--mesh", "square")
    assert tsuya(*small, "--set", "layers=7").exit_code == 0
    assert not tsuya("path", key).stdout.strip().endswith(version)
    result = tsuya("rollback", key)
    assert result.stdout.strip() == version
    assert tsuya("path", key).stdout.strip().endswith(version)
    result = tsuya("path", "photo_fur/nothing/grass")
    assert result.exit_code == 2
    result = tsuya("path", "photo_fur/fur_photo/nobody")
    assert result.exit_code == 2
    assert "Materialise" in result.stderr


def test_a_failing_check_is_exit_code_1(
    made: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    from pipelines.photo_fur import photograph

    monkeypatch.setattr(photograph, "expose", lambda radiance, opaque: radiance * 0.02 + 0.5)
    result = tsuya("run", "photo_fur", "--photo", "grass", "--mesh", "square", "--force")
    assert result.exit_code == 1
    assert "contrast" in result.stderr
    assert len(result.stderr.strip().splitlines()[-1]) < 300


def test_the_gallery_writes_a_png_for_every_picture(
    made: dict[str, Any], home: Path, tmp_path: Path
) -> None:
    store = Workspace(home / "data").store
    slots = [slot for slot in store.slots() if slot.partition in ("grass", "square.grass")]
    names = {path.name for path in write_pictures(store, slots, tmp_path)}
    assert names == {
        "fur_photo-grass-photograph.png",
        "attenuation-grass-decay.png",
        "shell_stack-grass-layers.png",
        "fur_patches-square.grass-lie.png",
        "fur_frames-square.grass-frames.png",
    }
    for path in (tmp_path / "photo_fur").iterdir():
        assert Image.open(path).size[0] >= 96


def test_a_run_ends_with_the_pictures_of_what_was_asked(made: dict[str, Any], home: Path) -> None:
    names = {Path(path).name for path in made["pictures"]}
    assert {"fur_photo-grass-photograph.png", "fur_frames-square.grass-frames.png"} <= names
    assert all(Path(path).parent == home / "pictures" / "photo_fur" for path in made["pictures"])
    said = tsuya("run", "photo_fur", "--photo", "grass", "--mesh", "square").stdout
    assert all(name in said for name in names)


def test_pictures_are_written_again_in_each_format(made: dict[str, Any], home: Path) -> None:
    import av
    import OpenEXR

    folder = home / "pictures" / "photo_fur"
    key = "photo_fur/fur_photo/grass"
    assert "fur_photo-grass-photograph.png" in tsuya("pictures", key).stdout
    written = tsuya("pictures", key, "--as", "exr").stdout.splitlines()
    assert len(written) == 2
    stored = open_dataset(Path(tsuya("path", key).stdout.strip()))["radiance"].values
    with OpenEXR.File(str(folder / "fur_photo-grass-radiance.exr")) as file:
        np.testing.assert_allclose(file.channels()["RGB"].pixels, stored, atol=1e-3)
    key = "photo_fur/fur_frames/square.grass"
    frames = open_dataset(Path(tsuya("path", key).stdout.strip()))["frames"].values
    assert tsuya("pictures", key, "--as", "mp4").exit_code == 0
    with av.open(str(folder / "fur_frames-square.grass-frames.mp4")) as film:
        shown = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
    assert len(shown) == len(frames)
    off = np.abs(np.stack(shown).astype(int) - frames[:, : shown[0].shape[0], : shown[0].shape[1]])
    assert off.mean() < 6  # colours at half the width: 4:2:0
    assert tsuya("pictures", key, "--as", "webp").exit_code == 0
    assert Image.open(folder / "fur_frames-square.grass-frames.webp").n_frames == len(frames)
    still = tsuya("pictures", "photo_fur/attenuation/grass", "--as", "mp4")
    assert still.exit_code == 2
    assert "no moving pictures" in still.stderr


def test_settings_are_explained(home: Path) -> None:
    table = tsuya("settings", "photo_fur").stdout
    for words in ("largest_side", "whole number, 64 to 8192", "1024", "Longer side in pixels"):
        assert words in table
    helped = " ".join(tsuya("run", "photo_fur", "--help").stdout.split())
    assert "layers whole number, 1 to 250 Layers of shells, N (default 15)" in helped
    assert tsuya("settings", "nothing").exit_code == 2


@pytest.mark.parametrize("system", systems())
def test_every_setting_has_a_meaning_and_a_kind(system: str) -> None:
    for row in setting_rows(SYSTEMS[system]):
        assert row.meaning, row
        assert not re.search(r"typing|<class|Annotated|NoneType", row.values), row


def test_the_shell_completes_systems_items_and_settings(home: Path) -> None:
    def completed(words: str) -> set[str]:
        environment = {
            "COMP_WORDS": words,
            "COMP_CWORD": str(len(words.split(" ")) - 1),
            "_TSUYA_COMPLETE": "bash_complete",
        }
        result = CliRunner().invoke(main, env=environment, prog_name="tsuya")
        return {line.partition(",")[2] for line in result.stdout.splitlines()}

    assert "photo_fur" in completed("tsuya run ph")
    assert {"sphere", "square"} <= completed("tsuya run photo_fur --mesh s")
    assert "largest_side=" in completed("tsuya run photo_fur --set lar")
    assert "complete -o nosort -F _tsuya_completion tsuya" in tsuya("completion", "bash").stdout


def test_a_damaged_version_is_found_told_and_made_again(made: dict[str, Any], home: Path) -> None:
    small = ("run", "photo_fur", "--photo", "grass", "--mesh", "square", "--preset", "test")
    assert tsuya(*small).exit_code == 0
    assert tsuya("verify").exit_code == 0
    for key, part in (
        ("photo_fur/fur_photo/grass", "radiance/c/0/0/0"),
        ("photo_fur/attenuation/grass", "zarr.json"),
        ("photo_fur/shell_mesh/square", "vertices/zarr.json"),
    ):
        folder = Path(tsuya("path", key).stdout.strip())
        content = open_dataset(folder).attrs["tsuya"]["content"]
        data = bytearray((folder / part).read_bytes())
        data[len(data) // 2] ^= 4
        (folder / part).write_bytes(data)
        if part != "radiance/c/0/0/0":
            assert "damaged" in tsuya("status").stdout or part != "zarr.json"
            found = tsuya("verify", key)
            assert found.exit_code == 1
            assert part in found.stdout
        # Whether it was looked for or not: the next launch makes it again.
        result = tsuya(*small, *(("--force",) if part == "radiance/c/0/0/0" else ()))
        assert result.exit_code == 0, result.output
        again = Path(tsuya("path", key).stdout.strip())
        assert again != folder
        assert open_dataset(again).attrs["tsuya"]["content"] == content
    assert tsuya("verify").exit_code == 0


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda home: home / "nowhere", "expected a folder"),
        (lambda home: Path("dagster"), "expected an absolute path"),
        (lambda home: _with(home, "dagster.yaml", b"concurrency: [unclosed"), "dagster.yaml"),
        (lambda home: _with(home, "dagster.yaml", b"no_such_field: 1"), "dagster.yaml"),
        (lambda home: _with(home, "history/runs.db", b"not a database " * 99), "history"),
    ],
    ids=["missing", "relative", "broken yaml", "unknown field", "broken history"],
)
def test_what_is_wrong_with_dagsters_home_is_one_sentence(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    damage: Callable[[Path], Path],
    words: str,
) -> None:
    monkeypatch.setenv("DAGSTER_HOME", str(damage(tmp_path)))
    monkeypatch.setenv("TSUYA_DATA", str(tmp_path / "data"))
    result = tsuya("run", "photo_fur", "--photo", "grass", "--mesh", "square", "--preset", "test")
    assert result.exit_code == 2, result.output
    assert words in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def _with(home: Path, name: str, data: bytes) -> Path:
    (home / name).parent.mkdir(parents=True, exist_ok=True)
    (home / name).write_bytes(data)
    return home


def test_the_doctor_finds_this_machine_well_and_draws(
    home: Path,
) -> None:
    result = tsuya("doctor")
    assert result.exit_code == 0, result.stdout
    assert all(line.startswith("ok") for line in result.stdout.splitlines())
    assert Image.open(home / "pictures" / "doctor.png").size == (320, 240)


def test_a_checkout_that_is_not_set_up_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("assets_defs.workspace.CHECKOUT", tmp_path)
    monkeypatch.delenv("DAGSTER_HOME", raising=False)
    result = tsuya("run", "photo_fur")
    assert result.exit_code == 2
    assert "make setup" in result.stderr


def test_a_run_killed_at_any_time_loses_nothing(made: dict[str, Any], home: Path) -> None:
    """`kill -9` while all is made again in another size; then all is still there, and goes on."""
    workspace = Workspace(home / "data")
    store = workspace.store
    slots = [
        slot for slot in store.slots() if slot.partition in ("grass", "square", "square.grass")
    ]
    command = [str(Path(sys.executable).parent / "tsuya"), "run", "photo_fur"]
    command += ["--photo", "grass", "--mesh", "square", "--force"]
    chance = random.Random(3)
    for number in range(2):  # `python -m benchmarks faults` kills forty
        before = {slot: store.current(slot) for slot in slots}
        command_now = [*command, "--set", f"largest_side={100 + number}"]
        process = subprocess.Popen(
            command_now, env=os.environ, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        time.sleep(chance.uniform(1.5, 6.0))
        process.send_signal(signal.SIGKILL)
        process.wait()
        for slot in slots:
            current = store.current(slot)
            assert current >= before[slot]
            store.open(slot).load()
            record = store.record(slot)
            verdicts = store.verdicts(slot, current)
            assert all(verdicts[check]["passed"] for check in record["checks"])
    result = tsuya("run", "photo_fur", "--photo", "grass", "--mesh", "square", "--preset", "test")
    assert result.exit_code == 0
    widths = {store.open(slot).sizes["x"] for slot in slots if slot.asset == "fur_photo"}
    assert widths == {128}


def _files(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name != "lock"
    }
