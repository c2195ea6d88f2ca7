"""Fur for other programs: shells with masks as glTF, and the shader for three.js."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from storage.packages import Mesh, Package
from storage.packages.glb import Z_UP_TO_Y_UP, GlbFile, glb_bytes
from tsuya.exports.format import Format, Notes
from tsuya.exports.packaged_fur import packaged_fur

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pipelines.photo_fur.packed_fur import PackedFur

_SYSTEMS = ("photo_fur",)
_MIRRORED, _LINEAR = 33648, 9729
"""glTF's numbers of wrapping and of filtering."""
_TOLD = ("look", "layers", "thickness", "attenuation", "fill", "middle", "constants")
"""Parameters that the shader is given."""


def write_glb(package: Package, target: Path) -> Notes:
    """The shells as one .glb: a primitive, a texture and a material with alpha mask a layer.

    Raises BadInput for a package that is damaged.
    """
    import numpy as np

    packed, glb = packaged_fur(package), GlbFile()
    mesh, picture, layers = packed.mesh, fur_picture(package, packed), packed.mesh.layers
    shared = {
        "NORMAL": glb.values(mesh.normals),
        "TEXCOORD_0": glb.values(np.stack([mesh.uvs[:, 0], 1 - mesh.uvs[:, 1]], axis=1)),
    }
    indices = glb.indices(mesh.triangles)
    primitives = [
        {
            "attributes": shared | {"POSITION": glb.values(shell)},
            "indices": indices,
            "material": number,
        }
        for number, shell in enumerate(mesh.vertices)
    ]
    numbers = range(1, layers + 1)
    document: dict[str, Any] = {
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "rotation": list(Z_UP_TO_Y_UP)}],
        "meshes": [{"primitives": primitives}],
        "images": [
            {"bufferView": glb.picture(layer_texture(package, picture, n)), "mimeType": "image/png"}
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
        "It is the plain look: hair lies as the mesh's texture coordinates have it.",
        f"Each of the {layers} layers is a draw call; masks of 0 and 1 are filtered at their rims, "
        "where the shader compares depths: `--to three` draws as the stage does.",
    )


def fur_picture(package: Package, packed: PackedFur) -> NDArray[np.uint8]:
    """Colours and depth codes (y, x, 4) of a package's own number of layers. Raises BadInput."""
    from pipelines.photo_fur.stage_view import fur_texture
    from storage.readers.bad_input import BadInput

    try:
        photograph = packed.photograph()
    except ValueError as error:
        raise BadInput(package.name, "part photograph", str(error), "an AVIF file") from None
    return fur_texture(photograph, packed.mesh.layers, tails=package.parameter("tails"))


def layer_texture(package: Package, picture: NDArray[np.uint8], layer: int) -> NDArray[np.uint8]:
    """What a layer, 1 at the tips, shows of the photograph: (y, x, 4), alpha 0 or 255.

    picture: of ``fur_picture``. Raises BadInput for a package that is damaged.
    """
    import numpy as np

    from pipelines.drawing.colour import decode_srgb, to_8bit
    from pipelines.photo_fur.attenuation import code_steps

    layers = package.parameter("layers")
    own = picture[..., 3] // code_steps(layers) + 1
    dropped = picture[..., 3] >= layers * code_steps(layers)
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
    from PIL import Image

    from pipelines.photo_fur.live_parts import shell_sources
    from pipelines.photo_fur.shells import mesh_radius

    packed = packaged_fur(package)
    picture, mesh = fur_picture(package, packed), packed.mesh
    is_full = package.parameter("look") == "full"
    vertex, fragment = shell_sources(package.parameter("look"))
    told = {name: package.parameter(name) for name in _TOLD}
    told["radius"] = mesh_radius(mesh.vertices[-1])
    target.mkdir(parents=True)
    (target / "fur.js").write_bytes(files("tsuya.exports").joinpath("three/fur.js").read_bytes())
    (target / "fur.json").write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    (target / "vertex.glsl").write_text(vertex, encoding="ascii")
    (target / "fragment.glsl").write_text(fragment, encoding="ascii")
    surface = laid_mesh(packed, picture.shape) if is_full else package.mesh("mesh")
    (target / "surface.glb").write_bytes(glb_bytes(surface))
    Image.fromarray(picture).save(target / "photograph.png")
    return ("Lamps of three.js do not light it: `setFur` sets its own light (docs/fur.md).",)


def laid_mesh(packed: PackedFur, shape: tuple[int, ...]) -> Mesh:
    """The surface with what the full look's shader wants of its vertices, for a photograph of this
    shape: `_ALONG`, `_HAIRLENGTH`, `_UVS` and `_UVTHIRD` (three places, v from the bottom),
    `_WEIGHTS`."""
    import numpy as np

    from pipelines.photo_fur.laid_fur import texture_coordinates

    fur = packed.fur()
    uvs = texture_coordinates(fur.laying.uvs, shape[:2])
    return Mesh(
        fur.skin,
        fur.laying.triangles.astype(np.uint32),
        fur.normals.astype(np.float32),
        None,
        {
            "ALONG": fur.tangents.astype(np.float32),
            "HAIRLENGTH": fur.lengths.astype(np.float32),
            "UVS": uvs[:, :2].reshape(len(uvs), 4),
            "UVTHIRD": uvs[:, 2],
            "WEIGHTS": fur.laying.weights,
        },
    )


FORMATS = (
    Format("glb", _SYSTEMS, ".glb", "glTF of all shells with alpha masks", write_glb),
    Format("three", _SYSTEMS, "", "three.js: a module with the stage's shader", write_three),
)
