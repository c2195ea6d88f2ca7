// A matt surface under spherical Gaussians.

#include "sg_visibility.glsl"

// The radiance of an albedo of 1 under a Gaussian of amplitude 1 at an angular distance d from the
// edge of what is visible. lobe: irradiance / pi with nothing hidden, sqrt(1 + sharpness) of the
// light times the cosine, and 1 / its share above the horizon.
float mattRadiance(vec3 lobe, float d) {
  return lobe.x * min(visibleShare(d, lobe.y) * lobe.z, 1.0);
}
