"""nuScenes' tables: `v1.0-mini` and its like, beside the pictures in `samples` and `sweeps`.

After the published schema, https://github.com/nutonomy/nuscenes-devkit/blob/master/docs. All
pictures of one scene are read, keyframes and what lies between them; the world is the map's, in
metres, z up.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput, shortened
from storage.readers.drives.json_fields import (
    json_matrix,
    json_number,
    json_text,
    json_vector,
    required,
)
from storage.readers.drives.json_rows import json_rows
from storage.readers.drives.motions import place, quaternion_rotation, rigid
from storage.readers.drives.recordings import (
    Frame,
    Recording,
    check_count,
    check_lens,
    counted,
    file_inside,
    pinhole_lens,
    shown_number,
)

_TABLES = ("scene", "sample", "sample_data", "calibrated_sensor", "ego_pose", "sensor")
_SPREAD = 0.6
"""Of a step: the cameras of one sweep are released as the laser's beam passes them."""
_MOST_ROWS = 2_000_000
"""Of tables that are kept whole."""

_Row = dict[str, Any]


def find_nuscenes(path: Path) -> Path | None:
    """The folder of tables in a data set's folder."""
    if not path.is_dir():
        return None
    inside = sorted(name for name in os.listdir(path) if name.startswith("v1."))[:20]
    for folder in (path / name for name in inside):
        if all((folder / f"{table}.json").is_file() for table in _TABLES):
            return folder
    return None


def read_nuscenes(tables: Path, root: Path) -> Recording:
    """The scene of which most pictures are there, the longest of equal ones.

    Raises BadInput for tables that are missing, broken or refer to rows that are not there, for
    rotations and lenses that cannot be any, and for paths that leave the data set's folder.
    """
    cameras = _cameras(tables)
    scene_of = {
        _text(tables, "sample", row, "token"): _text(tables, "sample", row, "scene_token")
        for row in _rows(tables, "sample")
    }
    scenes = {_text(tables, "scene", row, "token"): row for row in _rows(tables, "scene")}
    if not scenes:
        raise BadInput(tables / "scene.json", "number of scenes", "0", "at least one scene")
    counts = _pictures_there(tables, root, set(cameras), scene_of)
    chosen = max(scenes, key=lambda token: (counts[token], _samples(tables, scenes[token])))
    rows = [
        row
        for row in _camera_rows(tables, set(cameras))
        if scene_of.get(row.get("sample_token", "")) == chosen
    ]
    check_count(tables / "sample_data.json", len(rows))
    poses = _ego_poses(tables, {row["ego_pose_token"] for row in rows})
    frames = [_frame(tables, root, row, cameras, poses) for row in rows]
    notes = ["The world is nuScenes' map: metres, z up."]
    if len(scenes) > 1:
        name = shortened(str(scenes[chosen].get("name", chosen)), 40)
        others = counted(len(scenes) - 1, "other scene")
        notes.insert(0, f"{name} is read, which has most pictures; {others} not.")
    return Recording(
        tables / "scene.json",
        frames,
        metric=True,
        up_known=True,
        notes=tuple(notes),
        spread=_SPREAD,
    )


def _frame(
    tables: Path,
    folder: Path,
    row: _Row,
    cameras: dict[str, tuple[str, NDArray[np.float64], NDArray[np.float64]]],
    poses: dict[str, NDArray[np.float64]],
) -> Frame:
    file, field = tables / "sample_data.json", f"picture {row['filename']}"
    channel, k, mounted = cameras[row["calibrated_sensor_token"]]
    if row["ego_pose_token"] not in poses:
        expected = f"a row of ego_pose.json with the token {shortened(row['ego_pose_token'], 40)}"
        raise BadInput(file, f"pose of {field}", "missing", expected)
    width, height = (json_number(file, key, row.get(key)) for key in ("width", "height"))
    for key, side in (("width", width), ("height", height)):
        if side != int(side):
            raise BadInput(file, f"{key} of {field}", shown_number(side), "whole pixels")
    lens = pinhole_lens(k, int(width), int(height))
    check_lens(tables / "calibrated_sensor.json", lens, lambda key: f"{key} of {channel}")
    time = json_number(file, "timestamp", row.get("timestamp")) * 1e-6
    photograph = file_inside(file, folder, row["filename"], "filename")
    return Frame(channel, time, photograph, poses[row["ego_pose_token"]] @ mounted, lens)


def _cameras(
    tables: Path,
) -> dict[str, tuple[str, NDArray[np.float64], NDArray[np.float64]]]:
    """Channel, K and camera to car of each calibration of a camera, by token."""
    channels = {
        _text(tables, "sensor", row, "token"): _text(tables, "sensor", row, "channel")
        for row in _rows(tables, "sensor")
        if row.get("modality") == "camera"
    }
    file = tables / "calibrated_sensor.json"
    found = {}
    for row in _rows(tables, "calibrated_sensor"):
        if _text(tables, "calibrated_sensor", row, "sensor_token") not in channels:
            continue
        token = _text(tables, "calibrated_sensor", row, "token")
        field = f"calibration {shortened(token, 40)}"
        rows = required(file, [(f"{field} ", row)], "camera_intrinsic", "3 rows of 3 numbers")
        k = json_matrix(file, f"{field} camera_intrinsic", rows, ((3, 3),))
        found[token] = channels[row["sensor_token"]], k, _motion(file, field, row)
    if not found:
        raise BadInput(file, "number of cameras", "0", "calibrations of cameras")
    return found


def _ego_poses(tables: Path, wanted: set[str]) -> dict[str, NDArray[np.float64]]:
    file = tables / "ego_pose.json"
    return {
        row["token"]: _motion(file, f"pose {shortened(row['token'], 40)}", row)
        for row in json_rows(file)
        if isinstance(row.get("token"), str) and row["token"] in wanted
    }


def _motion(file: Path, field: str, row: _Row) -> NDArray[np.float64]:
    """(4, 4) of a row's rotation (w, x, y, z) and translation."""
    where = json_vector(file, f"{field} translation", row.get("translation"), 3)
    quaternion = json_vector(file, f"{field} rotation", row.get("rotation"), 4)
    turn = quaternion_rotation(file, f"{field} rotation", quaternion)
    return rigid(turn, place(file, f"{field} translation", where))


def _pictures_there(
    tables: Path, folder: Path, cameras: set[str], scene_of: dict[str, str]
) -> Counter[str]:
    """How many keyframes' pictures of each scene are there."""
    found: Counter[str] = Counter()
    for row in _camera_rows(tables, cameras):
        scene = scene_of.get(row.get("sample_token", ""))
        if scene and row.get("is_key_frame") and os.path.exists(folder / row["filename"]):
            found[scene] += 1
    return found


def _camera_rows(tables: Path, cameras: set[str]) -> Iterator[_Row]:
    """The rows of `sample_data` that are pictures."""
    for row in json_rows(tables / "sample_data.json"):
        if _text(tables, "sample_data", row, "calibrated_sensor_token") in cameras:
            for key in ("filename", "ego_pose_token", "sample_token"):
                _text(tables, "sample_data", row, key)
            yield row


def _samples(tables: Path, scene: _Row) -> float:
    return json_number(tables / "scene.json", "nbr_samples", scene.get("nbr_samples", 0))


def _rows(tables: Path, table: str) -> Iterator[_Row]:
    """The rows of a table that is kept whole."""
    for count, row in enumerate(json_rows(tables / f"{table}.json")):
        if count == _MOST_ROWS:
            file = tables / f"{table}.json"
            raise BadInput(file, "number of rows", f"over {count}", f"at most {_MOST_ROWS}")
        yield row


def _text(tables: Path, table: str, row: _Row, key: str) -> str:
    return json_text(tables / f"{table}.json", key, row.get(key))
