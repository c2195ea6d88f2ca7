"""What the package of a street holds."""

from __future__ import annotations

from storage.packages.schema import ArrayPart, PackageSchema, Parameter, TexturesPart

_DECODING = """\
Metres, z up. The street lies in tiles, each some metres of road; the parts `tile_000/…` of a tile
stand alone and lie side by side in the zip, so that a reader fetches, decodes and drops it by
itself. All textures are one layer, read with `texelFetch` but for the samples of `detail` and
`tint`, which are interpolated; row 0 is at t = 0, where a texture's top is.

**Headers**, five texels a billboard, `columns` = width / 5 of them side by side: (centre x, y, z;
fan), (half a row x, y, z; 1 if it turns to the viewer), (half a column x, y, z; 0), (first texel in
`views`; first mask; bits of directions 0 to 15; 16 to 31), (first tile in `detail`; in `tint`;
d + 64 t + 4096 for a mask a view + 8192; channel 2's first slot counted from that tile's). The
corners are centre ± half row ± half column. Of one that turns only the lengths count: with n the
unit vector to the viewer its row axis is (-n.y, n.x, 0), made unit, its column axis n x row.

**Views.** A viewer stands in the fan at p = azimuth of the viewer from the centre / 6 degrees -
fan, in [-14.5, 45.5). The stored views left and right of p are blended by where p lies between
them; beyond the last one it alone counts. View i of a billboard begins at its first texel + i (1 +
d + t): (mean of Y, Co, Cg; direction), then d texels of detail's weights and t of tint's.

**Colour** in codes: mean (128 less for Co and Cg) + the sum over the tiles' four channels of scale
x (weight - 128) / 127 x (sample - 128) / 127. Tiles have `detail_side` and `tint_side` texels;
those of less than 32 are sampled at the middles of the texture's texels and interpolated between
these. Slots of tint from channel 2's first on are Cg, those before are Co. R = Y + Co - Cg,
G = Y + Cg, B = Y - Co - Cg; these are sRGB codes. Where the mask's bits (32 x 32, a texel a row,
red first, its highest bit leftmost), interpolated between the middles of texels, are below 0.5
nothing is drawn. Behind all is the sky. `pipelines/drawing/shaders/street_*.glsl` does all of it.
"""

_TILE: dict[str, ArrayPart | TexturesPart] = {
    "billboard": ArrayPart(("billboard",), "uint32", "1", "Which of the street's each one is"),
    "headers": TexturesPart(
        "Where billboards stand and where their textures lie, five texels each",
        dtype="float32",
        units="m, texel",
    ),
    "views": TexturesPart("Means, directions, weights of the stored views", units="code"),
    "masks": TexturesPart("Alpha, a bit a texel, a texel a row of a mask", units="bit"),
    "detail": TexturesPart(
        "Eigen-images of Y, four a tile", units="code", source="4.3", optional=True
    ),
    "detail_scales": TexturesPart(
        "Scales of the four of a tile", dtype="float32", units="code", optional=True
    ),
    "tint": TexturesPart(
        "Eigen-images of Co and Cg, four a tile",
        units="code",
        source="4.3",
        optional=True,
    ),
    "tint_scales": TexturesPart(
        "Scales of the four of a tile", dtype="float32", units="code", optional=True
    ),
}

PACKAGE = PackageSchema(
    "street_billboards",
    1,
    "A street of eigen-textured billboards in tiles of road, and the way that was driven.",
    {
        "tile_billboards": ArrayPart(("tile",), "uint32", "1", "Billboards of each tile"),
        "tile_stretch": ArrayPart(
            ("tile", "end"), "float32", "m", "Along the way, from and to, in rising order"
        ),
        "tile_box": ArrayPart(
            ("tile", "corner", "axis"), "float32", "m", "Least and most that billboards reach"
        ),
        "path": ArrayPart(
            ("frame", "row", "column"),
            "float32",
            "m",
            "From the middle camera's axes (right, down, forward) to the world's, frame by frame",
        ),
        "path_held_out": ArrayPart(
            ("frame",), "uint8", "1", "1: the frame judges pictures and made none of the textures"
        ),
        "sky": ArrayPart(
            ("row", "column", "channel"),
            "float16",
            "1",
            "Linear radiance behind the street, equirectangular, row 0 at the zenith; azimuth 0 in "
            "the middle, 90 degrees a quarter of the width from the left",
        ),
        **{f"tile_*/{name}": part for name, part in _TILE.items()},
    },
    {
        "colour": Parameter("1", "What channels are: ycocg or rgb"),
        "detail_side": Parameter("texel", "Side of the tiles of detail"),
        "tint_side": Parameter("texel", "Side of the tiles of tint"),
        "detail_tiles": Parameter("1", "Tiles of detail that a billboard reaches into, at most"),
        "tint_tiles": Parameter("1", "Tiles of tint that a billboard reaches into, at most"),
        "view_angle": Parameter("degree", "Of the camera that drove, vertical"),
        "leaf": Parameter("m", "Side of the voxels that billboards stand for"),
    },
    _DECODING,
)
