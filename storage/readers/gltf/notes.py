"""What a glTF holds and is not read, or not as it may move: a sentence each."""

from __future__ import annotations

import re
from typing import Any

from storage.readers.bad_input import shortened
from storage.readers.gltf.extensions import LIGHTS, unread
from storage.readers.gltf.primitives import TRIANGLES, is_surface
from storage.readers.gltf.scene_tree import Group, Tree

_KNOWN_ATTRIBUTES = re.compile(
    r"POSITION|NORMAL|TANGENT|COLOR_0|(TEXCOORD|JOINTS|WEIGHTS)_[0-9]{1,3}"
)
_MOST_NAMES = 5


def document_notes(
    document: dict[str, Any], tree: Tree, groups: list[Group], flat: int
) -> list[str]:
    """``flat``: how many places of meshes are scaled to nothing, which hides them."""
    drawn = {group.mesh for group in groups}
    said = []
    if (scenes := _entries(document, "scenes")) > 1:
        said.append(f"{_are(scenes - 1, 'other scene')} left out.")
    if apart := len(set(range(_entries(document, "meshes"))) - drawn - set(tree.hidden)):
        said.append(f"{_are(apart, 'mesh', 'meshes')} not in the scene and left out.")
    if hidden := len(tree.hidden) + flat:
        said.append(f"{_are(hidden, 'mesh', 'meshes')} hidden by the file and left out.")
    lights = [_extension(document, name).get("lights") for name in LIGHTS]
    for count, one in (
        (_entries(document, "cameras"), "camera"),
        (sum(len(each) for each in lights if isinstance(each, list)), "light"),
        (_entries(document, "animations"), "animation"),
    ):
        if count:
            said.append(f"{_are(count, one)} left out.")
    variants = _extension(document, "KHR_materials_variants").get("variants")
    if isinstance(variants, list) and variants:
        said.append(f"Of {_many(len(variants), 'material variant')} the default look is read.")
    entries = [*document.get("nodes", ()), *_objects(document, "materials")]
    if lods := sum("MSFT_lod" in (entry.get("extensions") or ()) for entry in entries):
        said.append(f"{_many(lods, 'entry', 'entries')} with levels of detail: the finest is read.")
    if _extension(document, "CESIUM_RTC"):
        said.append("The centre of CESIUM_RTC is not added: positions are relative to it.")
    if names := unread(document):
        said.append(f"Extensions that are not read: {_listed(names)}.")
    return said


def mesh_notes(
    document: dict[str, Any], groups: list[Group], leftover: int, clamped: int
) -> list[str]:
    """``leftover``: corners that make no whole triangle; ``clamped``: vertices whose colours were
    not from 0 to 1."""
    said = []
    if skinned := len({group.mesh for group in groups if group.skin is not None}):
        said.append(f"{_many(skinned, 'mesh', 'meshes')} with a skin: posed as the joints stand.")
    primitives = [
        entry
        for mesh in sorted({group.mesh for group in groups})
        for entry in document["meshes"][mesh]["primitives"]
    ]
    surfaces = [entry for entry in primitives if is_surface(entry)]
    if morphed := sum("targets" in entry for entry in surfaces):
        things = _many(morphed, "primitive")
        said.append(f"{things} with morph targets: in the shape of the file's weights.")
    lines = sum(entry.get("mode", TRIANGLES) < TRIANGLES for entry in primitives)
    if lines:
        said.append(f"{_are(lines, 'primitive')} of points or lines and left out.")
    if bare := len(primitives) - len(surfaces) - lines:
        said.append(f"{_are(bare, 'primitive')} without positions and left out.")
    if leftover:
        said.append(f"{_many(leftover, 'last corner')} made no whole triangle: left out.")
    if clamped:
        said.append(f"Colours of {_many(clamped, 'vertex', 'vertices')} clamped to 0 to 1.")
    names = sorted({name for entry in surfaces for name in entry["attributes"]})
    if unknown := [name for name in names if not _KNOWN_ATTRIBUTES.fullmatch(name)]:
        said.append(f"Attributes of vertices that are not read: {_listed(unknown)}.")
    return said


def _entries(document: dict[str, Any], name: str) -> int:
    entries = document.get(name)
    return len(entries) if isinstance(entries, list) else 0


def _objects(document: dict[str, Any], name: str) -> list[dict[str, Any]]:
    entries = document.get(name)
    return [e for e in entries if isinstance(e, dict)] if isinstance(entries, list) else []


def _extension(document: dict[str, Any], name: str) -> dict[str, Any]:
    extensions = document.get("extensions")
    held = extensions.get(name) if isinstance(extensions, dict) else None
    return held if isinstance(held, dict) else {}


def _listed(names: list[str]) -> str:
    shown = ", ".join(shortened(name, 40) for name in names[:_MOST_NAMES])
    return shown if len(names) <= _MOST_NAMES else f"{shown} and {len(names) - _MOST_NAMES} more"


def _many(count: int, one: str, several: str = "") -> str:
    return f"{count} {one if count == 1 else several or one + 's'}"


def _are(count: int, one: str, several: str = "") -> str:
    return f"{_many(count, one, several)} {'is' if count == 1 else 'are'}"
