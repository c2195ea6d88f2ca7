"""Small valid files of every format that is read."""

from __future__ import annotations

import io
import json
import os
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from storage.btf_file import BtfFile, Quantised, write_btf_file
from storage.packages.conformance import good_packages

SPECIAL = ("folder", "pipe", "socket", "device")
"""What a case's file may be instead of bytes."""


class Case(NamedTuple):
    """``files``: content by path, or one of ``SPECIAL``; ``entry``: the one that the reader gets,
    '' for the folder of all."""

    name: str
    reader: str
    entry: str
    files: Mapping[str, bytes | str]


def valid_cases() -> list[Case]:
    """One or more of each format; every one is read."""
    meshes = {
        "ascii.ply": PLY.encode(),
        "binary.ply": _binary_ply(),
        "mesh.obj": OBJ.encode(),
        "mesh.glb": glb(GLTF, glb_body()),
    }
    library = {
        "mesh.mtl": b"newmtl a\nKd .5 .25 1\nKs .1 .1 .1\nNs 30\nnewmtl b\nKd 1 0 0\nPr .4\n"
    }
    encoded = pictures(64, 66)
    lights = {**_radiance_pictures(16, 8), "light.exr": _exr(16, 8, "RGB", np.float32)}
    profiles = {
        "commas.csv": b"v,n\n" + b"".join(b"%d,%d.5\n" % (v, v % 3) for v in range(12)),
        "semicolons.csv": b"# v [um]; n [um]\n0,5; 0\n1,5; -0,25\n2; -1e-1\n3; 0\n",
    }
    return [
        *(Case(name, "photograph", name, {name: data}) for name, data in encoded.items()),
        *_people_have("photographs", "photograph"),
        *(Case(name, "environment", name, {name: data}) for name, data in lights.items()),
        *_people_have("light_probes", "environment", ".hdr"),
        *_people_have("light_probes", "environment", ".exr"),
        *(Case(name, "mesh", name, {name: data}) for name, data in meshes.items()),
        *(Case(name, "scene", name, {name: data, **library}) for name, data in meshes.items()),
        *_people_have("gltf", "mesh", ".glb"),
        *_people_have("meshes", "mesh"),
        *(Case(name, "profile", name, {name: data}) for name, data in profiles.items()),
        *(
            case
            for ending in (".txt", ".prf", ".smd", ".sdf")
            for case in _people_have("profiles", "profile", ending)
        ),
        *_btf_cases(),
        *(Case(name, "btf_file", name, {name: data}) for name, data in btf_files().items()),
        drive("png"),
        drive("jpg"),
        *_written_drives(),
        *(Case(name, "package", name, {name: data}) for name, data in good_packages().items()),
    ]


def _people_have(group: str, reader: str, ending: str = "") -> list[Case]:
    """One of each kind of a group of ``benchmarks.captures`` that is read."""
    from benchmarks.captures.case import write_file
    from benchmarks.captures.cases import CASES

    found = {}
    for case in CASES[group]:
        if case.ends != "refused" and case.write and case.file.endswith(ending):
            with tempfile.TemporaryDirectory() as folder:
                path = write_file(case, Path(folder))
                if len(os.listdir(folder)) == 1:  # without files beside it
                    found[case.kind] = Case(
                        path.name, reader, path.name, {path.name: path.read_bytes()}
                    )
    return list(found.values())


def glb(description: Any, body: bytes) -> bytes:
    """A GLB of its two chunks; ``description``: an object or text."""
    text = description if isinstance(description, bytes) else json.dumps(description).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def zipped(files: Mapping[str, bytes]) -> bytes:
    """A zip of these files; the same bytes at any time of day."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, data in files.items():
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)
    return stream.getvalue()


# --- Pictures -----------------------------------------------------------------------------------


def _pixels(width: int, height: int, dtype: Any = np.uint8, channels: int = 3) -> Any:
    values = np.random.default_rng(0).random((height, width, channels))
    if np.issubdtype(dtype, np.floating):
        return values.astype(dtype)
    return (values * np.iinfo(dtype).max).astype(dtype)


def pictures(width: int, height: int) -> dict[str, bytes]:
    """Photographs by name: formats, depths, with and without tags, strips and tiles."""
    import cv2
    import tifffile
    from PIL import Image, ImageCms

    image = Image.fromarray(_pixels(width, height))
    exif = Image.Exif()
    exif[0x0112] = 6
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    profile = profile[:24] + bytes(12) + profile[36:]  # without the time of its making
    files = {}
    encodings: dict[str, dict[str, Any]] = {
        "plain.png": {},
        "tagged.png": {"exif": exif, "icc_profile": profile},
        "plain.jpg": {"quality": 60},
        "tagged.jpg": {"exif": exif, "icc_profile": profile, "progressive": True},
        "packed.tif": {"compression": "tiff_lzw"},
    }
    for name, options in encodings.items():
        stream = io.BytesIO()
        kind = {"png": "PNG", "jpg": "JPEG", "tif": "TIFF"}[name[-3:]]
        image.save(stream, kind, **options)
        files[name] = stream.getvalue()
    files["deep.png"] = cv2.imencode(".png", _pixels(width, height, np.uint16))[1].tobytes()
    for name, dtype in {"deep.tif": np.uint16, "float.tif": np.float32}.items():
        stream = io.BytesIO()
        tifffile.imwrite(stream, _pixels(width, height, dtype), photometric="rgb")
        files[name] = stream.getvalue()
    files["tiled.tif"] = _tiled_tiff(width, height)
    return files | {"half.exr": _exr(width, height, "RGBA", np.float16)}


def _tiled_tiff(width: int, height: int) -> bytes:
    import tifffile

    stream = io.BytesIO()
    tifffile.imwrite(stream, _pixels(width, height, np.uint16), photometric="rgb", tile=(32, 32))
    return stream.getvalue()


def _exr(width: int, height: int, names: str, dtype: Any) -> bytes:
    import OpenEXR

    pixels = _pixels(width, height, dtype, len(names))
    pixels[..., 3:] = 1
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    stream = io.BytesIO()
    with OpenEXR.File(header, {names: np.ascontiguousarray(pixels)}) as file:
        file.write(stream)
    return stream.getvalue()


def _radiance_pictures(width: int, height: int) -> dict[str, bytes]:
    pixels = _pixels(width, height, np.uint8, 4)
    pixels[..., 3] = 128 + pixels[..., 3] % 4
    head = b"#?RADIANCE\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width)
    runs = b"".join(
        bytes([2, 2, width >> 8, width & 255])
        + b"".join(bytes([width]) + channel.tobytes() for channel in row.T)
        for row in pixels
    )
    return {"flat.hdr": head + pixels.tobytes(), "runs.hdr": head + runs}


# --- Meshes -------------------------------------------------------------------------------------

CORNERS = [(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
_FACES = [
    (0, 1, 3, 2),
    (4, 6, 7, 5),
    (0, 4, 5, 1),
    (2, 3, 7, 6),
    (0, 2, 6),
    (0, 6, 4),
    (1, 5, 7, 3),
]

PLY = (
    "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
    "property float z\nproperty float s\nproperty float t\nelement face 7\n"
    "property list uchar int vertex_indices\nend_header\n"
    + "".join(f"{x:g} {y:g} {z:g} {x / 2:g} {y / 2:g}\n" for x, y, z in CORNERS)
    + "".join(f"{len(face)} {' '.join(map(str, face))}\n" for face in _FACES)
)
OBJ = (
    "mtllib mesh.mtl\n"
    + "".join(f"v {x:g} {y:g} {z:g}\nvt {x / 2:g} {y / 2:g}\n" for x, y, z in CORNERS)
    + "".join(
        f"usemtl {'ab'[row % 2]}\nf {' '.join(f'{c + 1}/{c + 1}' for c in face)}\n"
        for row, face in enumerate(_FACES)
    )
    + "f 1 3 4 2 -4\n"
)


def _binary_ply() -> bytes:
    head = (
        "ply\nformat binary_little_endian 1.0\nelement vertex 8\nproperty double x\n"
        "property double y\nproperty double z\nelement face 7\n"
        "property list uchar uint vertex_index\nend_header\n"
    )
    rows = [struct.pack("<3d", *corner) for corner in CORNERS]
    rows += [struct.pack(f"<B{len(face)}I", len(face), *face) for face in _FACES]
    return head.encode() + b"".join(rows)


GLTF: dict[str, Any] = {
    "asset": {"version": "2.0"},
    "scene": 0,
    "scenes": [{"nodes": [0]}],
    "nodes": [
        {"mesh": 0, "scale": [1, 1, -2], "children": [1, 2]},
        {"mesh": 1, "translation": [3, 0, 0], "rotation": [0, 0, 0, 1]},
        {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1]},
    ],
    "buffers": [{"byteLength": 72}],
    "bufferViews": [
        {"buffer": 0, "byteOffset": 0, "byteLength": 48},
        {"buffer": 0, "byteOffset": 48, "byteLength": 12},
        {"buffer": 0, "byteOffset": 48, "byteLength": 24},
    ],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
        {"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC2"},
    ],
    "materials": [{"name": "red", "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}],
    "meshes": [
        {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]},
        {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": 4}]},
    ],
}


def glb_body() -> bytes:
    """What the accessors of ``GLTF`` are about."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "<f4")
    return corners.tobytes() + struct.pack("<6H", 0, 1, 2, 2, 3, 0) + bytes(12)


# --- BTFs and drives ----------------------------------------------------------------------------


def _btf_cases() -> list[Case]:
    encoded = pictures(12, 10)
    kinds = {
        "utia.png": encoded["plain.png"],
        "ubo.jpg": encoded["plain.jpg"],
        "atrium.hdr": _radiance_pictures(12, 10)["runs.hdr"],
        "utia.exr": _exr(12, 10, "RGB", np.float16),
    }
    cases = []
    for kind, data in kinds.items():
        gap = "_" if kind.startswith("utia") else " "
        files: dict[str, bytes | str] = {
            gap.join((f"tl000{gap}pl000", f"tv{theta:03}", f"pv000.{kind[-3:]}")): data
            for theta in (0, 30)
        }
        cases.append(Case(f"{kind}.folder", "btf", "", files))
        archive = zipped({name: data for name, data in files.items() if isinstance(data, bytes)})
        cases.append(Case(f"{kind}.zip", "btf", "wood.zip", {"wood.zip": archive}))
    return [*cases, Case("ubo2014", "btf", "wood.btf", {"wood.btf": _ubo2014(3, 2)})]


def _ubo2014(width: int, height: int) -> bytes:
    """Two views of two lights; a component a channel."""
    measurement = b"\0" * 240 + struct.pack("<f3fI", 1, 1, 1, 1, 1) + struct.pack("<II", 0, 3)
    measurement += b"".join(struct.pack("<I", 1) + name for name in (b"R", b"G", b"B"))
    out = b"!DFMF08FC" + struct.pack("<II", 8 + len(measurement), 4) + measurement
    out += struct.pack("<I", 2)
    for theta in (0.0, 0.5):
        out += struct.pack("<2fI4f", theta, 0, 2, 0, 0, 0.5, 1)
    out += struct.pack("<IIIi12f", width, height, 1, 11, *[1.0] * 12)
    for _ in range(3):
        factors = np.linspace(0.1, 1, 1 + 4 + width * height).astype("<f2")
        out += struct.pack("<BIII", 2, 1, 4, width * height) + factors.tobytes()
    return out


def btf_files() -> dict[str, bytes]:
    """Compressed BTFs: an image of symbols with everything, clusters, values as they are."""
    chance = np.random.default_rng(0)

    def symbols(*shape: int, steps: int | None = None) -> Quantised:
        step = np.float32(0.125) if steps is None else np.full(steps, 0.25, np.float32)
        return Quantised(np.rint(chance.normal(0, 3, shape)).astype(np.int32), np.array(step))

    decoder: dict[str, Quantised | NDArray[np.float32]] = {
        "weight_1": symbols(5, 7), "bias_1": np.ones(5, np.float32),
        "weight_2": symbols(3, 5), "bias_2": symbols(3),
    }  # fmt: skip
    student = {"weight_1": symbols(3, 7), "bias_1": symbols(3)}
    ids = np.arange(24 * 21, dtype=np.int32) % 7
    mips = tuple(symbols(count, 3, steps=3) for count in (12 * 11, 6 * 6, 3 * 3))
    parallax = np.full((9, 2), 0.5, np.float32)
    values = {name: np.ones(tensor.symbols.shape, np.float32) for name, tensor in student.items()}
    files = {
        "image.tbtf": BtfFile(
            decoder, symbols(24 * 21, 3, steps=3), 24, 21, 1.5, None, mips, parallax,
            student=student,
        ),
        "clusters.tbtf": BtfFile(decoder, symbols(7, 3, steps=3), 24, 21, 1.5, ids, mips),
        "paper.tbtf": BtfFile(values, np.ones((7, 3), np.float32), 24, 21, 1.5, ids),
    }  # fmt: skip
    return {name: write_btf_file(file) for name, file in files.items()}


def drive_transforms(ending: str) -> dict[str, Any]:
    """Two cameras, three times."""
    frames = [
        {
            "file_path": f"{camera}{time}.{ending}",
            "camera": camera,
            "time": time,
            "transform_matrix": [
                [1, 0, 0, 0.5 * (camera == "b")],
                [0, 0, -1, float(time)],
                [0, 1, 0, 1.5],
                [0, 0, 0, 1],
            ],
        }
        for time in range(3)
        for camera in "ab"
    ]
    lens = {"fl_x": 16.0, "fl_y": 16.0, "cx": 8, "cy": 6, "w": 16, "h": 12, "k1": 0.01}
    return {**lens, "camera_model": "OPENCV", "cameras": {"b": {"k2": 0.001}}, "frames": frames}


def drive(ending: str) -> Case:
    """A drive whose photographs are PNG (``png``) or JPEG (``jpg``) files."""
    data = pictures(16, 12)[f"plain.{ending}"]
    files: dict[str, bytes | str] = {
        f"{camera}{time}.{ending}": data for camera in "ab" for time in range(3)
    }
    files["transforms.json"] = json.dumps(drive_transforms(ending)).encode()
    return Case(f"{ending}.drive", "drive", "", files)


def _written_drives() -> list[Case]:
    """A drive in forms of each format: text, tables, binary."""
    from benchmarks.written_drives import FORMS

    cases = []
    for form in (
        "transforms_nerfstudio", "transforms_panorama", "colmap_rig_binary", "colmap_older_text",
        "kitti_sequence", "kitti_raw", "nuscenes",
    ):  # fmt: skip
        with tempfile.TemporaryDirectory() as folder:
            root = FORMS[form](Path(folder) / "drive").path
            files = {
                str(file.relative_to(root)): file.read_bytes()
                for file in sorted(root.rglob("*"))
                if file.is_file()
            }
        cases.append(Case(form, "drive", "", files))
    return cases


def with_png_checksums(data: bytes) -> bytes:
    """A PNG whose chunks' checksums are right, as far as its chunks can be followed."""
    out, at = bytearray(data), 8
    while at + 12 <= len(out):
        (length,) = struct.unpack_from(">I", out, at)
        end = at + 8 + length
        if end + 4 > len(out):
            break
        struct.pack_into(">I", out, end, zlib.crc32(out[at + 4 : end]))
        at = end + 4
    return bytes(out)
