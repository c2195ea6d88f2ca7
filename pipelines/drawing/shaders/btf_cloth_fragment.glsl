// Cloth of a neural BTF under one light far away. Its back is the same material, seen from behind.
// LEAST, LARGEST: what colours over alpha are held to. PLACES: shows the place in the material and
// the footprint instead.

#include "btf_directions.glsl"
#include "btf_decoder.glsl"
#include "btf_latents.glsl"

in vec3 uprightOut;
in vec3 tangentOut;
in vec2 materialPlace;
in vec3 placeOut;

// Root of the area of the material that a pixel sees, in tiles.
float footprintOf(vec2 place) {
  vec2 along = dFdx(place), across = dFdy(place);
  return sqrt(abs(along.x * across.y - along.y * across.x));
}

vec3 surfaceColour() {
  // Derivatives are of four pixels, all of which must come by.
  float footprint = footprintOf(materialPlace);
#if PLACES
  return vec3(materialPlace, footprint);
#else
  vec3 up = normalize(gl_FrontFacing ? uprightOut : -uprightOut);
  vec3 along = normalize(tangentOut - dot(tangentOut, up) * up);
  vec3 across = cross(up, along);
  mat3 outOfFrame = mat3(along, across, up);
  vec3 towardsLight = vec3(LIGHT) * outOfFrame;
  vec3 towardsEye = normalize(vec3(EYE) - placeOut) * outOfFrame;
  float bright = SCALE * dimming(towardsLight.z);
  if (bright <= 0.0) return vec3(0.0);
  vec3 light = heldDirection(towardsLight), view = heldDirection(towardsEye);
  vec4 latents[LATENT_VECTORS];
  latentsAt(materialPlace, footprint, stereographicPlace(view), latents);
  vec3 found = clamp(decodedColour(latents, light, view), LEAST, LARGEST);
  return bright * max(found, 0.0);
#endif
}
