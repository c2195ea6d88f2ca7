// The sphere of directions as a square, x and y in [-1, 1]: the octahedral map. The upper half
// fills the diamond in the middle, the lower half is folded out into the corners.

vec2 foldedOut(vec2 place) {
  vec2 side = vec2(place.x < 0.0 ? -1.0 : 1.0, place.y < 0.0 ? -1.0 : 1.0);
  return (1.0 - abs(place.yx)) * side;
}

// The place of a direction, not 0, of any length.
vec2 octahedralPlace(vec3 direction) {
  vec3 onFaces = direction / (abs(direction.x) + abs(direction.y) + abs(direction.z));
  return onFaces.z < 0.0 ? foldedOut(onFaces.xy) : onFaces.xy;
}

// The unit vector of a place.
vec3 octahedralDirection(vec2 place) {
  float z = 1.0 - abs(place.x) - abs(place.y);
  return normalize(vec3(z < 0.0 ? foldedOut(place) : place, z));
}
