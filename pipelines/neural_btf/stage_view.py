"""Cloth on the stage by a shader that holds the decoder: what live pictures elsewhere show, too.

`live_parts.decoded_cloth` asks torch for each pixel instead, which is faster without a graphics
card.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.glsl import surface_shader
from pipelines.drawing.stage import PAINTED, Camera, Stage, surface, texture
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.decoder_arrays import DIRECTIONS, LAYERS, DecoderArrays
from pipelines.neural_btf.hanging_cloth import HangingCloth, Surroundings
from pipelines.neural_btf.latent_texture import MONOMIALS

_FOUR = 4
_LONGEST_ROW = 2048
_FAR_AWAY = 1e4
"""An orthographic camera is so many times as far away as its position."""


class Scenery(NamedTuple):
    """What is drawn: a cloth of a material, and what is around it."""

    btf: CompressedBtf
    cloth: HangingCloth
    around: Surroundings | None


class Showing(NamedTuple):
    """How it is drawn."""

    light: Sequence[float]
    """Unit vector towards the light."""
    tiles: float
    """Tiles of the material over the cloth's width."""
    exposure: float
    """Factor on the cloth's radiance."""


def decoder_vectors(decoder: DecoderArrays) -> int:
    """Vectors of four neurons of a hidden layer: `VECTORS` of `btf_decoder.glsl`."""
    return -(-len(decoder["bias_1"]) // _FOUR)


def weight_texels(decoder: DecoderArrays) -> NDArray[np.float32]:
    """Weights and biases as `btf_decoder.glsl` has them, (82, 109, 4) for 106 neurons.

    A row is four neurons, a column an input, the last column the bias. What pads layers is 0.
    """
    vectors = decoder_vectors(decoder)
    latents = decoder["weight_1"].shape[1] - DIRECTIONS
    texels = np.zeros((vectors * (LAYERS - 1) + 1, vectors * _FOUR + 1, _FOUR), np.float32)
    for layer in range(1, LAYERS + 1):
        weight, bias = decoder[f"weight_{layer}"], decoder[f"bias_{layer}"]
        outputs, inputs = weight.shape
        columns = np.arange(inputs)
        if layer == 1:
            columns[latents:] += -latents % _FOUR
        rows = -(-outputs // _FOUR)
        padded = np.zeros((rows * _FOUR, texels.shape[1]), np.float32)
        padded[:outputs, columns] = weight
        padded[:outputs, -1] = bias
        first = vectors * (layer - 1)
        texels[first : first + rows] = padded.reshape(rows, _FOUR, -1).transpose(0, 2, 1)
    return texels


def latent_texels(latents: NDArray[np.float32]) -> NDArray[np.float32]:
    """Latents (n, c) as lines of texels (y, x, 4), c / 4 texels a vector, padded by 0."""
    count, width = latents.shape
    vectors = -(-width // _FOUR)
    a_row = min(count, _LONGEST_ROW // vectors)
    texels = np.zeros((-(-count // a_row) * a_row, vectors * _FOUR), np.float32)
    texels[:count, :width] = latents
    return texels.reshape(-1, a_row * vectors, _FOUR)


def material_values(btf: CompressedBtf) -> dict[str, Any]:
    """What names in capitals of `btf_decoder.glsl` and `btf_latents.glsl` stand for, and of
    `btf_cloth_fragment.glsl` those that are the material's."""
    most = float(np.finfo(np.float32).max)
    parallax = np.zeros((MONOMIALS, 2)) if btf.parallax is None else btf.parallax
    return {
        "VECTORS": decoder_vectors(btf.decoder),
        "LATENT_VECTORS": -(-btf.latents.shape[1] // _FOUR),
        "TEXELS": [btf.width, btf.height],
        "LEVELS": 1 + len(btf.mips),
        "PARALLAX": parallax.astype(float).ravel().tolist(),
        "LEAST": max(float(btf.least), -most),
        "LARGEST": min(float(btf.largest), most),
    }


def cloth_actor(
    btf: CompressedBtf,
    cloth: HangingCloth,
    showing: Showing,
    camera: Camera,
    *,
    places: bool = False,
) -> Any:
    """The cloth as this camera sees it, in one draw call.

    ``places``: red and green are where in the material it is, in tiles, blue the footprint there.
    """
    position = np.asarray(camera.position)
    if camera.height is not None:
        target = np.asarray(camera.target)
        position = target + _FAR_AWAY * (position - target)
    levels = np.concatenate([btf.latents_of(slice(None)), *btf.mips])
    lines = {"weights": weight_texels(btf.decoder), "latentVectors": latent_texels(levels)}
    return surface(
        cloth.vertices,
        cloth.triangles,
        attributes={"upright": cloth.normals, "tangent": cloth.tangents, "place": cloth.places},
        # A texture's rows count from the bottom: the picture's last row is row 0 there.
        textures={
            name: texture(np.ascontiguousarray(rows[::-1]), interpolate=False)
            for name, rows in lines.items()
        },
        shader=surface_shader(
            "btf_cloth_vertex.glsl",
            "btf_cloth_fragment.glsl",
            **material_values(btf),
            PLACES=places,
            TILES=float(showing.tiles),
            LIGHT=list(showing.light),
            EYE=position.tolist(),
            SCALE=float(showing.exposure * btf.alpha),
        ),
        lit=False,
    )


def draw_cloth(
    scenery: Scenery,
    showing: Showing,
    camera: Camera,
    *,
    width: int,
    height: int,
    supersampling: int = 1,
    places: bool = False,
) -> NDArray[np.float32]:
    """Linear radiance and coverage (height, width, 4); ``places`` as of `cloth_actor`."""
    around = scenery.around
    with Stage(width, height, supersampling=supersampling) as stage:
        stage.add(cloth_actor(scenery.btf, scenery.cloth, showing, camera, places=places))
        if around is not None:
            attributes = {"shown": around.radiance}
            stage.add(
                surface(
                    around.vertices,
                    around.triangles,
                    attributes=attributes,
                    shader=PAINTED,
                    lit=False,
                )
            )
        stage.look(camera)
        return stage.radiance()
