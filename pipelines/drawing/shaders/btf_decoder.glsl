// The neural BTF's decoder (paper 1, figure 5): latents and two directions to RGB over alpha by
// three hidden layers. Latents are padded to LATENT_VECTORS vectors of four, 2 for the paper's 8;
// neurons to VECTORS, 27 for the paper's 106. A row of the texture is four neurons, a texel of it an
// input, the last one the bias; a layer's rows follow those of the layer before.

#include "stereographic.glsl"

uniform sampler2D weights;
// What a layer is given, and what it says. As arguments, arrays would be copied for each row.
vec4 given[VECTORS];
vec4 said[VECTORS];

// Four neurons' share of four inputs, the first of which is in this column.
vec4 fourInputs(int column, int row, vec4 values) {
  return mat4(texelFetch(weights, ivec2(column, row), 0),
              texelFetch(weights, ivec2(column + 1, row), 0),
              texelFetch(weights, ivec2(column + 2, row), 0),
              texelFetch(weights, ivec2(column + 3, row), 0)) * values;
}

// Four neurons of what a hidden layer gave.
vec4 fourNeurons(int row) {
  vec4 sum = texelFetch(weights, ivec2(4 * VECTORS, row), 0);
#pragma unroll_loop_start
  for (int i = 0; i < VECTORS; i++) {
    sum += fourInputs(4 * i, row, given[i]);
  }
#pragma unroll_loop_end
  return sum;
}

// Directions are unit vectors in the texture's frame, z >= 0.
vec3 decodedColour(vec4 latents[LATENT_VECTORS], vec3 light, vec3 view) {
  vec4 directions = vec4(stereographicPlace(light), stereographicPlace(view));
  vec4 sum;
  for (int row = 0; row < VECTORS; row++) {
    sum = texelFetch(weights, ivec2(4 * VECTORS, row), 0);
#pragma unroll_loop_start
    for (int i = 0; i < LATENT_VECTORS; i++) {
      sum += fourInputs(4 * i, row, latents[i]);
    }
#pragma unroll_loop_end
    given[row] = max(sum + fourInputs(4 * LATENT_VECTORS, row, directions), 0.0);
  }
  // One loop for all layers: the unrolled sum is long to compile.
  for (int layer = 1; layer < 4; layer++) {
    int rows = layer < 3 ? VECTORS : 1;
    for (int row = 0; row < rows; row++) {
      sum = fourNeurons(VECTORS * layer + row);
      said[row] = max(sum, 0.0);
    }
    given = said;
  }
  return sum.rgb;
}
