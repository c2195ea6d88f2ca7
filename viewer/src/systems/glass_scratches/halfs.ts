/** Half floats as 16-bit codes. */

import { DataUtils } from "three";

/** The number that a code stands for. */
export function floatOf(code: number): number {
  return DataUtils.fromHalfFloat(code);
}

/** Codes of n / 255, for n from 0 to 255. */
export const HALF_OF_BYTE = Uint16Array.from({ length: 256 }, (_, n) => DataUtils.toHalfFloat(n / 255));
