/** The decoder and the fit against values of Python (`python -m tests.viewer.ssdf_fixture`). */

import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";
import { clusterColour } from "../src/systems/ssdf_lighting/clusters";
import { readCompactFile } from "../src/systems/ssdf_lighting/compact_file";
import { tablesOfCodes, tablesOfPaper, type DistanceTables } from "../src/systems/ssdf_lighting/distance_tables";
import { fitLights, integral } from "../src/systems/ssdf_lighting/environment_fit";
import { bounced } from "../src/systems/ssdf_lighting/interreflection";
import { halved } from "../src/systems/ssdf_lighting/half_resolution";
import { Matrix, nonnegative, solved } from "../src/systems/ssdf_lighting/least_squares";
import { COLUMNS, FINE, mattTables, scaledBessel0, scaledBessel1 } from "../src/systems/ssdf_lighting/lobe_tables";
import { readRadiance } from "../src/systems/ssdf_lighting/probe_files";
import { Sphere, downsampled } from "../src/systems/ssdf_lighting/sphere_map";
import { softened, splitSuns } from "../src/systems/ssdf_lighting/suns";

const known = JSON.parse(readFileSync(new URL("./ssdf_lighting.json", import.meta.url), "utf8"));
const file = new Uint8Array(Buffer.from(known.file, "base64"));

/** d of a vertex in all directions, as the shader adds it up. */
function distancesOf({ vectors, weights, sources, resolution }: DistanceTables, vertex: number): number[] {
  const [start, width, first] = sources.subarray(4 * vertex, 4 * vertex + 3);
  return Array.from({ length: resolution ** 2 }, (_, direction) => {
    let sum = 0;
    for (let k = 0; k < 4 * width; k++) sum += (vectors[4 * (start + direction * width) + k] / 255) * weights[4 * first + k];
    return sum;
  });
}

describe("the compact file", () => {
  it("is decoded bit by bit as by Python", () => {
    const codes = readCompactFile(file);
    const hash = createHash("sha256");
    const { shared, sharedLevel, centre, basis, level, ranks, cluster, weights } = codes;
    for (const part of [shared, sharedLevel, centre, basis, level, ranks, cluster, weights]) {
      hash.update(new Uint8Array(part.slice().buffer));
    }
    expect(hash.digest("hex")).toBe(known.codes);
    expect(codes.step).toBe(known.step);
  });

  it("means the distances that it means in Python", () => {
    const tables = tablesOfCodes(readCompactFile(file), Float32Array.from(known.root_weight));
    known.distances.forEach((expected: number[], k: number) => {
      const found = distancesOf(tables, 9 * k);
      // Columns are rounded to bytes.
      const squares = found.map((value, direction) => (value - expected[direction]) ** 2);
      expect(Math.max(...squares)).toBeLessThan(0.02 ** 2);
      expect(squares.reduce((sum, each) => sum + each, 0) / squares.length).toBeLessThan(0.004 ** 2);
    });
    const off = distancesOf(tables, 0).reduce((sum, value, k) => sum + Math.abs(value - known.distances[1][k]), 0);
    expect(off).toBeGreaterThan(1);
  });

  it("is refused where it is cut, altered or none", () => {
    expect(() => readCompactFile(file.subarray(0, 30))).toThrow("no compact SSDFs");
    expect(() => readCompactFile(file.subarray(0, file.length - 40))).toThrow(/cut|damaged/);
    expect(() => readCompactFile(new Uint8Array(100))).toThrow("no compact SSDFs");
    const huge = file.slice();
    huge.fill(255, 20, 40);
    expect(() => readCompactFile(huge)).toThrow("announces what it cannot hold");
  });
});

it("halves rows of directions as Python", () => {
  const rows = known.halved_rows.map((row: number[]) => Float32Array.from(row));
  const found = halved(rows, Float32Array.from(known.halved_root_weight));
  known.halved.forEach((row: number[], k: number) => {
    row.forEach((value, place) => expect(Math.abs(found[k][place] - value)).toBeLessThan(1e-3));
  });
  expect(Math.abs(found[0][5] - known.halved[1][5])).toBeGreaterThan(0.01);
});

it("takes the first row of a vertex in the paper's form", () => {
  const form = {
    directions: 4,
    vectors: Float32Array.from([1, 2, 3, 4, 10, 20, 30, 40]),
    first: Int32Array.from([0, 1, 2]),
    rowVertex: Int32Array.from([0, 1, 1, 2]),
    rowFirst: Int32Array.from([0, 2, 4]),
    weights: Float32Array.from([0.5, 2, 7, 3]),
  };
  const tables = tablesOfPaper(form, 3);
  expect([0, 1, 2].map((vertex) => distancesOf(tables, vertex))).toEqual([
    [0.5, 1, 1.5, 2],
    [2, 4, 6, 8],
    [30, 60, 90, 120],
  ]);
});

it("makes the tables of the matt lobes", () => {
  const { axes, radiance } = mattTables(known.sharpness);
  known.sharpness.forEach((_: number, light: number) => {
    known.columns.forEach((column: number, k: number) => {
      const at = 4 * (light * COLUMNS + column);
      known.axes[light][k].forEach((value: number, i: number) => {
        expect(axes[at + i] / value - 1).toBeCloseTo(0, 3);
      });
    });
    known.matt[light].forEach((row: number[], k: number) => {
      const at = 4 * (light * (FINE + 1) + 256 * k);
      row.forEach((value, i) => expect(Math.abs(radiance[at + i] - value)).toBeLessThan(1e-4 * Math.max(1, value)));
    });
  });
});

it("knows Bessel's functions", () => {
  // Abramowitz and Stegun, table 9.8.
  expect(scaledBessel0(1)).toBeCloseTo(0.4657596077, 9);
  expect(scaledBessel1(1)).toBeCloseTo(0.2079104154, 9);
  expect(scaledBessel0(20)).toBeCloseTo(0.0897803119, 9);
  expect(scaledBessel1(20)).toBeCloseTo(0.0875062222, 9);
});

describe("the fit", () => {
  const environment = { height: 16, data: Float64Array.from(known.environment) };

  it("is about as near as Python's, and keeps the flux", () => {
    const { lights, irradianceError } = fitLights(environment, 6);
    expect(irradianceError).toBeLessThan(1.3 * known.irradiance_error + 0.003);
    const wanted = new Sphere(64).flux(downsampled(environment, 64).data);
    wanted.forEach((flux, channel) => {
      const found = lights.sharpness.reduce((sum, sharp, k) => sum + integral(sharp) * lights.amplitudes[3 * k + channel], 0);
      expect(found / flux).toBeCloseTo(1, 6);
    });
  }, 120_000);

  it("keeps the flux of a map of another height", () => {
    const before = new Sphere(16).flux(environment.data);
    for (const height of [5, 8, 40]) {
      const after = new Sphere(height).flux(downsampled(environment, height).data);
      before.forEach((flux, channel) => expect(after[channel] / flux).toBeCloseTo(1, 9));
    }
  });
});

describe("suns", () => {
  const { height, discs, axes, sharpness, amplitudes } = known.suns;
  const { ways, count } = new Sphere(height);
  const data = new Float64Array(3 * count).fill(0.5);
  for (const [azimuth, elevation, radius, value] of discs as number[][]) {
    const [a, e] = [(azimuth * Math.PI) / 180, (elevation * Math.PI) / 180];
    const axis = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
    for (let p = 0; p < count; p++) {
      const cosine = axis.reduce((sum, part, c) => sum + part * ways[3 * p + c], 0);
      if (cosine <= Math.cos((radius * Math.PI) / 180)) continue;
      [1, 0.8, 0.5].forEach((tint, channel) => (data[3 * p + channel] += value * tint));
    }
  }

  it("are found where and as wide as by Python, and leave nothing behind", () => {
    const { suns, rest } = splitSuns({ height, data }, 4);
    expect(suns.length).toBe(sharpness.length);
    suns.forEach((sun, k) => {
      sun.axis.forEach((value, c) => expect(value).toBeCloseTo(axes[k][c], 9));
      expect(sun.sharpness / sharpness[k]).toBeCloseTo(1, 6);
      sun.amplitude.forEach((value, c) => expect(value / amplitudes[k][c]).toBeCloseTo(1, 6));
    });
    expect(Math.max(...rest)).toBeCloseTo(0.5, 9);
  });

  it("are as soft as in Python where distances have an error", () => {
    const found = softened(Float32Array.from(sharpness), Float32Array.from(amplitudes.flat()), 0.006);
    found.sharpness.forEach((value, k) => expect(value / known.suns.soft_sharpness[k]).toBeCloseTo(1, 5));
    found.amplitudes.forEach((value, k) => expect(value / known.suns.soft_amplitudes.flat()[k]).toBeCloseTo(1, 5));
    expect(found.sharpness[0]).toBeLessThan(0.8 * sharpness[0]);
  });

  it("are as many as asked for, brightest first", () => {
    const { suns, rest } = splitSuns({ height, data }, 1);
    expect(suns.length).toBe(1);
    expect(Math.max(...rest)).toBeCloseTo(900.5, 6);
  });
});

it("gathers reflected light as Python does", () => {
  const { codes, steps, vectors, between, albedo, samples, direct, found } = known.bounce;
  const factors = {
    codes: Int8Array.from(codes),
    steps: Float32Array.from(steps),
    vectors: Float32Array.from(vectors),
    between: Float32Array.from(between),
    albedo: Float32Array.from(albedo),
    samples: Int32Array.from(samples),
  };
  const light = bounced(factors, Float64Array.from(direct));
  light.forEach((value, k) => expect(value).toBeCloseTo(found[k], 5));
  expect(Math.max(...light)).toBeGreaterThan(0.1);
  expect(bounced(factors, new Float64Array(direct.length)).every((value) => value === 0)).toBe(true);
});

it("solves systems, with and without signs", () => {
  const rows = [Float64Array.from([2, 1, 0]), Float64Array.from([1, 3, 1])];
  const gram = Matrix.gram(rows); // [[5, 5], [5, 11]]
  expect([...solved(gram, [10, 16])]).toEqual([1, 1].map((value) => expect.closeTo(value, 12)));
  expect(nonnegative(gram, [10, 16])).toEqual([1, 1].map((value) => expect.closeTo(value, 12)));
  expect(nonnegative(gram, [5, -1])).toEqual([expect.closeTo(1, 12), 0]);
});

it("has the stage's colours of clusters", () => {
  known.colours.forEach((colour: number[], number: number) => {
    clusterColour(number).forEach((value, channel) => expect(value).toBeCloseTo(colour[channel], 5));
  });
});

describe("Radiance files", () => {
  const head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n";
  const text = (...parts: (string | number[])[]) =>
    Uint8Array.from(parts.flatMap((part) => (typeof part === "string" ? [...Buffer.from(part)] : part)));
  const line = [2, 2, 0, 8, 136, 10, 136, 20, 4, 1, 2, 3, 4, 132, 40, 136, 129];

  it("are read, runs and all", () => {
    const { height, data } = readRadiance(text(head, ...Array<number[]>(4).fill(line)), "a.hdr");
    expect(height).toBe(4);
    expect([...data.subarray(0, 3)]).toEqual([10, 20, 1].map((code) => code * 2 ** (129 - 136)));
    expect([...data.subarray(12, 15)]).toEqual([10, 20, 40].map((code) => code * 2 ** (129 - 136)));
  });

  it("are refused in a sentence where they are none, cut or of another shape", () => {
    expect(() => readRadiance(text("GIF89a"), "a.hdr")).toThrow("a.hdr: file is no Radiance picture; expected");
    expect(() => readRadiance(text(head, line), "a.hdr")).toThrow("a.hdr: file is cut");
    const square = head.replace("+X 8", "+X 4");
    expect(() => readRadiance(text(square), "a.hdr")).toThrow("a.hdr: size is 4 x 4; expected an equirectangular");
  });
});
