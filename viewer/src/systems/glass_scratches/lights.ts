/** Lights drawn from an environment, as `pipelines/light/environment_sampling.py` draws them. */

/** Linear radiance (height, 2 height, 3) all around, row 0 at the zenith, as the stage's. */
export interface Radiance {
  height: number;
  data: Float32Array;
}

/** Lights: power, radiance times steradians, and unit vectors to them; both (count, 3). */
export interface Lights {
  power: Float32Array;
  towards: Float32Array;
}

/** How many lights stand for an environment. */
export const LIGHTS = 64;
const GOLDEN = 0.6180339887498949;
const WEIGHTS = [0.2126, 0.7152, 0.0722];
/** Of the mean luminance, added to every texel's, so that no light is missed. */
const FLOOR = 0.01;
const MARGIN = 1e-9;
const DARKEST = 1e-3;

/** Rec. 709 luminance of the texel that begins at an index. */
export function luminance(colours: ArrayLike<number>, at = 0): number {
  return WEIGHTS[0] * colours[at] + WEIGHTS[1] * colours[at + 1] + WEIGHTS[2] * colours[at + 2];
}

/** Mean luminance over all directions. */
export function meanLuminance({ height, data }: Radiance): number {
  let sum = 0;
  for (let row = 0; row < height; row++) {
    const steradians = texelSteradians(row, height);
    for (let texel = row * 2 * height; texel < (row + 1) * 2 * height; texel++) sum += steradians * luminance(data, 3 * texel);
  }
  return sum / (4 * Math.PI);
}

/** Geometric mean of the luminance over all directions: what is typical, whatever lamps there are.
 * What is darker than a thousandth of the mean counts as that. */
export function typicalLuminance(map: Radiance): number {
  const { height, data } = map;
  const least = DARKEST * meanLuminance(map);
  let sum = 0;
  for (let row = 0; row < height; row++) {
    const steradians = texelSteradians(row, height);
    for (let texel = row * 2 * height; texel < (row + 1) * 2 * height; texel++) {
      sum += steradians * Math.log(Math.max(luminance(data, 3 * texel), least));
    }
  }
  return Math.exp(sum / (4 * Math.PI));
}

/** Draws the lights, in proportion to luminance. */
export function drawnLights(map: Radiance): Lights {
  const { height, data } = map;
  const width = 2 * height;
  const floor = FLOOR * meanLuminance(map);
  const chances = new Float64Array(width * height);
  const rows = new Float64Array(height);
  for (let texel = 0; texel < chances.length; texel++) {
    const row = Math.floor(texel / width);
    chances[texel] = texelSteradians(row, height) * (luminance(data, 3 * texel) + floor);
    rows[row] += chances[texel];
  }
  const all = rows.reduce((sum, chance) => sum + chance, 0);
  const sums = sumsOf(rows);
  const power = new Float32Array(3 * LIGHTS);
  const towards = new Float32Array(3 * LIGHTS);
  for (let n = 0; n < LIGHTS; n++) {
    const [row, down] = drawn(sums, (n + 0.5) / LIGHTS);
    const columns = sumsOf(chances.subarray(row * width, (row + 1) * width));
    const [column, along] = drawn(columns, (n * GOLDEN) % 1);
    const texel = row * width + column;
    const steradians = (all / chances[texel]) * (texelSteradians(row, height) / LIGHTS);
    towards.set(directionIn(row, down, height, Math.PI * (1 - (2 * (column + along)) / width)), 3 * n);
    for (let channel = 0; channel < 3; channel++) power[3 * n + channel] = data[3 * texel + channel] * steradians;
  }
  return { power, towards };
}

function texelSteradians(row: number, height: number): number {
  const middle = ((row + 0.5) * Math.PI) / height;
  return 2 * Math.sin(middle) * Math.sin(Math.PI / (2 * height)) * (Math.PI / height);
}

/** A place in a row, 0 at its upper border, even in solid angle, at an azimuth. */
function directionIn(row: number, down: number, height: number, azimuth: number): [number, number, number] {
  // From the nearer pole, to be accurate there: 1 - cos of its two borders.
  const upper = 2 * row < height;
  const steps = upper ? row : height - 1 - row;
  const near = 2 * Math.sin((steps * Math.PI) / (2 * height)) ** 2;
  const far = 2 * Math.sin(((steps + 1) * Math.PI) / (2 * height)) ** 2;
  const lack = near + (upper ? down : 1 - down) * (far - near);
  const radius = Math.sqrt(lack * (2 - lack));
  return [radius * Math.cos(azimuth), radius * Math.sin(azimuth), (upper ? 1 : -1) * (1 - lack)];
}

/** Sums of chances from 0 to exactly 1. */
function sumsOf(chances: Float64Array): Float64Array {
  const sums = new Float64Array(chances.length + 1);
  for (let i = 0; i < chances.length; i++) sums[i + 1] = sums[i] + chances[i];
  const total = sums[chances.length];
  return sums.map((sum) => sum / total);
}

/** The interval of the sums that holds u, and the place in it, off its ends. */
function drawn(sums: Float64Array, u: number): [number, number] {
  let low = 0;
  let high = sums.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (sums[middle] <= u) low = middle;
    else high = middle;
  }
  const place = (u - sums[low]) / (sums[low + 1] - sums[low]);
  return [low, Math.min(place > MARGIN ? place : MARGIN, 1 - MARGIN)];
}
