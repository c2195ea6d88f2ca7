// Scratches by their table: rho of LEANS leans over the angles of light and view across a scratch,
// BINS on each side of the surface (outside, then inside the glass), a row for each view. Directions
// have their components (u, v, n) along the scratch, across it and out of the glass.

#include "pi.glsl"

const float leans[LEANS] = float[LEANS](LEAN_VALUES);

// Where the angle of a direction across a scratch lies among the bins of both sides.
float placeAcross(vec3 direction) {
  float place = atan(direction.y, max(abs(direction.z), 1e-6)) / PI + 0.5;
  float bins = float(BINS);
  return clamp(place * bins, 0.5, bins - 0.5) + (direction.z > 0.0 ? 0.0 : bins);
}

// The lean of a direction: what it has along the scratch, times the index where it is.
float leanOf(vec3 direction) {
  return direction.x * (direction.z > 0.0 ? 1.0 : INDEX);
}

// The tables below and above a lean, and the share of the latter.
vec3 tablesOf(float lean) {
  lean = abs(lean);
  int last = LEANS - 1;
  if (bool(KEEPS)) {
    if (lean >= 1.0) return vec3(float(last), float(last), 0.0);
    last -= 1;
  }
  if (last == 0 || lean >= leans[last]) return vec3(float(last), float(last), 0.0);
  int low = 0;
  while (leans[low + 1] <= lean) low++;
  return vec3(float(low), float(low + 1), (lean - leans[low]) / (leans[low + 1] - leans[low]));
}

// Rho between two tables.
float tabulated(sampler2D table, vec3 tables, float view, float light) {
  float rows = 2.0 * float(BINS);
  vec2 place = vec2(light, view) / rows;
  float low = texture(table, vec2(place.x, (place.y + tables.x) / float(LEANS))).r;
  if (tables.z == 0.0) return low;
  float high = texture(table, vec2(place.x, (place.y + tables.y) / float(LEANS))).r;
  return mix(low, high, tables.z);
}
