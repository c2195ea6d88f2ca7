// Billboards' textures as sums of planes (Eq. 1): four planes in a tile of an atlas, one a channel.

// One texel of a billboard's views, blended between two of them.
vec4 blendedTexel(sampler2D views, ivec2 lower, ivec2 upper, float part) {
  return mix(texelFetch(views, lower, 0), texelFetch(views, upper, 0), part);
}

// Factors on samples of four planes, in codes, of their weights as stored and the planes' scales.
vec4 planeWeights(vec4 stored, vec4 scales) {
  return (255.0 * stored - 128.0) * (0.01581003162006324 * scales);
}

// What planes with these weights add to a colour by being stored as 128 + code.
float offsetOfPlanes(vec4 weights) {
  return dot(weights, vec4(128.0 / 255.0));
}

// Of the planes in tile number n of a billboard's tint: 1 for those of channel 2, 0 for those of
// channel 1, which come first. secondSlot: the slot where channel 2 begins.
vec4 ofChannel2(int n, float secondSlot) {
  return step(vec4(secondSlot - 0.5), vec4(4 * n) + vec4(0.0, 1.0, 2.0, 3.0));
}

// A place in a tile of so many texels a side, 0 to 1, held where nothing beside the tile is
// interpolated into it; 1/512 texel more, for coordinates are rounded.
vec2 insideTile(vec2 place, float side) {
  float margin = (0.5 + 1.0 / 512.0) / side;
  return clamp(place, margin, 1.0 - margin);
}

// The next tile of an atlas with so many columns.
vec2 nextTile(vec2 tile, float columns) {
  tile.x += 1.0;
  return tile.x >= columns ? tile + vec2(-columns, 1.0) : tile;
}

// Samples in [0, 1] of a tile's four planes. size: of a tile in the atlas's coordinates.
vec4 planesAt(sampler2D atlas, vec2 tile, vec2 size, vec2 place) {
  return textureLod(atlas, (tile + place) * size, 0.0);
}

// Planes of a lower resolution than the texture's: they are sampled at the middles of the texture's
// texels around, low and high, and interpolated between these.
vec4 planesBetween(sampler2D atlas, vec2 tile, vec2 size, vec2 low, vec2 high, vec2 between) {
  return mix(
    mix(planesAt(atlas, tile, size, low), planesAt(atlas, tile, size, vec2(high.x, low.y)),
        between.x),
    mix(planesAt(atlas, tile, size, vec2(low.x, high.y)), planesAt(atlas, tile, size, high),
        between.x),
    between.y);
}
