// Cloth of a neural BTF under one light far away. Its back is the same material, seen from behind.

#include "btf_directions.glsl"
#include "btf_decoder.glsl"

uniform sampler2D latentVectors;
#if SHARED
uniform sampler2D owners;
#endif
in vec3 uprightOut;
in vec3 tangentOut;
in vec2 materialPlace;
in vec3 placeOut;

// Latents of the texel at a place of the material, where a tile is 1. Rows count from the top, v
// from the bottom. Vectors lie after one another, two texels each; where texels share them
// (SHARED), a texture has the number of each texel's.
void latentsAt(vec2 place, out vec4 latents[2]) {
  vec2 inside = fract(place);
  ivec2 size = ivec2(TEXELS);
  ivec2 texel = min(ivec2(vec2(inside.x, 1.0 - inside.y) * vec2(size)), size - 1);
#if SHARED
  int owner = int(texelFetch(owners, texel, 0).r + 0.5);
#else
  int owner = texel.y * size.x + texel.x;
#endif
  int columns = textureSize(latentVectors, 0).x, first = 2 * owner;
  ivec2 at = ivec2(first % columns, first / columns);
  latents[0] = texelFetch(latentVectors, at, 0);
  latents[1] = texelFetch(latentVectors, at + ivec2(1, 0), 0);
}

vec3 surfaceColour() {
  vec3 up = normalize(gl_FrontFacing ? uprightOut : -uprightOut);
  vec3 along = normalize(tangentOut - dot(tangentOut, up) * up);
  vec3 across = cross(up, along);
  mat3 outOfFrame = mat3(along, across, up);
  vec3 towardsLight = vec3(LIGHT) * outOfFrame;
  vec3 towardsEye = normalize(vec3(EYE) - placeOut) * outOfFrame;
  float bright = SCALE * dimming(towardsLight.z);
  if (bright <= 0.0) return vec3(0.0);
  vec4 latents[2];
  latentsAt(materialPlace, latents);
  vec3 found = decodedColour(latents, heldDirection(towardsLight), heldDirection(towardsEye));
  return bright * max(found, 0.0);
}
