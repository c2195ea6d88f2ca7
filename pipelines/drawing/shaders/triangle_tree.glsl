// What a ray meets first of a tree of triangles, which is two textures of floats. A node is two
// texels of tree: the least corner of its box and the number of the node to go on with where that is
// missed or done; the greatest, and 0 or, of a leaf, 8 times the number of its first triangle and
// their count. A triangle is six texels of corners, three places and three normals. Rows are
// TREE_WIDTH texels.

vec4 treeTexel(sampler2D texels, int number) {
  return texelFetch(texels, ivec2(number % TREE_WIDTH, number / TREE_WIDTH), 0);
}

// The distance to a triangle along a ray, in lengths of its direction, and the place in it; below 0
// where it is not met.
float triangleDistance(sampler2D corners, int triangle, vec3 origin, vec3 direction, out vec2 place) {
  vec3 a = treeTexel(corners, 6 * triangle).xyz;
  vec3 ab = treeTexel(corners, 6 * triangle + 1).xyz - a;
  vec3 ac = treeTexel(corners, 6 * triangle + 2).xyz - a;
  vec3 turned = cross(direction, ac);
  float area = dot(ab, turned);
  place = vec2(0.0);
  if (area == 0.0) return -1.0;
  vec3 from = (origin - a) / area;
  vec3 other = cross(from, ab);
  place = vec2(dot(from, turned), dot(direction, other));
  if (place.x < 0.0 || place.y < 0.0 || place.x + place.y > 1.0) return -1.0;
  return dot(ac, other);
}

// The number of the triangle that a ray meets first, farther away than least, or -1; with the
// distance and the place in it: the weights of its second and third corner.
int firstTriangle(sampler2D tree, sampler2D corners, vec3 origin, vec3 direction, float least,
                  out float distance, out vec2 place) {
  int found = -1, node = 0;
  distance = 1e30;
  place = vec2(0.0);
  vec3 inverse = 1.0 / mix(direction, vec3(1e-20), equal(direction, vec3(0.0)));
  int nodes = int(treeTexel(tree, 0).w);
  while (node < nodes) {
    vec4 low = treeTexel(tree, 2 * node), high = treeTexel(tree, 2 * node + 1);
    vec3 one = (low.xyz - origin) * inverse, other = (high.xyz - origin) * inverse;
    vec3 near = min(one, other), far = max(one, other);
    float enters = max(max(near.x, near.y), max(near.z, least));
    float leaves = min(min(far.x, far.y), min(far.z, distance));
    node = enters > leaves || high.w > 0.0 ? int(low.w) : node + 1;
    int count = enters > leaves ? 0 : int(high.w) % 8;
    for (int n = 0; n < count; n++) {
      int triangle = int(high.w) / 8 + n;
      vec2 here;
      float met = triangleDistance(corners, triangle, origin, direction, here);
      if (met > least && met < distance) {
        distance = met;
        place = here;
        found = triangle;
      }
    }
  }
  return found;
}
