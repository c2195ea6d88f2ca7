"""Packages, good and bad, that any program's reader can be run against.

    python -m storage.packages.conformance write FOLDER
    python -m storage.packages.conformance run COMMAND [ARGUMENT …]

``write`` puts all packages and `expected.json` into a folder. ``run`` calls the command with the
path of each package as its last argument. Of a good package it is to print one JSON object,
``{"parts": {NAME: DIGEST}}``, and to end with 0; DIGEST is the SHA-256, in hexadecimal, of a part's
values as little-endian bytes in C order; a mesh has one for each of its attributes and for
`indices`, under ``NAME/POSITION`` and so on. A bad package it is to refuse: to end with another
code than 0, in ten seconds, not by a signal.
"""

from __future__ import annotations

import hashlib
import io
import json
import struct
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from storage.packages.schema import (
    ArrayPart,
    Mesh,
    MeshPart,
    PackageSchema,
    Parameter,
    PicturePart,
    TexturesPart,
)
from storage.packages.writing import META, Contents, Source, View, write_package

if TYPE_CHECKING:
    import numpy as np

SECONDS = 10.0
"""A reader may take for one package."""
_INTEGERS = ("int8", "uint8", "int16", "uint16", "int32", "uint32")

SMALL = PackageSchema(
    "conformance",
    1,
    "Every kind of part, of every type.",
    {
        **{name: ArrayPart(("row", "column"), name, "1", f"Values, {name}") for name in _INTEGERS},
        "float16": ArrayPart(("row", "column"), "float16", "1", "Values, float16"),
        "float32": ArrayPart(("row", "column"), "float32", "1", "Values, float32"),
        "scalar": ArrayPart((), "float32", "1", "One value"),
        "empty": ArrayPart(("row",), "uint8", "1", "No value", optional=True),
        **{f"picture_{n}": PicturePart(f"{n} channels", channels=n) for n in range(1, 5)},
        "deep": PicturePart("16 bits", channels=4, dtype="uint16"),
        "tile_*/texels": TexturesPart("Texels of a tile", channels=4),
        "halfs": TexturesPart("Texels, float16", channels=2, dtype="float16"),
        "mesh": MeshPart("A triangle pair", attributes={"LAYER": "Number"}),
    },
    {"alpha": Parameter("1", "A number"), "name": Parameter("1", "A text")},
)


def small_contents(seed: int = 0) -> Contents:
    """Random values for all parts of `SMALL`."""
    import numpy as np

    random = np.random.default_rng(seed)
    values: dict[str, Any] = {
        name: random.integers(np.iinfo(name).min, np.iinfo(name).max, (5, 7), name, endpoint=True)
        for name in _INTEGERS
    }
    values |= {
        "float16": random.normal(size=(5, 7)).astype(np.float16),
        "float32": random.normal(size=(5, 7)).astype(np.float32),
        "scalar": np.float32(0.1),
        "empty": np.empty(0, np.uint8),
        "deep": random.integers(0, 1 << 16, (6, 5, 4), np.uint16),
        "halfs": random.normal(size=(3, 4, 6, 2)).astype(np.float16),
        "mesh": _small_mesh(random),
    }
    for channels in range(1, 5):
        values[f"picture_{channels}"] = random.integers(0, 256, (9, 8, channels), np.uint8)
    for tile in range(2):
        values[f"tile_{tile:03d}/texels"] = random.integers(0, 256, (2, 4, 4, 4), np.uint8)
    # Pictures that deflate makes smaller, and alpha of 0 with colours below it.
    for name in ("poster", "input", "reference_front"):
        values[name] = np.full((8, 8, 3), 77, np.uint8)
    values["picture_4"][:2, :, 3] = 0
    camera: dict[str, Any] = {
        "position": [3.0, 0.0, 0.0],
        "target": [0.0, 0.0, 0.0],
        "up": [0.0, 0.0, 1.0],
    }
    camera |= {"view_angle": 30.0, "height": None}
    view = View("front", "reference_front", 8, 8, 1, camera, {"light": [0.0, 0.0, 1.0]})
    return Contents(
        "Every kind of part",
        (Source("random numbers", "CC0-1.0"),),
        values,
        {"alpha": 1.5, "name": "wool, naïve"},
        (view,),
    )


def _small_mesh(random: np.random.Generator) -> Mesh:
    import numpy as np

    def floats(*shape: int) -> Any:
        return random.random(shape).astype(np.float32)

    triangles = np.array([[0, 1, 2], [1, 3, 2]], np.uint32)
    return Mesh(floats(4, 3), triangles, floats(4, 3), floats(4, 2), {"LAYER": floats(4)})


def good_packages() -> dict[str, bytes]:
    """Packages that each reader has to read, by file name."""
    plain = write_package(SMALL, small_contents())
    return {
        "plain.tsuya": plain,
        "other_values.tsuya": write_package(SMALL, small_contents(1)),
        "unknown_fields.tsuya": _with_meta(plain, lambda meta: meta | {"mood": "sunny"}),
        "unknown_files.tsuya": _packed(_files(plain) | {"notes/read me.txt": b"hello"}),
        "all_stored.tsuya": _packed(_files(plain), zipfile.ZIP_STORED),
        "meta_last.tsuya": _packed(dict(reversed(_files(plain).items()))),
    }


def bad_packages() -> dict[str, bytes]:
    """Packages that each reader has to refuse, by file name."""
    plain = write_package(SMALL, small_contents())
    files = _files(plain)
    bad = {
        "empty.tsuya": b"",
        "text.tsuya": b"no zip at all\n" * 40,
        "no_meta.tsuya": _packed({name: each for name, each in files.items() if name != META}),
        "meta_no_json.tsuya": _packed(files | {META: b'{"format": 1,'}),
        "meta_a_list.tsuya": _packed(files | {META: b"[1, 2]"}),
        "no_part.tsuya": _packed(
            {name: each for name, each in files.items() if name != "float32.bin"}
        ),
        "other_content.tsuya": _packed(files | {"float32.bin": b"\0" * len(files["float32.bin"])}),
        "short_content.tsuya": _packed(files | {"float32.bin": files["float32.bin"][:-4]}),
        "no_png.tsuya": rehashed(files | {"picture_3.png": b"\x89PNG\r\n\x1a\n" + b"\0" * 90}),
        "no_glb.tsuya": rehashed(files | {"mesh.glb": files["mesh.glb"][:60]}),
        "no_ktx2.tsuya": rehashed(files | {"halfs.ktx2": files["halfs.ktx2"][:120]}),
        "huge_ktx2.tsuya": rehashed(files | {"halfs.ktx2": _huge_ktx2(files["halfs.ktx2"])}),
    }
    for share in (0.2, 0.5, 0.8, 0.99):
        bad[f"cut_at_{share:g}.tsuya"] = plain[: int(len(plain) * share)]
    place = plain.index(files["float32.bin"])
    flipped = bytearray(plain)
    flipped[place + 5] ^= 0x10
    bad["one_bit.tsuya"] = bytes(flipped)
    for name, change in _BAD_METAS.items():
        bad[f"{name}.tsuya"] = _with_meta(plain, change)
    return bad


def expected_digests(name: str) -> dict[str, str]:
    """Digests of the parts of a good package, from the values that were written."""
    import numpy as np

    contents = small_contents(1 if name == "other_values.tsuya" else 0)
    digests: dict[str, str] = {}
    for part, value in contents.values.items():
        if isinstance(value, Mesh):
            assert value.normals is not None
            assert value.uvs is not None
            flipped = np.stack([value.uvs[:, 0], 1 - value.uvs[:, 1]], axis=1)
            arrays: dict[str, Any] = {
                "POSITION": value.vertices,
                "NORMAL": value.normals,
                "TEXCOORD_0": flipped,
                "indices": value.triangles.reshape(-1),
            }
            arrays |= {f"_{key}": each for key, each in value.attributes.items()}
            digests |= {f"{part}/{key}": digest(each) for key, each in arrays.items()}
        else:
            digests[part] = digest(np.asarray(value))
    return digests


def digest(values: Any) -> str:
    """SHA-256 of values as little-endian bytes in C order."""
    little = values.astype(values.dtype.newbyteorder("<"), copy=False)
    return hashlib.sha256(little.tobytes()).hexdigest()


def problems(command: Sequence[str]) -> list[str]:
    """What a reader does wrong, a sentence each; see the module for what it is to do."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for name, content in (good_packages() | bad_packages()).items():
            path = Path(folder, name)
            path.write_bytes(content)
            wrong = _problem(command, path, name)
            if wrong is not None:
                found.append(f"{name}: {wrong}")
    return found


def _problem(command: Sequence[str], path: Path, name: str) -> str | None:
    try:
        ended = subprocess.run(
            [*command, str(path)], capture_output=True, timeout=SECONDS, check=False
        )
    except subprocess.TimeoutExpired:
        return f"not done after {SECONDS:g} s."
    if ended.returncode < 0:
        return f"ended by signal {-ended.returncode}."
    if name in bad_packages():
        return None if ended.returncode else "read; expected a refusal."
    if ended.returncode:
        return f"refused: {ended.stderr.decode(errors='replace').strip()[-300:]}"
    try:
        parts = json.loads(ended.stdout)["parts"]
    except (ValueError, KeyError, TypeError):
        return 'printed no {"parts": …}.'
    expected = expected_digests(name)
    differing = sorted(part for part in expected if parts.get(part) != expected[part])
    return f"read differently: {', '.join(differing)}." if differing else None


# ---- making bad ones -------------------------------------------------------------------------


def _files(package: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(package)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _packed(files: Mapping[str, bytes], compression: int = zipfile.ZIP_DEFLATED) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", compression) as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), content, compression)
    return packed.getvalue()


def _with_meta(package: bytes, change: Callable[[dict[str, Any]], dict[str, Any]]) -> bytes:
    files = _files(package)
    return _packed(files | {META: json.dumps(change(json.loads(files[META]))).encode()})


def rehashed(files: Mapping[str, bytes]) -> bytes:
    """A package whose hashes and sizes are those of its files, whatever these are.

    Raises ValueError, KeyError, TypeError where `meta.json` does not tell the parts' files.
    """
    meta = json.loads(files[META])
    for part in meta["parts"].values():
        content = files[part["file"]]
        part |= {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
    return _packed({**files, META: json.dumps(meta).encode()})


def _huge_ktx2(content: bytes) -> bytes:
    """Announces 2^31 x 2^31 texels."""
    return content[:20] + struct.pack("<2I", 1 << 31, 1 << 31) + content[28:]


def _in_part(**fields: Any) -> Callable[[dict[str, Any]], dict[str, Any]]:
    def change(meta: dict[str, Any]) -> dict[str, Any]:
        meta["parts"]["float32"] |= fields
        return meta

    return change


_BAD_METAS: Mapping[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
    "newer_format": lambda meta: meta | {"format": 2},
    "format_a_text": lambda meta: meta | {"format": "1"},
    "no_parts": lambda meta: {key: value for key, value in meta.items() if key != "parts"},
    "parts_a_list": lambda meta: meta | {"parts": list(meta["parts"].values())},
    "path_out": _in_part(file="../../float32.bin"),
    "path_absolute": _in_part(file="/etc/passwd"),
    "path_backslash": _in_part(file="..\\float32.bin"),
    "wrong_hash": _in_part(sha256="0" * 64),
    "no_hash": _in_part(sha256=None),
    "wrong_bytes": _in_part(bytes=10**15),
    "absurd_shape": _in_part(shape=[1 << 30, 1 << 30]),
    "negative_shape": _in_part(shape=[-5, -7]),
    "shape_a_text": _in_part(shape="5 x 7"),
    "unknown_dtype": _in_part(dtype="float128"),
    "object_dtype": _in_part(dtype="O"),
    "unknown_kind": _in_part(kind="pickle"),
}


def write_packages(folder: Path) -> None:
    """All packages under `good/` and `bad/`, and `expected.json`: digests by file and part."""
    for kind, packages in (("good", good_packages()), ("bad", bad_packages())):
        (folder / kind).mkdir(parents=True, exist_ok=True)
        for name, content in packages.items():
            (folder / kind / name).write_bytes(content)
    expected = {name: expected_digests(name) for name in good_packages()}
    (folder / "expected.json").write_text(json.dumps(expected, indent=1))


def main(arguments: Sequence[str]) -> int:
    """The command line of the module; 0 where all is right."""
    match arguments:
        case ["write", folder]:
            write_packages(Path(folder))
            return 0
        case ["run", *command] if command:
            found = problems(command)
            print("\n".join(found) or "The reader conforms.")
            return 1 if found else 0
    print(__doc__, file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
