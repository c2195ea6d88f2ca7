"""Films: written here by FFmpeg with known pictures and times, right ones and with faults."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from storage.readers import BadInput
from storage.readers.films import film_frames, film_luma, read_film, read_film_frame

WIDTH, HEIGHT = 192, 128
RATE = 10
LENGTH = 60


def picture(number: int, width: int = WIDTH, height: int = HEIGHT) -> NDArray[np.uint8]:
    """Its number as blocks of black and white in the upper half; red at the left, blue below."""
    shown = np.full((height, width, 3), 90, np.uint8)
    for bit in range(8):
        shown[: height // 2, bit * 16 + 32 : bit * 16 + 48] = 235 if number >> bit & 1 else 20
    shown[:, :32] = (200, 30, 30)
    shown[height // 2 :, 32:] = (30, 30, 190)
    return shown


def number_of(shown: NDArray[np.uint8]) -> int:
    row = shown[HEIGHT // 4, 40 : 40 + 8 * 16 : 16].reshape(8, -1).mean(axis=1)
    return int(sum((value > 128) << bit for bit, value in enumerate(row)))


def write_film(
    file: Path,
    *,
    times: Sequence[int] = tuple(range(LENGTH)),
    codec: str = "libx264",
    turned: int = 0,
    **stream_fields: Any,
) -> Path:
    """A frame at each of ``times``, tenths of a second."""
    import av

    with av.open(str(file), "w") as container:
        stream: Any = container.add_stream(codec, rate=RATE)
        stream.width, stream.height = WIDTH, HEIGHT
        stream.pix_fmt = stream_fields.pop("pix_fmt", "yuv420p")
        stream.options = {"crf": "10", "g": "12"} if codec == "libx264" else {}
        stream.codec_context.time_base = Fraction(1, RATE)
        for name, value in stream_fields.items():
            setattr(stream.codec_context, name, value)
        if turned:
            stream.set_display_rotation(turned)
        for number, time in enumerate(times):
            frame = av.VideoFrame.from_ndarray(picture(number), format="rgb24")
            frame.pts, frame.time_base = time, Fraction(1, RATE)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return file


@pytest.fixture(scope="module")
def ride(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_film(tmp_path_factory.mktemp("films") / "ride.mp4")


def test_sizes_times_and_every_frame_in_its_order(ride: Path) -> None:
    film = read_film(ride)
    assert (film.width, film.height, film.turned) == (WIDTH, HEIGHT, 0)
    np.testing.assert_allclose(film.times, np.arange(LENGTH) / RATE)
    assert film.notes == ()
    found = [(number, number_of(luma)) for number, luma in film_luma(film)]
    assert found == [(number, number) for number in range(LENGTH)]


def test_colours_are_those_that_were_filmed(ride: Path) -> None:
    shown = read_film_frame(read_film(ride), 7).astype(int)
    assert shown.shape == (HEIGHT, WIDTH, 3)
    assert np.abs(shown - picture(7))[8:-8, 8:24].mean() < 6  # red
    assert np.abs(shown - picture(7))[HEIGHT // 2 + 8 : -8, 40:-8].mean() < 6  # blue


@pytest.mark.parametrize("number", [0, 1, 11, 12, 13, 40, LENGTH - 1])
def test_one_frame_is_the_same_as_in_turn(ride: Path, number: int) -> None:
    film = read_film(ride)
    alone = read_film_frame(film, number)
    assert number_of(alone) == number
    in_turn = dict(film_frames(film, list(range(LENGTH))))
    np.testing.assert_array_equal(alone, in_turn[number])


def test_some_frames_come_in_rising_order(ride: Path) -> None:
    film = read_film(ride)
    assert [number for number, _ in film_frames(film, [30, 3, 3, 17])] == [3, 17, 30]
    with pytest.raises(IndexError, match="no frame 60 of 60"):
        read_film_frame(film, LENGTH)


def test_times_of_a_variable_rate_are_those_shown(tmp_path: Path) -> None:
    times = [0, 1, 2, 5, 6, 7, 8, 20, 21, 22, 23, 24, 40, 41, 42, 43, 44, 45, 46, 60]
    film = read_film(write_film(tmp_path / "uneven.mkv", times=times))
    np.testing.assert_allclose(film.times, np.array(times) / RATE, atol=2e-3)
    assert any("the times at which they are shown are used" in note for note in film.notes)
    assert number_of(read_film_frame(film, 7)) == 7


@pytest.mark.parametrize(("turned", "corner"), [(90, (-1, 0)), (180, (-1, -1)), (270, (0, -1))])
def test_a_turned_film_is_upright(tmp_path: Path, turned: int, corner: tuple[int, int]) -> None:
    """Counterclockwise: the stored picture's upper left corner, red, goes down, over, right."""
    film = read_film(write_film(tmp_path / "turned.mp4", turned=turned))
    upright = read_film_frame(film, 3)
    assert upright.shape == ((HEIGHT, WIDTH, 3) if turned == 180 else (WIDTH, HEIGHT, 3))
    assert (film.height, film.width) == upright.shape[:2]
    assert upright[corner][0] > 150 > 100 > upright[corner][1]
    assert any(f"turned by {turned} degrees" in note for note in film.notes)
    luma = next(picture for number, picture in film_luma(film) if number == 3)
    assert luma.shape == upright.shape[:2]
    grey = upright.astype(float).mean(axis=2)
    assert np.corrcoef(grey.ravel(), luma.ravel())[0, 1] > 0.6


def test_hdr_is_converted_and_said(tmp_path: Path) -> None:
    """A grey that HLG codes as 0.75 is diffuse white (ITU-R BT.2408): 255."""
    import av

    file = tmp_path / "hdr.mkv"
    with av.open(str(file), "w") as container:
        stream: Any = container.add_stream("libx265", rate=RATE)
        stream.width, stream.height, stream.pix_fmt = 160, 128, "yuv420p10le"
        stream.options = {"x265-params": "log-level=none:transfer=18:colorprim=9:colormatrix=9"}
        stream.codec_context.color_trc, stream.codec_context.color_primaries = 18, 9
        stream.codec_context.colorspace = 9
        for number in range(LENGTH):
            frame: Any = av.VideoFrame(160, 128, "yuv420p10le")
            code = 64 + round(876 * (0.75 if number % 2 else 0.375))
            for plane, value in zip(frame.planes, (code, 512, 512), strict=True):
                size = plane.buffer_size // 2
                plane.update(np.full(size, value, "<u2").tobytes())
            frame.pts, frame.time_base = number, Fraction(1, RATE)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    film = read_film(file)
    assert any("HDR" in note for note in film.notes)
    white, dark = read_film_frame(film, 1), read_film_frame(film, 2)
    assert white.min() >= 253
    # Scene light (0.375^2 / 3) / 0.2650 of white's, to the power of the system's gamma, 1.2.
    light = (0.375**2 / 3 / 0.26496256) ** 1.2
    expected = 255 * (1.055 * light ** (1 / 2.4) - 0.055)
    assert abs(float(dark.mean()) - expected) < 3


# ---- what is refused, or mended ------------------------------------------------------------------


def test_a_short_film_is_no_street(tmp_path: Path) -> None:
    file = write_film(tmp_path / "short.mp4", times=range(40))
    with pytest.raises(BadInput, match=r"duration is 4.0 s; expected at least 5 s"):
        read_film(file)


def test_a_film_without_its_index_is_cut(tmp_path: Path, ride: Path) -> None:
    file = tmp_path / "cut.mp4"
    data = ride.read_bytes()
    file.write_bytes(data[: data.index(b"moov") - 4])
    with pytest.raises(BadInput, match="cut or damaged: its index is missing"):
        read_film(file)


def test_of_a_film_that_breaks_off_what_is_there_is_read(tmp_path: Path) -> None:
    import av

    file, whole = tmp_path / "cut.mp4", tmp_path / "whole.mp4"
    times = range(3 * LENGTH)
    write_film(whole, times=times)
    with (
        av.open(str(whole)) as source,
        av.open(str(file), "w", options={"movflags": "faststart"}) as sink,
    ):
        stream = sink.add_stream_from_template(source.streams.video[0])
        for packet in source.demux(video=0):
            if packet.dts is not None:
                packet.stream = stream
                sink.mux(packet)
    data = file.read_bytes()
    file.write_bytes(data[: int(0.7 * len(data))])
    film = read_film(file)
    assert LENGTH < len(film.times) < 3 * LENGTH
    assert any(f"of {3 * LENGTH} frames are there" in note for note in film.notes)
    shown = [(number, number_of(luma)) for number, luma in film_luma(film)]
    assert shown
    assert all(number % 256 == found for number, found in shown)


def test_stills_sound_and_other_files_are_no_films(tmp_path: Path) -> None:
    import av

    still = tmp_path / "still.png"
    Image.fromarray(picture(1)).save(still)
    with pytest.raises(BadInput, match="film is a still picture"):
        read_film(still)
    sound = tmp_path / "sound.wav"
    with av.open(str(sound), "w") as container:
        stream: Any = container.add_stream("pcm_s16le", rate=8000)
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 8000), np.int16), "s16", "mono")
        frame.sample_rate = 8000
        container.mux(stream.encode(frame))
    with pytest.raises(BadInput, match=r"without pictures \(sound alone\)"):
        read_film(sound)
    text = tmp_path / "film.mp4"
    text.write_text("no film")
    with pytest.raises(BadInput, match="format is unknown"):
        read_film(text)
    empty = tmp_path / "empty.mp4"
    empty.touch()
    with pytest.raises(BadInput, match="format is empty"):
        read_film(empty)
    with pytest.raises(BadInput, match="missing"):
        read_film(tmp_path / "none.mp4")


def test_one_frame_is_a_still_picture(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="film is a still picture"):
        read_film(write_film(tmp_path / "one.mp4", times=[0]))


def test_pixels_that_are_not_square_are_made_so(tmp_path: Path) -> None:
    film = read_film(write_film(tmp_path / "wide.mp4", sample_aspect_ratio=Fraction(4, 3)))
    assert (film.width, film.height) == (256, HEIGHT)
    assert read_film_frame(film, 5).shape == (HEIGHT, 256, 3)
    assert any("made square" in note for note in film.notes)


def test_a_film_without_times_in_its_packets_is_read(tmp_path: Path) -> None:
    film = read_film(write_film(tmp_path / "old.avi", codec="mpeg4"))
    assert len(film.times) == LENGTH
    assert number_of(read_film_frame(film, 31)) == 31


def test_memory_is_flat(ride: Path) -> None:
    """Two frames of the picture's size are alive at most, whatever the film's length."""
    import weakref

    film, alive = read_film(ride), []
    for _, luma in film_luma(film):
        alive.append(weakref.ref(luma))
        del luma
        assert sum(reference() is not None for reference in alive) <= 2
