/** Vectors over half the rows and columns of directions, as `compression/resident.py`. */

/** Rows of directions from which on half as many are kept. */
export const LEAST_HALVED = 64;
const ROUNDS = 16; // of conjugate gradients

/** Four places and their shares, for each of n x n directions. */
interface Taps {
  places: Int32Array;
  shares: Float64Array;
}

/**
 * Values at (n/2)² places whose bilinear interpolation at n² directions is nearest to the rows, by solid
 * angle, the square of rootWeight: normal equations by conjugate gradients.
 */
export function halved(rows: Float32Array[], rootWeight: Float32Array): Float32Array[] {
  const n = Math.round(Math.sqrt(rootWeight.length));
  const taps = tapsOf(n);
  const areas = Float64Array.from(rootWeight, (value) => value * value);
  const places = (n / 2) ** 2;
  const diagonal = new Float64Array(places);
  taps.places.forEach((place, k) => (diagonal[place] += areas[k >> 2] * taps.shares[k] ** 2));
  return rows.map((row) => {
    const values = new Float64Array(places);
    const left = gathered(taps, areas, row, places);
    const way = left.map((value, k) => value / diagonal[k]);
    let energy = dot(left, way);
    for (let round = 0; round < ROUNDS; round++) {
      const turned = gathered(taps, areas, interpolated(taps, way), places);
      const length = energy / Math.max(dot(way, turned), 1e-300);
      for (let k = 0; k < places; k++) {
        values[k] += length * way[k];
        left[k] -= length * turned[k];
      }
      const before = energy;
      energy = left.reduce((sum, value, k) => sum + (value * value) / diagonal[k], 0);
      const again = energy / Math.max(before, 1e-300);
      for (let k = 0; k < places; k++) way[k] = left[k] / diagonal[k] + again * way[k];
    }
    return Float32Array.from(values);
  });
}

function dot(one: Float64Array, other: Float64Array): number {
  let sum = 0;
  for (let k = 0; k < one.length; k++) sum += one[k] * other[k];
  return sum;
}

function interpolated({ places, shares }: Taps, values: Float64Array): Float64Array {
  const found = new Float64Array(places.length / 4);
  for (let k = 0; k < places.length; k++) found[k >> 2] += shares[k] * values[places[k]];
  return found;
}

function gathered(taps: Taps, areas: Float64Array, row: ArrayLike<number>, count: number): Float64Array {
  const found = new Float64Array(count);
  taps.places.forEach((place, k) => (found[place] += areas[k >> 2] * taps.shares[k] * row[k >> 2]));
  return found;
}

/** A direction is a quarter of a place away from its own place's middle. */
function tapsOf(n: number): Taps {
  const side = n / 2;
  const places = new Int32Array(4 * n * n);
  const shares = new Float64Array(4 * n * n);
  for (let k = 0; k < n * n; k++) {
    const row = (Math.floor(k / n) + 0.5) / 2 - 0.5;
    const column = ((k % n) + 0.5) / 2 - 0.5;
    const [top, left] = [Math.floor(row), Math.floor(column)];
    for (let tap = 0; tap < 4; tap++) {
      const [down, right] = [tap >> 1, tap & 1];
      places[4 * k + tap] = wrapped(top + down, left + right, side);
      shares[4 * k + tap] =
        (down ? row - top : 1 - row + top) * (right ? column - left : 1 - column + left);
    }
  }
  return { places, shares };
}

/** Beyond the border lies the same border, mirrored about its middle. */
function wrapped(row: number, column: number, side: number): number {
  if (row < 0 || row >= side) [row, column] = [Math.min(Math.max(row, 0), side - 1), side - 1 - column];
  if (column < 0 || column >= side) [row, column] = [side - 1 - row, Math.min(Math.max(column, 0), side - 1)];
  return row * side + column;
}
