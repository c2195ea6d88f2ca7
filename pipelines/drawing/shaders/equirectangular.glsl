#include "pi.glsl"

// Where a unit vector lies in an equirectangular picture of all around: z is up, azimuth 0 in the
// middle, azimuth 90 degrees a quarter of the width from the left edge.
vec2 equirectangularPlace(vec3 direction) {
  return vec2(0.5 - atan(direction.y, direction.x) / (2.0 * PI), 0.5 + asin(direction.z) / PI);
}
