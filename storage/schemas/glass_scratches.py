"""Datasets of scratched glass: profiles, tables, layers, objects, frames."""

from storage.schemas.schema import Schema, Variable

_SYSTEM = "glass_scratches"
_PIXELS = ("y", "x")
_FEATURE = ("feature",)

SCRATCH_PROFILE = Schema(
    _SYSTEM,
    "scratch_profile",
    1,
    "The cross-section of a scratch between its crests, from left to right.",
    {
        "points": Variable(
            ("point", "axis"),
            "float64",
            "micrometre",
            "v across the scratch and n upwards; the opening's ends are at n = 0",
            "section 3.1, figure 1",
        ),
    },
)

SCRATCH_TABLE_2D = Schema(
    _SYSTEM,
    "scratch_table_2d",
    2,
    "What walls do to light in the cross-section. Walls of glass: bins of phi outside and inside; "
    "tables of leans; a beam from bin i leaves into bin o with probability rho w r / pi, w = "
    "integral of cos phi over bin o, r = 1 outside, inside the ratio of étendue. The paper's: one "
    "table, of the bins outside.",
    {
        "rho": Variable(("lean", "out", "in"), "float64", "1", "rho_m(phi_o, phi_i)", "Eq. 1"),
        "standard_error": Variable(
            ("lean", "out", "in"),
            "float64",
            "1",
            "Standard error of rho_m; 0 where it was solved for",
        ),
        "absorbed": Variable(("lean", "in"), "float64", "1", "Part of the beam that walls keep"),
        "across": Variable(
            ("lean", "place", "out", "in"),
            "float32",
            "1",
            "rho_m by the place where the view's ray enters the opening, from the left end",
        ),
        "lean": Variable(
            ("lean",),
            "float64",
            "1",
            "Component along the scratch times the refractive index, where walls keep it; the last "
            "table is that from 1 on",
        ),
        "index": Variable((), "float64", "1", "Refractive index of the glass", "Eq. 2, n"),
    },
)

SCRATCH_TABLE = Schema(
    _SYSTEM,
    "scratch_table",
    2,
    "The scratch BSDF as it is looked up: both sides of the surface, along the scratch, sampler.",
    {
        "rho": Variable(
            ("lean", "view", "light"),
            "float32",
            "1",
            "What a view of a lean gets from a bin is rho w r / pi of its radiance over n squared",
            "Eq. 2 to 4",
        ),
        "lean": Variable(
            ("lean",), "float64", "1", "Component along the scratch times the refractive index"
        ),
        "cdf": Variable(
            ("lean", "place", "view", "border"),
            "float32",
            "1",
            "Share of the light of a view below each bin's border, by lean and place",
            "Eq. 5",
        ),
        "share": Variable(
            ("lean", "place", "view"), "float32", "1", "Part of the light that walls do not keep"
        ),
        "index": Variable((), "float64", "1", "Refractive index of the glass", "Eq. 2, n"),
    },
)

_SEGMENT = ("segment",)

SCRATCH_PHOTO = Schema(
    _SYSTEM,
    "scratch_photo",
    1,
    "Scratches found in a photograph of scratched glass, by layers. Empty for a setting that is no "
    "photograph. Pixels: x to the right, y downwards.",
    {
        "luminance": Variable(("row", "column"), "float32", "1", "The photograph, linear"),
        "centre": Variable((*_SEGMENT, "axis"), "float64", "pixel", "Middle of the scratch"),
        "direction": Variable(
            _SEGMENT, "float64", "radian", "From x towards up, at the middle, in [0, pi)"
        ),
        "length": Variable(_SEGMENT, "float64", "pixel", "Its length"),
        "width": Variable(
            _SEGMENT, "float64", "pixel", "Of a bar with its peak and area, the blur included"
        ),
        "contrast": Variable(
            _SEGMENT, "float64", "1", "Difference from its ground over the ground, without sign"
        ),
        "turn": Variable(_SEGMENT, "float64", "radian", "From end to end, positive to the left"),
        "strength": Variable(_SEGMENT, "float64", "1", "Contrast over a full scratch's, at most 1"),
        "segment_layer": Variable(_SEGMENT, "int32", "1", "Its layer"),
        "angle": Variable(("layer",), "float32", "radian", "Direction of a layer's scratches"),
    },
)

SCRATCH_LAYERS = Schema(
    _SYSTEM,
    "scratch_layers",
    1,
    "Scratches over a tile that repeats without seams: the features, and their coverage as maps.",
    {
        "angle": Variable(
            ("layer",), "float32", "radian", "Direction of a layer's scratches", "section 3.2"
        ),
        "feature_layer": Variable(_FEATURE, "int32", "1", "Layer of the scratch"),
        "centre": Variable((*_FEATURE, "axis"), "float32", "tile", "Middle of the scratch"),
        "turn": Variable(_FEATURE, "float32", "radian", "Its direction less the layer's"),
        "half_length": Variable(_FEATURE, "float32", "tile", "Half its length"),
        "half_width": Variable(_FEATURE, "float32", "tile", "Half its width"),
        "curvature": Variable(_FEATURE, "float32", "1/tile", "Of the arc that it follows"),
        "strength": Variable(_FEATURE, "float32", "1", "Share of the light that meets its walls"),
        "seed": Variable(_FEATURE, "uint32", "1", "Of its fading and breaks"),
        "is_dig": Variable(_FEATURE, "bool", "1", "Whether it is a pit"),
        "coverage": Variable(
            ("layer", *_PIXELS),
            "float32",
            "1",
            "Part of each texel that scratches cover; row 0 lies at y = 0 of the tile",
        ),
        "stages": Variable(
            ("stage", "row", "column"),
            "uint8",
            "1",
            "Cell noise, the same rotated and stretched, and thresholded",
            "figure 4",
        ),
    },
)

GLASS_OBJECT = Schema(
    _SYSTEM,
    "glass_object",
    1,
    "A closed glass solid about the origin, in a sphere of radius 1.",
    {
        "vertices": Variable(("vertex", "axis"), "float64", "scene unit", "Positions, z up"),
        "triangles": Variable(
            ("triangle", "corner"), "int32", "1", "Vertex numbers, counter-clockwise from outside"
        ),
        "corner_normals": Variable(
            ("triangle", "corner", "axis"), "float32", "1", "Unit normals for shading"
        ),
        "volume": Variable((), "float64", "scene unit^3", "Volume of the glass"),
    },
)

GLASS_FRAMES = Schema(
    _SYSTEM,
    "glass_frames",
    2,
    "Pictures of the scratched object: traced, and the same views on the stage.",
    {
        "radiance": Variable(
            ("view", *_PIXELS, "channel"),
            "float32",
            "1",
            "Linear RGB of the far and close view, as traced",
        ),
        "clean": Variable(("view", *_PIXELS, "channel"), "float32", "1", "The same, denoised"),
        "error": Variable(
            ("view", *_PIXELS), "float32", "1", "Standard error of the radiance's mean over RGB"
        ),
        "scratched": Variable(
            ("view", *_PIXELS), "float32", "1", "Share of the paths that met a scratch"
        ),
        "frames": Variable(
            ("view", *_PIXELS, "channel"),
            "uint8",
            "1",
            "sRGB pictures, traced and denoised, far and close",
            "figures 6-8",
        ),
        "stage": Variable(
            ("view", *_PIXELS, "channel"), "uint8", "1", "The same views drawn by the shader"
        ),
        "moving": Variable(
            ("light", "row", "column", "channel"),
            "uint8",
            "1",
            "The close view while the light goes around, by the shader",
        ),
        "exposure": Variable(
            (),
            "float64",
            "1",
            "Factor on the radiance before sRGB: both views' geometric mean becomes 0.22",
        ),
        "surroundings": Variable(
            ("channel",), "float64", "1", "Mean radiance of the environment, all around"
        ),
        "furnace": Variable(
            ("furnace_row", "furnace_column"),
            "float32",
            "1",
            "Mean over RGB of the far view in an environment of radiance 1",
        ),
        "furnace_error": Variable(
            ("furnace_row", "furnace_column"), "float32", "1", "Its standard error"
        ),
    },
)

GLASS_PACKAGE = Schema(
    _SYSTEM,
    "glass_package",
    1,
    "The scratched glass as a runtime package (docs/packages.md).",
    {"file": Variable(("byte",), "uint8", "1", "Bytes of the `.tsuya` file")},
)

SCHEMAS = (
    SCRATCH_PROFILE,
    SCRATCH_TABLE_2D,
    SCRATCH_TABLE,
    SCRATCH_PHOTO,
    SCRATCH_LAYERS,
    GLASS_OBJECT,
    GLASS_FRAMES,
    GLASS_PACKAGE,
)
