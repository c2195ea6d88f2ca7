// What is far away: an environment and a round lamp beside it.

#include "equirectangular.glsl"
#include "round_lamp.glsl"

// Radiance along a unit vector. toSky turns it into the environment's directions, brightness
// multiplies the environment; the lamp is not turned.
vec3 surroundings(sampler2D sky, mat3 toSky, float brightness, vec3 lamp, vec2 edge,
                  vec3 lampRadiance, vec3 direction) {
  vec3 seen = textureLod(sky, equirectangularPlace(toSky * direction), 0.0).rgb;
  return brightness * seen + roundLamp(direction, lamp, edge, lampRadiance);
}
