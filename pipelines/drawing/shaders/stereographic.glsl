// Directions above a surface on a plane: the normal, z, is its origin, the horizon the unit circle
// (paper 1, Eq. 7-9).

// The place of a unit vector with z >= 0.
vec2 stereographicPlace(vec3 direction) {
  return direction.xy / (1.0 + direction.z);
}

// The unit vector of a place.
vec3 stereographicDirection(vec2 place) {
  float squared = dot(place, place);
  return vec3(2.0 * place, 1.0 - squared) / (1.0 + squared);
}
