"""Datasets of the fur system: one photograph, layers of shells, meshes, frames."""

from storage.schemas.schema import Schema, Variable

_SYSTEM = "photo_fur"
_PIXELS = ("y", "x")

FUR_PHOTO = Schema(
    _SYSTEM,
    "fur_photo",
    1,
    "One photograph of fur from straight above, in linear light.",
    {
        "radiance": Variable(
            (*_PIXELS, "channel"), "float32", "1", "Linear RGB (sRGB primaries), white = 1"
        ),
        "luminance": Variable(
            _PIXELS, "float32", "1", "Rec. 709 luminance of the radiance", "section 3.1, I"
        ),
        "opaque": Variable(
            _PIXELS,
            "bool",
            "1",
            "Where there is fur; missing where there is fur everywhere",
            optional=True,
        ),
        "unevenness_before": Variable(
            (),
            "float64",
            "1",
            "Deviation of the logarithm of the light's slope that was taken out",
            optional=True,
        ),
        "depth": Variable(
            _PIXELS,
            "float32",
            "thickness",
            "True depth below the fur's surface: 0 at the top, 1 at the skin",
            "section 3.1, h / hb",
            optional=True,
        ),
    },
)

ATTENUATION = Schema(
    _SYSTEM,
    "attenuation",
    1,
    "How light decays from the fur's surface to the skin, read from the photograph's histogram.",
    {
        "histogram": Variable(
            ("bin",), "int64", "pixels", "Pixels per bin of luminance", "section 3.2"
        ),
        "bin_edge": Variable(("edge",), "float64", "1", "Luminance at the bins' edges"),
        "brightest": Variable((), "float64", "1", "Luminance at the surface", "Eq. 1, Imax"),
        "darkest": Variable((), "float64", "1", "Luminance at the skin", "Eq. 2, Imin"),
        "attenuation": Variable(
            (), "float64", "1/thickness", "Attenuation coefficient for thickness 1", "Eq. 2, a"
        ),
        "boundary_luminance": Variable(
            ("boundary",), "float64", "1", "Luminance between the layers", "Eq. 4, I(n)"
        ),
        "pixels_per_layer": Variable(
            ("layer",), "int64", "pixels", "Pixels of each layer, tails not counted"
        ),
        "bright_tail": Variable((), "int64", "pixels", "Pixels brighter than the brightest"),
        "dark_tail": Variable((), "int64", "pixels", "Pixels darker than the darkest"),
        "depth_rank_correlation": Variable(
            (),
            "float64",
            "1",
            "Spearman correlation of darkness with the true depth",
            optional=True,
        ),
        "depth_rmse": Variable(
            (), "float64", "thickness", "RMSE of the depth by Eq. 1", optional=True
        ),
        "depth_rmse_constant": Variable(
            (), "float64", "thickness", "RMSE of the best constant depth", optional=True
        ),
    },
)

SHELL_STACK = Schema(
    _SYSTEM,
    "shell_stack",
    1,
    "The photograph cut into layers: every pixel is in one of them.",
    {
        "layer": Variable(
            _PIXELS, "uint8", "1", "Layer of the pixel, 1 at the tips; 0 = dropped", "section 3.2"
        ),
        "mask": Variable(
            ("shell", *_PIXELS), "bool", "1", "Whether the pixel is in the layer (shell + 1)"
        ),
    },
)

SHELL_MESH = Schema(
    _SYSTEM,
    "shell_mesh",
    1,
    "A mesh with its vertices offset along the normals at equal steps, one set a layer.",
    {
        "vertices": Variable(
            ("shell", "vertex", "axis"),
            "float32",
            "mesh unit",
            "Positions on each layer, the first at the tips, the last on the surface",
            "section 3",
        ),
        "normals": Variable(("vertex", "axis"), "float32", "1", "Unit normals"),
        "triangles": Variable(("triangle", "corner"), "int32", "1", "Vertex numbers"),
        "uvs": Variable(
            ("vertex", "uv"), "float32", "photograph", "Texture coordinates, origin bottom left"
        ),
        "height": Variable(("shell",), "float64", "mesh unit", "Height above the surface", "Eq. 3"),
        "thickness": Variable((), "float64", "mesh unit", "Thickness of the fur", "Eq. 2, hb"),
    },
)

LIE_FIELD = Schema(
    _SYSTEM,
    "lie_field",
    1,
    "How hair lies on the mesh: a smooth field of directions (Knöppel et al. 2013).",
    {
        "tangents": Variable(
            ("vertex", "axis"), "float32", "1", "Unit directions along the surface, to the tips"
        ),
        "lengths": Variable(
            ("vertex",), "float32", "1", "How long the hair is, 1 for the fur's thickness"
        ),
        "guides": Variable(
            ("vertex", "axis"), "float32", "1", "Wanted directions; longer ones count for more"
        ),
        "singular_triangle": Variable(
            ("singularity",), "int64", "1", "Triangles about which the direction turns round"
        ),
        "index": Variable(
            ("singularity",), "int64", "1", "How often it does: 1 for a crown, -1 for a saddle"
        ),
        "backwards": Variable(("axis",), "float64", "1", "Unit vector from nose to tail"),
    },
)

FUR_PATCHES = Schema(
    _SYSTEM,
    "fur_patches",
    2,
    "The photograph laid over the mesh in patches that follow the lie (Praun et al. 2000).",
    {
        "vertex": Variable(
            ("corner_vertex",), "int64", "1", "Vertex of the mesh; split where patches change"
        ),
        "triangles": Variable(("triangle", "corner"), "int32", "1", "Split vertices' numbers"),
        "uvs": Variable(
            ("corner_vertex", "slot", "uv"),
            "float32",
            "photograph",
            "Places in the photograph, in widths, origin bottom left",
        ),
        "weights": Variable(
            ("corner_vertex", "slot"), "float32", "1", "Of the patches, adding up to 1"
        ),
        "patches": Variable(
            ("triangle", "slot"), "int64", "1", "Patches that a triangle shows; -1 for none"
        ),
        "middles": Variable(("patch",), "int64", "1", "Vertex in the middle of each patch"),
        "places": Variable(
            ("patch", "uv"), "float32", "photograph", "What of the photograph is in the middle"
        ),
        "directions": Variable(
            ("patch",), "float32", "radian", "How the photograph's hair lies there"
        ),
        "direction": Variable(
            _PIXELS, "float32", "radian", "How hair lies in the photograph, from x towards y (up)"
        ),
        "coherence": Variable(_PIXELS, "float32", "1", "1 where all lines are parallel"),
        "slant": Variable(
            (), "float64", "1", "Skewness of brightness's steps towards the tips; 0: sign unknown"
        ),
        "width": Variable((), "float64", "mesh unit", "Of the photograph on the surface"),
        "spacing": Variable((), "float64", "mesh unit", "Between patches' middles"),
    },
)

FUR_FRAMES = Schema(
    _SYSTEM,
    "fur_frames",
    1,
    "Pictures of the fur on the mesh.",
    {
        "frames": Variable(
            ("view", *_PIXELS, "channel"), "uint8", "1", "sRGB pictures, one a view", "figures 3-6"
        ),
        "azimuth": Variable(("view",), "float64", "degree", "Camera's angle around the up axis"),
        "elevation": Variable(("view",), "float64", "degree", "Camera's angle above the horizon"),
        "coverage": Variable(("view",), "float64", "1", "Share of the picture's pixels with fur"),
    },
)

FUR_PACKAGE = Schema(
    _SYSTEM,
    "fur_package",
    1,
    "The fur as a runtime package (docs/packages.md).",
    {"file": Variable(("byte",), "uint8", "1", "Bytes of the `.tsuya` file")},
)

SCHEMAS = (
    FUR_PHOTO,
    ATTENUATION,
    SHELL_STACK,
    SHELL_MESH,
    LIE_FIELD,
    FUR_PATCHES,
    FUR_FRAMES,
    FUR_PACKAGE,
)
