/** Decoders and latents of a package as floats: its numbers times their steps. */

import { BadPackage } from "../../package/bad_package";
import type { Package } from "../../package/package";
import type { Layer } from "./decoder_texels";

/** Of `storage/packages/neural_btf.py`. */
const SCHEMA = 2;
const DIRECTIONS = 4;
const LAYERS = [1, 2, 3, 4];

/** What a package says of a material. */
export interface PackedBtf {
  /** Columns and rows of texels. */
  texels: [number, number];
  /** Latent vectors that texels share. */
  vectors: number;
  /** Latents of texels (texel, channels), then of the coarser levels, row by row. */
  latents: Float32Array;
  channels: number;
  /** The finest, and the coarser ones. */
  levels: number;
  decoder: Layer[];
  student?: Layer[];
  /** 9 x 2 factors. */
  parallax: number[];
  least: number;
  largest: number;
  alpha: number;
}

/** Numbers times steps, of which there is one for each column, as float32. */
export function stepped(numbers: ArrayLike<number>, steps: Float32Array): Float32Array {
  return Float32Array.from(numbers, (number, at) => number * steps[at % steps.length]);
}

/** Texels of each level from the finest to one texel. */
export function levelTexels(columns: number, rows: number): number[] {
  const texels = [columns * rows];
  while (columns > 1 || rows > 1) {
    [columns, rows] = [Math.ceil(columns / 2), Math.ceil(rows / 2)];
    texels.push(columns * rows);
  }
  return texels;
}

/** Reads all of it. Throws BadPackage for numbers that do not belong together. */
export async function packedBtf(pkg: Package): Promise<PackedBtf> {
  if (pkg.meta.schema !== SCHEMA) {
    throw new BadPackage(pkg.name, "schema", `${pkg.meta.schema}`, `${SCHEMA}: make the package again`);
  }
  const channels = pkg.shape("latents")[1];
  const columns = pkg.parameter("width");
  const rows = pkg.parameter("height");
  const [vectors, owners, coarser, decoder, student, parallax] = await Promise.all([
    steppedPart(pkg, "latents", "latent_steps"),
    pkg.has("ids") ? pkg.array("ids") : undefined,
    pkg.has("mips") ? steppedPart(pkg, "mips", "mip_steps") : new Float32Array(0),
    layersOf(pkg, "", channels),
    pkg.has("student_steps") ? layersOf(pkg, "student_", channels) : undefined,
    pkg.has("parallax") ? pkg.floats("parallax") : new Float32Array(18),
  ]);
  const [finest, ...coarse] = levelTexels(columns, rows);
  const wrong = (field: string, found: number, expected: string) => new BadPackage(pkg.name, field, `${found}`, expected);
  const texels = owners?.length ?? vectors.length / channels;
  if (texels !== finest) throw wrong("texels", texels, `${columns} x ${rows}`);
  const past = owners && Array.from(owners).find((owner) => owner >= vectors.length / channels);
  if (past !== undefined) throw wrong("ids", past, `less than ${vectors.length / channels}`);
  const expected = coarse.reduce((sum, count) => sum + count, 0);
  if (coarser.length && coarser.length !== channels * expected) {
    throw wrong("texels of coarser levels", coarser.length / channels, `${expected}`);
  }
  if (parallax.length !== 18) throw wrong("numbers of parallax", parallax.length, "9 x 2");
  const latents = new Float32Array(channels * finest + coarser.length);
  for (let texel = 0; texel < finest; texel++) {
    const from = channels * (owners ? owners[texel] : texel);
    latents.set(vectors.subarray(from, from + channels), channels * texel);
  }
  latents.set(coarser, channels * finest);
  return {
    texels: [columns, rows],
    vectors: vectors.length / channels,
    latents,
    channels,
    levels: coarser.length ? 1 + coarse.length : 1,
    decoder,
    student,
    parallax: Array.from(parallax),
    least: pkg.parameter("least"),
    largest: pkg.parameter("largest"),
    alpha: pkg.parameter("alpha"),
  };
}

async function steppedPart(pkg: Package, name: string, steps: string): Promise<Float32Array> {
  return stepped(await pkg.array(name), await pkg.floats(steps));
}

async function layersOf(pkg: Package, prefix: string, channels: number): Promise<Layer[]> {
  const steps = await pkg.floats(`${prefix}steps`);
  const layers = await Promise.all(
    LAYERS.map(async (n) => {
      const [weight, bias] = await Promise.all([pkg.array(`${prefix}weight_${n}`), pkg.array(`${prefix}bias_${n}`)]);
      const at = 2 * (n - 1);
      return { weight: stepped(weight, steps.subarray(at, at + 1)), bias: stepped(bias, steps.subarray(at + 1, at + 2)) };
    }),
  );
  const hidden = layers[0].bias.length;
  const sizes = [channels + DIRECTIONS, hidden, hidden, hidden, 3];
  layers.forEach(({ weight, bias }, n) => {
    if (bias.length !== sizes[n + 1] || weight.length !== sizes[n] * sizes[n + 1]) {
      const expected = `${sizes[n + 1]} of ${sizes[n]} inputs`;
      throw new BadPackage(pkg.name, `${prefix}layer ${n + 1}`, `${bias.length} neurons, ${weight.length} weights`, expected);
    }
  });
  return layers;
}
