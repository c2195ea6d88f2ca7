// Scratches by their table (section 3.3): rho over the angles of light and view across a scratch.

#include "pi.glsl"

// Where a direction's angle across a scratch lies in the table, from one horizon, 0, to the other,
// 1. across and normal are unit vectors, at right angles to the scratch.
float placeAcross(vec3 direction, vec3 across, vec3 normal) {
  return atan(dot(direction, across), max(dot(direction, normal), 0.0)) / PI + 0.5;
}

// The share of light that a scratch reflects (Eq. 3 and 4), F: for a view at a place across, and by
// its cosine to the scratch. leaning: for each place F at a right angle to the scratch, and gamma.
float reflectedShare(sampler2D leaning, float place, float cosine) {
  vec2 leant = texture(leaning, vec2(place, 0.5)).rg;
  float theta = asin(clamp(abs(cosine), 0.0, 1.0));
  float lean = pow(2.0 * theta / PI, leant.g);
  return lean + (1.0 - lean) * leant.r;
}

// The sum of the lights' power times rho (Eq. 5) for a view at a place across the scratch.
// table: rho, a row for each place of a view; lights: powers in row 0, directions in row 1.
vec3 scatteredLight(sampler2D table, sampler2D lights, int count, float place, vec3 across,
                    vec3 normal) {
  vec3 lit = vec3(0.0);
  for (int n = 0; n < count; n++) {
    vec3 towards = texelFetch(lights, ivec2(n, 1), 0).xyz;
    float falling = dot(towards, normal);
    if (falling <= 0.0) continue;
    vec3 power = texelFetch(lights, ivec2(n, 0), 0).rgb;
    float rho = texture(table, vec2(placeAcross(towards, across, normal), place)).r;
    lit += power * rho * falling;
  }
  return lit;
}
