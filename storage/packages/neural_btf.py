"""What the package of a compressed BTF holds."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from storage.packages.schema import ArrayPart, MeshPart, PackageSchema, Parameter, Part

if TYPE_CHECKING:
    from numpy.typing import NDArray

_DECODING = """\
Directions are unit vectors, z up. Numbers of decoder and latents are whole, or float32 as in the
paper; either way a value is number times step, in float32.

**Place.** A point of the cloth lies at (u, v) = `tiles` times TEXCOORD_0; v counts from the bottom,
and the material repeats without end. Column = u `width` - 1/2, row = (1 - v) `height` - 1/2: a
texel's middle is at whole numbers, row 0 at the top.

**Frame.** N is the normal, turned round where the back of a triangle is seen (front:
counter-clockwise); T is `TANGENT` made perpendicular to N and 1 long; B = N x T. Light l and view
v are taken into (T, B, N). What was measured ends 75° from the normal: a direction below that
(z < cos 75°) is lifted to it, its azimuth kept, and radiance is dimmed by
clamp(l.z / cos 75°, 0, 1), l.z before it was lifted. A direction's place on the stereographic plane
is (x, y) / (1 + z).

**Parallax.** With (x, y) the view's place, column and row grow by the sums over j of
`parallax` (j, 0) m(j) and `parallax` (j, 1) m(j), m = x, y, x², xy, y², x³, x²y, xy², y³.

**Latents.** Level 0 is `latents`: texel row * `width` + column has row `ids`[texel] of them, or row
texel where there are no `ids`. Level l = 1, 2, … has ceil(`height` / 2^l) rows of
ceil(`width` / 2^l) texels; they lie after one another in `mips`, to the level of one texel. A place
is (row + 1/2) h / `height` - 1/2 in a level of h rows, so for columns. In a level latents are
bilinear between four texels. A pixel that sees n² of the material's area, in tiles, takes level
log2(n max(`height`, `width`)), held to 0 and the last, linear between two levels; without `mips`
level 0.

**Decoder.** Inputs are the latents, the light's place, the view's place. Three times
x := max(`weight_n` x + `bias_n`, 0), then `weight_4` x + `bias_4`, held to `least` and `largest`,
is RGB over `alpha`. The radiance is `alpha` times that and the dimming, where it is negative 0. It
stands for a light that gives a white matt surface, where it falls straight, the radiance 1. The
student, where there is one, is a decoder of the same latents with fewer neurons, for pictures that
move.

**Picture.** The cloth's radiance times `exposure` is what the reference pictures show, each sample
of a pixel with its own n; `room` shows its `RADIANCE` as it is. A view's state has `light`, the
unit vector towards the light, `tiles`, and `exposure` in stops, which is 0.
"""

TENSORS = tuple(f"{kind}_{layer}" for layer in range(1, 5) for kind in ("weight", "bias"))
"""Names of a decoder's parts, in the order of their steps; those of the student's begin with
`STUDENT`."""
STUDENT = "student_"


def _decoder(prefix: str = "") -> dict[str, Part]:
    layers = ["input", *(f"{prefix}hidden_{number}" for number in (1, 2, 3)), "channel"]
    who, optional = ("Student", True) if prefix else ("Decoder", False)
    parts: dict[str, Part] = {}
    for number, (before, after) in enumerate(itertools.pairwise(layers), start=1):
        for kind, dims in (("weight", (after, before)), ("bias", (after,))):
            meaning = f"{who}: {kind} of layer {number}; float32 in the paper's form"
            parts[f"{prefix}{kind}_{number}"] = ArrayPart(
                dims, "int8", "step", meaning, "figure 5", optional
            )
    meaning = f"{who}: steps of weight_1, bias_1, weight_2 … bias_4"
    parts[f"{prefix}steps"] = ArrayPart(("tensor",), "float32", "1", meaning, optional=optional)
    return parts


PACKAGE = PackageSchema(
    "neural_btf",
    2,
    "A compressed BTF: decoder, latents as a texture with coarser levels, parallax; a cloth that "
    "hangs in a room.",
    {
        **_decoder(),
        "latents": ArrayPart(
            ("vector", "latent"), "int8", "step",
            "Latent vectors; the paper's form is float32, of 8 latents", "table 1",
        ),
        "latent_steps": ArrayPart(("latent",), "float32", "1", "Steps of `latents`"),
        "ids": ArrayPart(
            ("texel",), "uint16", "1",
            "Row of `latents` of each texel, where texels share them; uint8 for at most 256 rows, "
            "uint32 for more than 65 536",
            "table 1", optional=True,
        ),
        "mips": ArrayPart(
            ("coarse_texel", "latent"), "int8", "step", "Latents of coarser levels, one behind the "
            "other", optional=True,
        ),
        "mip_steps": ArrayPart(("latent",), "float32", "1", "Steps of `mips`", optional=True),
        "parallax": ArrayPart(
            ("monomial", "axis"), "float32", "texel",
            "By how many columns and rows latents are looked up beside a place, by the view",
            optional=True,
        ),
        **_decoder(STUDENT),
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
        "least": Parameter("alpha", "Decoded values are held to this and to `largest`"),
        "largest": Parameter("alpha", "As `least`"),
        "tiles": Parameter("1", "Tiles of the material over the cloth's width, at first"),
        "exposure": Parameter("1", "Factor on the cloth's radiance in the reference pictures"),
    },
    _DECODING,
)  # fmt: skip


def package_schema(values: Mapping[str, NDArray[Any]]) -> PackageSchema:
    """The declaration with the types of a package's numbers where they are others: float32 in the
    paper's form, the smallest integer that is enough for ``ids``.

    >>> import numpy as np
    >>> package_schema({"ids": np.zeros(4, np.uint8)}).parts["ids"].dtype
    'uint8'
    """
    parts = dict(PACKAGE.parts)
    for name, array in values.items():
        part = parts[name]
        assert isinstance(part, ArrayPart)
        parts[name] = replace(part, dtype=str(array.dtype))
    return replace(PACKAGE, parts=parts)
