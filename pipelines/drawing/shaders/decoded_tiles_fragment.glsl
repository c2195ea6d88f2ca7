// Billboards whose textures were decoded before they were sent. The texture's height is another in
// each frame.

#include "billboard.glsl"
#include "eigen_planes.glsl"
#include "srgb.glsl"

uniform sampler2D tiles;
in vec2 placeOut;
flat in vec2 tileOut;

vec3 surfaceColour() {
  vec2 place = insideTile(placeOut, float(SIDE)) + tileOut;
  vec4 texel = textureLod(tiles, place * float(SIDE) / vec2(textureSize(tiles, 0)), 0.0);
  if (texel.a < 0.5) discard;
  return linearFromSrgb(texel.rgb);
}
