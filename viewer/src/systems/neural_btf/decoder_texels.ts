/** Decoders and latents as textures, as `pipelines/neural_btf/stage_view.py` has them. */

import type { Picture } from "../../package/package";

const FOUR = 4;
const LONGEST_ROW = 2048;
const DIRECTIONS = 4;

/** A layer's weights (outputs, inputs) and biases. */
export interface Layer {
  weight: Float32Array;
  bias: Float32Array;
}

/** Vectors of four neurons of a hidden layer: `VECTORS` of `btf_decoder.glsl`. */
export function vectorsOf(layers: readonly Layer[]): number {
  return Math.ceil(layers[0].bias.length / FOUR);
}

/**
 * All layers: a row is four neurons, a column an input, the last column the bias. What pads layers
 * is 0. Row 0 is the first.
 */
export function weightTexels(layers: readonly Layer[]): Picture<Float32Array> {
  const vectors = vectorsOf(layers);
  const width = vectors * FOUR + 1;
  const height = vectors * (layers.length - 1) + 1;
  const latents = layers[0].weight.length / layers[0].bias.length - DIRECTIONS;
  const padding = latentVectors(latents) * FOUR - latents;
  const data = new Float32Array(height * width * FOUR);
  layers.forEach(({ weight, bias }, layer) => {
    const inputs = weight.length / bias.length;
    for (let neuron = 0; neuron < bias.length; neuron++) {
      const row = vectors * layer + Math.floor(neuron / FOUR);
      const at = (column: number) => (row * width + column) * FOUR + (neuron % FOUR);
      for (let input = 0; input < inputs; input++) {
        const column = layer === 0 && input >= latents ? input + padding : input;
        data[at(column)] = weight[neuron * inputs + input];
      }
      data[at(width - 1)] = bias[neuron];
    }
  });
  return { width, height, channels: FOUR, data };
}

/** Vectors of four of so many latents: `LATENT_VECTORS` of `btf_latents.glsl`. */
export function latentVectors(latents: number): number {
  return Math.ceil(latents / FOUR);
}

/** Latents (n, count) as lines of texels, padded by 0 to whole texels a vector. */
export function latentTexels(latents: Float32Array, count: number): Picture<Float32Array> {
  const texels = latents.length / count;
  const vectors = latentVectors(count);
  const aRow = Math.min(texels, Math.floor(LONGEST_ROW / vectors));
  const [width, height] = [aRow * vectors, Math.ceil(texels / aRow)];
  const data = new Float32Array(width * height * FOUR);
  for (let texel = 0; texel < texels; texel++) {
    data.set(latents.subarray(texel * count, (texel + 1) * count), texel * vectors * FOUR);
  }
  return { width, height, channels: FOUR, data };
}

/** A picture with its last row first: `texture` puts the last row at the bottom, which is row 0. */
export function upsideDown({ width, height, channels, data }: Picture<Float32Array>): Picture<Float32Array> {
  const row = width * channels;
  const turned = new Float32Array(data.length);
  for (let y = 0; y < height; y++) turned.set(data.subarray(y * row, (y + 1) * row), (height - 1 - y) * row);
  return { width, height, channels, data: turned };
}
