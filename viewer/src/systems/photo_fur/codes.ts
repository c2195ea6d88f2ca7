/** Depth codes of a photograph for any number of layers, as `pipelines/photo_fur/attenuation.py`. */

/** Code of a pixel that no layer shows. */
export const DROPPED = 255;
/** A layer needs a code of its own. */
export const MOST_LAYERS = 250;

/** The medium: luminance at the surface and at the skin. */
export interface Medium {
  brightest: number;
  darkest: number;
}

/** Codes of each layer: layer n has those from (n - 1) steps to n steps - 1. */
export function codeSteps(layers: number): number {
  return Math.floor(DROPPED / layers);
}

/**
 * The code of each pixel. luminance: linear, below 0 where there is no fur; `dropped`: nor is there
 * beyond the medium's two luminances. Layers are exactly Python's; within one, where two codes meet,
 * a pixel's may be the neighbouring one: its logarithm is a float's.
 */
export function depthCodes(luminance: Float32Array, medium: Medium, layers: number, dropped: boolean): Uint8Array {
  const { brightest, darkest } = medium;
  const steps = codeSteps(layers);
  const ratio = darkest / brightest;
  const boundaries = Float64Array.from({ length: layers + 1 }, (_, n) => brightest * ratio ** (n / layers));
  const [single, decay] = [Math.fround(brightest), Math.fround(-Math.log(ratio))];
  const codes = new Uint8Array(luminance.length);
  for (let pixel = 0; pixel < luminance.length; pixel++) {
    const light = luminance[pixel];
    if (light < 0 || (dropped && (light > brightest || light < darkest))) {
      codes[pixel] = DROPPED;
      continue;
    }
    const depth = Math.fround(Math.fround(Math.log(Math.fround(single / light))) / decay);
    const place = Math.fround(depth * layers);
    // I(layer) < light <= I(layer - 1); the logarithm is right but for its last digits.
    let layer = Math.min(Math.max(Math.ceil(place), 1), layers);
    while (layer > 1 && light > boundaries[layer - 1]) layer--;
    while (layer < layers && light <= boundaries[layer]) layer++;
    const within = Math.min(Math.max(place - (layer - 1), 0), 1);
    codes[pixel] = (layer - 1) * steps + Math.min(Math.floor(within * steps), steps - 1);
  }
  return codes;
}
