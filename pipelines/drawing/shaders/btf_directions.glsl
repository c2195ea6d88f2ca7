// Directions at a material whose measurement ended 75 degrees from its normal: lower ones are
// lifted, their azimuth kept, and light from there is dimmed with its cosine.

const float LEAST_COSINE = 0.25881904510252074;
const float MOST_SINE = 0.9659258262890683;

vec3 heldDirection(vec3 direction) {
  if (direction.z >= LEAST_COSINE) return direction;
  float level = length(direction.xy);
  vec2 along = level > 1e-6 ? direction.xy / level : vec2(1.0, 0.0);
  return vec3(MOST_SINE * along, LEAST_COSINE);
}

float dimming(float cosine) {
  return clamp(cosine / LEAST_COSINE, 0.0, 1.0);
}
