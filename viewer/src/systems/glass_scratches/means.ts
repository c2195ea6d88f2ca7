/** Smaller maps, each texel the mean of what it stands for. */

import type { Radiance } from "./lights";

/** A map with at most `most` rows. */
export function softMap({ height, data }: Radiance, most: number): Radiance {
  const rows = Math.min(height, most);
  return { height: rows, data: smaller(data, [height, 2 * height], [rows, 2 * rows]) };
}

/** Colours (height, width, 3) averaged to other sizes, which are no larger. */
export function smaller(colours: Float32Array, [height, width]: [number, number], [rows, columns]: [number, number]): Float32Array {
  return averaged(averaged(colours, height, width, columns, 3), 1, height, rows, 3 * columns);
}

/** Values (lines, from, size) averaged to (lines, to, size), to <= from, each over its share. */
function averaged(values: Float32Array, lines: number, from: number, to: number, size: number): Float32Array {
  if (from === to) return values;
  const kept = new Float32Array(lines * to * size);
  const step = from / to;
  for (let line = 0; line < lines; line++) {
    for (let n = 0; n < to; n++) {
      const [start, end] = [n * step, Math.min((n + 1) * step, from)];
      const into = (line * to + n) * size;
      for (let i = Math.floor(start); i < end; i++) {
        const share = (Math.min(end, i + 1) - Math.max(start, i)) / (end - start);
        const out = (line * from + i) * size;
        for (let value = 0; value < size; value++) kept[into + value] += share * values[out + value];
      }
    }
  }
  return kept;
}
