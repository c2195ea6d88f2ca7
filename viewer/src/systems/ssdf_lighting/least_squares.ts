/** Small systems of equations: dense, symmetric. */

/** A square matrix. */
export class Matrix {
  private readonly values: Float64Array;

  constructor(readonly size: number) {
    this.values = new Float64Array(size * size);
  }

  /** Products of all pairs of vectors. */
  static gram(vectors: Float64Array[]): Matrix {
    const found = new Matrix(vectors.length);
    vectors.forEach((one, i) => {
      for (let j = 0; j <= i; j++) {
        const other = vectors[j];
        let sum = 0;
        for (let k = 0; k < one.length; k++) sum += one[k] * other[k];
        found.values[i * found.size + j] = found.values[j * found.size + i] = sum;
      }
    });
    return found;
  }

  at(row: number, column: number): number {
    return this.values[row * this.size + column];
  }

  add(row: number, column: number, value: number): void {
    this.values[row * this.size + column] += value;
  }

  /** Some rows and columns of it. */
  part(rows: number[]): Matrix {
    const found = new Matrix(rows.length);
    rows.forEach((row, i) => rows.forEach((column, j) => found.add(i, j, this.at(row, column))));
    return found;
  }
}

/** x with matrix x = wanted, of a positive definite matrix: Cholesky's method. */
export function solved(matrix: Matrix, wanted: number[]): Float64Array {
  const n = matrix.size;
  const lower = new Float64Array(n * n);
  const found = Float64Array.from(wanted);
  for (let i = 0; i < n; i++) {
    for (let j = 0; j <= i; j++) {
      let sum = matrix.at(i, j);
      for (let k = 0; k < j; k++) sum -= lower[i * n + k] * lower[j * n + k];
      lower[i * n + j] = i === j ? Math.sqrt(Math.max(sum, 1e-300)) : sum / lower[j * n + j];
    }
  }
  for (let i = 0; i < n; i++) {
    for (let k = 0; k < i; k++) found[i] -= lower[i * n + k] * found[k];
    found[i] /= lower[i * n + i];
  }
  for (let i = n - 1; i >= 0; i--) {
    for (let k = i + 1; k < n; k++) found[i] -= lower[k * n + i] * found[k];
    found[i] /= lower[i * n + i];
  }
  return found;
}

/** x >= 0 that is least in x·gram x - 2 wanted·x: Lawson and Hanson's active sets. */
export function nonnegative(gram: Matrix, wanted: number[]): number[] {
  const size = wanted.length;
  let found = wanted.map(() => 0);
  const free = new Set<number>();
  const slopes = () => wanted.map((value, i) => found.reduce((rest, x, j) => rest - gram.at(i, j) * x, value));
  const least = 1e-12 * Math.max(...wanted.map(Math.abs));
  for (let turn = 0; turn < 3 * size; turn++) {
    const slope = slopes();
    const held = slope.map((value, i) => (free.has(i) ? -Infinity : value));
    const next = held.indexOf(Math.max(...held));
    if (free.size === size || held[next] <= least) break;
    free.add(next);
    for (;;) {
      const rows = [...free];
      const tried = solved(gram.part(rows), rows.map((row) => wanted[row]));
      if (tried.every((value) => value > 0)) {
        found = wanted.map(() => 0);
        rows.forEach((row, i) => (found[row] = tried[i]));
        break;
      }
      // As far as nothing becomes negative; what has become 0 is held again.
      const steps = rows.map((row, i) => (tried[i] > 0 ? 1 : found[row] / (found[row] - tried[i])));
      const step = Math.min(...steps);
      rows.forEach((row, i) => {
        found[row] += step * (tried[i] - found[row]);
        if (tried[i] <= 0 && steps[i] <= step) {
          found[row] = 0;
          free.delete(row);
        }
      });
    }
  }
  return found;
}
