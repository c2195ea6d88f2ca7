// Billboards made visible: each in a colour of its own, with its rim. Colours come from where a
// billboard stands, so that they are the same however billboards are numbered.

// A number from 0 to 1 that says nothing of the place; steps of 1/16 m tell places apart.
float scattered(vec3 place) {
  ivec3 steps = ivec3(floor(place * 16.0));
  uint word = uint(steps.x) * 73856093u ^ uint(steps.y) * 19349663u ^ uint(steps.z) * 83492791u;
  word = (word ^ (word >> 15)) * 2246822519u;
  word = (word ^ (word >> 13)) * 3266489917u;
  return float((word ^ (word >> 16)) & 0xFFFFFFu) / 16777216.0;
}

// Linear light, all hues about as bright.
vec3 colourOfBillboard(vec3 centre) {
  vec3 turn = 6.28318530718 * (scattered(centre) + vec3(0.0, 0.3333333, 0.6666667));
  return 0.25 + 0.17 * cos(turn);
}

// Whether a place in a billboard, 0 to 1, is at its rim.
bool atRim(vec2 place) {
  vec2 inside = min(place, 1.0 - place);
  return min(inside.x, inside.y) < 0.008;
}

vec3 rimOf(vec3 centre) {
  return 1.6 * colourOfBillboard(centre) + 0.12;
}

// The photographs' light, grey, under the billboard's colour.
vec3 tinted(vec3 light, vec3 centre) {
  float grey = dot(light, vec3(0.2126, 0.7152, 0.0722));
  return colourOfBillboard(centre) * (0.35 + 1.5 * grey);
}
