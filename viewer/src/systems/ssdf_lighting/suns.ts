/** Suns in a map of radiance, after `light/suns.py`: small, bright, found in the map as it is. */

import { Sphere, type Environment } from "./sphere_map";

const SUN_RADIUS = (0.2665 * Math.PI) / 180;
const MOST_RADIUS = (3 * Math.PI) / 180;
const EDGE = 0.05;
const LEAST_SHARE = 0.003;
const AT_EDGES = 2; // as of `light/spherical_gaussians.py`
const LUMINANCE = [0.2126, 0.7152, 0.0722];

/** A Gaussian of the width, place and flux of a sun. */
export interface Sun {
  axis: number[];
  sharpness: number;
  /** (3). */
  amplitude: number[];
}

/** Takes up to `most` suns out of a map; with the rest they have the map's flux. */
export function splitSuns({ height, data }: Environment, most: number): { suns: Sun[]; rest: Float64Array } {
  const rest = Float64Array.from(data);
  const sphere = new Sphere(height);
  const whole = luminance(sphere.flux(rest));
  const suns: Sun[] = [];
  while (suns.length < most) {
    const found = brightest(rest, sphere);
    if (!found || luminance(found.flux) < LEAST_SHARE * whole) break;
    found.texels.forEach((p, k) => {
      for (let channel = 0; channel < 3; channel++) rest[3 * p + channel] -= found.above[k][channel];
    });
    const unit = unitFlux(found.sharpness);
    suns.push({ axis: found.axis, sharpness: found.sharpness, amplitude: found.flux.map((value) => value / unit) });
  }
  return { suns, rest };
}

/** (N) and (N, 3): lights as distances with an error (radians) show them, each with its flux. */
export function softened(sharpness: Float32Array, amplitudes: Float32Array, rmse: number) {
  const soft = sharpness.map((sharp) => 1 / (1 / sharp + (AT_EDGES * rmse) ** 2));
  const kept = soft.map((sharp, k) => unitFlux(sharpness[k]) / unitFlux(sharp));
  return { sharpness: soft, amplitudes: amplitudes.map((value, k) => value * kept[Math.floor(k / 3)]) };
}

/** Integral over the sphere of a Gaussian of amplitude 1. */
function unitFlux(sharpness: number): number {
  return (-2 * Math.PI * Math.expm1(-2 * sharpness)) / sharpness;
}

function luminance(colour: ArrayLike<number>): number {
  return LUMINANCE.reduce((sum, weight, channel) => sum + weight * colour[channel], 0);
}

/** The sun about the brightest texel, or nothing where that is part of something wide. */
function brightest(map: Float64Array, { height, count, ways, omega }: Sphere) {
  const bright = (p: number) => luminance([map[3 * p], map[3 * p + 1], map[3 * p + 2]]);
  let peak = 0;
  for (let p = 1; p < count; p++) if (bright(p) > bright(peak)) peak = p;
  const texel = Math.PI / height;
  const centre = ways.subarray(3 * peak, 3 * peak + 3);
  const width = 2 * height;
  const reach = Math.trunc((2 * MOST_RADIUS) / texel) + 2;
  const row = Math.floor(peak / width);
  const near: { p: number; off: number }[] = [];
  for (let p = Math.max(0, row - reach) * width; p < Math.min(height, row + reach + 1) * width; p++) {
    const chord = Math.hypot(ways[3 * p] - centre[0], ways[3 * p + 1] - centre[1], ways[3 * p + 2] - centre[2]);
    near.push({ p, off: 2 * Math.asin(Math.min(chord / 2, 1)) });
  }
  const radius = radiusOf(near, bright, bright(peak), texel);
  if (radius === undefined || texel > MOST_RADIUS) return undefined;
  const ring = near.filter(({ off }) => off > radius && off <= 1.5 * radius + texel);
  const around = [0, 1, 2].map((channel) => median(ring.map(({ p }) => map[3 * p + channel])));
  const texels = near.filter(({ off }) => off <= radius).map(({ p }) => p);
  const above = texels.map((p) => around.map((value, channel) => Math.max(map[3 * p + channel] - value, 0)));
  const flux = [0, 1, 2].map((channel) => texels.reduce((sum, p, k) => sum + above[k][channel] * omega[p], 0));
  const weights = texels.map((p, k) => (above[k][0] + above[k][1] + above[k][2]) * omega[p]);
  const total = weights.reduce((sum, value) => sum + value, 0);
  if (!total) return undefined;
  const mean = [0, 1, 2].map((c) => texels.reduce((sum, p, k) => sum + (weights[k] / total) * ways[3 * p + c], 0));
  const axis = mean.map((value) => value / Math.hypot(...mean));
  const spread = texels.reduce((sum, p, k) => {
    const cosine = axis.reduce((part, value, c) => part + value * ways[3 * p + c], 0);
    return sum + (weights[k] / total) * (1 - cosine);
  }, texel ** 2 / 12); // a texel has a width itself
  const sharpness = Math.min(1 / Math.max(spread, 1e-30), 4 / SUN_RADIUS ** 2);
  return { axis, sharpness, flux, texels, above };
}

/** How far from the peak the mean of a ring has faded. */
function radiusOf(
  near: { p: number; off: number }[],
  bright: (p: number) => number,
  peak: number,
  texel: number,
): number | undefined {
  const last = Math.trunc((2 * MOST_RADIUS) / texel) + 2;
  const sums = new Float64Array(last + 1);
  const counts = new Float64Array(last + 1);
  for (const { p, off } of near) {
    const ring = Math.min(Math.floor(off / texel + 0.5), last);
    sums[ring] += bright(p);
    counts[ring]++;
  }
  const means = sums.map((sum, ring) => sum / Math.max(counts[ring], 1));
  const inner = Math.max(1, Math.ceil(MOST_RADIUS / texel));
  const floor = Math.min(...means.slice(1, last).slice(0, 2 * inner));
  const faded = means.slice(0, inner + 1).findIndex((mean) => mean <= floor + EDGE * (peak - floor));
  return faded < 0 ? undefined : (faded + 0.5) * texel;
}

function median(values: number[]): number {
  const sorted = [...values].sort((a, b) => a - b);
  const middle = sorted.length >> 1;
  return sorted.length % 2 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
}
