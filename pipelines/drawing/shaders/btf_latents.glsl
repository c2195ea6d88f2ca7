// Latents of a neural BTF as a texture that repeats, as `latent_texture.py` has it: moved by
// parallax, between four texels, between two levels. Texels of a level lie after one another, row by
// row from the top, LATENT_VECTORS texels of the sampler each; levels follow one another, the finest
// first. TEXELS: columns and rows of the finest; LEVELS: how many; PARALLAX: 9 x 2 factors.

uniform sampler2D latentVectors;

void addTexel(int number, float weight, inout vec4 latents[LATENT_VECTORS]) {
  int columns = textureSize(latentVectors, 0).x, first = LATENT_VECTORS * number;
  ivec2 at = ivec2(first % columns, first / columns);
#pragma unroll_loop_start
  for (int i = 0; i < LATENT_VECTORS; i++) {
    latents[i] += weight * texelFetch(latentVectors, at + ivec2(i, 0), 0);
  }
#pragma unroll_loop_end
}

void addLevel(int level, vec2 place, float weight, inout vec4 latents[LATENT_VECTORS]) {
  ivec2 size = ivec2(TEXELS);
  int first = 0;
  for (int finer = 0; finer < level; finer++) {
    first += size.x * size.y;
    size = (size + 1) / 2;
  }
  vec2 at = place * vec2(size) - 0.5, corner = floor(at), part = at - corner;
  ivec2 low = (ivec2(corner) + size) % size, high = (ivec2(corner) + 1) % size;
  vec2 left = weight * (1.0 - part.x) * vec2(1.0 - part.y, part.y);
  vec2 right = weight * part.x * vec2(1.0 - part.y, part.y);
  addTexel(first + low.y * size.x + low.x, left.x, latents);
  addTexel(first + low.y * size.x + high.x, right.x, latents);
  addTexel(first + high.y * size.x + low.x, left.y, latents);
  addTexel(first + high.y * size.x + high.x, right.y, latents);
}

// Columns and rows of the finest level at which a view, on the stereographic plane, sees what lies
// elsewhere.
vec2 parallaxOf(vec2 view) {
  float x = view.x, y = view.y;
  float terms[9] = float[9](x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y);
  float factors[18] = float[18](PARALLAX);
  vec2 sum = vec2(0.0);
  for (int i = 0; i < 9; i++) sum += terms[i] * vec2(factors[2 * i], factors[2 * i + 1]);
  return sum;
}

// Latents at a place of the material, where a tile is 1 and v counts from the bottom. footprint:
// width of what is seen, in tiles; view: on the stereographic plane.
void latentsAt(vec2 place, float footprint, vec2 view, out vec4 latents[LATENT_VECTORS]) {
  vec2 size = vec2(TEXELS);
  vec2 inside = fract(vec2(place.x, 1.0 - place.y) + parallaxOf(view) / size);
  float seen = footprint * max(size.x, size.y);
  float level = clamp(log2(max(seen, 1e-6)), 0.0, float(LEVELS - 1));
  int lower = min(int(level), max(LEVELS - 2, 0));
  float share = level - float(lower);
  for (int i = 0; i < LATENT_VECTORS; i++) latents[i] = vec4(0.0);
  addLevel(lower, inside, 1.0 - share, latents);
  if (share > 0.0) addLevel(lower + 1, inside, share, latents);
}
