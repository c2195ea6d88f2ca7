/** The file of compressed SSDFs: `compression/compact_file.py`, read. */

import { decodeNumbers } from "./range_decoder";

const MAGIC = "TSUYASDF";
const VERSION = 1;
const HEADER = 40; // 8 + 2 + 2 + 8 + 5 * 4
const MOST_LEVEL = 80;
const LARGEST_LEVEL = 4000;
const MOST_CONTEXT = 4096; // of one group
const MOST_A_BYTE = 12_000; // numbers that a byte can hold

/** Codes of a scene's SSDFs, as `CompactCodes`; R vectors, K clusters, M vectors of theirs. */
export interface CompactCodes {
  /** q, radians. */
  step: number;
  /** n of n x n directions. */
  resolution: number;
  /** (R, n²). */
  shared: Int32Array;
  sharedLevel: Int32Array;
  /** (K, R). */
  centre: Int32Array;
  /** (M, R). */
  basis: Int32Array;
  level: Int32Array;
  /** (K). */
  ranks: Int32Array;
  /** Of each vertex. */
  cluster: Int32Array;
  /** Vertices (K) of each cluster. */
  sizes: Int32Array;
  /** Vertex by vertex in their order in clusters, cluster by cluster. */
  weights: Int32Array;
}

/** The codes of a file. Throws an Error for what is no such file, or is damaged. */
export function readCompactFile(data: Uint8Array): CompactCodes {
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const magic = String.fromCharCode(...data.subarray(0, 8));
  if (data.length < HEADER + 4 || magic !== MAGIC) throw new Error("no compact SSDFs");
  if (view.getUint16(8, true) !== VERSION) throw new Error(`of version ${view.getUint16(8, true)}`);
  const n = view.getUint16(10, true);
  const step = view.getFloat64(12, true);
  const [rank, count, total, vertices, weights] = [0, 1, 2, 3, 4].map((k) => view.getUint32(20 + 4 * k, true));
  const numbers = (n * n + count + total) * rank + weights + vertices + count + total;
  if (!(step > 0 && step < Infinity) || !count || n < 4 || n % 2 || numbers > MOST_A_BYTE * data.length) {
    throw new Error("damaged: its header announces what it cannot hold");
  }
  const length = view.getUint32(HEADER, true);
  const start = HEADER + 4;
  const small = decodeNumbers(
    data.subarray(start, start + length),
    Uint32Array.from([count, rank, total, vertices].flatMap((size, kind) => new Array<number>(size).fill(kind))),
  );
  const [ranks, sharedSteps, steps, moved] = split(small, [count, rank, total, vertices]);
  if (ranks.some((size) => size < 0) || sum(ranks) !== total || moved.some((place) => place < 0 || place >= count)) {
    throw new Error("damaged: its clusters do not add up");
  }
  const sharedLevel = summed(sharedSteps);
  const level = Int32Array.from(split(steps, ranks).flatMap((own) => [...summed(own)]));
  if ([...sharedLevel, ...level].some((each) => each < 0 || each > LARGEST_LEVEL)) {
    throw new Error("damaged: its levels are out of range");
  }
  const cluster = movedBack(moved, count);
  const sizes = new Int32Array(count);
  for (const own of cluster) sizes[own]++;
  if (ranks.reduce((found, size, k) => found + size * sizes[k], 0) !== weights) {
    throw new Error("damaged: its clusters do not add up");
  }
  const large = decodeNumbers(data.subarray(start + length), contextsOf(n, sharedLevel, level, ranks, sizes));
  const [shared, centre, basis, rest] = split(large, [rank * n * n, count * rank, total * rank, weights]);
  return { step, resolution: n, shared, sharedLevel, centre, basis, level, ranks, cluster, sizes, weights: rest };
}

function split(values: Int32Array, lengths: ArrayLike<number>): Int32Array[] {
  let first = 0;
  return Array.from(lengths, (length) => values.subarray(first, (first += length)));
}

function sum(values: Int32Array): number {
  return values.reduce((found, value) => found + value, 0);
}

function summed(steps: Int32Array): Int32Array {
  let level = 0;
  return steps.map((each) => (level += each));
}

/** Undoes the list in which the last one used is the first. */
function movedBack(moved: Int32Array, count: number): Int32Array {
  const recent = Array.from({ length: count }, (_, k) => k);
  return moved.map((place) => {
    const [found] = recent.splice(place, 1);
    recent.unshift(found);
    return found;
  });
}

/** Contexts of the shared basis, the centres, the clusters' vectors, the weights. */
function contextsOf(
  n: number,
  sharedLevel: Int32Array,
  level: Int32Array,
  ranks: Int32Array,
  sizes: Int32Array,
): Uint32Array {
  const rank = sharedLevel.length;
  const ring = Uint32Array.from({ length: n * n }, (_, k) => octave(1 + Math.hypot(Math.floor(k / n), k % n), 3, 24));
  const place = Uint32Array.from({ length: rank }, (_, k) => octave(1 + k / 4, 2, 16));
  const groups: Int32Array[] = [
    table(sharedLevel, ring, (one, other) => clipped(one) * 24 + other),
    table(sizes, place, (one, other) => octave(Math.max(one, 1), 1, 24) * 16 + other),
    table(level, place, (one, other) => clipped(one) * 16 + other),
    weightContexts(level, ranks, sizes),
  ];
  const joined = new Uint32Array(groups.reduce((found, group) => found + group.length, 0));
  let first = 0;
  let offset = 0;
  for (const group of groups) {
    // Numbered without gaps, in their order.
    const dense = new Uint32Array(MOST_CONTEXT);
    for (const value of group) dense[value] = 1;
    for (let value = 0; value < MOST_CONTEXT; value++) if (dense[value]) dense[value] = offset++;
    for (const value of group) joined[first++] = dense[value];
  }
  return joined;
}

function weightContexts(level: Int32Array, ranks: Int32Array, sizes: Int32Array): Int32Array {
  const found: Int32Array[] = [];
  let first = 0;
  ranks.forEach((rank, cluster) => {
    // An entry u of a column of length 1 over n vertices is about 1 / sqrt(n).
    const narrow = rounded(2 * Math.log2(Math.max(sizes[cluster], 1)));
    const own = Array.from(level.subarray(first, first + rank), (each) => clipped(each) - narrow + 80);
    const all = new Int32Array(rank * sizes[cluster]);
    for (let k = 0; k < all.length; k++) all[k] = own[k % rank];
    found.push(all);
    first += rank;
  });
  const all = new Int32Array(found.reduce((count, each) => count + each.length, 0));
  let at = 0;
  for (const each of found) {
    all.set(each, at);
    at += each.length;
  }
  return all;
}

function table(
  rows: Int32Array,
  columns: Uint32Array,
  value: (row: number, column: number) => number,
): Int32Array {
  const found = new Int32Array(rows.length * columns.length);
  let at = 0;
  for (const row of rows) for (const column of columns) found[at++] = value(row, column);
  return found;
}

function clipped(level: number): number {
  return Math.min(Math.max(level, 0), MOST_LEVEL);
}

function octave(value: number, perOctave: number, most: number): number {
  return Math.min(Math.trunc(Math.log2(value) * perOctave), most - 1);
}

/** To the nearest whole number, halves to the even one. */
function rounded(value: number): number {
  const nearest = Math.round(value);
  return nearest - value === 0.5 && nearest % 2 ? nearest - 1 : nearest;
}
