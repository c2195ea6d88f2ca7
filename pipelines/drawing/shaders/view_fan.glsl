// The fan of 32 directions, 6 degrees apart, from which a billboard may have a stored view.

#include "bits.glsl"

// Where a viewer stands in a fan, in [-14.5, 45.5): 0 is its first direction, 31 its last.
// towards: from the billboard to the viewer; first: the fan's first direction, 0 to 59.
float fanPosition(vec3 towards, float first) {
  return mod(degrees(atan(towards.y, towards.x)) * 0.16666666666666666 - first + 14.5, 60.0)
    - 14.5;
}

// Two of a billboard's stored views, numbered in their order, and how far from the lower to the
// upper one, 0 to 1.
struct TwoViews {
  int lower;
  int upper;
  float part;
};

// The views on both sides of a position in the fan; the outermost one where there is none beyond.
// stored: bit n is 1 where there is a view from direction n; at least one is.
TwoViews viewsBeside(uint stored, float position) {
  uint before = position < 0.0 ? 0u
    : stored & ((2u << uint(clamp(int(position), 0, 31))) - 1u);
  uint beyond = stored & ~before;
  int below = countOnes(before), count = countOnes(stored);
  int lower = max(below - 1, 0), upper = min(below, count - 1);
  float from = float(highestOne(before)), to = float(lowestOne(beyond));
  return TwoViews(lower, upper, lower == upper ? 0.0 : (position - from) / (to - from));
}
