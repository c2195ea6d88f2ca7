"""Datasets of streets: drives, depths, points, billboards, their textures, their looks."""

from storage.schemas.schema import Schema, Variable

_SYSTEM = "street_billboards"

DRIVE_POSES = Schema(
    _SYSTEM,
    "drive_poses",
    1,
    "Where a drive's cameras were, and through which lenses they looked.",
    {
        "poses": Variable(
            ("frame", "camera", "row_4", "column_4"),
            "float64",
            "m",
            "From the camera's axes (right, down, forward) to the world's, z up",
        ),
        "intrinsics": Variable(
            ("camera", "row", "column"), "float64", "pixel", "K of the photographs as they are"
        ),
        "size": Variable(("side",), "int64", "pixel", "Width and height of the photographs"),
        "instant": Variable(("frame",), "int64", "1", "Which of the drive's own instants"),
        "origin": Variable(
            ("axis",), "float64", "m", "Where the drive's own world has this one's zero"
        ),
        "points": Variable(
            ("point", "axis"), "float64", "m", "What poses were found or adjusted by"
        ),
        "point_colours": Variable(("point", "channel"), "uint8", "1", "sRGB"),
        "focal_deviation": Variable(
            ("camera",), "float64", "pixel", "Standard deviation of a focal length; 0 where given"
        ),
        "used": Variable(
            ("camera", "y", "x"),
            "bool",
            "1",
            "Where a picture shows the world: not the bonnet, a logo, a date",
            optional=True,
        ),
        "exposure": Variable(
            ("frame", "camera"),
            "float64",
            "1",
            "Built-in drive: factors on linear light, about 1",
            optional=True,
        ),
    },
)

DRIVE_FRAMES = Schema(
    _SYSTEM,
    "drive_frames",
    1,
    "A drive: photographs of cameras in a row, where they were taken, what is kept for the test.",
    {
        "photographs": Variable(
            ("frame", "camera", "y", "x", "channel"), "uint8", "1", "sRGB, without distortion"
        ),
        "intrinsics": Variable(("camera", "row", "column"), "float64", "pixel", "K"),
        "poses": Variable(
            ("frame", "camera", "row_4", "column_4"),
            "float64",
            "m",
            "From the camera's axes (right, down, forward) to the world's, z up",
        ),
        "origin": Variable(
            ("axis",), "float64", "m", "Where the drive's own world has this one's zero"
        ),
        "held_out": Variable(
            ("frame",), "bool", "1", "Used to judge pictures and for nothing else"
        ),
        "used": Variable(
            ("frame", "camera", "y", "x"),
            "bool",
            "1",
            "Where a photograph shows the world; all of it where this is missing",
            optional=True,
        ),
        "truth_depth": Variable(
            ("held", "y", "x"),
            "float32",
            "m",
            "Along the axis, of the middle camera's held-out frames; inf is sky",
            optional=True,
        ),
        "truth_pole": Variable(
            ("held", "y", "x"), "bool", "1", "Where those show a thin pole", optional=True
        ),
        "beside": Variable(
            ("held", "offset", "y", "x", "channel"),
            "uint8",
            "1",
            "What the middle camera would see beside the path",
            "figure 9",
            optional=True,
        ),
        "offset": Variable(("offset",), "float64", "m", "To the left of the path", optional=True),
    },
)

DEPTH_MAPS = Schema(
    _SYSTEM,
    "depth_maps",
    1,
    "Depth of each photograph that is not held out, by semi-global matching of neighbours.",
    {
        "depth": Variable(
            ("taken", "camera", "y", "x"),
            "float32",
            "m",
            "Along the axis; NaN where unknown, inf in the sky",
        ),
        "deviation": Variable(
            ("taken", "camera", "y", "x"), "float32", "m", "Standard deviation to be expected"
        ),
        "frame": Variable(("taken",), "int64", "1", "Which frame of the drive"),
        "sky": Variable(
            ("row", "column", "channel"),
            "float32",
            "1",
            "Radiance of what is farther than depths reach, equirectangular, z up",
        ),
    },
)

STREET_POINTS = Schema(
    _SYSTEM,
    "street_points",
    1,
    "The coloured point cloud of the street: what several depth maps agree on.",
    {
        "positions": Variable(("point", "axis"), "float64", "m", "World coordinates, z up"),
        "colours": Variable(("point", "channel"), "uint8", "1", "sRGB"),
        "gains": Variable(
            ("taken", "camera", "channel"),
            "float64",
            "1",
            "Exposure of each photograph: factor of linear light, about 1",
        ),
        "agreement": Variable(
            ("taken",),
            "float64",
            "1",
            "Share of some frames' points that their neighbours confirm; NaN: not asked",
        ),
    },
)

BILLBOARDS = Schema(
    _SYSTEM,
    "billboards",
    1,
    "A rectangle for every leaf of the octree that holds enough points, in the order of the road.",
    {
        "centre": Variable(("billboard", "axis"), "float64", "m", "Of the rectangle", "4.1"),
        "voxel": Variable(("billboard", "axis"), "float64", "m", "Middle of the leaf"),
        "turns": Variable(("billboard",), "bool", "1", "Faces the viewer; others stand still"),
        "half_s": Variable(("billboard", "axis"), "float32", "m", "Half a row, to the right"),
        "half_t": Variable(("billboard", "axis"), "float32", "m", "Half a column, upwards"),
        "fan": Variable(
            ("billboard",), "int32", "6 degrees", "Azimuth of the first of 32 directions", "4.2"
        ),
        "tile": Variable(("billboard",), "int32", "1", "Tile of the road"),
        "side": Variable((), "float64", "m", "Of a leaf"),
        "depth": Variable((), "int64", "1", "Levels of the octree"),
    },
)

VIEW_TEXTURES = Schema(
    _SYSTEM,
    "view_textures",
    1,
    "What each billboard looks like from the directions in which somebody looked.",
    {
        "first": Variable(("billboard_end",), "int64", "1", "Where a billboard's views begin"),
        "direction": Variable(("view",), "uint8", "1", "0 to 31, of the billboard's fan", "4.2.1"),
        "colours": Variable(
            ("view", "v", "u", "channel"), "uint8", "1", "sRGB at an exposure of 1", "4.2.1"
        ),
        "states": Variable(
            ("view", "v", "u"), "uint8", "1", "0 nobody looked there, 1 seen, 2 looked through"
        ),
        "sharpness": Variable(("view",), "float32", "1", "Pixels of the photograph to a texel"),
    },
)

_COMPRESSED = {
    "first": Variable(("billboard_end",), "int64", "1", "Where a billboard's views begin"),
    "direction": Variable(("view",), "uint8", "1", "0 to 31, of the billboard's fan"),
    "means": Variable(("view", "channel"), "uint8", "1", "Mean colours", "Eq. 1, ave"),
    "ranks": Variable(("billboard", "channel"), "uint8", "1", "Eigen-images", "Eq. 1, r"),
    **{
        f"{name}_{number}": Variable(dims, dtype, units, f"{meaning}, channel {number}", source)
        for number in range(3)
        for name, dims, dtype, units, meaning, source in (
            (
                "planes",
                (f"plane_{number}", f"v_{number}", f"u_{number}"),
                "uint8",
                "1",
                "Eigen-images",
                "Eq. 1, V",
            ),
            (
                "scales",
                (f"plane_{number}",),
                "float32",
                "code",
                "Of plane times weight",
                "",
            ),
            ("weights", (f"weight_{number}",), "uint8", "1", "Weights, ragged", "Eq. 1, w"),
        )
    },
    "first_mask": Variable(("billboard_end",), "int64", "1", "Where a billboard's masks begin"),
    "masks": Variable(("mask", "v", "byte"), "uint8", "1", "Alpha, a bit a texel"),
}

EIGEN_TEXTURES = Schema(
    _SYSTEM,
    "eigen_textures",
    1,
    "The textures compressed as eigen-textures in 8 bit (docs/street.md).",
    {
        **_COMPRESSED,
        "bytes": Variable((), "int64", "byte", "Everything above that is needed to draw"),
        "rmse": Variable((), "float64", "code", "Error, pooled over all texels that were seen"),
    },
)

TEXTURE_ATLASES = Schema(
    _SYSTEM,
    "texture_atlases",
    1,
    "The textures as a graphics card takes them, page by page (pipelines/street_billboards/"
    "atlases.py says how they are laid out).",
    {
        "detail": Variable(("detail_byte",), "uint8", "1", "RGBA8 tiles of channel 0", "4.3"),
        "detail_scales": Variable(("detail_scale",), "float32", "code", "Four a tile"),
        "tint": Variable(("tint_byte",), "uint8", "1", "RGBA8 tiles of channels 1 and 2", "4.3"),
        "tint_scales": Variable(("tint_scale",), "float32", "code", "Four a tile"),
        "views": Variable(("view_byte",), "uint8", "1", "Means, directions, weights", "4.3"),
        "masks": Variable(("mask_byte",), "uint8", "1", "Alpha, a bit a texel"),
        "records": Variable(("record",), "float32", "1", "Eight a billboard"),
        "shapes": Variable(
            ("page", "texture", "axis_2"),
            "int64",
            "texel",
            "Rows and columns of detail, detail scales, tint, tint scales, views, masks",
        ),
        "reach": Variable(
            ("page", "atlas"), "int64", "tile", "Tiles that a billboard reaches into, at most"
        ),
        "page": Variable(("billboard",), "int64", "1", "Page of each billboard"),
        "bytes": Variable((), "int64", "byte", "Of what stands for something"),
        "padding": Variable((), "int64", "byte", "Of what stands for nothing"),
    },
)

STREET_FRAMES = Schema(
    _SYSTEM,
    "street_frames",
    1,
    "The street seen anew: along the path, beside it, and beside photographs that were held out.",
    {
        "flight": Variable(
            ("frame", "y", "x", "channel"), "uint8", "1", "A drive that changes lanes", "figure 9"
        ),
        "rendered": Variable(
            ("held", "y", "x", "channel"),
            "uint8",
            "1",
            "From where the held-out frames were taken, at their exposure",
            "figure 8 b",
        ),
        "truth": Variable(
            ("held", "y", "x", "channel"), "uint8", "1", "The held-out frames", "figure 8 a"
        ),
        "alone": Variable(
            ("held", "y", "x", "channel"), "uint8", "1", "Billboards alone", "figure 8 c"
        ),
        "covered": Variable(("held", "y", "x"), "bool", "1", "Where some billboard is seen"),
        "beside": Variable(
            ("held", "offset", "y", "x", "channel"),
            "uint8",
            "1",
            "From beside the path",
            "figure 9 b",
        ),
        "beside_covered": Variable(("held", "offset", "y", "x"), "bool", "1", "Likewise"),
        "beside_truth": Variable(
            ("held", "offset", "y", "x", "channel"),
            "uint8",
            "1",
            "What a camera there would see",
            "figure 9 a",
            optional=True,
        ),
        "offset": Variable(("offset",), "float64", "m", "To the left of the path"),
        "decoded": Variable(
            ("y", "x", "channel"),
            "uint8",
            "1",
            "The first held-out frame, decoded by the processor instead of the shader",
            "5.1",
        ),
        "shaded": Variable(("y", "x", "channel"), "uint8", "1", "The same, by the shader"),
        "psnr": Variable(("held",), "float64", "dB", "Of rendered, where covered"),
        "ssim": Variable(("held",), "float64", "1", "Likewise"),
        "flip": Variable(("held",), "float64", "1", "Likewise; 0 = alike"),
    },
)

STREET_PACKAGE = Schema(
    _SYSTEM,
    "street_package",
    1,
    "The street as a runtime package (docs/packages.md).",
    {"file": Variable(("byte",), "uint8", "1", "Bytes of the `.tsuya` file")},
)

SCHEMAS = (
    DRIVE_POSES,
    DRIVE_FRAMES,
    DEPTH_MAPS,
    STREET_POINTS,
    BILLBOARDS,
    VIEW_TEXTURES,
    EIGEN_TEXTURES,
    TEXTURE_ATLASES,
    STREET_FRAMES,
    STREET_PACKAGE,
)
