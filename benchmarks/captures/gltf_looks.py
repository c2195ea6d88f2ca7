"""Materials of glTF: what extensions change, what is said, what is held."""

from __future__ import annotations

from benchmarks.captures.case import Case
from benchmarks.captures.gltf_textures import MATT, OAK, extension, gltf_case, has_shares, textured
from benchmarks.captures.looks import (
    both,
    encoded,
    has,
    linear,
    plain,
    shows,
)
from storage.readers.scenes import read_scene

_GLOSSY = encoded(plain((128, 128, 128)).convert("RGBA"))
_DATA = encoded(plain((128, 128, 128)))

CASES = (
    Case(
        "glb_specular_glossiness.glb",
        "specular and glossiness",
        read_scene,
        "read",
        (),
        has(albedo=(0.8, 0.1, 0.1), specular=0, roughness=0.64),
    ),
    gltf_case(
        "glb_specular_glossiness_map.glb",
        "specular and glossiness",
        extension(
            "KHR_materials_pbrSpecularGlossiness",
            diffuseTexture=OAK,
            specularFactor=[0.5, 0.5, 0.5],
            glossinessFactor=0.5,
            specularGlossinessTexture={"index": 1},
        ),
        both(shows(), has_shares(float(linear((128,))[0]), 0.5), has(metal=0)),
        other=_GLOSSY,
    ),
    gltf_case(
        "glb_mask.glb",
        "holes and transparency",
        textured(alphaMode="MASK"),
        shows(),
        "told",
        ("has holes .alphaMode MASK. and is drawn opaque",),
    ),
    gltf_case(
        "glb_blend.glb",
        "holes and transparency",
        textured(alphaMode="BLEND"),
        shows(),
        "told",
        ("is transparent",),
    ),
    gltf_case(
        "glb_emission.glb",
        "emission",
        textured(emissiveFactor=[1, 1, 1])
        | extension("KHR_materials_emissive_strength", emissiveStrength=10.0),
        shows(),
        "told",
        ("it emits light, which is not used",),
    ),
    gltf_case(
        "glb_clear_coat_required.glb",
        "material extensions",
        textured() | extension("KHR_materials_clearcoat", clearcoatFactor=1.0),
        shows(),
        "refused",
        ("KHR_materials_clearcoat", "with that extension optional"),
        required=("KHR_materials_clearcoat",),
    ),
    gltf_case(
        "glb_clear_coat.glb",
        "material extensions",
        textured() | extension("KHR_materials_clearcoat", clearcoatFactor=1.0),
        shows(),
        "told",
        ("KHR_materials_clearcoat is not used",),
    ),
    gltf_case(
        "glb_ior.glb",
        "material extensions",
        textured() | extension("KHR_materials_ior", ior=2.0),
        has(specular=1 / 9),
    ),
    gltf_case(
        "glb_specular.glb",
        "material extensions",
        {"pbrMetallicRoughness": MATT}
        | extension(
            "KHR_materials_specular",
            specularFactor=0.5,
            specularColorFactor=[2, 1, 0],
        ),
        has(specular=0.02, tint=(2, 1, 0)),
    ),
    gltf_case(
        "glb_unlit.glb",
        "material extensions",
        textured() | extension("KHR_materials_unlit"),
        both(shows(), has(specular=0)),
        "told",
        ("shown without light",),
    ),
    gltf_case(
        "glb_occlusion.glb",
        "occlusion",
        textured(occlusionTexture=OAK),
        shows(),
        "told",
        ("occlusionTexture is not used",),
    ),
    gltf_case(
        "glb_gold.glb",
        "colour of a glTF's metal",
        {"pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.6, 0.3, 1], "roughnessFactor": 0.5}},
        has(albedo=(0, 0, 0), specular=0.6, tint=(1.5, 1, 0.5), roughness=0.25),
    ),
    gltf_case(
        "glb_factor_over_one.glb",
        "factor outside its range",
        {"pbrMetallicRoughness": MATT | {"baseColorFactor": [1.0000001, 0.5, 0.25, 1]}},
        has(albedo=(1, 0.5, 0.25)),
    ),
    gltf_case(
        "glb_factor_two.glb",
        "factor outside its range",
        {"pbrMetallicRoughness": MATT | {"roughnessFactor": 2}},
        has(roughness=1),
        "told",
        ("roughnessFactor of material 'wood' is 2: held",),
    ),
    gltf_case(
        "glb_linear_data.glb",
        "data are no colours",
        {"pbrMetallicRoughness": MATT | {"metallicRoughnessTexture": OAK}},
        has_shares(1, 128 / 255),
        image=_DATA,
    ),
)
