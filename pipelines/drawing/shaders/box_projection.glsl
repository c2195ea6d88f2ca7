// Textures laid on a surface from the three axes, with no seams between them.

// How much of each axis's texture a surface with this unit normal shows; the shares sum to 1.
vec3 axisShares(vec3 normal) {
  vec3 share = pow(abs(normal), vec3(4.0));
  return share / (share.x + share.y + share.z);
}

// Texture coordinates of a place seen along an axis, from ahead of it or from behind: tile is the
// length that a texture covers. Each axis and side begins elsewhere.
vec2 boxPlace(vec3 place, int axis, bool ahead, float tile) {
  float side = ahead ? 1.0 : 0.0;
  return vec2(place[(axis + 1) % 3] / tile + 0.37 * float(axis) + 0.11 * side,
              place[(axis + 2) % 3] / tile + 0.61 * float(axis) + 0.23 * side);
}
