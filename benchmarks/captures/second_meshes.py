"""Meshes as trimesh sees them, and as their own headers and lists tell without any reader."""

from __future__ import annotations

import json
import re
import struct
from pathlib import Path
from typing import Any

Found = dict[str, str]

# What only says how geometry, textures and materials that everyone reads are stored.
_EVERYWHERE = frozenset(
    """KHR_texture_transform KHR_mesh_quantization KHR_draco_mesh_compression KHR_texture_basisu
    EXT_meshopt_compression KHR_meshopt_compression EXT_mesh_gpu_instancing EXT_texture_webp
    EXT_texture_avif KHR_xmp_json_ld KHR_xmp KHR_materials_pbrSpecularGlossiness
    KHR_materials_specular KHR_materials_ior KHR_lights_punctual""".split()  # noqa: SIM905
)
_OF_VERTICES = re.compile(r"n?[xyz]|([a-z]*_)?(red|green|blue|alpha)|[rgba]|[stuv]|texture_?[uvst]")


def in_gltf(path: Path) -> Found:
    """By its JSON, as the specification has it."""
    data = path.read_bytes()
    text = data
    if data[:4] == b"glTF":
        text = data[20 : 20 + struct.unpack_from("<I", data, 12)[0]]
    document: dict[str, Any] = json.loads(
        text.decode("utf-8-sig", "replace").rstrip("\0 "),
        object_pairs_hook=lambda pairs: {name: value for name, value in pairs if value is not None},
    )
    found: Found = {}
    for thing in ("animation", "camera", "skin"):
        if document.get(f"{thing}s"):
            found[thing] = f"{len(document[f'{thing}s'])}"
    if len(document.get("scenes", ())) > 1:
        found["scene"] = f"{len(document['scenes'])} scenes"
    lights = document.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights")
    if lights:
        found["light"] = f"{len(lights)}"
    primitives = [
        primitive for mesh in document.get("meshes", ()) for primitive in mesh["primitives"]
    ]
    modes = {primitive.get("mode", 4) for primitive in primitives}
    if modes & {0, 1, 2, 3}:
        found["lines"] = f"modes {sorted(modes)}"
    if any(primitive.get("targets") for primitive in primitives):
        found["morph"] = "targets"
    drawn = _drawn_meshes(document)
    if drawn is not None and len(drawn) < len(document.get("meshes", ())):
        found["mesh"] = f"{len(document['meshes']) - len(drawn)} outside of the scene"
    names = {name for primitive in primitives for name in primitive.get("attributes", {})}
    if "COLOR_0" in names:
        found["colours"] = "COLOR_0"
    own = sorted(name for name in names if name.startswith("_"))
    if own:
        found["attribute"] = ", ".join(own)
    found |= _of_materials(document)
    extensions = sorted(set(document.get("extensionsUsed", ())) - _EVERYWHERE)
    if extensions:
        found["extension"] = ", ".join(extensions)
    return found


def _drawn_meshes(document: dict[str, Any]) -> set[int] | None:
    """The meshes of the scene's nodes and of those below; None without a scene."""
    scenes, nodes = document.get("scenes"), document.get("nodes", [])
    if not scenes:
        return None
    waiting = list(scenes[document.get("scene", 0)].get("nodes", ()))
    reached: set[int] = set()
    while waiting:
        at = waiting.pop()
        if at not in reached:
            reached.add(at)
            waiting += nodes[at].get("children", ())
    return {nodes[at]["mesh"] for at in reached if "mesh" in nodes[at]}


def _of_materials(document: dict[str, Any]) -> Found:
    found: Found = {}
    materials = json.dumps(document.get("materials", ()))
    if re.search(r'Texture"', materials) and document.get("images"):
        found["texture"] = f"{len(document['images'])} images"
    if "occlusionTexture" in materials:
        found["occlusion"] = "a texture"
    if any(sum(m.get("emissiveFactor", ())) > 0 for m in document.get("materials", ())):
        found["emission"] = "a factor"
    modes = {m.get("alphaMode", "OPAQUE") for m in document.get("materials", ())}
    if modes - {"OPAQUE"}:
        found["alpha"] = ", ".join(sorted(modes))
    return found


def in_obj(path: Path) -> Found:
    """By the keywords of its lines, and of its material libraries'."""
    text = _text(path)
    words = {line.split(None, 1)[0] for line in text.splitlines() if line.strip()}
    found: Found = {}
    if words & {"l", "p"}:
        found["lines"] = ", ".join(sorted(words & {"l", "p"}))
    if words & {"curv", "curv2", "surf"}:
        found["curves"] = ", ".join(sorted(words & {"curv", "curv2", "surf"}))
    colours = re.search(r"^\s*v((\s+[-+\d.e]+){6,7})\s*$", text, re.MULTILINE | re.IGNORECASE)
    if colours:
        found["colours"] = "of vertices"
    for name in re.findall(r"^\s*mtllib\s+(.+?)\s*$", text, re.MULTILINE):
        library = path.parent / name
        if library.is_file():
            found |= _in_library(library)
    return found


def _in_library(path: Path) -> Found:
    text = _text(path)
    found: Found = {}
    maps = re.findall(r"^\s*(map_\w+|bump|norm|disp|decal|refl)\s", text, re.MULTILINE)
    if maps:
        found["texture"] = ", ".join(sorted(set(maps)))
    emitted = re.findall(r"^\s*Ke\s+([\d.eE+-]+)(?:\s+([\d.eE+-]+)\s+([\d.eE+-]+))?", text,
                         re.MULTILINE)  # fmt: skip
    if any(float(value) > 0 for values in emitted for value in values if value):
        found["emission"] = "Ke"
    dissolved = re.findall(r"^\s*d\s+([\d.eE+-]+)\s*$", text, re.MULTILINE)
    if any(float(value) < 1 for value in dissolved):
        found["alpha"] = "d"
    return found


def in_ply(path: Path) -> Found:
    """By its header, and by trimesh where colours are."""
    header = path.read_bytes().partition(b"end_header")[0].decode("latin-1")
    lines = [line.split() for line in header.replace("\r", "\n").split("\n") if line.strip()]
    found: Found = {}
    others = [
        line[1]
        for line in lines
        if line[0] == "element"
        and line[1] not in ("vertex", "face", "tristrips", "tristrip")
        and int(line[2]) > 0
    ]
    if others:
        found["element"] = ", ".join(others)
    names: set[str] = set()
    of_vertices: set[str] = set()
    element = ""
    for line in lines:
        element = line[1] if line[0] == "element" else element
        if line[0] == "property":
            names.add(line[-1].lower())
            of_vertices |= {line[-1].lower()} if element == "vertex" else set()
    own = sorted(name for name in of_vertices if not _OF_VERTICES.fullmatch(name))
    if own:
        found["attribute"] = ", ".join(own)
    colours = ({"red", "green", "blue"}, {"diffuse_red", "diffuse_green", "diffuse_blue"})
    if any(three <= names for three in (*colours, {"r", "g", "b"})):
        found["colours"] = "of vertices or faces"
    textures = [" ".join(line[2:]) for line in lines if line[:2] == ["comment", "TextureFile"]]
    if textures:
        found["texture"] = ", ".join(textures)
    return found


def in_stl(path: Path) -> Found:
    """Colours, where trimesh reads some or the triangles' last two bytes hold them."""
    data = path.read_bytes()
    if len(data) < 84 or len(data) != 84 + 50 * struct.unpack_from("<I", data, 80)[0]:
        return {}
    marks = {data[at : at + 2] for at in range(84 + 48, len(data), 50)}
    return {"colours": "of triangles"} if marks - {b"\0\0"} else {}


def _text(path: Path) -> str:
    data = path.read_bytes()
    for mark, name in (
        (b"\xff\xfe", "utf-16"),
        (b"\xfe\xff", "utf-16"),
        (b"\xef\xbb\xbf", "utf-8"),
    ):
        if data.startswith(mark):
            return data.decode(name, "replace").lstrip("\ufeff")
    return data.decode("utf-8", "replace")
