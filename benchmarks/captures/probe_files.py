"""Light probes to write: one known picture, Radiance pictures and EXR files byte by byte."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures.case import Case, Ending
from storage.readers.environments import read_environment

HEIGHT, WIDTH = 16, 32

TO_SRGB = {
    # Published: IEC 61966-2-1, ITU-R BT.2087, the ACES and the Display P3 documents.
    "XYZ": ((3.2409699, -1.5373832, -0.4986108),
            (-0.9692436, 1.8759675, 0.0415551),
            (0.0556301, -0.2039770, 1.0569715)),
    "Rec. 2020": ((1.6604910, -0.5876411, -0.0728499),
                  (-0.1245505, 1.1328999, -0.0083494),
                  (-0.0181508, -0.1005789, 1.1187297)),
    "ACEScg": ((1.7050510, -0.6217921, -0.0832589),
               (-0.1302564, 1.1408047, -0.0105483),
               (-0.0240034, -0.1289690, 1.1529723)),
    "ACES2065-1": ((2.5216862, -1.1341310, -0.3875552),
                   (-0.2764799, 1.3727191, -0.0962392),
                   (-0.0153781, -0.1529753, 1.1683534)),
    "Display P3": ((1.2249402, -0.2249402, 0.0),
                   (-0.0420570, 1.0420570, 0.0),
                   (-0.0196376, -0.0786361, 1.0982736)),
}  # fmt: skip
"""Linear light to linear sRGB, rows of the matrices."""


def rgbe(height: int = HEIGHT, width: int = WIDTH) -> NDArray[np.uint8]:
    """A sky over a ground, with a sun: unlike itself under every turn and reflection.

    All of it is exact in halfs, and within sRGB whichever primaries it is said to have.
    """
    row, column = np.mgrid[:height, :width]
    red, green = 150 + 60 * row // height, 170 + 30 * (4 * column // width) // 4
    pixels = np.stack([red, green, np.full_like(row, 190), 129 + (3 * row < height)], axis=2)
    pixels[height // 8, width // 6] = (250, 240, 200, 136)
    return pixels.astype(np.uint8)


def light(height: int = HEIGHT, width: int = WIDTH) -> NDArray[np.float64]:
    """The same as radiance: mantissas are 256ths of two to the exponent's excess over 128."""
    return radiance_of(rgbe(height, width))


def radiance_of(pixels: NDArray[np.uint8]) -> NDArray[np.float64]:
    """(…, 3) of RGBE (…, 4)."""
    mantissas, exponents = pixels[..., :3].astype(float), pixels[..., 3:].astype(float)
    return np.where(exponents > 0, mantissas / 256 * 2 ** (exponents - 128), 0)


def converted(space: str, values: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    """The picture, or other values, of a space of ``TO_SRGB`` in linear sRGB."""
    return (light() if values is None else values) @ np.array(TO_SRGB[space]).T


def equals(
    expected: NDArray[Any] | None = None, rtol: float = 1e-6, atol: float = 0.0
) -> Callable[[Any], bool]:
    """Whether a reading's radiance is this, or the known picture."""

    def is_right(found: Any) -> bool:
        wanted = light() if expected is None else expected
        got = found.radiance
        return bool(
            got.shape == wanted.shape
            and got.dtype == np.float32
            and np.allclose(got, wanted, rtol=rtol, atol=atol)
        )

    return is_right


def saved(data: bytes | Callable[[], bytes]) -> Callable[[Path], object]:
    """What writes these bytes, made when they are needed."""
    return lambda path: path.write_bytes(data if isinstance(data, bytes) else data())


def probe(
    name: str,
    kind: str,
    write: Callable[[Path], object] | bytes | None,
    ends: Ending = "read",
    says: Sequence[str] = (),
    is_right: Callable[[Any], bool] | None = None,
) -> Case:
    """A case of a light probe: by what writes it, or its bytes; None for a file that was met.

    What is read is the known picture, where nothing else is said.
    """
    right = equals() if is_right is None and ends != "refused" else is_right
    made = saved(write) if isinstance(write, bytes) else write
    return Case(name, kind, read_environment, ends, says, right, made)


def met(sun: float = 500.0, dtype: type = np.float32) -> NDArray[np.float64]:
    """What the probes in ``files`` hold: ramps from the top to the bottom, and a sun."""
    down = np.arange(32)[:, None, None] / 32
    ramps = np.array([0.7, 0.8, 0.9]) - down * np.array([0.4, 0.4, 0.3])
    picture = np.broadcast_to(ramps, (32, 64, 3)).copy()
    picture[6:8, 10:12] = sun
    return picture.astype(dtype).astype(np.float64)


# --- Radiance -----------------------------------------------------------------------------------

FORMAT = "FORMAT=32-bit_rle_rgbe"


def hdr(
    lines: Sequence[str] = (FORMAT,),
    pixels: bytes | None = None,
    *,
    signature: str = "#?RADIANCE",
    size: str = f"-Y {HEIGHT} +X {WIDTH}",
    end: str = "\n",
    gap: int = 1,
) -> bytes:
    """A Radiance picture: header lines, ``gap`` empty ones, the size, the pixels (flat)."""
    head = [*([signature] if signature else []), *lines, *[""] * gap, size]
    return "".join(line + end for line in head).encode() + (
        rgbe().tobytes() if pixels is None else pixels
    )


def by_channel(line: NDArray[np.uint8]) -> bytes:
    """A scanline of run lengths as they are since 1991: runs of up to 127, else one literal."""
    coded = bytearray([2, 2, len(line) >> 8, len(line) & 255])
    for channel in line.T:
        at = 0
        while at < len(channel):
            ends = np.flatnonzero(channel[at : at + 127] != channel[at])
            count = int(ends[0]) if len(ends) else min(127, len(channel) - at)
            coded += bytes([128 + count if count > 1 else 1, channel[at]])
            at += count
    return bytes(coded)


def by_pixel(line: NDArray[np.uint8]) -> bytes:
    """A scanline of the older runs: (1, 1, 1, n) repeats the pixel before, n in base 256."""
    coded = bytearray()
    at = 0
    while at < len(line):
        count = 1
        while at + count < len(line) and (line[at + count] == line[at]).all():
            count += 1
        coded += bytes(line[at])
        at += count
        count -= 1
        while count:
            coded += bytes([1, 1, 1, count & 255])
            count >>= 8
    return bytes(coded)


# --- OpenEXR ------------------------------------------------------------------------------------


def exr(
    channels: Mapping[str, NDArray[Any]] | None = None, **header: Any
) -> Callable[[Path], object]:
    """What writes a file by the OpenEXR library; channels of the known picture as halfs."""

    def write(path: Path) -> None:
        import OpenEXR

        planes = rgb() if channels is None else channels
        with OpenEXR.File(_header(header), {n: np.array(v) for n, v in planes.items()}) as file:
            file.write(str(path))

    return write


def exr_parts(*parts: tuple[str, Mapping[str, NDArray[Any]], Mapping[str, Any]]) -> Any:
    """What writes a file of several parts: names, channels, and what their headers say."""

    def write(path: Path) -> None:
        import OpenEXR

        made = [
            OpenEXR.Part(_header(header), {n: np.array(v) for n, v in channels.items()}, name)
            for name, channels, header in parts
        ]
        with OpenEXR.File(made) as file:
            file.write(str(path))

    return write


def _header(given: Mapping[str, Any]) -> dict[str, Any]:
    import OpenEXR

    plain = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    return {
        name: getattr(OpenEXR, value)
        if isinstance(value, str) and hasattr(OpenEXR, value)
        else value
        for name, value in (plain | dict(given)).items()
    }


def rgb(
    prefix: str = "",
    names: Sequence[str] = "RGB",
    values: NDArray[Any] | None = None,
    dtype: type = np.float16,
) -> dict[str, NDArray[Any]]:
    """Channels of (height, width, 3) values, or of the known picture."""
    values = light() if values is None else values
    return {prefix + name: values[..., at].astype(dtype) for at, name in enumerate(names)}


def window(left: int, top: int, width: int, height: int) -> tuple[NDArray[np.int32], ...]:
    """As OpenEXR's headers have it: the first and the last pixel."""
    return (
        np.array([left, top], np.int32),
        np.array([left + width - 1, top + height - 1], np.int32),
    )


def raw_exr(channels: Mapping[str, tuple[int, NDArray[np.float16]]]) -> bytes:
    """A file of halfs without compression, each channel with its own step of sampling."""
    names = sorted(channels)
    box = struct.pack("<4i", 0, 0, WIDTH - 1, HEIGHT - 1)
    listed = b"".join(
        name.encode() + b"\0" + struct.pack("<iB3xii", 1, 0, channels[name][0], channels[name][0])
        for name in names
    )
    attributes = (
        ("channels", "chlist", listed + b"\0"),
        ("compression", "compression", b"\0"),
        ("dataWindow", "box2i", box),
        ("displayWindow", "box2i", box),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1)),
        ("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        ("screenWindowWidth", "float", struct.pack("<f", 1)),
    )
    head = struct.pack("<ii", 20000630, 2)
    for name, kind, value in attributes:
        head += f"{name}\0{kind}\0".encode() + struct.pack("<i", len(value)) + value
    head += b"\0"
    lines, places, at = [], [], len(head) + 8 * HEIGHT
    for y in range(HEIGHT):
        data = b"".join(
            values[y // step].astype("<f2").tobytes()
            for step, values in (channels[name] for name in names)
            if y % step == 0
        )
        lines.append(struct.pack("<ii", y, len(data)) + data)
        places.append(at)
        at += len(lines[-1])
    return head + struct.pack(f"<{HEIGHT}Q", *places) + b"".join(lines)


def luminance_chroma() -> bytes:
    """The known picture: Y for every pixel, RY and BY for every second one (Rec. 709)."""
    red, green, blue = np.moveaxis(light(), -1, 0)
    luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue
    chroma = [((colour - luminance) / luminance)[::2, ::2] for colour in (red, blue)]
    planes = {"Y": (1, luminance), "RY": (2, chroma[0]), "BY": (2, chroma[1])}
    return raw_exr({name: (step, p.astype(np.float16)) for name, (step, p) in planes.items()})
