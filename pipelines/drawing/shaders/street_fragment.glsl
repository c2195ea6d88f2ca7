// A street of billboards: a fragment looks at the mask's bits, multiplies samples of the planes by
// the vertex's weights, and converts the colour.

#include "billboard.glsl"
#include "billboard_mask.glsl"
#if SHOW_BILLBOARDS
#include "billboard_colour.glsl"
#endif
#include "eigen_planes.glsl"
#include "srgb.glsl"
#include "ycocg.glsl"

uniform sampler2D masks;
in vec2 placeOut;
#if SHOW_BILLBOARDS
flat in vec3 centreOut;
#endif
flat in vec4 baseOut;
flat in vec4 tilesOut;
flat in vec4 runsOut;
#if DETAIL_TILES
uniform sampler2D detail;
flat in vec4 detailOut[DETAIL_TILES];
#endif
#if TINT_TILES
uniform sampler2D tint;
flat in vec4 tintOut[TINT_TILES];
#endif

// The middle of a texel of the billboard's texture, which is no further than its last one.
vec2 middleOf(ivec2 texel) {
  return (min(vec2(texel), float(SIDE - 1)) + 0.5) / float(SIDE);
}

vec3 surfaceColour() {
  vec2 texel = clamp(placeOut * float(SIDE) - 0.5, 0.0, float(SIDE - 1));
  ivec2 corner = ivec2(texel);
  vec2 between = texel - vec2(corner);
  ivec2 mask = ivec2(runsOut.w, baseOut.w);
  float alpha = maskBetween(masks, mask, corner, between);
#if SHOW_BILLBOARDS
  if (atRim(placeOut)) return rimOf(centreOut);
#endif
  if (alpha < 0.5) discard;
  vec3 codes = baseOut.rgb;
#if DETAIL_TILES
  vec2 detailTile = tilesOut.xy;
  for (int k = 0; k < int(runsOut.x); k++) {
#if DETAIL_SIDE == 32
    vec4 planes = planesAt(
      detail, detailTile, vec2(DETAIL_SIZE), insideTile(placeOut, float(DETAIL_SIDE)));
#else
    vec4 planes = planesBetween(
      detail, detailTile, vec2(DETAIL_SIZE), insideTile(middleOf(corner), float(DETAIL_SIDE)),
      insideTile(middleOf(corner + 1), float(DETAIL_SIDE)), between);
#endif
    codes.x += dot(planes * detailOut[k], vec4(1.0));
    detailTile = nextTile(detailTile, float(DETAIL_COLUMNS));
  }
#endif
#if TINT_TILES
  vec2 tintTile = tilesOut.zw;
  for (int k = 0; k < int(runsOut.y); k++) {
#if TINT_SIDE == 32
    vec4 planes = planesAt(
      tint, tintTile, vec2(TINT_SIZE), insideTile(placeOut, float(TINT_SIDE)));
#else
    vec4 planes = planesBetween(
      tint, tintTile, vec2(TINT_SIZE), insideTile(middleOf(corner), float(TINT_SIDE)),
      insideTile(middleOf(corner + 1), float(TINT_SIDE)), between);
#endif
    planes *= tintOut[k];
    vec4 second = ofChannel2(k, runsOut.z);
    codes.z += dot(planes, second);
    codes.y += dot(planes, 1.0 - second);
    tintTile = nextTile(tintTile, float(TINT_COLUMNS));
  }
#endif
#if YCOCG
  codes = rgbFromYcocg(codes);
#endif
  vec3 light = linearFromSrgb(clamp(codes / 255.0, 0.0, 1.0));
#if SHOW_BILLBOARDS
  light = tinted(light, centreOut);
#endif
  return light;
}
