/** Arrays as textures, as the stage's `texture`. */

import * as THREE from "three";
import type { Picture, Values } from "../package/package";
import type { Layers } from "../package/textures";

/** How a texture is sampled. */
export interface Sampling {
  wrap?: "clamp" | "repeat" | "mirrored";
  interpolate?: boolean;
  mipmap?: boolean;
  /** The colours are sRGB codes, decoded when they are sampled (alpha is not). */
  srgb?: boolean;
}

const WRAPS = {
  clamp: THREE.ClampToEdgeWrapping,
  repeat: THREE.RepeatWrapping,
  mirrored: THREE.MirroredRepeatWrapping,
};
let floatsInterpolate = true;

/** Notes what a renderer can do; where it cannot interpolate floats, textures hold halfs. */
export function useRenderer(renderer: THREE.WebGLRenderer): void {
  floatsInterpolate = renderer.extensions.has("OES_texture_float_linear");
}

/**
 * A picture (uint8 or float32, 1 to 4 channels) as a texture; row 0 is the top, v = 1. One channel
 * is grey, two are red and green.
 */
export function texture(picture: Picture<Uint8Array | Float32Array>, sampling: Sampling = {}): THREE.DataTexture {
  const { width, height } = picture;
  const content = fourChannels(picture);
  flipRows(content, width * 4);
  const made = new THREE.DataTexture(null, width, height, THREE.RGBAFormat);
  fill(made, content, sampling);
  if (sampling.srgb) made.colorSpace = THREE.SRGBColorSpace;
  return made;
}

/** Layers as an array texture (`sampler2DArray`), row 0 first: at v = 0. */
export function layersTexture(layers: Layers, sampling: Sampling = {}): THREE.DataArrayTexture {
  const { width, height, count, channels, dtype, data } = layers;
  const made = new THREE.DataArrayTexture(null, width, height, count);
  made.format = [THREE.RedFormat, THREE.RGFormat, THREE.RGBAFormat, THREE.RGBAFormat][channels - 1];
  if (channels === 3) throw new Error("layers have 3 channels; expected 1, 2 or 4.");
  if (dtype === "uint16") throw new Error("layers are uint16; expected uint8, float16 or float32.");
  fill(made, data, sampling, dtype === "float16");
  return made;
}

function fill(
  made: THREE.DataTexture | THREE.DataArrayTexture,
  data: Values,
  sampling: Sampling,
  halfs = false,
): void {
  const { interpolate = true, mipmap = false, wrap = "clamp" } = sampling;
  let content = data;
  if (data instanceof Float32Array && interpolate && !floatsInterpolate) {
    content = Uint16Array.from(data, (value) => THREE.DataUtils.toHalfFloat(value));
    halfs = true;
  }
  made.image.data = content as never;
  made.type = halfs
    ? THREE.HalfFloatType
    : content instanceof Float32Array
      ? THREE.FloatType
      : THREE.UnsignedByteType;
  made.wrapS = made.wrapT = WRAPS[wrap];
  made.magFilter = interpolate ? THREE.LinearFilter : THREE.NearestFilter;
  const between = interpolate ? THREE.LinearMipmapLinearFilter : THREE.NearestMipmapNearestFilter;
  made.minFilter = mipmap ? between : made.magFilter;
  made.generateMipmaps = mipmap;
  made.unpackAlignment = 1;
  made.needsUpdate = true;
}

function fourChannels({ width, height, channels, data }: Picture): Uint8Array | Float32Array {
  const pixels = width * height;
  const isFloat = data instanceof Float32Array;
  const content = isFloat ? new Float32Array(4 * pixels) : new Uint8Array(4 * pixels);
  const opaque = isFloat ? 1 : 255;
  for (let pixel = 0; pixel < pixels; pixel++) {
    const from = pixel * channels;
    const to = pixel * 4;
    content[to] = data[from];
    content[to + 1] = channels === 1 ? data[from] : data[from + 1];
    content[to + 2] = channels === 1 ? data[from] : channels === 2 ? 0 : data[from + 2];
    content[to + 3] = channels === 4 ? data[from + 3] : opaque;
  }
  return content;
}

function flipRows(content: Uint8Array | Float32Array, row: number): void {
  const rows = content.length / row;
  for (let top = 0; top < rows >> 1; top++) {
    const bottom = rows - 1 - top;
    const kept = content.slice(top * row, (top + 1) * row);
    content.copyWithin(top * row, bottom * row, (bottom + 1) * row);
    content.set(kept, bottom * row);
  }
}
