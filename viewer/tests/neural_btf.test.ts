/** The decoder's texels against what NumPy decodes, and the state of a cloth. */

import { describe, expect, it } from "vitest";
import { latentTexels, upsideDown, vectorsOf, weightTexels, type Layer } from "../src/systems/neural_btf/decoder_texels";
import { levelTexels, stepped } from "../src/systems/neural_btf/packed_btf";
import { withState, type Settings } from "../src/systems/neural_btf/state";
import { shaderSource } from "../src/shaders";
import stored from "./neural_btf.json";

const PAPER = 106;
const STUDENT = 44;

/** As `written_decoder` of `tests/pipelines/neural_btf/test_stage_view.py`. */
function writtenLayers(hidden: number): Layer[] {
  const sizes = [12, hidden, hidden, hidden, 3];
  return [1, 2, 3, 4].map((layer) => {
    const [inputs, outputs] = [sizes[layer - 1], sizes[layer]];
    const weight = Float32Array.from({ length: inputs * outputs }, (_, n) => {
      const [row, column] = [Math.floor(n / inputs), n % inputs];
      return 0.25 * Math.sin(1 + 5 * layer + 1.7 * row + 0.9 * column * column);
    });
    const bias = Float32Array.from({ length: outputs }, (_, row) => 0.2 * Math.cos(3 * layer + 1.1 * row));
    return { weight, bias };
  });
}

/** What `btf_decoder.glsl` does, texel by texel. */
function decoded(hidden: number, latents: number[], light: number[], view: number[]): number[] {
  const layers = writtenLayers(hidden);
  const [{ width, data }, vectors] = [weightTexels(layers), vectorsOf(layers)];
  const texel = (column: number, row: number) => Array.from(data.subarray((row * width + column) * 4, (row * width + column) * 4 + 4));
  const neurons = (row: number, values: number[]) => {
    const sum = texel(4 * vectors, row);
    values.forEach((value, column) => texel(column, row).forEach((weight, n) => (sum[n] += weight * value)));
    return sum;
  };
  const place = ([x, y, z]: number[]) => [x / (1 + z), y / (1 + z)];
  let values = [...latents, ...place(light), ...place(view)];
  for (let layer = 0; layer < 3; layer++) {
    const rows = Array.from({ length: vectors }, (_, row) => neurons(vectors * layer + row, values));
    values = rows.flat().map((value) => Math.max(value, 0));
  }
  return neurons(3 * vectors, values).slice(0, 3);
}

describe("the decoder", () => {
  it.each([
    [PAPER, stored.colour],
    [STUDENT, stored.student_colour],
  ])("of %i neurons decodes from its texels what NumPy decodes", (hidden, colours) => {
    colours.forEach((colour, n) => {
      const found = decoded(hidden, stored.latents[n], stored.light[n], stored.view[n]);
      found.forEach((value, channel) => expect(value).toBeCloseTo(colour[channel], 4));
    });
    const swapped = decoded(hidden, stored.latents[0], stored.view[0], stored.light[0]);
    expect(Math.abs(swapped[0] - colours[0][0])).toBeGreaterThan(0.001);
  });

  it.each([
    [PAPER, [109, 82], 24383],
    [STUDENT, [45, 34], 4667],
  ])("of %i neurons has all weights in its texels, and nothing else", (hidden, size, count) => {
    const { width, height, data } = weightTexels(writtenLayers(hidden));
    expect([width, height]).toEqual(size);
    const all = writtenLayers(hidden).flatMap(({ weight, bias }) => [...weight, ...bias]);
    expect(all.length).toBe(count);
    const sum = (values: Iterable<number>) => [...values].reduce((so, value) => so + Math.abs(value), 0);
    expect(sum(data)).toBeCloseTo(sum(all), 6);
  });

  it.each([27, 11])("is written for WebGL with its sums unrolled, %i vectors", (vectors) => {
    const text = shaderSource("btf_decoder.glsl", { VECTORS: vectors, LATENT_VECTORS: 2 });
    expect(text.match(/fourInputs\(4 \* \d+, row, given/g)?.length).toBe(vectors);
    expect(text.match(/fourInputs\(4 \* \d+, row, latents/g)?.length).toBe(2);
  });
});

describe("latents", () => {
  it("are lines of texels, two a vector of eight", () => {
    const latents = Float32Array.from({ length: 8 * 1500 }, (_, n) => n);
    const { width, height, data } = latentTexels(latents, 8);
    expect([width, height]).toEqual([2048, 2]);
    expect(Array.from(data.subarray(0, latents.length))).toEqual(Array.from(latents));
  });

  it("are padded to whole texels, and begin none at a row's end", () => {
    const latents = Float32Array.from({ length: 10 * 700 }, (_, n) => n + 1);
    const { width, height, data } = latentTexels(latents, 10);
    expect([width, height]).toEqual([2046, 2]);
    expect(Array.from(data.subarray(12 * 682, 12 * 682 + 12))).toEqual([...latents.subarray(6820, 6830), 0, 0]);
  });

  it("are turned for a texture whose rows count from the bottom", () => {
    const picture = { width: 1, height: 3, channels: 2, data: Float32Array.of(0, 1, 2, 3, 4, 5) };
    expect([...upsideDown(picture).data]).toEqual([4, 5, 2, 3, 0, 1]);
  });
});

describe("a package's numbers", () => {
  it("are symbols times the steps of their columns, in float32", () => {
    const steps = Float32Array.of(0.1, 3);
    expect([...stepped(Int8Array.of(3, -2, -127, 1), steps)]).toEqual([Math.fround(3 * steps[0]), -6, Math.fround(-127 * steps[0]), 3]);
  });

  it("have levels down to one texel", () => {
    expect(levelTexels(2, 5)).toEqual([10, 3, 2, 1]);
    expect(levelTexels(1, 1)).toEqual([1]);
  });
});

describe("the state", () => {
  const settings: Settings = { light: [0, -1, 0], tiles: 4, exposure: 0 };

  it("takes parts, and makes the light a unit vector", () => {
    expect(withState(settings, { light: [0, 0, 5], exposure: -1.5 })).toEqual({ light: [0, 0, 1], tiles: 4, exposure: -1.5 });
  });

  it.each([
    [{ light: [0, 0, 0] }, "light is [0,0,0]; expected [x, y, z]."],
    [{ light: "up" }, 'light is "up"; expected [x, y, z].'],
    [{ tiles: -1 }, "tiles is -1; expected a positive number."],
    [{ exposure: null }, "exposure is null; expected a number."],
    [{ fill: 1 }, "state has fill; expected light, tiles, exposure."],
  ])("refuses %j", (state, sentence) => {
    expect(() => withState(settings, state)).toThrow(sentence);
  });
});
