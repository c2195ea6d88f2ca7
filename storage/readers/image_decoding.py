"""PNG, JPEG, TIFF and OpenEXR files to arrays of the values they hold, upright and complete.

Which library decodes what is decided by the file's own header, never by its name: Pillow reads
8 bit files (it notices truncation and converts colour profiles), but cuts 16 bit colour down to
8 bit, so OpenCV reads those and float TIFF, after Pillow or tifffile has seen that the file is
complete (OpenCV fills what is missing with grey and says nothing). OpenEXR reads EXR.
"""

from __future__ import annotations

import io
import math
import struct
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.exr_files import read_exr
from storage.readers.opening import first_bytes
from storage.readers.picture_sizes import LARGEST_PICTURE, check_area

if TYPE_CHECKING:
    import tifffile
    from PIL import Image, ImageFile

FORMATS = "a PNG, JPEG, TIFF or EXR photograph"

_PNG_END = b"IEND\xaeB`\x82"  # the last chunk's name and checksum, the same in every PNG
_SRGB_GAMMA = 0.45455
_MANY_SCANS = 64  # of a JPEG, each of which takes as long as all of the picture; 10 are usual
_MOST_SCANNED = 1_000_000_000  # pixels, which take some seconds
_UPRIGHT: dict[int, Callable[[NDArray[Any]], NDArray[Any]]] = {
    1: lambda a: a,
    2: lambda a: a[:, ::-1],
    3: lambda a: a[::-1, ::-1],
    4: lambda a: a[::-1],
    5: lambda a: a.swapaxes(0, 1),
    6: lambda a: a.swapaxes(0, 1)[:, ::-1],
    7: lambda a: a.swapaxes(0, 1)[::-1, ::-1],
    8: lambda a: a.swapaxes(0, 1)[::-1],
}  # EXIF 2.32, tag 0x0112: what a stored array needs to stand upright


class DecodedImage(NamedTuple):
    """What a picture file holds, upright, the top row first.

    ``colours``: (height, width, 1 or 3), grey or RGB with the primaries of sRGB; unsigned
    integers are codes of the sRGB curve, floats are linear. ``opaque``: (height, width) bool,
    or None where the file has no alpha. ``notes``: sentences on what was converted, mended or
    left out.
    """

    colours: NDArray[Any]
    opaque: NDArray[np.bool_] | None
    notes: tuple[str, ...] = ()


def decode_image(file: Path) -> DecodedImage:
    """Decode a picture file, whole and upright.

    Colours of an 8 bit file with another profile (Display P3, Adobe RGB, ...) are converted to
    sRGB; deeper files must be sRGB (integers) or linear (floats) already, as no colour engine
    at hand converts them without loss. Of a TIFF with several pages the first is read.

    Raises BadInput where the file is missing, of another format, truncated, larger than
    400 megapixels or in a colour space or sample type that cannot be read faithfully.
    """
    start = first_bytes(file, 8, FORMATS, LARGEST_PICTURE)
    for signatures, kind, decode in (
        ((b"\x89PNG\r\n\x1a\n",), "PNG", _decode_png),
        ((b"\xff\xd8\xff",), "JPEG", _decode_jpeg),
        ((b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"), "TIFF", _decode_tiff),
        ((b"\x76\x2f\x31\x01",), "EXR", _decode_exr),
    ):
        if start.startswith(signatures):
            try:
                return decode(file)
            except BadInput:
                raise
            except Exception as error:  # decoders of damaged data raise nearly anything
                raise _damaged(file, kind) from error
    raise BadInput(file, "format", "unknown" if start else "unknown (the file is empty)", FORMATS)


def _damaged(file: Path, kind: str) -> BadInput:
    return BadInput(file, "content", "truncated or damaged", f"a complete {kind} file")


# --- PNG and JPEG -------------------------------------------------------------------------------


def _decode_png(file: Path) -> DecodedImage:
    from PIL import PngImagePlugin

    data = file.read_bytes()
    deep = data[24] == 16  # the header chunk's bit depth
    image = _load_with_pillow(file, PngImagePlugin.PngImageFile, io.BytesIO(data), 8 if deep else 4)
    if _PNG_END not in data[-4096:] and _PNG_END not in data:
        raise _damaged(file, "PNG")
    _check_png_gamma(file, image)
    decoded = _deep_png(file, data, image) if deep else _eight_bits(file, image)
    return _turned_upright(file, decoded, image)


def _decode_jpeg(file: Path) -> DecodedImage:
    from PIL import JpegImagePlugin

    data = file.read_bytes()
    size = JpegImagePlugin.JpegImageFile(io.BytesIO(data)).size
    scans = data.count(b"\xff\xda")  # and some by chance, in a film behind the photograph
    if scans > _MANY_SCANS and scans * math.prod(size) > _MOST_SCANNED:
        raise BadInput(file, "number of scans", f"{scans}", f"at most {_MANY_SCANS}")
    image = _load_with_pillow(file, JpegImagePlugin.JpegImageFile, io.BytesIO(data), 4)
    return _turned_upright(file, _eight_bits(file, image), image)


def _load_with_pillow(
    file: Path, plugin: type[ImageFile.ImageFile], stream: Any, pixel_bytes: int
) -> ImageFile.ImageFile:
    """Open through the format's own class: ``Image.open`` would apply a limit of its own, which
    can only be changed for the whole process."""
    image = plugin(stream)
    check_area(file, *image.size, pixel_bytes)
    image.load()
    return image


def _turned_upright(file: Path, decoded: DecodedImage, image: Image.Image) -> DecodedImage:
    try:
        orientation = image.getexif().get(0x0112, 1)
    except Exception as error:  # SyntaxError, struct.error and others by what is broken
        raise BadInput(file, "EXIF block", "damaged", "a readable one or none") from error
    turn = _UPRIGHT.get(orientation, _UPRIGHT[1]) if isinstance(orientation, int) else _UPRIGHT[1]
    opaque = None if decoded.opaque is None else turn(decoded.opaque)
    return DecodedImage(turn(decoded.colours), opaque)


def _eight_bits(file: Path, image: Image.Image) -> DecodedImage:
    if image.mode in ("CMYK", "LAB", "HSV"):
        raise BadInput(file, "colour space", image.mode, "RGB or grey")
    opaque = None
    if image.has_transparency_data:
        opaque = np.asarray(image.convert("RGBA").getchannel("A")) == 255
    if image.mode == "RGBa":  # premultiplied; Pillow converts it to RGB only by way of RGBA
        image = image.convert("RGBA")
    profile = image.info.get("icc_profile")
    colours = image.convert("L" if image.mode in ("1", "L", "LA") else "RGB")
    if profile and not _profile_is(file, profile, colours.mode, _identity):
        colours = _converted_to_srgb(file, profile, colours)
    codes = np.asarray(colours)
    return DecodedImage(codes if codes.ndim == 3 else codes[..., None], opaque)


def _deep_png(file: Path, data: bytes, image: Image.Image) -> DecodedImage:
    codes = _decode_with_opencv(file, "PNG", np.frombuffer(data, np.uint8), np.dtype(np.uint16))
    opaque = None
    if codes.shape[2] == 4:
        opaque = codes[..., 3] == 65535
    elif "transparency" in image.info:  # one grey value that stands for a hole
        opaque = codes[..., 0] != image.info["transparency"]
    grey = image.mode == "I;16"
    _refuse_other_profiles(file, image.info.get("icc_profile"), "L" if grey else "RGB", _identity)
    return DecodedImage(codes[..., :3], opaque)


def _check_png_gamma(file: Path, image: Image.Image) -> None:
    """A gamma chunk is overruled by an sRGB or a profile chunk (PNG, third edition, 11.3.2)."""
    gamma = image.info.get("gamma")
    if gamma is None or "srgb" in image.info or "icc_profile" in image.info:
        return
    if not math.isclose(gamma, _SRGB_GAMMA, rel_tol=0.02):
        raise BadInput(file, "gamma", f"{gamma:.5g}", f"that of sRGB ({_SRGB_GAMMA})")


# --- TIFF ---------------------------------------------------------------------------------------


def _decode_tiff(file: Path) -> DecodedImage:
    import tifffile
    from PIL import TiffImagePlugin

    with tifffile.TiffFile(file) as tiff:
        page = tiff.pages.first
        ends = [a + b for a, b in zip(page.dataoffsets, page.databytecounts, strict=True)]
        complete = max(ends) <= file.stat().st_size
        complete &= len(page.tags) == _tag_count(tiff, page)
    if not complete:
        raise _damaged(file, "TIFF")
    pixel_bytes = (page.dtype.itemsize if page.dtype else 1) * max(page.samplesperpixel, 4)
    check_area(file, int(page.imagewidth), int(page.imagelength), pixel_bytes)
    if page.is_tiled:
        check_area(file, int(page.tilewidth), int(page.tilelength), pixel_bytes)
    kind = str(np.dtype(page.dtype)) if page.dtype else f"{page.bitspersample} bit"
    if kind in ("uint16", "float32", "float64"):
        return _deep_tiff(file, page, np.dtype(kind))
    if kind != "uint8":
        raise BadInput(
            file, "sample type", kind, "8 or 16 bit unsigned integers or 32 or 64 bit floats"
        )
    with file.open("rb") as stream:
        # Pillow turns TIFF files upright by itself, unlike the other formats.
        return _eight_bits(file, _load_with_pillow(file, TiffImagePlugin.TiffImageFile, stream, 4))


def _tag_count(tiff: tifffile.TiffFile, page: tifffile.TiffPage) -> int:
    """How many tags the page announces: tifffile leaves out, with no more than a line in the
    log, those whose values lie beyond the file's end."""
    tiff.filehandle.seek(page.offset)
    count: int = struct.unpack(tiff.tiff.tagnoformat, tiff.filehandle.read(tiff.tiff.tagnosize))[0]
    return count


def _deep_tiff(file: Path, page: tifffile.TiffPage, sample_type: np.dtype[Any]) -> DecodedImage:
    """16 bit and float samples. OpenCV turns these upright by itself."""
    if page.photometric not in (0, 1, 2):
        name = getattr(page.photometric, "name", str(page.photometric))
        raise BadInput(file, "colour space", name, "RGB or grey")
    samples = page.samplesperpixel
    if samples not in ((3, 4) if page.photometric == 2 else (1,)):
        raise BadInput(file, "samples per pixel", str(samples), "1 (grey), 3 (RGB) or 4 (RGBA)")
    if samples > 1 and page.planarconfig == 2:
        raise BadInput(file, "planar configuration", "separate planes", "interleaved samples")
    values = _decode_with_opencv(file, "TIFF", np.fromfile(file, np.uint8), sample_type)
    if values.shape[2] != samples:
        raise _damaged(file, "TIFF")
    linear = values.dtype.kind == "f"
    full = 1 if linear else np.iinfo(values.dtype).max
    if page.photometric == 0:  # white is zero
        values = full - values
    has_alpha = samples == 4 and page.extrasamples[:1] in ((1,), (2,))
    opaque = values[..., 3] == full if has_alpha else None
    tag = page.tags.get(34675)
    mode = "RGB" if page.photometric == 2 else "L"
    expected = _srgb_codes_of_linear if linear else _identity
    _refuse_other_profiles(file, tag.value if tag else None, mode, expected)
    return DecodedImage(values[..., :3], opaque)


def _decode_with_opencv(
    file: Path, kind: str, data: NDArray[np.uint8], sample_type: np.dtype[Any]
) -> NDArray[Any]:
    """(height, width, channels), RGB(A) order, as stored."""
    import cv2

    values = cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
    if values is None or values.dtype != sample_type:
        raise _damaged(file, kind)
    if values.ndim == 2:
        return values[..., None]
    return values[..., [2, 1, 0, 3][: values.shape[2]]]


# --- OpenEXR ------------------------------------------------------------------------------------


def _decode_exr(file: Path) -> DecodedImage:
    picture = read_exr(file)
    opaque = None if picture.alpha is None else picture.alpha >= 1
    return DecodedImage(picture.colours, opaque, picture.notes)


# --- Colour profiles ----------------------------------------------------------------------------


def _identity(codes: NDArray[np.float64]) -> NDArray[np.float64]:
    return codes


def _srgb_codes_of_linear(codes: NDArray[np.float64]) -> NDArray[np.float64]:
    light = codes / 255
    curved = 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055
    return 255 * np.where(light <= 0.0031308, 12.92 * light, curved)


def _transform(file: Path, profile: bytes, mode: str) -> Any:
    """A colour transform from a profile to 8 bit sRGB."""
    from PIL import ImageCms

    try:
        return ImageCms.buildTransform(
            ImageCms.ImageCmsProfile(io.BytesIO(profile)),
            ImageCms.createProfile("sRGB"),
            mode,
            "RGB",
            ImageCms.Intent.RELATIVE_COLORIMETRIC,
        )
    except (OSError, ImageCms.PyCMSError) as error:
        raise BadInput(
            file, "ICC profile", "unreadable or of another colour space", "one of RGB or grey"
        ) from error


def _profile_is(
    file: Path,
    profile: bytes,
    mode: str,
    expected: Callable[[NDArray[np.float64]], NDArray[np.float64]],
) -> bool:
    """Whether a profile turns codes into the expected sRGB codes, to two steps of 255.

    Asked of the profile's behaviour, as dozens of profiles with as many names are sRGB.
    """
    from PIL import Image, ImageCms

    steps = np.linspace(0, 255, 18).astype(np.uint8)
    samples = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(18, -1, 3)
    if mode == "L":
        samples = np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 3, axis=2)
    probe = Image.fromarray(samples[..., 0] if mode == "L" else samples)
    out = np.asarray(ImageCms.applyTransform(probe, _transform(file, profile, mode)), np.float64)
    return bool(np.abs(out - expected(samples.astype(np.float64))).max() <= 2.0)


def _converted_to_srgb(file: Path, profile: bytes, image: Image.Image) -> Image.Image:
    from PIL import ImageCms

    converted = ImageCms.applyTransform(image, _transform(file, profile, image.mode))
    assert converted is not None  # None is only returned for a conversion in place
    return converted


def _refuse_other_profiles(
    file: Path,
    profile: bytes | None,
    mode: str,
    expected: Callable[[NDArray[np.float64]], NDArray[np.float64]],
) -> None:
    from PIL import ImageCms

    if not profile or _profile_is(file, profile, mode, expected):
        return
    name = ImageCms.getProfileDescription(ImageCms.ImageCmsProfile(io.BytesIO(profile))).strip()
    wanted = "sRGB" if expected is _identity else "linear light with the primaries of sRGB"
    raise BadInput(file, "ICC profile", repr(name[:60]), f"{wanted} in a file deeper than 8 bit")
