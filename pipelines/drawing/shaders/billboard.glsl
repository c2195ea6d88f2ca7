// Billboards: where they stand, which of their views are stored, and where in the atlases their
// textures lie (pipelines/street_billboards/textures/atlases.py says how).

// Side of a billboard's texture, in texels.
const int SIDE = 32;

struct Billboard {
  vec3 centre;
  vec3 halfS;       // half edges; of one that turns only their lengths, in x and z, count
  vec3 halfT;
  bool turns;       // to the viewer
  float fan;        // number of the first direction of its fan
  uint directions;  // a bit for each direction of the fan with a stored view
  int view;         // first texel of its views
  int mask;         // first mask
  int detail;       // first tile of detail, and how many it reaches into
  int detailTiles;
  int tint;
  int tintTiles;
  float secondSlot; // first slot of channel 2 in the tiles of tint
  bool maskPerView;
};

// Texel number n of a texture that is filled row by row.
ivec2 texelOf(int number, int width) {
  return ivec2(number % width, number / width);
}

// One of the billboards in headers: five texels each, so many side by side.
Billboard billboardOf(sampler2D headers, int number, int columns) {
  ivec2 at = ivec2(number % columns * 5, number / columns);
  vec4 centre = texelFetch(headers, at, 0);
  vec4 halfS = texelFetch(headers, at + ivec2(1, 0), 0);
  vec4 halfT = texelFetch(headers, at + ivec2(2, 0), 0);
  vec4 stored = texelFetch(headers, at + ivec2(3, 0), 0);
  vec4 runs = texelFetch(headers, at + ivec2(4, 0), 0);
  int counts = int(runs.z);
  return Billboard(
    centre.xyz, halfS.xyz, halfT.xyz, halfS.w > 0.5, centre.w,
    uint(stored.z) | (uint(stored.w) << 16), int(stored.x), int(stored.y),
    int(runs.x), counts & 63, int(runs.y), (counts >> 6) & 63, runs.w, (counts & 4096) != 0);
}

// A point of a billboard's rectangle: s and t are -1 to 1. towards: from its centre to the viewer.
vec3 billboardPoint(Billboard billboard, vec3 towards, float s, float t) {
  vec3 halfS = billboard.halfS, halfT = billboard.halfT;
  if (billboard.turns) {
    vec3 normal = normalize(towards);
    vec3 row = vec3(-normal.y, normal.x, 0.0);
    row /= max(length(row), 1e-12);
    halfS = halfS.x * row;
    halfT = halfT.z * cross(normal, row);
  }
  return billboard.centre + s * halfS + t * halfT;
}
