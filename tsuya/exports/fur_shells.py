"""Fur for other programs: shells with masks as glTF, and the shader for three.js."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from storage.packages import Mesh, Package
from storage.packages.glb import Z_UP_TO_Y_UP, GlbFile, glb_bytes
from tsuya.exports.format import Format, Notes

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_SYSTEMS = ("photo_fur",)
_MIRRORED, _LINEAR = 33648, 9729
"""glTF's numbers of wrapping and of filtering."""
_TOLD = ("layers", "thickness", "attenuation", "fill")
"""Parameters that the shader is given."""


def write_glb(package: Package, target: Path) -> Notes:
    """The shells as one .glb: a primitive, a texture and a material with alpha mask a layer.

    Raises BadInput for a package that is damaged.
    """
    import numpy as np

    from pipelines.photo_fur.shells import shell_vertices

    layers, mesh, glb = package.parameter("layers"), package.mesh("mesh"), GlbFile()
    assert mesh.normals is not None
    assert mesh.uvs is not None
    shared = {
        "NORMAL": glb.values(mesh.normals),
        "TEXCOORD_0": glb.values(np.stack([mesh.uvs[:, 0], 1 - mesh.uvs[:, 1]], axis=1)),
    }
    indices = glb.indices(mesh.triangles)
    shells = shell_vertices(mesh.vertices, mesh.normals, package.parameter("thickness"), layers)
    primitives = [
        {
            "attributes": shared | {"POSITION": glb.values(shell)},
            "indices": indices,
            "material": number,
        }
        for number, shell in enumerate(shells)
    ]
    numbers = range(1, layers + 1)
    document: dict[str, Any] = {
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "rotation": list(Z_UP_TO_Y_UP)}],
        "meshes": [{"primitives": primitives}],
        "images": [
            {"bufferView": glb.picture(layer_texture(package, n)), "mimeType": "image/png"}
            for n in numbers
        ],
        "samplers": [
            {"wrapS": _MIRRORED, "wrapT": _MIRRORED, "minFilter": _LINEAR, "magFilter": _LINEAR}
        ],
        "textures": [{"source": number, "sampler": 0} for number in range(layers)],
        "materials": [_material(n) for n in numbers],
    }
    target.write_bytes(glb.whole(document))
    return (
        f"Each of the {layers} layers is a draw call; masks of 0 and 1 are filtered at their rims, "
        "where the shader compares depths: `--to three` draws as the stage does.",
    )


def layer_texture(package: Package, layer: int) -> NDArray[np.uint8]:
    """What a layer, 1 at the tips, shows of the photograph: (y, x, 4), alpha 0 or 255.

    Raises BadInput for a package that is damaged.
    """
    import numpy as np

    from pipelines.drawing.colour import decode_srgb, to_8bit

    picture, layers = package.picture("photograph"), package.parameter("layers")
    own = picture[..., 3] // package.parameter("code_steps") + 1
    dropped = picture[..., 3] >= layers * package.parameter("code_steps")
    colours, stands = picture[..., :3], (own == layer) & ~dropped
    if package.parameter("fill") == "columns":
        stands = (own <= layer) & ~dropped
        above = np.maximum(layer - own.astype(np.float64), 0.0)
        darker = np.exp(-package.parameter("attenuation") / layers * above)
        colours = to_8bit(decode_srgb(colours / 255.0) * darker[..., None])
    return np.dstack([colours, np.where(stands, np.uint8(255), np.uint8(0))])


def _material(layer: int) -> dict[str, Any]:
    surface = {
        "baseColorTexture": {"index": layer - 1},
        "metallicFactor": 0.0,
        "roughnessFactor": 1.0,
    }
    return {
        "name": f"layer {layer}",
        "pbrMetallicRoughness": surface,
        "alphaMode": "MASK",
        "alphaCutoff": 0.5,
        "doubleSided": True,
    }


def write_three(package: Package, target: Path) -> Notes:
    """A folder for three.js: `fur.js` with the stage's shader, and what it draws.

    Raises BadInput for a package that is damaged.
    """
    from pipelines.photo_fur.live_parts import shell_sources

    mesh = package.mesh("mesh")
    surface = Mesh(mesh.vertices, mesh.triangles, mesh.normals, mesh.uvs)
    vertex, fragment = shell_sources()
    told = {name: package.parameter(name) for name in _TOLD}
    target.mkdir(parents=True)
    (target / "fur.js").write_bytes(files("tsuya.exports").joinpath("three/fur.js").read_bytes())
    (target / "fur.json").write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    (target / "vertex.glsl").write_text(vertex, encoding="ascii")
    (target / "fragment.glsl").write_text(fragment, encoding="ascii")
    (target / "surface.glb").write_bytes(glb_bytes(surface))
    (target / "photograph.png").write_bytes(package.content("photograph"))
    return ("Lamps of three.js do not light it: `setFur` sets its own light (docs/fur.md).",)


FORMATS = (
    Format("glb", _SYSTEMS, ".glb", "glTF of all shells with alpha masks", write_glb),
    Format("three", _SYSTEMS, "", "three.js: a module with the stage's shader", write_three),
)
