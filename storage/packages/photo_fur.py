"""What the package of a fur holds."""

from __future__ import annotations

from storage.packages.schema import ArrayPart, MeshPart, PackageSchema, Parameter, PicturePart

_DECODING = """\
**Shells.** Layer n of N, 1 at the tips, is the mesh with its vertices moved along their normals by
thickness (1 - n / N). All layers have the same triangles and texture coordinates; beyond [0, 1] the
photograph is repeated mirrored. It is interpolated linearly, without mipmaps: colours after they
were decoded from sRGB, alpha as it is.

**What a layer shows.** With s = floor(255 / N) steps a layer, code = floor(255 alpha + 0.5) lies in
layer floor(code / s) + 1; layer n has the codes (n - 1) s to n s - 1, and code 255 is in none where
N s <= 255. A fragment of layer n is dropped if code >= n s: there is no hair yet. If code < (n - 1)
s the hair stands in a layer above. Filled in *bands* it is dropped, too; filled in *columns* its
colour is times exp(a (own - n) / N), own = floor(code / s) + 1, a = `attenuation`.

**Other numbers of layers.** The codes in `photograph` are for `layers`. For another N they follow
from `luminance` L: with I(n) = Imax (Imin / Imax)^(n / N), Imax = `brightest`, Imin = `darkest`,
layer n has I(n) < L <= I(n-1); the first has all that is brighter, the last all that is darker, or,
where `tails` is "dropped", L outside [Imin, Imax] has the code 255; so has L < 0. Within the layer
the code is (n - 1) s + min(floor(s clamp(N ln(Imax / L) / a - n + 1)), s - 1).

**Light.** The surface is Lambertian, with the colours as albedo, seen from both sides, and casts
no shadows. The state of a reference picture has the radiance of an even `sky`, of a lamp along
the view, `headlight`, and of one towards `light`, `lamp`; a fragment shows its colour times (sky
+ headlight max(n·v, 0) + lamp max(n·l, 0)), with v the view's axis and n the shading normal,
turned to the viewer. Where no fur is they show `background`.
`pipelines/drawing/shaders/fur_*.glsl` does it all.
"""

PACKAGE = PackageSchema(
    "photo_fur",
    1,
    "A photograph of fur with the depth of its pixels, and the surface that it grows on.",
    {
        "photograph": PicturePart(
            "The photograph; alpha: depth code of each pixel for `layers` layers",
            channels=4,
            source="section 3.3",
        ),
        "luminance": ArrayPart(
            ("y", "x"),
            "float32",
            "1",
            "Linear luminance of the photograph; -1 where it is transparent",
            "Eq. 1",
        ),
        "mesh": MeshPart(
            "The surface below the fur: the innermost layer", units="mesh unit", source="section 3"
        ),
    },
    {
        "layers": Parameter("1", "Layers of shells, N", "Eq. 3"),
        "thickness": Parameter("mesh unit", "Thickness of the fur, hb", "Eq. 2"),
        "brightest": Parameter("1", "Imax: luminance at the surface", "Eq. 1"),
        "darkest": Parameter("1", "Imin: luminance at the skin", "Eq. 1"),
        "attenuation": Parameter("1", "a: decay of ln I over the thickness", "Eq. 2"),
        "code_steps": Parameter("1", "Codes of each layer: floor(255 / N)"),
        "fill": Parameter("1", "columns: a hair stands in all layers below its own; bands: not"),
        "tails": Parameter("1", "Pixels outside Imin and Imax: in the end layers, or dropped"),
        "background": Parameter("1", "Linear radiance of the reference pictures without fur"),
    },
    _DECODING,
)
