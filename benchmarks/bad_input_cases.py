"""Named files that once hung a reader, took gigabytes or raised what no user understands."""

from __future__ import annotations

import json
import math
import struct
from typing import Any

import numpy as np

from benchmarks.bad_input_files import (
    CORNERS,
    GLTF,
    OBJ,
    PLY,
    SPECIAL,
    Case,
    btf_files,
    drive,
    glb,
    glb_body,
    pictures,
    with_png_checksums,
)
from storage.btf_file.layout import sealed
from storage.packages.conformance import bad_packages


def named_cases() -> list[Case]:
    """Files that once hung a reader, took gigabytes or raised what no user understands."""
    return [
        *_named_pictures(),
        *_named_meshes(),
        *_named_glbs(),
        *_named_drives(),
        *_named_btf_files(),
        *_named_specials(),
        *(Case(name, "package", name, {name: data}) for name, data in bad_packages().items()),
        Case("commas", "profile", "p.csv", {"p.csv": b"," * 1_000_000 + b"\n"}),
        Case("comments", "profile", "p.csv", {"p.csv": b"#\n" * 600_000}),
        Case("token", "profile", "p.csv", {"p.csv": b"v,n\n" + b"1" * 900_000 + b",2\n"}),
    ]


def _named_btf_files() -> list[Case]:
    """A billion texels that take no bytes, the largest image, and decoders as large as can be."""
    image = btf_files()["image.tbtf"]

    def changed(at: int, value: bytes) -> bytes:
        return sealed(image[:at] + value + image[at + len(value) :])

    cases = {
        "billion texels": changed(16, struct.pack("<2HI", 65535, 16384, 65535 * 16384)),
        "as many as can be": changed(16, struct.pack("<2HI", 1671, 1671, 1671 * 1671)),
        "one line": changed(16, struct.pack("<2HI", 1, 65535, 65535)),
        "wide layers": changed(40, struct.pack("<H", 4096)),
        "no side": changed(36, b"\0"),
        "newer": image[:4] + b"\2" + image[5:],
    }
    return [Case(name, "btf_file", "a.tbtf", {"a.tbtf": data}) for name, data in cases.items()]


def _named_pictures() -> list[Case]:
    import cv2

    encoded = pictures(64, 66)
    broken = encoded["tagged.png"].replace(b"MM\0*", b"XX\0*").replace(b"II*\0", b"XX*\0")
    deep = encoded["deep.png"]
    length = deep.index(b"IDAT") - 4
    endless = deep[:length] + b"\xff\0\0\0" + deep[length + 4 :]
    zeros = cv2.imencode(".png", np.zeros((8_000, 8_000), np.uint8))[1].tobytes()
    grey = cv2.imencode(
        ".jpg", np.zeros((3000, 3000), np.uint8), [cv2.IMWRITE_JPEG_PROGRESSIVE, 1]
    )[1].tobytes()
    last = grey[grey.rindex(b"\xff\xda") : -2]
    return [
        Case("broken EXIF", "photograph", "a.png", {"a.png": with_png_checksums(broken)}),
        Case("endless chunk", "photograph", "a.png", {"a.png": endless}),
        Case("unfolding PNG", "photograph", "a.png", {"a.png": zeros}),
        Case(
            "endless scans",
            "photograph",
            "a.jpg",
            {"a.jpg": grey[:-2] + last * 300 + grey[-2:]},
        ),
    ]


def _named_meshes() -> list[Case]:
    ply = PLY.replace("4 0 1 3 2", "{}")
    corners = "".join(f"v {x:g} {y:g} {z:g}\n" for x, y, z in CORNERS)
    around = "".join(
        f"v {math.cos(a / 400 * math.pi)} {math.sin(a / 400 * math.pi)} 0\n" for a in range(800)
    )
    texts = {
        "count.ply": ply.format("1e400 0 1 3 2"),
        "negative.ply": ply.format("-4 0 1 3 2"),
        "token.ply": ply.format("4 0 1 3 " + "2" * 900_000),
        "fraction.ply": ply.format("4 0 1 3 1.5"),
        "rows.ply": PLY.replace("vertex 8", "vertex 900000000000000000"),
        "token.obj": OBJ + "f 1 2 " + "3" * 900_000 + "\n",
        "position.obj": "v 1 2 " + "3" * 900_000 + "\n",
        "line.obj": corners + "f" + " 1 2 3" * 200_000 + "\n",
        "repeated.obj": corners + "f" + " 1 2 3 4" * 250 + "\n",
        "faces.obj": corners + ("f" + " 1 2 3 4" * 5000 + "\n") * 50,
        "cap.obj": around + "f " + " ".join(map(str, range(1, 801))) + "\n",
    }
    return [
        Case(name, reader, name, {name: text.encode()})
        for name, text in texts.items()
        for reader in ("mesh", "scene")
    ]


def _named_glbs() -> list[Case]:
    body = np.random.default_rng(0).random((90_000, 3)).astype("<f4").tobytes()
    many = GLTF | {
        "scenes": [{"nodes": list(range(5000))}],
        "nodes": [{"mesh": 0} for _ in range(5000)],
        "buffers": [{"byteLength": len(body)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(body)}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 90_000, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "materials": [],
    }
    chain: list[dict[str, Any]] = [{"mesh": 0, "children": [row + 1]} for row in range(4000)]
    zeros = {"componentType": 5126, "count": 2_000_000_000, "type": "VEC3"}
    digits = json.dumps(GLTF).replace('"count": 4', '"count": ' + "9" * 400).encode()
    nodes = [{"mesh": 0}] * 200_000
    files = {
        "digits.glb": glb(digits, glb_body()),
        "nodes.glb": glb(GLTF | {"nodes": nodes}, glb_body()),
        "nested.glb": glb(b'{"asset": ' + b"[" * 200_000, b""),
        "closed.glb": glb(b'{"asset": ' + b"[" * 900 + b"]" * 900 + b"}", b""),
        "instances.glb": glb(many, body),
        "views.glb": glb(many | {"nodes": [], "bufferViews": many["bufferViews"] * 5000}, body),
        "chain.glb": glb(GLTF | {"nodes": [*chain, {"mesh": 0}]}, glb_body()),
        "circle.glb": glb(GLTF | {"nodes": [{"children": [1]}, {"children": [0]}]}, glb_body()),
        "zeros.glb": glb(GLTF | {"accessors": [zeros, *GLTF["accessors"][1:]]}, glb_body()),
    }
    return [
        Case(name, reader, name, {name: data})
        for name, data in files.items()
        for reader in ("mesh", "scene")
    ]


def _named_drives() -> list[Case]:
    valid = drive("png")
    text = valid.files["transforms.json"]
    assert isinstance(text, bytes)
    digits = b"9" * 400
    changes = {
        "focal digits": text.replace(b'"fl_x": 16.0', b'"fl_x": ' + digits),
        "camera digits": text.replace(b'"camera": "a"', b'"camera": ' + digits),
        "time digits": text.replace(b'"time": 1', b'"time": ' + digits),
        "focal of nothing": text.replace(b"16.0", b"1e-300"),
        "focal of everything": text.replace(b"16.0", b"1e300"),
        "distortion": text.replace(b'"k1": 0.01', b'"k1": 1e300'),
        "nested": b'{"frames": ' + b"[" * 200_000,
        "nested and closed": b'{"frames": ' + b"[" * 900 + b"]" * 900 + b"}",
    }
    frame = text[text.index(b"[{") + 1 : text.index(b"}, {") + 1]
    changes["frames"] = text.replace(frame, b", ".join([frame] * 50_000))
    return [
        Case(name, "drive", "", {**valid.files, "transforms.json": changed})
        for name, changed in changes.items()
    ]


def _named_specials() -> list[Case]:
    entries = {
        "photograph": "a.png",
        "environment": "a.exr",
        "mesh": "a.obj",
        "scene": "a.obj",
        "profile": "a.csv",
        "btf": "a.btf",
    }
    cases = [
        Case(f"{kind} as {reader}", reader, name, {name: kind})
        for reader, name in entries.items()
        for kind in SPECIAL
        if (reader, kind) != ("btf", "folder")
    ]
    valid = drive("png").files
    wood = "tl000_pl000_tv000_pv000.png"
    return [
        *cases,
        *(
            Case(f"{kind} in a drive", "drive", "", {**valid, name: kind})
            for kind in SPECIAL
            for name in ("transforms.json", "a1.png")
        ),
        *(Case(f"{kind} in a BTF", "btf", "", {wood: kind}) for kind in SPECIAL[1:]),
        Case("library", "scene", "a.obj", {"a.obj": OBJ.encode(), "mesh.mtl": "pipe"}),
    ]
