"""A BTF as the material that every engine draws, with the error that this makes: glTF.

The maps are those of `pipelines.neural_btf.svbrdf_fit`; errors are of the maps as they are
written, in 8 bits, for pairs of directions that they were not fitted to.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from storage.packages import Mesh, Package
from storage.packages.glb import Z_UP_TO_Y_UP
from tsuya.exports.format import Format, Notes

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pipelines.neural_btf.svbrdf_fit import Svbrdf, SvbrdfErrors

_FITTED, _HELD_OUT = 320, 160
"""Pairs of directions, of the 81 x 81 of a goniometer."""
_SHARE = "RMSE over alpha"


class SvbrdfMaps(NamedTuple):
    """Pictures (y, x, 3) uint8, row 0 at the top, and errors.

    ``base_colour`` sRGB; ``surface``: green is roughness, blue metallic; ``normal``: 127.5 (1 + n),
    green towards the top. ``network_rmse``: the network's own error over all photographs, where the
    package states it.
    """

    base_colour: NDArray[np.uint8]
    surface: NDArray[np.uint8]
    normal: NDArray[np.uint8]
    errors: SvbrdfErrors
    network_rmse: float | None

    @property
    def sentences(self) -> tuple[str, ...]:
        """The errors in words."""
        told = "not stated" if self.network_rmse is None else f"{self.network_rmse:.4f}"
        return (
            f"{_SHARE} of the maps against the BTF of the package, {_HELD_OUT} pairs of directions "
            f"that they were not fitted to: {self.errors.rmse:.4f}.",
            f"One matt colour for all texels has {self.errors.flat_rmse:.4f}; the network's own, "
            f"against the photographs, is {told}.",
            "What is lost: parallax, shadows between yarns, lobes off the mirror direction.",
        )

    @property
    def extras(self) -> dict[str, float | None]:
        """The same for glTF's extras."""
        return {
            "rmse_over_alpha": self.errors.rmse,
            "rmse_over_alpha_of_one_matt_colour": self.errors.flat_rmse,
            "rmse_over_alpha_of_the_network": self.network_rmse,
        }


def svbrdf_maps(package: Package) -> SvbrdfMaps:
    """Fit maps to a `neural_btf` package. Raises BadInput."""
    import numpy as np

    from pipelines.drawing.colour import encode_srgb
    from pipelines.light.directions import Pairs, all_pairs, hemisphere_table, unit_vectors
    from pipelines.neural_btf.decoder_arrays import direction_inputs
    from pipelines.neural_btf.svbrdf_fit import fit_svbrdf, svbrdf_errors
    from tsuya.exports.packaged_btf import packaged_btf

    btf, table = packaged_btf(package), hemisphere_table(81)
    every = all_pairs(table, table)
    chosen = np.random.default_rng(0).permutation(len(every.light))[: _FITTED + _HELD_OUT]
    pairs = Pairs(every.light[chosen], every.view[chosen])
    values = btf.abrdfs(0, btf.texels, direction_inputs(pairs)) * np.float32(btf.alpha)
    light, view = unit_vectors(pairs.light), unit_vectors(pairs.view)
    fitted = fit_svbrdf(values[:, :_FITTED], light[:_FITTED], view[:_FITTED])
    size = (btf.height, btf.width)
    surface = np.stack([np.ones_like(fitted.roughness), fitted.roughness, fitted.metallic], -1)
    codes = [
        np.rint(part * 255).astype(np.uint8).reshape(*size, 3)
        for part in (encode_srgb(fitted.base_colour), surface, (fitted.normal + 1) / 2)
    ]
    held_out = (values[:, _FITTED:], light[_FITTED:], view[_FITTED:])
    errors = svbrdf_errors(svbrdf_of_pictures(*codes), *held_out, btf.alpha)
    figures = {each["name"]: each["value"] for each in package.meta["figures"]}
    return SvbrdfMaps(codes[0], codes[1], codes[2], errors, figures.get(_SHARE))


def svbrdf_of_pictures(
    base_colour: NDArray[np.uint8], surface: NDArray[np.uint8], normal: NDArray[np.uint8]
) -> Svbrdf:
    """Maps as engines read them from the pictures."""
    import numpy as np

    from pipelines.drawing.colour import decode_srgb
    from pipelines.neural_btf.svbrdf_fit import Svbrdf

    way = normal.reshape(-1, 3) / 127.5 - 1
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    parts = surface.reshape(-1, 3) / 255
    colour = decode_srgb(base_colour.reshape(-1, 3) / 255)
    return Svbrdf(*(part.astype(np.float32) for part in (colour, parts[:, 2], parts[:, 1], way)))


def write_pictures(maps: SvbrdfMaps, target: Path) -> None:
    """`base_colour.png`, `surface.png`, `normal.png`, and the errors in `errors.txt`."""
    import imagecodecs

    target.mkdir(parents=True, exist_ok=True)
    for name in ("base_colour", "surface", "normal"):
        content = bytes(imagecodecs.png_encode(getattr(maps, name)))
        (target / f"{name}.png").write_bytes(content)
    (target / "errors.txt").write_text("\n".join((*maps.sentences, "")), encoding="utf-8")


def write_gltf(package: Package, target: Path) -> Notes:
    """`cloth.glb`, the maps by themselves, and the errors, in a folder. Raises BadInput."""
    maps = svbrdf_maps(package)
    write_pictures(maps, target)
    tiles = float(package.parameter("tiles"))
    cloth = package.mesh("cloth")
    (target / "cloth.glb").write_bytes(cloth_glb(maps, cloth, tiles, package.meta["title"]))
    return maps.sentences


def cloth_glb(maps: SvbrdfMaps, cloth: Mesh, tiles: float, title: str) -> bytes:
    """A cloth with the material, ``tiles`` repeats over a unit of its texture coordinates."""
    import numpy as np

    from storage.packages.glb import GlbFile

    assert cloth.normals is not None
    assert cloth.uvs is not None
    file = GlbFile()
    places = tiles * cloth.uvs
    # glTF counts v from the top. Tangent and the sign of the bitangent, which is our v upwards.
    tangents = np.pad(cloth.attributes["TANGENT"], ((0, 0), (0, 1)), constant_values=1.0)
    primitive = {
        "attributes": {
            "POSITION": file.values(cloth.vertices),
            "NORMAL": file.values(cloth.normals),
            "TEXCOORD_0": file.values(np.stack([places[:, 0], 1 - places[:, 1]], axis=1)),
            "TANGENT": file.values(tangents),
        },
        "indices": file.indices(cloth.triangles),
        "material": 0,
    }
    pictures = (maps.base_colour, maps.surface, maps.normal)
    images = [{"mimeType": "image/png", "bufferView": file.picture(each)} for each in pictures]
    document = {
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": title, "rotation": list(Z_UP_TO_Y_UP)}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [_material(title, maps.extras)],
        "images": images,
        "samplers": [{"wrapS": 10497, "wrapT": 10497}],
        "textures": [{"source": number, "sampler": 0} for number in range(len(images))],
    }
    return file.whole(document)


def _material(title: str, extras: Mapping[str, float | None]) -> dict[str, Any]:
    return {
        "name": title,
        "doubleSided": True,
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0},
            "metallicRoughnessTexture": {"index": 1},
        },
        "normalTexture": {"index": 2},
        "extras": dict(extras),
    }


FORMATS = (
    Format(
        "gltf",
        ("neural_btf",),
        "",
        "glTF with base colour, roughness and normals, and the error of that",
        write_gltf,
    ),
)
