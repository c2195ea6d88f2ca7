"""Folders of photographs: order, EXIF that is written here, GPX beside them, and faults."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, TiffImagePlugin

from storage.readers import BadInput
from storage.readers.exif_cameras import read_exif_camera
from storage.readers.gpx_files import places_at, read_gpx
from storage.readers.photograph_folders import read_folder_photograph, read_photograph_folder

WIDTH, HEIGHT = 120, 80
NOON = datetime(2024, 5, 1, 12, 0, 0, tzinfo=UTC).timestamp()
Tags = dict[int, Any]


def rational(numerator: int, denominator: int = 1) -> Any:
    return TiffImagePlugin.IFDRational(numerator, denominator)


def write(
    file: Path,
    seed: int = 0,
    *,
    size: tuple[int, int] = (WIDTH, HEIGHT),
    exif: Tags | None = None,
    gps: Tags | None = None,
    orientation: int = 1,
) -> Path:
    codes = np.random.default_rng(seed).integers(0, 255, (size[1], size[0], 3)).astype(np.uint8)
    image = Image.fromarray(codes)
    tags = image.getexif()
    tags[0x0112] = orientation
    tags.get_ifd(0x8769).update(exif or {})
    tags.get_ifd(0x8825).update(gps or {})
    image.save(file, exif=tags)
    return file


def folder_of(folder: Path, names: list[str], **fields: Any) -> Path:
    folder.mkdir(exist_ok=True)
    for seed, name in enumerate(names):
        write(folder / name, seed, **fields)
    return folder


TEN = [f"img{number}.jpg" for number in range(1, 11)]


def test_names_are_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "ride", TEN[::-1])
    (folder / "notes.txt").write_text("left alone")
    write(folder / ".hidden.jpg")
    found = read_photograph_folder(folder)
    assert [file.name for file in found.files] == TEN
    assert (found.width, found.height) == (WIDTH, HEIGHT)
    assert math.isnan(found.focal)
    assert any("No focal length in EXIF" in note for note in found.notes)
    assert np.isnan(found.times).all()


def test_pixels_are_those_of_the_photograph(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "ride", [f"{number}.png" for number in range(8)])
    found = read_photograph_folder(folder)
    for number in (0, 7):
        expected = np.asarray(Image.open(folder / f"{number}.png"))
        np.testing.assert_array_equal(read_folder_photograph(found, number), expected)
    Image.fromarray(np.full((HEIGHT, WIDTH), 77, np.uint8)).save(folder / "3.png")
    grey = read_folder_photograph(found, 3)
    assert grey.shape == (HEIGHT, WIDTH, 3)
    assert (grey == 77).all()
    write(folder / "4.png", size=(60, 80))
    with pytest.raises(BadInput, match="60 x 80 pixels; expected 120 x 80"):
        read_folder_photograph(found, 4)


def test_a_focal_length_by_film_and_by_the_sensor(tmp_path: Path) -> None:
    by_film = read_exif_camera(write(tmp_path / "film.jpg", exif={0xA405: 28}))
    assert by_film.focal == pytest.approx(28 / math.hypot(36, 24) * math.hypot(WIDTH, HEIGHT))
    assert by_film.focal_deviation == pytest.approx(0.03 * by_film.focal)
    # 6 mm behind a sensor of 25 pixels a millimetre, of which every second was kept.
    exif = {0x920A: rational(6), 0xA20E: rational(250), 0xA210: 3, 0xA002: 2 * WIDTH, 0xA405: 90}
    by_sensor = read_exif_camera(write(tmp_path / "sensor.jpg", exif=exif))
    assert by_sensor.focal == pytest.approx(6 * 25 / 2)
    assert by_sensor.focal_deviation == pytest.approx(0.01 * by_sensor.focal)
    nothing = read_exif_camera(write(tmp_path / "nothing.jpg", exif={0xA405: 0}))
    assert math.isnan(nothing.focal)


def test_a_turned_photograph_has_the_size_that_it_is_shown_in(tmp_path: Path) -> None:
    turned = read_exif_camera(write(tmp_path / "turned.jpg", orientation=6))
    assert (turned.width, turned.height) == (HEIGHT, WIDTH)


def test_dates_and_places(tmp_path: Path) -> None:
    exif = {0x9003: "2024:05:01 14:00:00", 0x9291: "250", 0x9011: "+02:00"}
    third = (rational(48), rational(30), rational(36))
    gps = {1: "S", 2: third, 3: "W", 4: third, 5: b"\x01", 6: rational(25, 2)}
    found = read_exif_camera(write(tmp_path / "one.jpg", exif=exif, gps=gps))
    assert found.time == NOON + 0.25
    assert found.place == pytest.approx((-48.51, -48.51, -12.5))
    exif = {0x9003: "0000:00:00 00:00:00"}
    unset = read_exif_camera(write(tmp_path / "two.jpg", exif=exif, gps={2: third}))
    assert unset.time is None
    assert unset.place is None


def test_one_focal_length_for_all_and_zooming_is_said(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "ride", TEN, exif={0xA405: 28})
    found = read_photograph_folder(folder)
    assert found.focal == pytest.approx(28 / math.hypot(36, 24) * math.hypot(WIDTH, HEIGHT))
    assert not any("focal" in note.lower() for note in found.notes)
    write(folder / "img4.jpg", exif={0xA405: 56})
    zoomed = read_photograph_folder(folder)
    assert zoomed.focal == found.focal
    assert any("zoomed" in note for note in zoomed.notes)


def test_what_differs_in_size_or_is_broken_is_left_out_and_said(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "ride", TEN)
    write(folder / "img2.jpg", size=(90, 60))
    (folder / "img3.jpg").write_bytes(b"\xff\xd8\xff no photograph")
    found = read_photograph_folder(folder)
    assert len(found.files) == 8
    assert any("img3.jpg" in note for note in found.notes)
    assert any("1 photograph(s) that are not of 120 x 80" in note for note in found.notes)
    write(folder / "img5.jpg", size=(90, 60))
    with pytest.raises(BadInput, match="number of photographs is 7; expected at least 8"):
        read_photograph_folder(folder)


@pytest.mark.parametrize(("name", "found"), [("none", "missing"), ("a.jpg", "a file")])
def test_a_folder_is_wanted(tmp_path: Path, name: str, found: str) -> None:
    write(tmp_path / "a.jpg")
    with pytest.raises(BadInput, match=f"photographs is {found}"):
        read_photograph_folder(tmp_path / name)


# ---- GPX -----------------------------------------------------------------------------------------


def gpx(points: str, space: str = 'xmlns="http://www.topografix.com/GPX/1/1"') -> str:
    inside = f"<trk><trkseg>{points}</trkseg></trk>"
    return f'<?xml version="1.0"?><gpx version="1.1" {space}>{inside}</gpx>'


TWO = (
    '<trkpt lat="48.0" lon="11.0"><ele>500</ele><time>2024-05-01T12:00:10Z</time></trkpt>'
    '<trkpt lat="48.1" lon="11.2"><time>2024-05-01T12:00:00Z</time></trkpt>'
    '<trkpt lat="1" lon="1"/>'
)


@pytest.mark.parametrize("space", ["", 'xmlns="http://www.topografix.com/GPX/1/0"'])
def test_a_track_is_read_in_the_order_of_its_times(tmp_path: Path, space: str) -> None:
    file = tmp_path / "ride.gpx"
    file.write_text(gpx(TWO, space))
    track = read_gpx(file)
    np.testing.assert_allclose(track.times, [NOON, NOON + 10])
    np.testing.assert_allclose(track.places, [[48.1, 11.2, np.nan], [48, 11, 500]])
    between = places_at(track, np.array([NOON + 5, NOON + 11]))
    np.testing.assert_allclose(between[0, :2], [48.05, 11.1])
    assert np.isnan(between[1]).all()


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("<gpx>", "XML is broken in line 1"),
        ("<kml/>", "format is <kml>"),
        (gpx(TWO).replace("48.1", "148"), "lat of a track point is 148; expected degrees"),
        (gpx(TWO).replace('lon="11.2"', ""), "lon of a track point is missing"),
        (gpx('<trkpt lat="1" lon="1"/>'), "number of points with a time is 0"),
        ('<!DOCTYPE gpx [<!ENTITY a "a">]><gpx/>', "definitions of its own"),
    ],
)
def test_tracks_that_are_none(tmp_path: Path, text: str, sentence: str) -> None:
    file = tmp_path / "ride.gpx"
    file.write_text(text)
    with pytest.raises(BadInput, match=sentence):
        read_gpx(file)


def test_a_track_beside_gives_places_by_the_photographs_times(tmp_path: Path) -> None:
    folder = folder_of(tmp_path / "ride", TEN)
    for number, name in enumerate(TEN):
        write(folder / name, exif={0x9003: f"2024:05:01 12:00:{number:02d}", 0x9011: "+00:00"})
    (folder / "track.gpx").write_text(gpx(TWO))
    found = read_photograph_folder(folder)
    np.testing.assert_allclose(found.places[:, 0], 48.1 - 0.01 * np.arange(10))
    np.testing.assert_allclose(found.times, NOON + np.arange(10))
    (folder / "track.gpx").write_text("<kml/>")
    without = read_photograph_folder(folder)
    assert np.isnan(without.places).all()
    assert any("track.gpx" in note for note in without.notes)
