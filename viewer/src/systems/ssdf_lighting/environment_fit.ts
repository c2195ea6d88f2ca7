/**
 * Spherical Gaussians fitted to an environment, after `light/environment_fit.py`: lights are placed
 * one by one where they help most and refined together by Levenberg and Marquardt's method; at last
 * their amplitudes follow from nonnegative least squares of the irradiance behind random occluders,
 * with the flux given. Suns are taken out of the map before (`suns.ts`). Here lights are placed
 * on a map of half the height, and the last refinement takes fewer steps.
 */

import { Matrix, nonnegative, solved } from "./least_squares";
import { splitSuns, type Sun } from "./suns";
import { Sphere, blurred, downsampled, type Environment } from "./sphere_map";

/** An environment as a sum of N Gaussians. */
export interface Lights {
  /** (N, 3), unit vectors. */
  axes: Float64Array;
  /** (N). */
  sharpness: Float64Array;
  /** (N, 3), linear radiance. */
  amplitudes: Float64Array;
}

/** Lights, and how far they are from the map. */
export interface Fit {
  lights: Lights;
  /** Relative RMS error of the irradiance over all normals. */
  irradianceError: number;
}

const HEIGHT = 64;
const PLACING = 32;
const BLUR = 100;
const PLACES = 400;
const SHARPNESSES = 7;
const STEPS = 5;
const LAST_STEPS = 30;
const ENOUGH = 1e-6;
const FLUX_WEIGHT = 1e3;
const LIGHTS_A_SUN = 3;
const OCCLUDERS = 384;
const SOFT = 0.05; // radians
const SHARPEST = 600; // that texels of the map can show
const LUMINANCE = [0.2126, 0.7152, 0.0722];

/** Blurred lights: axes (N, 3), log of the sharpness (N), square roots of amplitudes (N, 3). */
interface Blobs {
  axes: number[][];
  rates: number[];
  roots: number[][];
}

/** What is fitted: blurred radiance (P, 3) on a sphere, weights (P) of differences. */
interface Target {
  sphere: Sphere;
  soft: Float64Array;
  weights: Float64Array;
}

/**
 * Fits `count` lights whose λ lies between the bounds; their flux is the map's. Wide lights are shaded
 * worst, and few lights have to be wide: 8 of 24, 3 of the smallest package's 6, as in the graph.
 */
export function fitLights(given: Environment, count: number, least = Math.max(3, count / 3), most = 1000): Fit {
  const { suns, rest } = splitSuns(given, Math.floor(count / LIGHTS_A_SUN));
  const map = downsampled({ height: given.height, data: rest }, HEIGHT);
  const sphere = new Sphere(HEIGHT);
  const fluxes = sphere.flux(map.data);
  const level = (fluxes[0] + fluxes[1] + fluxes[2]) / 3 / (4 * Math.PI) || 1;
  const values = Float64Array.from(map.data, (value) => value / level);
  const blur = 1 / (1 / BLUR + 1 / most);
  const soft = blurred(values, sphere, blur);
  const target = targetOf(sphere, soft);
  const small = new Sphere(PLACING);
  const coarse = targetOf(small, downsampled({ height: HEIGHT, data: soft }, PLACING).data);
  const bounds: [number, number] = [Math.log(1 / (1 / least + 1 / blur)), Math.log(blur)];
  let blobs = placed(coarse, count - suns.length, bounds);
  blobs = refined(target, blobs, bounds, LAST_STEPS);
  const sharpness = Float64Array.from(blobs.rates, (rate) => {
    const variance = Math.exp(-rate) - 1 / blur;
    return Math.min(Math.max(1 / Math.max(variance, 1e-300), least), most);
  });
  const unit = fluxes.map((flux) => flux / level);
  const amplitudes = withFlux(target, blobs, sharpness, unit);
  const axes = Float64Array.from(blobs.axes.flat());
  const wider = { axes, sharpness, amplitudes: amplitudes.map((value) => value * level) };
  const irradianceError = errorOfIrradiance(wider, map.data, suns, sphere);
  return { lights: withSuns(wider, suns), irradianceError };
}

function withSuns({ axes, sharpness, amplitudes }: Lights, suns: Sun[]): Lights {
  return {
    axes: Float64Array.from([...axes, ...suns.flatMap(({ axis }) => axis)]),
    sharpness: Float64Array.from([...sharpness, ...suns.map((sun) => sun.sharpness)]),
    amplitudes: Float64Array.from([...amplitudes, ...suns.flatMap(({ amplitude }) => amplitude)]),
  };
}

/** Surfaces, each behind a soft edge: what they see (P) of light from everywhere, times omega. */
function occluders({ count, ways, omega }: Sphere): Float32Array[] {
  let state = 1;
  const random = () => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 2 ** 32;
  const somewhere = () => {
    const z = 2 * random() - 1;
    const azimuth = 2 * Math.PI * random();
    const radius = Math.sqrt(1 - z * z);
    return [radius * Math.cos(azimuth), radius * Math.sin(azimuth), z];
  };
  return Array.from({ length: OCCLUDERS }, () => {
    const [normal, edge] = [somewhere(), somewhere()];
    const seen = new Float32Array(count);
    for (let p = 0; p < count; p++) {
      const [x, y, z] = [ways[3 * p], ways[3 * p + 1], ways[3 * p + 2]];
      const cosine = normal[0] * x + normal[1] * y + normal[2] * z;
      if (cosine <= 0) continue;
      const step = 0.5 + 0.5 * Math.tanh((edge[0] * x + edge[1] * y + edge[2] * z) / SOFT);
      seen[p] = cosine * step * omega[p];
    }
    return seen;
  });
}

/** Radiance (3) of lights in a direction. */
export function radianceOf({ axes, sharpness, amplitudes }: Lights, [x, y, z]: Float64Array | number[]): number[] {
  const found = [0, 0, 0];
  sharpness.forEach((sharp, k) => {
    const cosine = x * axes[3 * k] + y * axes[3 * k + 1] + z * axes[3 * k + 2];
    const value = Math.exp(sharp * (cosine - 1));
    for (let channel = 0; channel < 3; channel++) found[channel] += value * amplitudes[3 * k + channel];
  });
  return found;
}

/** Integral over the sphere of a Gaussian of amplitude 1. */
export function integral(sharpness: number): number {
  return (-2 * Math.PI * Math.expm1(-2 * sharpness)) / sharpness;
}

function targetOf(sphere: Sphere, soft: Float64Array): Target {
  const bright = Float64Array.from({ length: sphere.count }, (_, p) =>
    LUMINANCE.reduce((sum, weight, channel) => sum + weight * soft[3 * p + channel], 0),
  );
  const mean = bright.reduce((sum, value, p) => sum + value * sphere.omega[p], 0) / (4 * Math.PI);
  return { sphere, soft, weights: bright.map((value, p) => Math.sqrt(sphere.omega[p] / (value + mean))) };
}

/** One light after the other, each where it takes most of what is left, all refined then. */
function placed(target: Target, count: number, bounds: [number, number]): Blobs {
  const { sphere, soft, weights } = target;
  const places = spiral(PLACES);
  const rates = Array.from({ length: SHARPNESSES }, (_, k) => bounds[0] + ((bounds[1] - bounds[0]) * k) / (SHARPNESSES - 1));
  const tried = rates.flatMap((rate) => places.map((axis) => ({ rate, axis })));
  const book = tried.map(({ rate, axis }) => Float32Array.from(valuesOf(sphere, axis, rate)));
  const norms = book.map((own) => own.reduce((sum, value, p) => sum + (value * weights[p]) ** 2, 0));
  let blobs: Blobs = { axes: [], rates: [], roots: [] };
  const left = Float32Array.from(soft);
  const weighted = new Float32Array(left.length);
  for (let number = 0; number < count; number++) {
    for (let k = 0; k < left.length; k++) weighted[k] = left[k] * weights[(k / 3) | 0] ** 2;
    let best = 0;
    let most = -1;
    book.forEach((own, k) => {
      const [r, g, b] = correlated(own, weighted);
      const gain = (Math.max(r, 0) ** 2 + Math.max(g, 0) ** 2 + Math.max(b, 0) ** 2) / norms[k];
      if (gain > most) [most, best] = [gain, k];
    });
    const axes = [...blobs.axes, tried[best].axis];
    const every = [...blobs.rates, tried[best].rate];
    const amplitudes = fittedAmplitudes(target, axes.map((axis, k) => valuesOf(sphere, axis, every[k])));
    const roots = amplitudes.map((own) => own.map(Math.sqrt));
    blobs = refined(target, { axes, rates: every, roots }, bounds, STEPS);
    left.set(soft);
    subtract(left, sphere, blobs);
  }
  return blobs;
}

function correlated(own: Float32Array, weighted: Float32Array): [number, number, number] {
  let [r, g, b] = [0, 0, 0];
  for (let p = 0, k = 0; p < own.length; p++, k += 3) {
    r += own[p] * weighted[k];
    g += own[p] * weighted[k + 1];
    b += own[p] * weighted[k + 2];
  }
  return [r, g, b];
}

function subtract(left: Float32Array | Float64Array, sphere: Sphere, blobs: Blobs): void {
  blobs.axes.forEach((axis, light) => {
    const values = valuesOf(sphere, axis, blobs.rates[light]);
    const [r, g, b] = blobs.roots[light].map((root) => root * root);
    for (let p = 0, k = 0; p < values.length; p++, k += 3) {
      left[k] -= values[p] * r;
      left[k + 1] -= values[p] * g;
      left[k + 2] -= values[p] * b;
    }
  });
}

/** A Gaussian of amplitude 1 on the sphere. */
function valuesOf(sphere: Sphere, [x, y, z]: number[], rate: number): Float64Array {
  const sharp = Math.exp(rate);
  const { ways } = sphere;
  const found = new Float64Array(sphere.count);
  for (let p = 0, k = 0; p < found.length; p++, k += 3) {
    found[p] = Math.exp(sharp * (x * ways[k] + y * ways[k + 1] + z * ways[k + 2] - 1));
  }
  return found;
}

/** Amplitudes (N, 3) >= 0 with which functions come nearest to the target. */
function fittedAmplitudes({ soft, weights }: Target, functions: Float64Array[]): number[][] {
  const own = functions.map((values) => values.map((value, p) => value * weights[p]));
  const gram = Matrix.gram(own);
  const channels = [0, 1, 2].map((channel) =>
    nonnegative(
      gram,
      own.map((values) => values.reduce((sum, value, p) => sum + value * weights[p] * soft[3 * p + channel], 0)),
    ),
  );
  return own.map((_, light) => channels.map((values) => values[light]));
}

/** Amplitudes (N, 3) of the lights before the blur, flux and all. */
function withFlux({ soft, sphere }: Target, blobs: Blobs, sharpness: Float64Array, fluxes: number[]): Float64Array {
  const integrals = Array.from(sharpness, integral);
  const behind = occluders(sphere);
  const own = blobs.axes.map((axis, light) => {
    const share = integrals[light] / integral(Math.exp(blobs.rates[light]));
    const values = valuesOf(sphere, axis, blobs.rates[light]);
    return Float64Array.from(behind, (seen) => share * seen.reduce((sum, part, p) => sum + part * values[p], 0));
  });
  const seenOfMap = behind.map((seen) =>
    [0, 1, 2].map((channel) => seen.reduce((sum, part, p) => sum + part * soft[3 * p + channel], 0)),
  );
  const norm = (rows: ArrayLike<number>[]) =>
    Math.sqrt(rows.reduce((sum, row) => sum + Array.from(row).reduce((part, value) => part + value * value, 0), 0));
  const heavy = (FLUX_WEIGHT * norm(own)) / norm([integrals]);
  const gram = Matrix.gram(own);
  const count = own.length;
  for (let i = 0; i < count; i++) {
    for (let j = 0; j < count; j++) gram.add(i, j, heavy * heavy * integrals[i] * integrals[j]);
  }
  const found = new Float64Array(3 * count);
  for (let channel = 0; channel < 3; channel++) {
    const wanted = own.map(
      (values, light) =>
        values.reduce((sum, value, k) => sum + value * seenOfMap[k][channel], 0) +
        heavy * heavy * integrals[light] * fluxes[channel],
    );
    const amplitudes = nonnegative(gram, wanted);
    const reached = amplitudes.reduce((sum, value, light) => sum + value * integrals[light], 0);
    amplitudes.forEach((value, light) => (found[3 * light + channel] = (value * fluxes[channel]) / Math.max(reached, 1e-300)));
  }
  return found;
}

/** Levenberg and Marquardt's method for axes, sharpnesses and amplitudes of all lights. */
function refined(target: Target, given: Blobs, bounds: [number, number], steps: number): Blobs {
  const count = given.axes.length;
  const least = 1e-3 * Math.max(...given.roots.flat(), 1e-300);
  let blobs: Blobs = { ...given, roots: given.roots.map((own) => own.map((root) => Math.max(root, least))) };
  let damping = 1e-2;
  let cost = costOf(target, blobs);
  for (let step = 0; step < steps; step++) {
    const frames = blobs.axes.map(across);
    const { matrix, slope } = normalEquations(target, blobs, frames);
    const free: number[] = [];
    for (let k = 0; k < 6 * count; k++) {
      const rate = k - 2 * count;
      const isHeld =
        rate >= 0 &&
        rate < count &&
        ((blobs.rates[rate] <= bounds[0] && slope[k] > 0) || (blobs.rates[rate] >= bounds[1] && slope[k] < 0));
      if (!isHeld) free.push(k);
    }
    const before = cost;
    const largest = Math.max(...free.map((k) => matrix.at(k, k)));
    while (damping < 1e6) {
      const part = matrix.part(free);
      free.forEach((k, i) => part.add(i, i, damping * (matrix.at(k, k) + 1e-9 * largest)));
      const found = solved(part, free.map((k) => -slope[k]));
      const move = new Float64Array(6 * count);
      free.forEach((k, i) => (move[k] = found[i]));
      const moved = movedBy(blobs, move, frames, bounds);
      const reached = costOf(target, moved);
      if (reached < cost) {
        [blobs, cost] = [moved, reached];
        break;
      }
      damping *= 4;
    }
    if (before - cost <= ENOUGH * before) break;
    damping = Math.max(damping / 5, 1e-9);
  }
  return blobs;
}

/** Two unit vectors that stand on an axis and on each other. */
function across(axis: number[]): [number[], number[]] {
  const one = unit(cross(axis, Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
  return [one, cross(axis, one)];
}

function movedBy(blobs: Blobs, move: Float64Array, frames: [number[], number[]][], bounds: [number, number]): Blobs {
  const count = blobs.axes.length;
  return {
    axes: blobs.axes.map((axis, k) =>
      unit(axis.map((value, c) => value + move[k] * frames[k][0][c] + move[count + k] * frames[k][1][c])),
    ),
    rates: blobs.rates.map((rate, k) => {
      const step = Math.min(Math.max(move[2 * count + k], -1), 1);
      return Math.min(Math.max(rate + step, bounds[0]), bounds[1]);
    }),
    roots: blobs.roots.map((own, k) => own.map((root, c) => root + move[(3 + c) * count + k])),
  };
}

function costOf({ sphere, soft, weights }: Target, blobs: Blobs): number {
  const left = Float64Array.from(soft);
  subtract(left, sphere, blobs);
  let cost = 0;
  for (let p = 0, k = 0; p < weights.length; p++, k += 3) {
    cost += weights[p] ** 2 * (left[k] ** 2 + left[k + 1] ** 2 + left[k + 2] ** 2);
  }
  return cost;
}

/** J^T J and J^T r; unknowns: moves along the frames, logs of sharpness, roots of red, green, blue. */
function normalEquations({ sphere, soft, weights }: Target, blobs: Blobs, frames: [number[], number[]][]) {
  const count = blobs.axes.length;
  const { ways } = sphere;
  const values = blobs.axes.map((axis, k) => valuesOf(sphere, axis, blobs.rates[k]).map((value, p) => value * weights[p]));
  const rest = Float64Array.from(soft);
  subtract(rest, sphere, blobs);
  for (let k = 0; k < rest.length; k++) rest[k] *= -weights[(k / 3) | 0];
  const along = (axis: number[], p: number) =>
    axis[0] * ways[3 * p] + axis[1] * ways[3 * p + 1] + axis[2] * ways[3 * p + 2];
  const steep = (k: number, factor: (p: number) => number) => {
    const sharp = Math.exp(blobs.rates[k]);
    return values[k].map((value, p) => value * sharp * factor(p));
  };
  const functions = [
    ...values.map((_, k) => steep(k, (p) => along(frames[k][0], p))),
    ...values.map((_, k) => steep(k, (p) => along(frames[k][1], p))),
    ...values.map((_, k) => steep(k, (p) => along(blobs.axes[k], p) - 1)),
    ...values,
  ];
  const products = Matrix.gram(functions);
  const onto = functions.map((own) => correlatedExactly(own, rest));
  const matrix = new Matrix(6 * count);
  const slope = new Float64Array(6 * count);
  for (let channel = 0; channel < 3; channel++) {
    const factor = (k: number) => {
      const root = blobs.roots[k % count][channel];
      return k < 3 * count ? root * root : 2 * root;
    };
    const unknown = (k: number) => (k < 3 * count ? k : k + channel * count);
    for (let i = 0; i < 4 * count; i++) {
      slope[unknown(i)] += factor(i) * onto[i][channel];
      for (let j = 0; j < 4 * count; j++) {
        matrix.add(unknown(i), unknown(j), factor(i) * factor(j) * products.at(i, j));
      }
    }
  }
  return { matrix, slope };
}

function correlatedExactly(own: Float64Array, rest: Float64Array): number[] {
  const found = [0, 0, 0];
  for (let p = 0; p < own.length; p++) {
    for (let channel = 0; channel < 3; channel++) found[channel] += own[p] * rest[3 * p + channel];
  }
  return found;
}

/** Relative RMS error of irradiance over 512 normals. */
function errorOfIrradiance(soft: Lights, map: ArrayLike<number>, suns: Sun[], sphere: Sphere): number {
  const normals = new Sphere(16);
  // Suns are exact; as wide as texels, they are part of both.
  const wide = suns.map((sun) => {
    const sharpness = Math.min(sun.sharpness, SHARPEST);
    const kept = integral(sun.sharpness) / integral(sharpness);
    return { ...sun, sharpness, amplitude: sun.amplitude.map((value) => value * kept) };
  });
  const lights = withSuns(soft, wide);
  const none = { axes: new Float64Array(), sharpness: new Float64Array(), amplitudes: new Float64Array() };
  const values = Float64Array.from(map);
  for (let p = 0; p < sphere.count; p++) {
    const ofSuns = radianceOf(withSuns(none, wide), sphere.ways.subarray(3 * p, 3 * p + 3));
    ofSuns.forEach((value, channel) => (values[3 * p + channel] += value));
  }
  const again = Float64Array.from({ length: 3 * sphere.count });
  for (let p = 0; p < sphere.count; p++) again.set(radianceOf(lights, sphere.ways.subarray(3 * p, 3 * p + 3)), 3 * p);
  let [off, whole] = [0, 0];
  for (let n = 0; n < normals.count; n++) {
    const [x, y, z] = normals.ways.subarray(3 * n, 3 * n + 3);
    const found = [0, 0, 0];
    const wanted = [0, 0, 0];
    for (let p = 0, k = 0; p < sphere.count; p++, k += 3) {
      const cosine = x * sphere.ways[k] + y * sphere.ways[k + 1] + z * sphere.ways[k + 2];
      if (cosine <= 0) continue;
      const share = cosine * sphere.omega[p];
      for (let channel = 0; channel < 3; channel++) {
        found[channel] += share * again[k + channel];
        wanted[channel] += share * values[k + channel];
      }
    }
    for (let channel = 0; channel < 3; channel++) {
      off += normals.omega[n] * (found[channel] - wanted[channel]) ** 2;
      whole += normals.omega[n] * wanted[channel] ** 2;
    }
  }
  return Math.sqrt(off / whole);
}

/** Unit vectors, even over the sphere: Fibonacci's spiral. */
function spiral(count: number): number[][] {
  return Array.from({ length: count }, (_, k) => {
    const z = 1 - (2 * (k + 0.5)) / count;
    const azimuth = (k + 0.5) * Math.PI * (3 - Math.sqrt(5));
    const radius = Math.sqrt(1 - z * z);
    return [radius * Math.cos(azimuth), radius * Math.sin(azimuth), z];
  });
}

function cross([a, b, c]: number[], [x, y, z]: number[]): number[] {
  return [b * z - c * y, c * x - a * z, a * y - b * x];
}

function unit(vector: number[]): number[] {
  const length = Math.hypot(...vector);
  return vector.map((value) => value / length);
}
