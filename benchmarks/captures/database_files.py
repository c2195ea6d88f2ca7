"""What the cases of material databases are written with: photographs, their light, containers."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.case import Case, Ending
from storage.readers.btf import ExrColours, open_btf

HEIGHT, WIDTH = 6, 5
VIEWS = ((0, 0), (60, 45))
LIGHTS = ((0, 0), (30, 120), (60, 240))
PAIRS = [(light, view) for view in VIEWS for light in LIGHTS]
"""In the order of what is read: by view, then by light."""
SRGB_OF_XYZ = np.linalg.inv(
    [[0.4123908, 0.3575843, 0.1804808], [0.2126390, 0.7151687, 0.0721923],
     [0.0193308, 0.1191948, 0.9505322]]
)  # fmt: skip
"""IEC 61966-2-1."""

Right = Callable[[Any], bool]
Writer = Callable[[Path], object]
Direction = Sequence[float]


class Database(NamedTuple):
    """What is read of a database: (image, 2) radians, (image, y, x, 3) linear RGB."""

    light: NDArray[np.float64]
    view: NDArray[np.float64]
    photographs: NDArray[np.float32]
    notes: tuple[str, ...]


def read_database(path: Path, exr_colours: ExrColours = "auto") -> Database:
    """Open a database and read all of its photographs."""
    btf = open_btf(path, exr_colours=exr_colours)
    return Database(btf.light, btf.view, btf.read(0, btf.images), btf.notes)


def case(
    file: str,
    kind: str,
    write: Writer,
    right: Right | None = None,
    says: Sequence[str] = (),
    read: Callable[[Path], Database] = read_database,
) -> Case:
    """A case that is refused where nothing is right, told where something is said, else read."""
    ends: Ending = "refused" if right is None else "told" if says else "read"
    return Case(file, f"database: {kind}", read, ends, says, right, write)


# ---- photographs -----------------------------------------------------------------------------


def codes(dtype: Any = np.uint8, channels: int = 3) -> NDArray[Any]:
    """(pair, y, x, channel): codes of any value."""
    most = np.iinfo(dtype).max + 1
    values = np.random.default_rng(11).random((len(PAIRS), HEIGHT, WIDTH, channels))
    return (values * most).astype(dtype)


def slow_codes() -> NDArray[np.uint8]:
    """(pair, y, x, 3) that JPEG keeps: slow gradients of another brightness in every pair."""
    y, x = np.mgrid[:HEIGHT, :WIDTH] * 4.0
    base = np.stack([x + 60, y + 90, x + y + 40], axis=-1)
    return np.stack([base + 20 * k for k in range(len(PAIRS))]).astype(np.uint8)


def radiance(largest: float = 3.0) -> NDArray[np.float64]:
    """(pair, y, x, 3): light that no 8 bits hold, no colour far from grey."""
    values = np.random.default_rng(12).random((len(PAIRS), HEIGHT, WIDTH, 3))
    grey = np.linspace(0.2, largest, len(PAIRS))[:, None, None, None]
    return np.asarray(grey * (0.7 + 0.3 * values))


def light_of(stored: NDArray[Any]) -> NDArray[np.float64]:
    """The sRGB curve of IEC 61966-2-1; grey thrice."""
    encoded = stored.astype(np.float64) / np.iinfo(stored.dtype).max
    light = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return np.array(np.broadcast_to(light, (*light.shape[:-1], 3)))


def is_light(
    expected: NDArray[Any],
    atol: float = 1e-5,
    pairs: Sequence[tuple[Direction, Direction]] = PAIRS,
) -> Right:
    """Whether photographs, (pair, y, x, 3), and directions, in degrees, are the expected ones."""

    def right(found: Database) -> bool:
        if found.photographs.shape != expected.shape:
            return False
        directions = np.degrees(np.stack([found.light, found.view], axis=1))
        step = np.abs(found.photographs - expected).max()
        return bool(np.allclose(directions, pairs, atol=1e-4) and step <= atol)

    return right


def png(pixels: NDArray[Any], mode: str | None = None, **options: Any) -> bytes:
    """By Pillow."""
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(pixels.squeeze(), mode).save(stream, "PNG", **options)
    return stream.getvalue()


def deep_png(pixels: NDArray[np.uint16]) -> bytes:
    """16 bits a channel, by OpenCV: Pillow has no such pictures in colour."""
    import cv2

    order = [2, 1, 0, 3][: pixels.shape[2]] if pixels.shape[2] > 1 else [0]
    return bytes(cv2.imencode(".png", pixels[..., order])[1])


def jpeg(pixels: NDArray[np.uint8], mode: str = "RGB", **options: Any) -> bytes:
    """By Pillow."""
    from PIL import Image

    stream = io.BytesIO()
    picture = Image.fromarray(pixels).convert(mode)
    picture.save(stream, "JPEG", **{"quality": 97, "subsampling": 0} | options)
    return stream.getvalue()


# ---- names and containers --------------------------------------------------------------------


def utia(light: Direction, view: Direction) -> str:
    """``tv000_pv000/tl000_pl000_tv000_pv000``"""
    folder = f"tv{view[0]:03}_pv{view[1]:03}"
    return f"{folder}/tl{light[0]:03}_pl{light[1]:03}_{folder}"


def ubo2003(light: Direction, view: Direction) -> str:
    """``WOOL/tv000_pv000/00008 tl000 pl000 tv000 pv000``"""
    angles = f"tl{light[0]:03} pl{light[1]:03} tv{view[0]:03} pv{view[1]:03}"
    return f"WOOL/tv{view[0]:03}_pv{view[1]:03}/00008 {angles}"


def files(
    pictures: Sequence[bytes],
    suffix: str = ".png",
    name: Callable[[Direction, Direction], str] = utia,
    pairs: Sequence[tuple[Direction, Direction]] = PAIRS,
) -> dict[str, bytes]:
    """One file a pair."""
    return {name(*pair) + suffix: data for pair, data in zip(pairs, pictures, strict=True)}


def plain() -> dict[str, bytes]:
    """8-bit PNG of `codes`, as UTIA's."""
    return files([png(image) for image in codes()])


def zipped(content: Mapping[str, bytes], **options: Any) -> Writer:
    """Writes a zip."""

    def write(path: Path) -> None:
        with zipfile.ZipFile(path, "w", **options) as archive:
            for name, data in content.items():
                archive.writestr(name, data)

    return write


def unpacked(content: Mapping[str, bytes]) -> Writer:
    """Writes a folder."""

    def write(path: Path) -> None:
        for name, data in content.items():
            (path / name).parent.mkdir(parents=True, exist_ok=True)
            (path / name).write_bytes(data)

    return write


def zip_bytes(content: Mapping[str, bytes]) -> bytes:
    """A zip in memory."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, data in content.items():
            archive.writestr(name, data)
    return stream.getvalue()
