"""What the package of a compressed BTF holds."""

from __future__ import annotations

import itertools
from dataclasses import replace

from storage.packages.schema import ArrayPart, MeshPart, PackageSchema, Parameter, Part

_DECODING = """\
Directions are unit vectors, z up.

**Texel.** A point of the cloth lies at (u, v) = `tiles` times TEXCOORD_0; v counts from the bottom.
Of the fractions of u and v, column = floor(u `width`), row = floor((1 - v) `height`), at most the
last; texel = row * `width` + column. Texels are not interpolated. Its latents are row
`ids`[texel] of `latents`, or row texel where there are no `ids`.

**Frame.** N is the normal, turned round where the back of a triangle is seen (front:
counter-clockwise); T is `TANGENT` made perpendicular to N and 1 long; B = N x T. Light l and view
v are taken into (T, B, N). What was measured ends 75° from the normal: a direction below that
(z < cos 75°) is lifted to it, its azimuth kept, and radiance is dimmed by
clamp(l.z / cos 75°, 0, 1), l.z before it was lifted.

**Decoder.** A direction's place is (x, y) / (1 + z). Inputs are the 8 latents, the light's place,
the view's place: 12 numbers. Three times x := max(`weight_n` x + `bias_n`, 0), then
`weight_4` x + `bias_4` is RGB over `alpha`. The radiance is `alpha` times that and the
dimming, where it is negative 0. It stands for a light that gives a white matt surface, where it
falls straight, the radiance 1.

**Picture.** The cloth's radiance times `exposure` is what the reference pictures show;
`room` shows its `RADIANCE` as it is. A view's state has `light`, the unit vector towards the
light, `tiles`, and `exposure` in stops, which is 0.
"""


def _decoder() -> dict[str, Part]:
    layers = ("input", "hidden_1", "hidden_2", "hidden_3", "channel")
    parts: dict[str, Part] = {}
    for number, (before, after) in enumerate(itertools.pairwise(layers), start=1):
        parts[f"weight_{number}"] = ArrayPart(
            (after, before), "float32", "1", f"Decoder: weights of layer {number}", "figure 5"
        )
        parts[f"bias_{number}"] = ArrayPart(
            (after,), "float32", "1", f"Decoder: biases of layer {number}", "figure 5"
        )
    return parts


_IDS = ArrayPart(
    ("texel",),
    "uint16",
    "1",
    "Row of `latents` of each texel, where texels share them; uint8 where there are at most 256 "
    "rows, uint32 where there are more than 65 536",
    "table 1",
    optional=True,
)

PACKAGE = PackageSchema(
    "neural_btf",
    1,
    "A compressed BTF: decoder, latents, which texel has which; a cloth that hangs in a room.",
    {
        **_decoder(),
        "latents": ArrayPart(("cluster", "latent"), "float32", "1", "Latent vectors", "table 1"),
        "ids": _IDS,
        "cloth": MeshPart(
            "A hanging cloth; its places in the material are 1 over its width",
            attributes={"TANGENT": "Unit vector along u on the surface"},
        ),
        "room": MeshPart(
            "What is around it",
            attributes={"RADIANCE": "Linear RGB, as it is shown"},
            normals=False,
            uvs=False,
        ),
    },
    {
        "alpha": Parameter("1", "Radiance that the decoder's 1 stands for", "Eq. 5"),
        "height": Parameter("texel", "Rows of texels"),
        "width": Parameter("texel", "Texels of a row"),
        "tiles": Parameter("1", "Tiles of the material over the cloth's width, at first"),
        "exposure": Parameter("1", "Factor on the cloth's radiance in the reference pictures"),
    },
    _DECODING,
)


def package_schema(ids_dtype: str) -> PackageSchema:
    """The declaration with the smallest integer that is enough for a package's `ids`.

    >>> package_schema("uint8").parts["ids"].dtype
    'uint8'
    """
    return replace(PACKAGE, parts={**PACKAGE.parts, "ids": replace(_IDS, dtype=ids_dtype)})
