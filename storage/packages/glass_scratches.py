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

**A point of the glass.** N is the shading normal (`FACING` where the shading normal looks away from
a viewer in front of the triangle), turned towards the viewer; V the direction to the viewer. Smooth
glass shows the environment along the mirrored V by Schlick's reflectance of `refractive_index`, and
for the rest along -V, refracted once and moved half of the way back to -V, for there is a second
surface.

**Scratches.** Of each of the three axes a tile of `tile` scene units lies on the glass, by the
fourth powers of `FACING`, as `box_projection.glsl` places it; row 0 of `coverage` lies at v = 0. A
layer's scratches run along cos(angle), sin(angle) in the axis's plane, laid into the tangent
plane: T. Across them is B = N x T. The place of a direction D across a scratch is
p(D) = atan2(D·B, max(D·N, 0)) / π + 1/2. With F0, γ = `leaning` at p(V) and θ the angle
between V and the plane across the scratch, F = R + (1 - R) F0, R = (2 θ / π)^γ. A scratch shows
2 F / π² Σ power · `table`(p(V), p(light)) · max(N·light, 0) over the lights, and (1 - F) times the
mean of their power over 4 π, which stands for what comes through. All is interpolated linearly.
Layers cover independently: what none of them covers shows smooth glass, the rest the mean of their
scratches by coverage.

**A lamp** beside the environment, where a view's state has `lamp` > 0: it lies towards `light`, its
radiance rises from 0 to full between the two cosines of `lamp_edge`; its irradiance where it falls
straight is `lamp` times π times the environment's mean luminance, in the colour `lamp_colour`. It
is one more light, and smooth glass shows it. Where it lies behind the face, max(-N·light, 0) / π of
its irradiance comes through scratches, beside the environment's mean.

Radiance times `exposure` is what the reference pictures show.
"""

PACKAGE = PackageSchema(
    "glass_scratches",
    1,
    "Scratched glass: the table of a scratch, where scratches lie, the object, light around it.",
    {
        "table": ArrayPart(
            ("out", "in"),
            "float16",
            "1",
            "rho_m(phi_o, phi_i), bins of phi from -90 to 90 degrees",
            "Eq. 1",
        ),
        "leaning": ArrayPart(
            ("quantity", "out"),
            "float32",
            "1",
            "Fresnel's factor at theta = 0, and the exponent gamma along the scratch",
            "Eq. 2 and 4",
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
        "roughness": Parameter("1", "Of the scratches' walls: 1 diffuse, 0 mirrors"),
        "tile": Parameter("scene unit", "Side of a tile of scratches"),
        "environment": Parameter("1", "NAME of the environment of the reference pictures"),
        "exposure": Parameter("1", "Factor on the radiance of the reference pictures"),
        "lamp_edge": Parameter("1", "Cosines at which a lamp's radiance is 0, and full"),
        "lamp_colour": Parameter("1", "Its linear RGB, before it is scaled to luminance 1"),
    },
    _DECODING,
)
