"""What the package of a scratched glass holds."""

from __future__ import annotations

from storage.packages.schema import (
    ArrayPart,
    MeshPart,
    PackageSchema,
    Parameter,
    PicturePart,
    TexturesPart,
)

_DECODING = """\
Directions are unit vectors, z up; those of the glass and of the environment are the same until
somebody tilts the glass.

**Environment.** `environment_NAME` is equirectangular, row 0 at the zenith: a direction (x, y, z)
lies at u = 1/2 - atan2(y, x) / 2π from the left and asin(z) / π + 1/2 from the bottom. Read each
16-bit code as the bits of a half float: linear radiance. `lights_NAME` are lights drawn from it.

**A point of the glass.** What is seen is followed from surface to surface of the object, at most
eight of them. At each, N is the shading normal (`FACING` where the shading normal looks away from
where light comes), turned out of the glass; Fresnel's equations for `refractive_index` reflect a
part, which shows the environment along the mirrored direction, and the rest goes on, bent. Inside,
what is reflected in part shows the environment where it would leave at once; what is reflected
totally is followed. Where no surface is met, or after the eighth, the rest shows the environment.

**Scratches.** Of each of the three axes a tile of `tile` scene units lies on the glass, by the
fourth powers of `FACING`, as `box_projection.glsl` places it; row 0 of `coverage` lies at v = 0. A
layer's scratches run along cos(angle), sin(angle) in the axis's plane, laid into the tangent plane:
T. Across them is B = N x T. A direction D (away from the surface) has the lean |s|, s = D·T, times
`refractive_index` inside; its bin of phi = atan2(D·B, |D·N|), from -90 to 90 degrees, is one of M
outside, M to 2 M - 1 inside. `table`[lean, bin of view, bin of light] is rho, linear between
`leans` and bins of a side; where walls keep the lean (`keeps_lean`), the last table is that of
leans from 1 on. With w the difference of the sines of a bin's ends and r = 1 outside, inside n² or,
where the lean is kept, sqrt((n² - s²) / (1 - s²)), a view gets the part rho w r / π of radiance
over n². Where walls forget the lean a scratch shows 2 / π² Σ power · rho · |N·light| over the
lights; those on the other side count as they come through a face parallel to this one, by 1 -
Fresnel's reflectance; of the part that comes from inside, 1 - 1 / n² shows the mean of the lights'
power over 4 π. Where walls keep it, a scratch shows, over all bins, the part times the environment
(at most 64 rows, means) along the direction of lean -s of that bin, the inside's as it leaves
through a parallel face. Layers cover independently: what none of them covers shows smooth glass,
the rest the mean of their scratches by coverage.

**A lamp** beside the environment, where a view's state has `lamp` > 0: it lies towards `light`, its
radiance rises from 0 to full between the two cosines of `lamp_edge`; its irradiance where it falls
straight is `lamp` times π times the environment's mean luminance, in the colour `lamp_colour`. It
is one more light, and smooth glass shows it.

Radiance times `exposure` is what the reference pictures show.
"""

PACKAGE = PackageSchema(
    "glass_scratches",
    2,
    "Scratched glass: the table of a scratch, where scratches lie, the object, light around it.",
    {
        "table": ArrayPart(
            ("lean", "view", "light"),
            "float16",
            "1",
            "rho of a view's and a light's bin of phi, outside, then inside",
            "Eq. 1 to 4",
        ),
        "leans": ArrayPart(
            ("lean",),
            "float32",
            "1",
            "Component along the scratch times the refractive index, of each table",
        ),
        "angles": ArrayPart(
            ("layer",), "float32", "radian", "Direction of a layer's scratches", "section 3.2"
        ),
        "coverage": TexturesPart(
            "Part of each texel that a layer's scratches cover, 255 for all of it",
            channels=1,
            units="1/255",
            source="section 3.2",
        ),
        "object": MeshPart(
            "The glass in a sphere of radius 1: each triangle has corners of its own, normals are "
            "those of shading",
            attributes={"FACING": "Normal of the triangle"},
            uvs=False,
        ),
        "environment_*": PicturePart(
            "Linear radiance all around, as the bits of half floats, scaled down as a whole where "
            "these cannot hold it",
            dtype="uint16",
            units="bits of a half float",
        ),
        "lights_*": ArrayPart(
            ("row", "light", "axis"),
            "float32",
            "1",
            "Lights drawn from the environment of the same name: their power in RGB, radiance "
            "times steradians; unit vectors to them",
        ),
    },
    {
        "refractive_index": Parameter("1", "Of the glass", "section 3.1"),
        "roughness": Parameter("1", "Of the scratches' walls: 1 scatter evenly, 0 clear"),
        "keeps_lean": Parameter("1", "Whether the walls keep the lean"),
        "tile": Parameter("scene unit", "Side of a tile of scratches"),
        "environment": Parameter("1", "NAME of the environment of the reference pictures"),
        "exposure": Parameter("1", "Factor on the radiance of the reference pictures"),
        "lamp_edge": Parameter("1", "Cosines at which a lamp's radiance is 0, and full"),
        "lamp_colour": Parameter("1", "Its linear RGB, before it is scaled to luminance 1"),
    },
    _DECODING,
)
