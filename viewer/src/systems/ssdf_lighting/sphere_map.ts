/** Maps of radiance all around: equirectangular, z up, row 0 at the zenith, as the stage's. */

/** Linear radiance (height, 2 height, 3). */
export interface Environment {
  height: number;
  data: Float32Array | Float64Array;
}

const FAINT = 16; // exponents of the blur's kernel beyond do not count

/** Directions and solid angles of a map's texels. */
export class Sphere {
  readonly count: number;
  /** (P, 3). */
  readonly ways: Float64Array;
  /** (P), steradians. */
  readonly omega: Float64Array;

  constructor(readonly height: number) {
    const width = 2 * height;
    this.count = height * width;
    this.ways = new Float64Array(3 * this.count);
    this.omega = new Float64Array(this.count);
    for (let row = 0; row < height; row++) {
      const polar = (Math.PI * (row + 0.5)) / height;
      const band = Math.cos((Math.PI * row) / height) - Math.cos((Math.PI * (row + 1)) / height);
      for (let column = 0; column < width; column++) {
        const azimuth = 2 * Math.PI * (0.5 - (column + 0.5) / width);
        const p = row * width + column;
        this.ways.set(
          [Math.sin(polar) * Math.cos(azimuth), Math.sin(polar) * Math.sin(azimuth), Math.cos(polar)],
          3 * p,
        );
        this.omega[p] = (2 * Math.PI * band) / width;
      }
    }
  }

  /** Integral (3) of a map. */
  flux(data: ArrayLike<number>): number[] {
    const found = [0, 0, 0];
    for (let p = 0; p < this.count; p++) {
      for (let channel = 0; channel < 3; channel++) found[channel] += this.omega[p] * data[3 * p + channel];
    }
    return found;
  }
}

/** A map's means, by solid angle, over the texels of a map of another height. */
export function downsampled({ height, data }: Environment, to: number): { height: number; data: Float64Array } {
  const border = (count: number) =>
    Array.from({ length: count + 1 }, (_, k) => Math.sin((0.5 * Math.PI * k) / count) ** 2);
  const even = (count: number) => Array.from({ length: count + 1 }, (_, k) => k / count);
  const down = overlaps(border(height), border(to));
  const along = overlaps(even(2 * height), even(2 * to));
  const rows = new Float64Array(to * 2 * height * 3);
  down.forEach((shares, row) => {
    for (const [from, share] of shares) {
      for (let k = 0; k < 6 * height; k++) rows[row * 6 * height + k] += share * data[from * 6 * height + k];
    }
  });
  const found = new Float64Array(to * 2 * to * 3);
  for (let row = 0; row < to; row++) {
    along.forEach((shares, column) => {
      for (const [from, share] of shares) {
        for (let channel = 0; channel < 3; channel++) {
          found[3 * (row * 2 * to + column) + channel] += share * rows[3 * (row * 2 * height + from) + channel];
        }
      }
    });
  }
  return { height: to, data: found };
}

/** For each new interval, the old ones in it with their shares. */
function overlaps(old: number[], made: number[]): [number, number][][] {
  let first = 0;
  return made.slice(1).map((end, k) => {
    const start = made[k];
    while (first > 0 && old[first] > start) first--;
    while (old[first + 1] <= start && first < old.length - 2) first++;
    const found: [number, number][] = [];
    for (let from = first; from < old.length - 1 && old[from] < end; from++) {
      const shared = Math.min(end, old[from + 1]) - Math.max(start, old[from]);
      if (shared > 0) found.push([from, shared]);
    }
    const whole = found.reduce((sum, [, share]) => sum + share, 0);
    return found.map(([from, share]) => [from, share / whole]);
  });
}

/** A map, each texel replaced by its surroundings' mean, weighted by a Gaussian. */
export function blurred(data: Float64Array, sphere: Sphere, sharpness: number): Float64Array {
  const { height, ways, omega } = sphere;
  const width = 2 * height;
  const found = new Float64Array(data.length);
  for (let row = 0; row < height; row++) {
    const p = 3 * row * width;
    const kernel: [number, number, number][] = []; // row, columns on, weight
    let whole = 0;
    for (let other = 0; other < height; other++) {
      for (let on = 0; on < width; on++) {
        const q = 3 * (other * width + on);
        const cosine = ways[p] * ways[q] + ways[p + 1] * ways[q + 1] + ways[p + 2] * ways[q + 2];
        const less = sharpness * (1 - cosine);
        if (less > FAINT) continue;
        const weight = Math.exp(-less) * omega[other * width + on];
        kernel.push([other, on, weight]);
        whole += weight;
      }
    }
    for (const [other, on, weight] of kernel) {
      const share = weight / whole;
      for (let column = 0; column < width; column++) {
        const to = 3 * (row * width + column);
        const from = 3 * (other * width + ((column + on) % width));
        for (let channel = 0; channel < 3; channel++) found[to + channel] += share * data[from + channel];
      }
    }
  }
  return found;
}
