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
    1,
    "The scratch BRDF in the cross-section: a beam from bin i leaves into bin o with probability "
    "rho w / pi, w = integral of cos phi over bin o.",
    {
        "rho": Variable(("out", "in"), "float64", "1", "rho_m(phi_o, phi_i)", "Eq. 1"),
        "standard_error": Variable(
            ("out", "in"), "float64", "1", "Standard error of rho_m; 0 where it was solved for"
        ),
        "absorbed": Variable(("in",), "float64", "1", "Part of the beam that the walls keep"),
        "across": Variable(
            ("place", "out", "in"),
            "float32",
            "1",
            "rho_m by the place where the view's ray enters the opening, from the left end",
        ),
    },
)

SCRATCH_TABLE = Schema(
    _SYSTEM,
    "scratch_table",
    1,
    "The scratch BRDF along the scratch: three leans, the exponent between them, the sampler.",
    {
        "rho_s": Variable(
            ("lean", "out", "in"),
            "float32",
            "1",
            "rho_s at the leans theta_o of the view",
            "Eq. 2, 3",
        ),
        "lean": Variable(("lean",), "float64", "radian", "Tabulated theta_o", "section 3.1"),
        "factor": Variable(("lean", "out"), "float64", "1", "Fresnel's factor on rho_m", "Eq. 2"),
        "gamma": Variable(("out",), "float64", "1", "Exponent of the interpolation", "Eq. 4"),
        "cdf": Variable(
            ("place", "out", "border"),
            "float32",
            "1",
            "Share of the reflected light below each bin's border, by place and view",
            "Eq. 5",
        ),
        "share": Variable(
            ("place", "out"), "float32", "1", "Part of the light that the walls give back"
        ),
        "index": Variable((), "float64", "1", "Refractive index", "Eq. 2, n"),
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
    SCRATCH_LAYERS,
    GLASS_OBJECT,
    GLASS_FRAMES,
    GLASS_PACKAGE,
)
