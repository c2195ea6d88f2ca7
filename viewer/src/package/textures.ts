/** Layers of KTX 2 files: one level, not compressed. */

import type { KTX2Container } from "ktx-parse";
import type { Values } from "./package";

/** Layers (layer, y, x, channel), row 0 first; float16 as 16-bit codes. */
export interface Layers {
  count: number;
  width: number;
  height: number;
  channels: number;
  dtype: "uint8" | "uint16" | "float16" | "float32";
  data: Values;
}

// Vulkan's numbers of formats with 1 to 4 channels.
const FORMATS: [Layers["dtype"], number[]][] = [
  ["uint8", [9, 16, 23, 37]],
  ["uint16", [70, 77, 84, 91]],
  ["float16", [76, 83, 90, 97]],
  ["float32", [100, 103, 106, 109]],
];
const BYTES = { uint8: 1, uint16: 2, float16: 2, float32: 4 };

/** The layers of a container. Throws an Error that says what is wrong. */
export function layersOf(container: KTX2Container): Layers {
  const found = FORMATS.find(([, numbers]) => numbers.includes(container.vkFormat));
  if (!found || container.supercompressionScheme !== 0 || container.levels.length !== 1) {
    throw new Error("a KTX 2 of another kind");
  }
  const [dtype, numbers] = found;
  const channels = numbers.indexOf(container.vkFormat) + 1;
  const { pixelWidth: width, pixelHeight: height } = container;
  const count = Math.max(container.layerCount, 1);
  const content = container.levels[0].levelData;
  if (content.length !== count * width * height * channels * BYTES[dtype]) throw new Error("a KTX 2 that is cut");
  const own = content.slice().buffer as ArrayBuffer;
  const data =
    dtype === "uint8" ? new Uint8Array(own) : dtype === "float32" ? new Float32Array(own) : new Uint16Array(own);
  return { count, width, height, channels, dtype, data };
}
