// A street of billboards: a vertex turns its billboard to the eye, picks the two stored views
// beside the viewer and blends all that the fragments need of them.

#include "billboard.glsl"
#include "eigen_planes.glsl"
#include "view_fan.glsl"

uniform mat4 MCVCMatrix;
uniform sampler2D headers;
uniform sampler2D views;
out vec2 placeOut;
#if SHOW_BILLBOARDS
flat out vec3 centreOut;
#endif
flat out vec4 baseOut;   // colour without planes, in codes; row of the mask
flat out vec4 tilesOut;  // column and row of the first tile of detail, and of tint
flat out vec4 runsOut;   // tiles of detail, of tint; where channel 2 begins; column of the mask
#if DETAIL_TILES
uniform sampler2D detailScales;
flat out vec4 detailOut[DETAIL_TILES];
#endif
#if TINT_TILES
uniform sampler2D tintScales;
flat out vec4 tintOut[TINT_TILES];
#endif

void placeVertex() {
  int number = gl_VertexID / 4, corner = gl_VertexID - 4 * number;
  Billboard billboard = billboardOf(headers, number, HEADER_COLUMNS);
  vec3 towards = -transpose(mat3(MCVCMatrix)) * MCVCMatrix[3].xyz - billboard.centre;
  TwoViews beside = viewsBeside(billboard.directions, fanPosition(towards, billboard.fan));
  float part = beside.part;
  int taken = 1 + billboard.detailTiles + billboard.tintTiles;  // texels of a view
  int lower = billboard.view + beside.lower * taken;
  int upper = billboard.view + beside.upper * taken;
  int mask = billboard.mask;
  if (billboard.maskPerView) mask += part < 0.5 ? beside.lower : beside.upper;
  vec3 base = 255.0 * blendedTexel(
    views, texelOf(lower, VIEW_COLUMNS), texelOf(upper, VIEW_COLUMNS), part).rgb - vec3(NEUTRAL);
  tilesOut = vec4(0.0);
#if DETAIL_TILES
  for (int k = 0; k < billboard.detailTiles; k++) {
    lower++; upper++;
    vec4 stored = blendedTexel(
      views, texelOf(lower, VIEW_COLUMNS), texelOf(upper, VIEW_COLUMNS), part);
    ivec2 tile = texelOf(billboard.detail + k, DETAIL_COLUMNS);
    vec4 weights = planeWeights(stored, texelFetch(detailScales, tile, 0));
    base.x -= offsetOfPlanes(weights);
    detailOut[k] = weights;
  }
  tilesOut.xy = vec2(texelOf(billboard.detail, DETAIL_COLUMNS));
#endif
#if TINT_TILES
  for (int k = 0; k < billboard.tintTiles; k++) {
    lower++; upper++;
    vec4 stored = blendedTexel(
      views, texelOf(lower, VIEW_COLUMNS), texelOf(upper, VIEW_COLUMNS), part);
    ivec2 tile = texelOf(billboard.tint + k, TINT_COLUMNS);
    vec4 weights = planeWeights(stored, texelFetch(tintScales, tile, 0));
    vec4 second = ofChannel2(k, billboard.secondSlot);
    base.z -= offsetOfPlanes(weights * second);
    base.y -= offsetOfPlanes(weights * (1.0 - second));
    tintOut[k] = weights;
  }
  tilesOut.zw = vec2(texelOf(billboard.tint, TINT_COLUMNS));
#endif
  baseOut = vec4(base, float(mask / MASK_COLUMNS));
  runsOut = vec4(billboard.detailTiles, billboard.tintTiles, billboard.secondSlot,
                 mask % MASK_COLUMNS * SIDE);
  float s = corner == 1 || corner == 2 ? 1.0 : -1.0, t = corner > 1 ? 1.0 : -1.0;
  placeOut = vec2(0.5 + 0.5 * s, 0.5 - 0.5 * t);
#if SHOW_BILLBOARDS
  centreOut = billboard.centre;
#endif
  gl_Position = MCDCMatrix * vec4(billboardPoint(billboard, towards, s, t), 1.0);
}
