"""Extensions of glTF 2.0: which are read, which may be passed over, and which are refused."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from storage.readers.bad_input import BadInput, shortened
from storage.readers.gltf.document import DRACO, INSTANCING, MESHOPT, VISIBILITY

_READ = {*MESHOPT, DRACO, INSTANCING, VISIBILITY, "KHR_mesh_quantization"}
_SAID = {"KHR_lights_punctual", "KHR_materials_variants", "MSFT_lod"}
"""What `notes` has a sentence for."""
_LOOKS = re.compile(r"[A-Z]+[0-9]*_(materials?|textures?|lights?)_.*|MSFT_texture_dds|EXT_bloom")
"""Of materials, textures and lights: whoever shows them judges."""
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
_WAYS_OUT = {
    "KHR_gaussian_splatting": "triangles, which splats have none of",
    "KHR_techniques_webgl": "plain materials: gltf-pipeline turns them into such",
}


def check_version_and_extensions(file: Path, document: dict[str, Any]) -> None:
    """Raise BadInput for a glTF that says that it cannot be read without what this reader lacks."""
    asset = document["asset"]
    for name in ("version", "minVersion"):
        version = asset.get(name, "2.0" if name == "minVersion" else "missing")
        if not re.match(r"2(\.\d+)?$", f"{version}"):
            expected = "2.0 (convert it: gltf-pipeline makes glTF 2.0 of 1.0)"
            raise BadInput(file, f"glTF {name}", shortened(f"{version}"), expected)
        if name == "minVersion" and f"{version}" not in ("2.0", "2"):
            raise BadInput(file, f"glTF {name}", f"{version}", "2.0: export it as glTF 2.0")
    for name in document.get("extensionsRequired", ()):
        if not _is_known(name):
            way_out = _WAYS_OUT.get(name, "a file without it: export it anew with that turned off")
            raise BadInput(file, "required extension", name, way_out)


def unread(document: dict[str, Any]) -> list[str]:
    """The extensions that a file uses and that no module here knows, sorted."""
    names = {*document.get("extensionsUsed", ()), *document.get("extensionsRequired", ())}
    return sorted(name for name in names if not _is_known(name))


def _is_known(name: str) -> bool:
    return name in _READ | _SAID | _WITHOUT_SHAPE or _LOOKS.fullmatch(name) is not None
