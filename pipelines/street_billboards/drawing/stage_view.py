"""The street on the stage: textures decoded in the shader (4.3), or before, on the processor.

A billboard is four vertices of one mesh, a page (:mod:`.atlases`) one draw call. The vertex shader
turns the billboard to the eye, finds the two stored views beside the viewer's direction and blends
their weights and means; the fragment shader looks at the mask's bits, multiplies samples of the
planes by the weights, converts colours, and hands on linear light. Only the triangles of what is
in view are sent, nearest first.

``CpuStreet`` is the paper's rival: it decodes each visible billboard before the frame and sends
RGBA8 tiles. The two agree because interpolating texels and adding planes can change places; but
decoded colours are rounded and clamped to 0 to 255 before they are interpolated, and planes of a
lower resolution are first sampled at the middles of 32 x 32 texels: between these the rival cuts
off what such a plane has of peaks (noise of 40 codes differs by up to 5, smooth planes do not).

Textures are interpolated between the middles of texels and clamped at a tile's rim. The mask is a
bit a texel; between four middles the outline is where their interpolated bits are 0.5. A turning
billboard between two views has the nearer one's mask, as a blend of bits says that is >= 0.5.

The stage's own near plane is at a thousandth of the far one. The shader passes d + t + 4 vectors,
d and t the tiles that planes of a billboard reach into (three channels of 31 planes: 29): OpenGL
promises 16, drivers have 31 or more.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.stage import Camera, Shader, require_graphics, surface, texture
from pipelines.street_billboards.billboards import Billboards, turned_axes
from pipelines.street_billboards.drawing.culling import visible
from pipelines.street_billboards.textures.atlases import MOST_TEXELS, Page, pages
from pipelines.street_billboards.textures.decoding import Decodable, decodable, decoded_views
from pipelines.street_billboards.textures.forms import SIDE, CompressedTextures
from pipelines.street_billboards.textures.view_directions import CIRCLE, DIRECTIONS, fan_position

_CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
"""(s, t) of a billboard's four vertices."""
_QUAD = np.array([0, 1, 2, 0, 2, 3])
_MARGIN = 0.5 + 1 / 512
"""Texels from a tile's rim at which coordinates are clamped: less, rounded, would reach over it."""


@functools.cache
def most_texels_of_driver() -> int:
    """Texels of the largest texture's side. Raises NoGraphicsError."""
    require_graphics()
    from vtkmodules.vtkRenderingCore import vtkRenderWindow
    from vtkmodules.vtkRenderingOpenGL2 import vtkTextureObject

    window = vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.Initialize()
    most = int(vtkTextureObject.GetMaximumTextureSize(cast(Any, window)))
    window.Finalize()
    return most


def stage_camera(
    intrinsics: NDArray[np.floating], to_world: NDArray[np.floating], height: int
) -> Camera:
    """The stage's camera that takes the photograph of a camera (K (3, 3), to_world (4, 4)).

    height: of the photograph, in pixels; the stage has to be as wide as it. Raises ValueError for
    pixels that are not square and a principal point that is not in the picture's middle.
    """
    across, down = float(intrinsics[0, 0]), float(intrinsics[1, 1])
    if abs(across - down) > 1e-6 * down:
        raise ValueError(f"intrinsics: found focal lengths {across} and {down}; expected equal.")
    _check_middle("row", float(intrinsics[1, 2]), height)
    place, forward, up = to_world[:3, 3], to_world[:3, 2], -to_world[:3, 1]
    x, y, z = (float(value) for value in place)
    target_x, target_y, target_z = (float(value) for value in place + forward)
    up_x, up_y, up_z = (float(value) for value in up)
    return Camera(
        position=(x, y, z),
        target=(target_x, target_y, target_z),
        up=(up_x, up_y, up_z),
        view_angle=float(np.degrees(2 * np.arctan(height / 2 / down))),
    )


def _check_middle(name: str, found: float, count: int) -> None:
    if abs(found - (count - 1) / 2) > 1e-3:
        raise ValueError(
            f"intrinsics: the principal point is in {name} {found}; expected "
            f"{(count - 1) / 2}, the middle of {count}."
        )


# ---- decoded in the shader ---------------------------------------------------------------------


class Street:
    """Billboards with textures that the shader decodes.

    textures: of the same b billboards, or as ``atlases.pages`` packed them. most_texels: of a
    texture's side, where they are still to be packed; less where the driver has less. ``actors``
    are for ``Stage.add``, one a page (``pages``); nothing shows before ``look``. Raises ValueError
    as ``atlases.pages``, and for pages that the driver cannot hold or of other billboards.
    """

    def __init__(
        self,
        billboards: Billboards,
        textures: CompressedTextures | Sequence[Page],
        *,
        most_texels: int = MOST_TEXELS,
    ) -> None:
        most = most_texels_of_driver()
        if isinstance(textures, CompressedTextures):
            textures = pages(textures, min(most_texels, most))
        self.pages = list(textures)
        _check_pages(self.pages, len(billboards.centre), most)
        self._billboards = billboards
        self._drawable = np.concatenate([np.empty(0, bool), *(p.has_views for p in self.pages)])
        self.actors = [_page_actor(billboards, page) for page in self.pages]

    def look(
        self,
        intrinsics: NDArray[np.floating],
        to_world: NDArray[np.floating],
        width: int,
        height: int,
    ) -> int:
        """Send the triangles of what a camera sees; how many billboards that are.

        intrinsics (3, 3) in pixels, to_world (4, 4). Raises ValueError where the principal point is
        not in the picture's middle.
        """
        seen = _seen(self._billboards, self._drawable, intrinsics, to_world, width, height)
        for page, actor in zip(self.pages, self.actors, strict=True):
            first, last = page.billboards[0], page.billboards[-1]
            _send_quads(actor, seen[(seen >= first) & (seen <= last)] - first)
        return len(seen)


def _check_pages(pages: Sequence[Page], count: int, most: int) -> None:
    found = sum(len(page.billboards) for page in pages)
    if found != count:
        raise ValueError(f"pages: found textures of {found} billboards; expected {count}.")
    sheets = [sheet for p in pages for sheet in (p.detail.texels, p.tint.texels, p.views, p.masks)]
    largest = max((max(sheet.shape[:2]) for sheet in sheets), default=0)
    if largest > most:
        raise ValueError(
            f"pages: found a texture of {largest} texels; expected {most} at most, which is what "
            "the graphics driver has."
        )


def _seen(
    billboards: Billboards,
    drawable: NDArray[np.bool_],
    intrinsics: NDArray[np.floating],
    to_world: NDArray[np.floating],
    width: int,
    height: int,
) -> NDArray[np.int64]:
    _check_middle("column", float(intrinsics[0, 2]), width)
    _check_middle("row", float(intrinsics[1, 2]), height)
    seen = visible(billboards, intrinsics, to_world, width, height)
    return seen[drawable[seen]]


def _send_quads(actor: Any, quads: NDArray[np.int64]) -> None:
    """Draw these quads of the actor's mesh only, in this order."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import VTK_INT
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    corners = (4 * quads[:, None] + _QUAD).astype(np.int32).ravel()
    cells = vtkCellArray()
    cells.SetData(3, numpy_to_vtk(corners, deep=True, array_type=VTK_INT))
    mesh = actor.GetMapper().GetInput()
    mesh.SetPolys(cells)
    mesh.Modified()


def _page_actor(billboards: Billboards, page: Page) -> Any:
    rows = page.billboards
    geometry = np.zeros((len(rows), 3, 4), np.float32)
    geometry[:, 0, :3] = billboards.centre[rows]
    geometry[:, 1, :3] = billboards.half_s[rows]
    geometry[:, 2, :3] = billboards.half_t[rows]
    geometry[:, 0, 3] = billboards.fan[rows]
    geometry[:, 1, 3] = billboards.turns[rows]
    headers = np.concatenate([geometry, page.records], axis=1)
    columns = max(int(np.sqrt(len(rows))), 1)
    header_rows = -(-len(rows) // columns)
    sheet = np.zeros((header_rows * columns, 5, 4), np.float32)
    sheet[: len(rows)] = headers
    images = {
        "headers": _fixed(sheet.reshape(header_rows, columns * 5, 4)),
        "views": _fixed(page.views),
        "masks": _fixed(page.masks),
    }
    for name, atlas in (("detail", page.detail), ("tint", page.tint)):
        if atlas.most_tiles:
            images[name] = _fixed(atlas.texels, interpolate=True)
            images[f"{name}Scales"] = _fixed(atlas.scales)
    actor = surface(
        _bounding_points(billboards, rows),
        _QUAD.reshape(-1, 3),
        textures=images,
        shader=_shader(page, columns),
        lit=False,
    )
    _send_quads(actor, np.empty(0, np.int64))
    return actor


def _bounding_points(billboards: Billboards, rows: NDArray[np.int64]) -> NDArray[np.float32]:
    """(4 p, 3): the shader places the vertices; but the stage takes its depths from these."""
    reach = np.hypot(
        np.linalg.norm(billboards.half_s[rows], axis=1),
        np.linalg.norm(billboards.half_t[rows], axis=1),
    )
    ends = np.array([-1.0, 1.0, -1.0, 1.0])[:, None]
    around = billboards.centre[rows][:, None] + ends * reach[:, None, None]
    return around.reshape(-1, 3).astype(np.float32)


def _fixed(image: NDArray[Any], *, interpolate: bool = False) -> Any:
    """A texture whose row 0 is at t = 0."""
    return texture(np.ascontiguousarray(image[::-1]), wrap="clamp", interpolate=interpolate)


# ---- the shader --------------------------------------------------------------------------------


def _shader(page: Page, header_columns: int) -> Shader:
    detail, tint = page.detail.most_tiles, page.tint.most_tiles
    declared = "{0} vec2 placeOut;"
    declared += " flat {0} vec4 baseOut; flat {0} vec4 tilesOut; flat {0} vec4 runsOut;"
    if detail:
        declared += f" flat {{0}} vec4 detailOut[{detail}];"
    if tint:
        declared += f" flat {{0}} vec4 tintOut[{tint}];"
    samplers = "uniform sampler2D headers; uniform sampler2D views;"
    samplers += "uniform sampler2D detailScales;" if detail else ""
    samplers += "uniform sampler2D tintScales;" if tint else ""
    return Shader(
        vertex={
            "PositionVC::Dec": "//VTK::PositionVC::Dec\nuniform mat4 MCVCMatrix;\n"
            + samplers
            + declared.format("out")
            + _VERTEX_FUNCTIONS,
            "PositionVC::Impl": _vertex(page, header_columns),
        },
        fragment={
            "TCoord::Dec": "//VTK::TCoord::Dec\n" + declared.format("in") + _FRAGMENT_FUNCTIONS,
            "Color::Impl": "//VTK::Color::Impl\n" + _fragment(page),
        },
    )


_VERTEX_FUNCTIONS = """
uint ones(uint bits) {
  bits = bits - ((bits >> 1) & 0x55555555u);
  bits = (bits & 0x33333333u) + ((bits >> 2) & 0x33333333u);
  bits = (bits + (bits >> 4)) & 0x0F0F0F0Fu;
  return (bits * 0x01010101u) >> 24;
}
int highest(uint bits) {
  bits |= bits >> 1; bits |= bits >> 2; bits |= bits >> 4; bits |= bits >> 8; bits |= bits >> 16;
  return int(ones(bits)) - 1;
}
int lowest(uint bits) { return int(ones((bits & (~bits + 1u)) - 1u)); }
"""


def _vertex(page: Page, header_columns: int) -> str:
    views, masks = page.views.shape[1], page.masks.shape[1] // SIDE
    outside = (CIRCLE - DIRECTIONS + 1) / 2
    neutral = "vec3(0.0, 128.0, 128.0)" if page.flags[0, 1] else "vec3(0.0)"
    parts = [
        f"""
  int billboard = gl_VertexID / 4, corner = gl_VertexID - 4 * billboard;
  ivec2 header = ivec2(billboard % {header_columns} * 5, billboard / {header_columns});
  vec4 centre = texelFetch(headers, header, 0);
  vec4 halfS = texelFetch(headers, header + ivec2(1, 0), 0);
  vec4 halfT = texelFetch(headers, header + ivec2(2, 0), 0);
  vec4 stored = texelFetch(headers, header + ivec2(3, 0), 0);
  vec4 runs = texelFetch(headers, header + ivec2(4, 0), 0);
  vec3 towards = -transpose(mat3(MCVCMatrix)) * MCVCMatrix[3].xyz - centre.xyz;
  // The two stored views beside the viewer, and how far it is from the lower one.
  float position = mod(degrees(atan(towards.y, towards.x)) * {CIRCLE / 360.0!r} - centre.w
    + {outside!r}, {CIRCLE}.0) - {outside!r};
  uint all = uint(stored.z) | (uint(stored.w) << 16);
  uint up = position < 0.0 ? 0u
    : all & ((2u << uint(clamp(int(position), 0, {DIRECTIONS - 1}))) - 1u);
  uint beyond = all & ~up;
  int below = int(ones(up)), count = int(ones(all));
  int lower = max(below - 1, 0), upper = min(below, count - 1);
  float from = float(highest(up)), to = float(lowest(beyond));
  float part = lower == upper ? 0.0 : (position - from) / (to - from);
  int detailTiles = int(runs.z) & 63, tintTiles = (int(runs.z) >> 6) & 63;
  int taken = 1 + detailTiles + tintTiles;
  int lowerTexel = int(stored.x) + lower * taken, upperTexel = int(stored.x) + upper * taken;
  vec3 base = 255.0 * mix(
    texelFetch(views, ivec2(lowerTexel % {views}, lowerTexel / {views}), 0).rgb,
    texelFetch(views, ivec2(upperTexel % {views}, upperTexel / {views}), 0).rgb, part)
    - {neutral};
  int mask = int(stored.y);
  if ((int(runs.z) & 4096) != 0) mask += part < 0.5 ? lower : upper;
"""
    ]
    for name, atlas in (("detail", page.detail), ("tint", page.tint)):
        if not atlas.most_tiles:
            continue
        columns = atlas.scales.shape[1]
        first = f"{name}First"
        # Weights become what a sample in [0, 1] is multiplied by; what they owe to the planes'
        # middle at code 128 goes to the colour that they are added to.
        base = (
            "base.x -= dot(weights, vec4(128.0 / 255.0));"
            if name == "detail"
            else """vec4 second = step(vec4(runs.w - 0.5), vec4(4 * k) + vec4(0.0, 1.0, 2.0, 3.0));
    base.z -= dot(weights * second, vec4(128.0 / 255.0));
    base.y -= dot(weights * (1.0 - second), vec4(128.0 / 255.0));"""
        )
        parts.append(f"""
  int {first} = int(runs.{"x" if name == "detail" else "y"});
  for (int k = 0; k < {name}Tiles; k++) {{
    lowerTexel++; upperTexel++;
    int tile = {first} + k;
    vec4 weights = 255.0 * mix(
      texelFetch(views, ivec2(lowerTexel % {views}, lowerTexel / {views}), 0),
      texelFetch(views, ivec2(upperTexel % {views}, upperTexel / {views}), 0), part) - 128.0;
    weights *= {255.0 / 127.0**2!r}
      * texelFetch({name}Scales, ivec2(tile % {columns}, tile / {columns}), 0);
    {base}
    {name}Out[k] = weights;
  }}
  tilesOut.{"xy" if name == "detail" else "zw"} = vec2({first} % {columns}, {first} / {columns});
""")
    parts.append(f"""
  baseOut = vec4(base, float(mask / {masks}));
  runsOut = vec4(detailTiles, tintTiles, runs.w, mask % {masks} * {SIDE});
  float s = corner == 1 || corner == 2 ? 1.0 : -1.0, t = corner > 1 ? 1.0 : -1.0;
  placeOut = vec2(0.5 + 0.5 * s, 0.5 - 0.5 * t);
  if (halfS.w > 0.5) {{
    vec3 normal = normalize(towards);
    vec3 row = vec3(-normal.y, normal.x, 0.0);
    row /= max(length(row), 1e-12);
    halfS.xyz = halfS.x * row;
    halfT.xyz = halfT.z * cross(normal, row);
  }}
  gl_Position = MCDCMatrix * vec4(centre.xyz + s * halfS.xyz + t * halfT.xyz, 1.0);
""")
    return "".join(parts)


_LINEAR = """
vec3 linear(vec3 codes) {
  return mix(pow((codes + 0.055) / 1.055, vec3(2.4)), codes / 12.92,
    vec3(lessThanEqual(codes, vec3(0.04045))));
}
"""
_FRAGMENT_FUNCTIONS = (
    _LINEAR
    + """
uint rowOfMask(int column, int row) {
  uvec4 bytes = uvec4(texelFetch(masks, ivec2(column, row), 0) * 255.0 + 0.5);
  return (bytes.r << 24) | (bytes.g << 16) | (bytes.b << 8) | bytes.a;
}
"""
)


def _fragment(page: Page) -> str:
    parts = [
        f"""
  vec2 texel = clamp(placeOut * {SIDE}.0 - 0.5, 0.0, {SIDE - 1}.0);
  ivec2 corner = ivec2(texel);
  vec2 between = texel - vec2(corner);
  int maskColumn = int(runsOut.w) + corner.y, maskRow = int(baseOut.w);
  // Two bits of a row are shifted to its end; that beside the last one has no weight.
  uint top = (rowOfMask(maskColumn, maskRow) << uint(corner.x)) >> 30;
  uint bottom = (rowOfMask(maskColumn + (corner.y < {SIDE - 1} ? 1 : 0), maskRow)
    << uint(corner.x)) >> 30;
  vec2 alphas = mix(vec2(top >> 1, bottom >> 1), vec2(top & 1u, bottom & 1u), between.x);
  if (mix(alphas.x, alphas.y, between.y) < 0.5) discard;
  vec3 codes = baseOut.rgb;
"""
    ]
    for name, atlas in (("detail", page.detail), ("tint", page.tint)):
        if not atlas.most_tiles:
            continue
        rows, columns, _ = atlas.scales.shape
        side = atlas.side
        added = (
            "codes.x += dot(planes, vec4(1.0));"
            if name == "detail"
            else """vec4 second = step(vec4(runsOut.z - 0.5), vec4(4 * k) + vec4(0, 1, 2, 3));
    codes.z += dot(planes, second);
    codes.y += dot(planes, 1.0 - second);"""
        )
        sample = f"textureLod({name}, ({name}Tile + {{}}) * {_vec2(1 / columns, 1 / rows)}, 0.0)"
        if side == SIDE:
            parts.append(f"\n  vec2 {name}Place = {_inside(side, 'placeOut')};")
            sample = sample.format(f"{name}Place")
        else:
            # The decoder takes these planes at the texture's texels; what lies between them is
            # interpolated.
            for end, place in (("Low", "vec2(corner)"), ("High", "vec2(corner + 1)")):
                place = f"(min({place}, {SIDE - 1}.0) + 0.5) / {SIDE}.0"
                parts.append(f"\n  vec2 {name}{end} = {_inside(side, place)};")
            low, high = f"{name}Low", f"{name}High"
            ends = [low, f"vec2({high}.x, {low}.y)", f"vec2({low}.x, {high}.y)", high]
            one, two, three, four = (sample.format(end) for end in ends)
            sample = (
                f"mix(mix({one}, {two}, between.x), mix({three}, {four}, between.x), between.y)"
            )
        parts.append(f"""
  vec2 {name}Tile = tilesOut.{"xy" if name == "detail" else "zw"};
  for (int k = 0; k < int(runsOut.{"x" if name == "detail" else "y"}); k++) {{
    vec4 planes = {sample} * {name}Out[k];
    {added}
    {name}Tile.x += 1.0;
    if ({name}Tile.x >= {columns}.0) {name}Tile += vec2(-{columns}.0, 1.0);
  }}
""")
    if page.flags[0, 1]:
        parts.append("""
  codes = codes.x + vec3(codes.y - codes.z, codes.z, -codes.y - codes.z);
""")
    parts.append("""
  ambientColor = linear(clamp(codes / 255.0, 0.0, 1.0));
  diffuseColor = vec3(0.0);
""")
    return "".join(parts)


def _inside(side: int, place: str) -> str:
    """A place in a tile of ``side`` texels, away from what lies beside it."""
    return f"clamp({place}, {_MARGIN / side!r}, {1 - _MARGIN / side!r})"


def _vec2(x: float, y: float) -> str:
    return f"vec2({x!r}, {y!r})"


# ---- decoded on the processor ------------------------------------------------------------------


class CpuStreet:
    """The same billboards; each visible one is decoded by ``look`` and sent as a tile of RGBA8.

    ``actors`` are for ``Stage.add``, one for each texture of ``most_texels`` (or less, where the
    driver has less) that the tiles of all billboards would fill.
    """

    def __init__(
        self,
        billboards: Billboards,
        textures: CompressedTextures,
        *,
        most_texels: int = MOST_TEXELS,
    ) -> None:
        self._billboards, self._textures = billboards, decodable(textures)
        self._drawable = np.diff(textures.first) > 0
        across = min(most_texels, most_texels_of_driver()) // SIDE
        count = len(billboards.centre)
        self._columns = min(max(int(np.ceil(np.sqrt(count))), 1), across)
        self._page = self._columns * across
        self._sheets = [_Tiles(self._columns) for _ in range(max(-(-count // self._page), 1))]
        self.actors = [sheet.actor for sheet in self._sheets]

    def look(
        self,
        intrinsics: NDArray[np.floating],
        to_world: NDArray[np.floating],
        width: int,
        height: int,
    ) -> int:
        """Decode and send what a camera sees, as ``Street.look``."""
        seen = _seen(self._billboards, self._drawable, intrinsics, to_world, width, height)
        eye = np.asarray(to_world, np.float64)[:3, 3]
        for number, sheet in enumerate(self._sheets):
            chosen = seen[number * self._page : (number + 1) * self._page]
            sheet.show(self._billboards, self._textures, chosen, eye)
        return len(seen)


class _Tiles:
    """One texture of decoded tiles and its quads."""

    def __init__(self, columns: int) -> None:
        self._columns = columns
        self._texels = np.zeros((0, 0, 4), np.uint8)
        self._image = texture(np.zeros((SIDE, columns * SIDE, 4), np.uint8), interpolate=True)
        self.actor = surface(
            np.zeros((4, 3)),
            _QUAD.reshape(-1, 3),
            textures={"tiles": self._image},
            shader=_tile_shader(columns),
            lit=False,
        )
        _send_quads(self.actor, np.empty(0, np.int64))

    def show(
        self,
        billboards: Billboards,
        textures: Decodable,
        chosen: NDArray[np.int64],
        eye: NDArray[np.float64],
    ) -> None:
        """Decode the chosen billboards (k,) as seen from the eye (3,) and draw them."""
        from vtkmodules.util.numpy_support import numpy_to_vtk

        rows = max(-(-len(chosen) // self._columns), 1)
        shape = (rows * SIDE, self._columns * SIDE, 4)
        if self._texels.shape != shape:
            self._texels = np.zeros(shape, np.uint8)
        position = fan_position(eye - billboards.centre[chosen], billboards.fan[chosen])
        for row in range(rows):
            part = slice(row * self._columns, (row + 1) * self._columns)
            tiles = self._texels[row * SIDE : (row + 1) * SIDE]
            tiles = tiles.reshape(SIDE, self._columns, SIDE, 4).transpose(1, 0, 2, 3)
            count = len(chosen[part])
            decoded_views(textures, chosen[part], position[part], tiles[:count])
        data = self._image.GetInput()
        data.SetDimensions(shape[1], shape[0], 1)
        data.GetPointData().SetScalars(numpy_to_vtk(self._texels.reshape(-1, 4), deep=False))
        data.Modified()
        mesh = self.actor.GetMapper().GetInput()
        mesh.points = _corners(billboards, chosen, eye)
        _send_quads(self.actor, np.arange(len(chosen)))


def _corners(
    billboards: Billboards, chosen: NDArray[np.int64], eye: NDArray[np.float64]
) -> NDArray[np.float32]:
    """(4 k, 3), in metres."""
    centre, turns = billboards.centre[chosen], billboards.turns[chosen, None]
    row, column = turned_axes(centre, eye)
    half_s, half_t = billboards.half_s[chosen], billboards.half_t[chosen]
    half_s = np.where(turns, row * half_s[:, :1], half_s)
    half_t = np.where(turns, column * half_t[:, 2:], half_t)
    s, t = _CORNERS[:, :1], _CORNERS[:, 1:]
    places = centre[:, None] + s * half_s[:, None] + t * half_t[:, None]
    return places.reshape(-1, 3).astype(np.float32)


def _tile_shader(columns: int) -> Shader:
    # The texture's height is another in each frame.
    return Shader(
        vertex={
            "TCoord::Dec": "out vec2 placeOut; flat out vec2 tileOut;",
            "TCoord::Impl": f"""
  int billboard = gl_VertexID / 4, corner = gl_VertexID - 4 * billboard;
  placeOut = vec2(corner == 1 || corner == 2 ? 1.0 : 0.0, corner > 1 ? 0.0 : 1.0);
  tileOut = vec2(billboard % {columns}, billboard / {columns});
""",
        },
        fragment={
            "TCoord::Dec": "//VTK::TCoord::Dec\nin vec2 placeOut; flat in vec2 tileOut;" + _LINEAR,
            "Color::Impl": f"""//VTK::Color::Impl
  vec2 place = clamp(placeOut, {_MARGIN / SIDE!r}, {1 - _MARGIN / SIDE!r}) + tileOut;
  vec4 texel = textureLod(tiles, place * {SIDE}.0 / vec2(textureSize(tiles, 0)), 0.0);
  if (texel.a < 0.5) discard;
  ambientColor = linear(texel.rgb);
  diffuseColor = vec3(0.0);
""",
        },
    )
