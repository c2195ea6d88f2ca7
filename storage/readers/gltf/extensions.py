"""Extensions of glTF 2.0: which are read, which may be passed over, and which are refused."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from storage.readers.bad_input import BadInput
from storage.readers.gltf.document import DRACO, INSTANCING, MESHOPT, VISIBILITY

_READ = {*MESHOPT, DRACO, INSTANCING, VISIBILITY, "KHR_mesh_quantization"}
LIGHTS = ("KHR_lights_punctual", "EXT_lights_ies", "EXT_lights_image_based")
_SAID = {*LIGHTS, "KHR_materials_variants", "MSFT_lod", "CESIUM_RTC"}
"""What `notes` has sentences for."""
_LOOKS = re.compile(r"[A-Z]+[0-9]*_(materials?|textures?)_.*")
"""Of materials and textures: whoever shows them judges."""
_WITHOUT_SHAPE = {
    "KHR_xmp", "KHR_xmp_json_ld", "KHR_animation_pointer", "KHR_interactivity",
    "KHR_node_hoverability", "KHR_node_selectability", "KHR_audio_emitter", "KHR_audio_graph",
    "KHR_physics_rigid_bodies", "KHR_implicit_shapes", "KHR_environment_map",
    "EXT_mesh_features", "EXT_instance_features", "EXT_structural_metadata", "EXT_mesh_manifold",
    "EXT_property_animation", "CESIUM_primitive_outline", "FB_geometry_metadata",
    "MSFT_screencoverage", "MSFT_packing_occlusionRoughnessMetallic",
    "MSFT_packing_normalRoughnessMetallic", "MSFT_audio_emitter", "AGI_articulations",
    "AGI_stk_metadata", "OMI_physics_body", "OMI_physics_shape", "VRM", "VRMC_vrm",
    "VRMC_springBone", "VRMC_materials_mtoon", "VRMC_node_constraint", "VRMC_vrm_animation",
    "MPEG_media", "GODOT_single_root", "BLENDER_physics", "MOZ_hubs_components",
}  # fmt: skip
"""Behaviour and knowledge about things: nothing that is drawn is lost."""


def check_version(file: Path, description: Any) -> None:
    """Raise BadInput for JSON of another version than 2, or that wants a later reader than 2.0."""
    asset = description.get("asset") if isinstance(description, dict) else None
    held = asset if isinstance(asset, dict) else {}
    version, least = held.get("version", "missing"), held.get("minVersion", "2.0")
    if not re.fullmatch(r"2(\.\d+)?", f"{version}"):
        expected = "2.0 (of glTF 1.0 gltf-pipeline makes 2.0)"
        raise BadInput(file, "glTF version", f"{version}", expected)
    if f"{least}" not in ("2.0", "2"):
        raise BadInput(file, "glTF minVersion", f"{least}", "2.0: export it as glTF 2.0")


def check_required(file: Path, document: dict[str, Any]) -> None:
    """Raise BadInput for a document that cannot be read without an extension that is not known."""
    for name in document.get("extensionsRequired", ()):
        if not _is_known(name):
            splats = "a mesh of triangles: splats have no surface"
            plain = "a file without it: export it anew with that extension turned off"
            raise BadInput(
                file, "required extension", name, splats if "gaussian_splat" in name else plain
            )


def unread(document: dict[str, Any]) -> list[str]:
    """The extensions that a file uses and that no module here knows, sorted."""
    names = {*document.get("extensionsUsed", ()), *document.get("extensionsRequired", ())}
    return sorted(name for name in names if not _is_known(name))


def _is_known(name: str) -> bool:
    return name in _READ | _SAID | _WITHOUT_SHAPE or _LOOKS.fullmatch(name) is not None
