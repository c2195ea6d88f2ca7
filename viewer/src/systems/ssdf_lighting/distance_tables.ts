/** Compressed SSDFs laid out for the graphics card: what `ssdf_lookup.glsl` reads. */

import type { CompactCodes } from "./compact_file";
import { LEAST_HALVED, halved } from "./half_resolution";

const MEMORY_STEP = 0.5; // of the shared basis in memory over q
const LEVELS_PER_OCTAVE = 4;

/** Lines of texels of four numbers. */
export interface DistanceTables {
  /** n of n x n places. */
  resolution: number;
  /**
   * Bytes, read as 0 to 1: for each cluster, place by place, 1, its centre, what rounding left of the
   * centre, its vectors, zeros to whole texels.
   */
  vectors: Uint8Array;
  /** For each vertex: the factors of these columns, zeros. */
  weights: Float32Array;
  /** (V, 4): texel of the cluster's first, texels a direction, texel of the weights, 0. */
  sources: Float32Array;
}

/** The paper's form, as a package has it. */
export interface PapersForm {
  vectors: Float32Array;
  directions: number;
  first: Int32Array;
  rowVertex: Int32Array;
  rowFirst: Int32Array;
  weights: Float32Array;
}

/** Tables of the compact form; rootWeight (n²). */
export function tablesOfCodes(codes: CompactCodes, rootWeight: Float32Array): DistanceTables {
  const { step, ranks, centre, basis, level, sizes, cluster } = codes;
  let resolution = codes.resolution;
  let shared = sharedVectors(codes, rootWeight);
  if (resolution >= LEAST_HALVED) {
    shared = halved(shared, rootWeight);
    resolution /= 2;
  }
  const directions = resolution * resolution;
  const rank = codes.sharedLevel.length;
  const laid = layOut(ranks, directions);
  const row = new Float32Array(directions);
  let first = 0;
  ranks.forEach((count, own) => {
    combine(row, shared, centre.subarray(own * rank, (own + 1) * rank), step / Math.sqrt(Math.max(sizes[own], 1)));
    laid.put(own, 0, row);
    for (let k = 0; k < count; k++, first++) {
      const scale = step / sigmaOf(level[first], step);
      combine(row, shared, basis.subarray(first * rank, (first + 1) * rank), scale);
      laid.put(own, k + 1, row);
    }
  });
  const starts = new Uint32Array(ranks.length); // of the clusters' next weights
  for (let own = 1; own < ranks.length; own++) starts[own] = starts[own - 1] + ranks[own - 1] * sizes[own - 1];
  const weightsOf = [...cluster].map((own) => {
    const start = starts[own];
    starts[own] += ranks[own];
    return { start, own };
  });
  const values = new Float32Array(codes.weights.length);
  for (let k = 0; k < values.length; k++) values[k] = codes.weights[k] * step;
  return laid.tables(resolution, weightsOf, values);
}

/** Tables of the paper's form; a vertex in several clusters is decoded from the first. */
export function tablesOfPaper(form: PapersForm, vertices: number): DistanceTables {
  const { directions, first, rowFirst, rowVertex } = form;
  const ranks = Int32Array.from({ length: first.length - 1 }, (_, own) => first[own + 1] - first[own]);
  const laid = layOut(ranks, directions);
  const weightsOf: { start: number; own: number }[] = Array.from({ length: vertices }, () => ({ start: 0, own: 0 }));
  const isPlaced = new Uint8Array(vertices);
  let start = 0;
  ranks.forEach((count, own) => {
    for (let k = 0; k < count; k++) {
      const at = (first[own] + k) * directions;
      laid.put(own, k + 1, form.vectors.subarray(at, at + directions));
    }
    for (let row = rowFirst[own]; row < rowFirst[own + 1]; row++, start += count) {
      const vertex = rowVertex[row];
      if (!isPlaced[vertex]) weightsOf[vertex] = { start, own };
      isPlaced[vertex] = 1;
    }
  });
  return laid.tables(Math.round(Math.sqrt(directions)), weightsOf, form.weights);
}

/** Sigma that a level stands for. */
function sigmaOf(level: number, step: number): number {
  return step * 2 ** (level / LEVELS_PER_OCTAVE);
}

/** R vectors (n²): the shared ones as they are in memory, no longer weighted. */
function sharedVectors(codes: CompactCodes, rootWeight: Float32Array): Float32Array[] {
  const { resolution: n, step, shared, sharedLevel } = codes;
  const directions = n * n;
  const cosines = cosineTable(n);
  return Array.from(sharedLevel, (level, row) => {
    const own = shared.subarray(row * directions, (row + 1) * directions);
    const square = inverseCosineTransform(own, cosines, n);
    const sigma = sigmaOf(level, step);
    const scale = (MEMORY_STEP * step) / sigma;
    const found = new Float32Array(directions);
    for (let k = 0; k < directions; k++) {
      found[k] = (Math.round((square[k] * step) / sigma / scale) * scale) / rootWeight[k];
    }
    return found;
  });
}

/** (frequency, place) of the orthonormal cosine transform. */
function cosineTable(n: number): Float64Array {
  return Float64Array.from({ length: n * n }, (_, k) => {
    const frequency = Math.floor(k / n);
    const scale = Math.sqrt((frequency ? 2 : 1) / n);
    return scale * Math.cos((Math.PI * frequency * ((k % n) + 0.5)) / n);
  });
}

function inverseCosineTransform(codes: Int32Array, cosines: Float64Array, n: number): Float64Array {
  const along = new Float64Array(n * n); // rows of frequencies, columns of places
  const found = new Float64Array(n * n);
  for (let row = 0; row < n; row++) {
    for (let frequency = 0; frequency < n; frequency++) {
      const code = codes[row * n + frequency];
      if (code) for (let x = 0; x < n; x++) along[row * n + x] += code * cosines[frequency * n + x];
    }
  }
  for (let frequency = 0; frequency < n; frequency++) {
    for (let y = 0; y < n; y++) {
      const cosine = cosines[frequency * n + y];
      for (let x = 0; x < n; x++) found[y * n + x] += cosine * along[frequency * n + x];
    }
  }
  return found;
}

/** Puts the sum of `scale` codes times vectors into `row`: many codes are 0. */
function combine(row: Float32Array, vectors: Float32Array[], codes: Int32Array, scale: number): void {
  row.fill(0);
  const some: number[] = [];
  for (let k = 0; k < codes.length; k++) if (codes[k]) some.push(k);
  for (let at = 0; at < some.length; at += 8) {
    const own = Array.from({ length: 8 }, (_, i) => some[at + i] ?? some[at]);
    addEight(row, own.map((k) => vectors[k]), own.map((k, i) => (at + i < some.length ? codes[k] * scale : 0)));
  }
}

/** Adds eight vectors times factors: most of the time of all goes here. */
function addEight(row: Float32Array, [a, b, c, d, e, f, g, h]: Float32Array[], factors: number[]): void {
  const [fa, fb, fc, fd, fe, ff, fg, fh] = factors;
  for (let k = 0; k < row.length; k++) {
    row[k] +=
      fa * a[k] + fb * b[k] + (fc * c[k] + fd * d[k]) + (fe * e[k] + ff * f[k] + (fg * g[k] + fh * h[k]));
  }
}

const BEFORE = 3; // columns before the vectors: 1, the centre, what is left of it

/** Room for clusters of so many vectors. */
function layOut(ranks: Int32Array, directions: number) {
  const texels = Int32Array.from(ranks, (rank) => Math.ceil((rank + BEFORE) / 4));
  const starts = new Uint32Array(ranks.length + 1);
  texels.forEach((count, own) => (starts[own + 1] = starts[own] + count * directions));
  const vectors = new Uint8Array(4 * starts[ranks.length]);
  // Of a column: what byte 0 stands for, and how much more 255 does.
  const lows = Array.from(texels, (count) => new Float64Array(4 * count));
  const spans = Array.from(texels, (count) => new Float64Array(4 * count));
  texels.forEach((count, own) => {
    const to = 4 * starts[own];
    for (let k = 0; k < directions; k++) vectors[to + 4 * count * k] = 255;
  });

  /** Rounds a column, and returns what is left. */
  function write(own: number, column: number, row: Float32Array): Float32Array {
    const low = row.reduce((least, value) => Math.min(least, value), Infinity);
    const span = row.reduce((most, value) => Math.max(most, value), -Infinity) - low;
    const width = 4 * texels[own];
    const left = new Float32Array(directions);
    let to = 4 * starts[own] + column;
    for (let k = 0; k < directions; k++, to += width) {
      vectors[to] = span > 0 ? Math.round((255 * (row[k] - low)) / span) : 0;
      left[k] = row[k] - low - (vectors[to] * span) / 255;
    }
    lows[own][column] = low;
    spans[own][column] = span;
    return left;
  }

  return {
    /** Vector `place` of a cluster: 0 is its centre. */
    put(own: number, place: number, row: Float32Array): void {
      if (place) write(own, BEFORE - 1 + place, row);
      else write(own, 2, write(own, 1, row));
    },
    /** The tables of vertices of these clusters, whose weights begin there. */
    tables(resolution: number, of: { start: number; own: number }[], values: Float32Array): DistanceTables {
      const sources = new Float32Array(4 * of.length);
      const weights = new Float32Array(4 * of.reduce((count, { own }) => count + texels[own], 0));
      let at = 0;
      of.forEach(({ start, own }, vertex) => {
        sources.set([starts[own], texels[own], at], 4 * vertex);
        let base = 0;
        for (let column = 1; column < BEFORE + ranks[own]; column++) {
          const weight = column < BEFORE ? 1 : values[start + column - BEFORE];
          base += weight * lows[own][column];
          weights[4 * at + column] = weight * spans[own][column];
        }
        weights[4 * at] = base;
        at += texels[own];
      });
      return { resolution, vectors, weights, sources };
    },
  };
}
