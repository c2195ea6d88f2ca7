#include "pi.glsl"

// A round lamp far away, as it is seen along a direction: full of its radiance up to one cosine to
// its middle, edge.y, and nothing beyond another, edge.x. Directions are unit vectors.
vec3 roundLamp(vec3 direction, vec3 towards, vec2 edge, vec3 radiance) {
  return clamp((dot(direction, towards) - edge.x) / (edge.y - edge.x), 0.0, 1.0) * radiance;
}

// Steradians of a lamp of even radiance that gives the same light.
float roundLampSteradians(vec2 edge) {
  return PI * (2.0 - edge.x - edge.y);
}
