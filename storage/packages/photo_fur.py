"""What the package of a fur holds."""

from __future__ import annotations

from storage.packages.schema import ArrayPart, MeshPart, PackageSchema, Parameter, PicturePart

_DECODING = """\
**Photograph.** `photograph` is an AVIF file of 8-bit sRGB. Its luminance L, 0.2126 R + 0.7152 G +
0.0722 B of linear colours, tells the depth. Of N layers, with I(n) = Imax (Imin / Imax)^(n / N),
Imax = `brightest`, Imin = `darkest`, layer n, 1 at the tips, has I(n) < L <= I(n-1); the first has
all that is brighter, the last all that is darker, or, where `tails` is "dropped", L outside
[Imin, Imax] has the code 255; so has what `opaque` has below 128. With s = floor(255 / N), within
the layer the code is (n - 1) s + min(floor(s clamp(N ln(Imax / L) / a - n + 1)), s - 1), a =
`attenuation`. A texture holds colours and, in alpha, codes; beyond [0, 1] it is repeated mirrored,
and interpolated linearly, in the plain look without mipmaps, in the full one with isotropic ones:
colours after they were decoded from sRGB, alpha as it is. code = floor(255 alpha + 0.5) in the
following.

**Lie.** `lie` has two bytes a vertex v. With n the normal and b = `backwards`, east is b - (b·n) n
made 1 long; where that is shorter than |b| / 1000 the coordinate axis takes b's place that b has
least of. The hair's direction is cos(w) east + sin(w) n x east, w = 2 π `lie`(0, v) / 256; its
length is `lie`(1, v) / 255 of `thickness`.

**Patches.** Vertices of equal position and normal count as one, the first. An edge's step is (way ·
t, way · u), scaled to the edge's length: t is the sum of its ends' directions, u that of n x
direction. For each patch p let D(v) be the distance along edges from its middle `patch_vertex`,
up to 2.25 `patch_spacing`. The middle's place is (0, 0); in the order of D each other vertex's is
the mean, over its neighbours w that are nearer, of w's place plus the step from w to v, weighted by
1 / (D(w) + e - D(v) + e / 10), e the edge's length. With r = |place| / (1.5
`patch_spacing`) the patch's weight is max(1 - r, 0)^4; of each vertex's patches, sorted by r, the
fourth one's weight is taken from all, what falls below 0 is 0, and the rest is scaled to the sum 1
(where nothing is left, the nearest patch has 1). A triangle shows the three patches that have most
weight on its corners, in the order of their numbers; a corner has of them its own weights, scaled
to the sum 1. Of the photograph a corner has `patch_place` plus its place over `photograph_width`,
turned by `patch_direction` counter-clockwise; in widths of the photograph, from the lower left.

**The full look.** Any number M of shells is drawn: shell m at depth d = m / M. A vertex is lifted
by `thickness` times its hair's length times (h n + h² (BEND direction + wind)), h = 1 - (m - 1/2) /
M, of the last one 0. A fragment takes of its three patches, but for weights below 0.02, the texel
whose weight times HEIGHT_OF_WEIGHT less alpha is greatest. Its own depth is o = code / (N s), to be
drawn at o' = clamp(`middle` + SPREAD (o - `middle`), 0, 0.999); it is dropped where o >= 1, o' >=
d, or, but for the last shell, d - o' > max(s', 1 / M), s' = STANDS times EDGE where the surface is
seen from aside, STANDS where it is seen from above, smoothstep between at EDGE_TO. Light, wind and
the names in capitals: `fur_laid_fragment.glsl`, `fur_laid_vertex.glsl` and the parameter
`constants`.

**The plain look** is the paper's: layer n of N is the mesh with its vertices moved along their
normals by `thickness` (1 - n / N), with the mesh's texture coordinates. A fragment of layer n is
dropped if code >= n s: there is no hair yet. If code < (n - 1) s the hair stands in a layer above.
Filled in *bands* it is dropped, too; filled in *columns* its colour is times exp(a (own - n) / N),
own = floor(code / s) + 1. It is Lambertian, with the colours as albedo, seen from both sides, and
casts no shadows: a fragment shows its colour times (sky + headlight max(n·v, 0) + lamp max(n·l,
0)), v the view's axis, n the shading normal, turned to the viewer (`fur_*.glsl`).

**State** of a view: `look`, `layers`, `thickness` (in `thickness`es), `fill`, radiances of an even
`sky`, of a lamp along the view, `headlight`, and of one towards `light`, `lamp`; `wind`, and the
seconds `moment` since it began. Where no fur is pictures show `background`. In the full look
min(MOST_SHELLS, max(FEWEST_SHELLS, ceil(SHELLS_A_PIXEL x))) shells are drawn, x the fur's thickness
in samples where a sphere about the middle of the mesh's box that holds its vertices is nearest,
though not nearer than a tenth of its radius.
"""

_PATCH = ("patch",)

PACKAGE = PackageSchema(
    "photo_fur",
    2,
    "A photograph of fur, how it is laid over a surface, and the surface that it grows on.",
    {
        "photograph": ArrayPart(
            ("byte",), "uint8", "1", "The photograph, an AVIF file", "section 3.1"
        ),
        "opaque": PicturePart(
            "Where there is fur: 255, else 0", channels=1, units="1", optional=True
        ),
        "mesh": MeshPart(
            "The surface below the fur: the innermost layer", units="mesh unit", source="section 3"
        ),
        "lie": ArrayPart(
            ("value", "vertex"), "uint8", "1", "Direction and length of the hair, see *Lie*"
        ),
        "patch_vertex": ArrayPart(_PATCH, "uint32", "1", "Vertex in the middle of a patch"),
        "patch_place": ArrayPart(
            (*_PATCH, "uv"), "float32", "photograph width", "What of the photograph is there"
        ),
        "patch_direction": ArrayPart(
            _PATCH, "float32", "radian", "How the photograph's hair lies there"
        ),
    },
    {
        "look": Parameter("1", "full or plain: the look at first"),
        "layers": Parameter("1", "Layers of shells, N", "Eq. 3"),
        "thickness": Parameter("mesh unit", "Thickness of the fur, hb", "Eq. 2"),
        "brightest": Parameter("1", "Imax: luminance at the surface", "Eq. 1"),
        "darkest": Parameter("1", "Imin: luminance at the skin", "Eq. 1"),
        "attenuation": Parameter("1", "a: decay of ln I over the thickness", "Eq. 2"),
        "middle": Parameter("thickness", "Mean depth of the hair"),
        "fill": Parameter("1", "columns: a hair stands in all layers below its own; bands: not"),
        "tails": Parameter("1", "Pixels outside Imin and Imax: in the end layers, or dropped"),
        "backwards": Parameter("1", "From nose to tail"),
        "patch_spacing": Parameter("mesh unit", "Between patches' middles"),
        "photograph_width": Parameter("mesh unit", "Of the photograph on the surface"),
        "constants": Parameter("1", "Names in capitals of the full look's shader, by name"),
        "background": Parameter("1", "Linear radiance of the reference pictures without fur"),
    },
    _DECODING,
)
