// Masks of billboards: 32 x 32 bits, a texel for each row.

// A row of a mask, its leftmost bit the highest.
uint rowOfMask(sampler2D masks, ivec2 at) {
  uvec4 bytes = uvec4(texelFetch(masks, at, 0) * 255.0 + 0.5);
  return (bytes.r << 24) | (bytes.g << 16) | (bytes.b << 8) | bytes.a;
}

// A mask between the middles of four texels: their bits, interpolated. first: where the mask's top
// row lies; corner: the upper left one of the four, between: how far from its middle, 0 to 1.
float maskBetween(sampler2D masks, ivec2 first, ivec2 corner, vec2 between) {
  ivec2 at = first + ivec2(corner.y, 0);
  // Two bits of a row are shifted to its end; that beside the last one has no weight.
  uint top = (rowOfMask(masks, at) << uint(corner.x)) >> 30;
  uint bottom = (rowOfMask(masks, at + ivec2(corner.y < 31 ? 1 : 0, 0)) << uint(corner.x)) >> 30;
  vec2 alphas = mix(vec2(top >> 1, bottom >> 1), vec2(top & 1u, bottom & 1u), between.x);
  return mix(alphas.x, alphas.y, between.y);
}
