import { describe, expect, it } from "vitest";
import type { State } from "../src/live_view";
import { codeSteps, depthCodes, DROPPED } from "../src/systems/photo_fur/codes";
import { controlsOf, withState, type Look } from "../src/systems/photo_fur/look";
import { lay, SLOTS, tangentsOf } from "../src/systems/photo_fur/laying";
import { luminanceOf, sizeOf } from "../src/systems/photo_fur/photograph";
import python from "./photo_fur_codes.json";
import laid from "./photo_fur_laying.json";

const luminance = Float32Array.from(python.luminance);
const given = Object.entries(python.codes).flatMap(([tails, byLayers]) =>
  Object.entries(byLayers).map(([layers, codes]): [string, number, number[]] => [tails, Number(layers), codes]),
);

/** Layers of codes, 0 for none. */
function layersOf(codes: ArrayLike<number>, layers: number): number[] {
  const steps = codeSteps(layers);
  return Array.from(codes, (code) => (code >= layers * steps ? 0 : Math.floor(code / steps) + 1));
}

describe("depthCodes", () => {
  it.each(given)("are Python's with %s, %i layers", (tails, layers, expected) => {
    const codes = depthCodes(luminance, python, layers, tails === "dropped");
    expect(layersOf(codes, layers)).toEqual(layersOf(expected, layers));
    const apart = Array.from(codes, (code, pixel) => Math.abs(code - expected[pixel]));
    expect(Math.max(...apart)).toBeLessThanOrEqual(1);
    expect(apart.filter((difference) => difference > 0).length).toBeLessThanOrEqual(2);
  });

  it("drop what is transparent", () => {
    const codes = depthCodes(luminance, python, 15, false);
    expect(Array.from(codes.subarray(390))).toEqual(Array(10).fill(DROPPED));
    expect(Array.from(codes.subarray(0, 390))).not.toContain(DROPPED);
  });

  it("tell another medium apart", () => {
    const codes = depthCodes(luminance, { ...python, darkest: python.darkest / 2 }, 15, false);
    const expected = python.codes["end layers"]["15"];
    expect(Array.from(codes).filter((code, pixel) => Math.abs(code - expected[pixel]) > 1).length).toBeGreaterThan(100);
  });
});

describe("a look", () => {
  const look: Look = {
    look: "full",
    wind: 0,
    moment: null,
    layers: 15,
    thickness: 1,
    fill: "columns",
    sky: 0.15,
    headlight: 0.35,
    lamp: 0.75,
    light: [0, 0, 1],
    background: "night",
  };
  const backgrounds = ["grey", "night"];

  it("takes part of a state, and makes directions unit vectors", () => {
    const set = withState(look, { layers: 8, light: [0, 3, 4] }, backgrounds);
    expect(set).toEqual({ ...look, layers: 8, light: [0, 0.6, 0.8] });
    expect(look.layers).toBe(15);
  });

  it.each<[State, string]>([
    [{ layers: 251 }, "layers is 251; expected a whole number of 1 to 250."],
    [{ layers: 1.5 }, "layers is 1.5; expected a whole number of 1 to 250."],
    [{ thickness: NaN }, "thickness is null; expected 0 or more."],
    [{ look: "wet" }, 'look is "wet"; expected one of full, plain.'],
    [{ wind: -1 }, "wind is -1; expected 0 or more."],
    [{ moment: "now" }, 'moment is "now"; expected 0 or more.'],
    [{ fill: "waves" }, 'fill is "waves"; expected one of columns, bands.'],
    [{ background: "sea" }, 'background is "sea"; expected one of grey, night.'],
    [{ light: [1, 2] }, "light is [1,2]; expected [x, y, z]."],
    [{ hair: 1 }, "state has hair; expected look, wind, moment, layers, thickness, fill, sky, headlight, lamp, light, background."],
  ])("refuses %o", (state, said) => {
    expect(() => withState(look, state, backgrounds)).toThrow(said);
  });

  it("has a control for each setting, with all of the package's own layers in reach", () => {
    const controls = controlsOf({ ...look, look: "plain", layers: 120 }, backgrounds);
    const names = controls.map((control) => control.name);
    const full = controlsOf(look, backgrounds).map((control) => control.name);
    // The time runs by itself; wind is of the one look, layers and fill of the other.
    const settable = Object.keys(look).filter((name) => name !== "moment");
    expect([...new Set([...names, ...full])].sort()).toEqual(settable.sort());
    expect(full.filter((name) => !names.includes(name))).toEqual(["wind"]);
    expect(names.filter((name) => !full.includes(name))).toEqual(["layers", "fill"]);
    expect(controls.find((control) => control.name === "layers")).toMatchObject({ min: 1, max: 120 });
  });
});

describe("the photograph laid over a body", () => {
  const normals = Float32Array.from(laid.normals);
  const tangents = tangentsOf(Uint8Array.from(laid.lie), normals, laid.backwards);
  const body = {
    vertices: Float32Array.from(laid.vertices),
    triangles: Uint32Array.from(laid.triangles),
    normals,
    tangents,
  };
  const patches = {
    ...laid.patches,
    middles: Uint32Array.from(laid.patches.middles),
    places: Float32Array.from(laid.patches.places),
    directions: Float32Array.from(laid.patches.directions),
  };
  const { expected } = laid;
  const largest = (found: ArrayLike<number>, wanted: readonly number[]) =>
    wanted.reduce((most, value, i) => Math.max(most, Math.abs(value - found[i])), 0);
  /** Values of split vertices by corner of each triangle. */
  const byCorner = (values: Float32Array, triangles: Uint32Array, width: number) =>
    Array.from(triangles).flatMap((vertex) => Array.from(values.subarray(vertex * width, (vertex + 1) * width)));

  it("lies as Python has it", () => {
    expect(largest(tangents, expected.tangents)).toBeLessThan(1e-5);
    const made = lay(body, patches);
    expect(made.vertex.length).toBe(expected.count);
    const weights = byCorner(made.weights, made.triangles, SLOTS);
    expect(largest(weights, expected.weights)).toBeLessThan(1e-4);
    const uvs = byCorner(made.uvs, made.triangles, 2 * SLOTS).map((uv, i) => uv * Number(weights[i >> 1] > 0));
    expect(largest(uvs, expected.uvs)).toBeLessThan(1e-4);
    // Copies of a vertex count as one: places are compared, not numbers.
    const at = (vertex: number) => laid.vertices.slice(3 * vertex, 3 * vertex + 3);
    expect(Array.from(made.triangles, (vertex) => at(made.vertex[vertex]))).toEqual(laid.triangles.map(at));
  });

  it("lies otherwise with other patches", () => {
    const turned = lay(body, { ...patches, directions: patches.directions.map((direction) => direction + 0.1) });
    const uvs = byCorner(turned.uvs, turned.triangles, 2 * SLOTS);
    expect(largest(uvs, expected.uvs)).toBeGreaterThan(0.01);
  });
});

describe("a photograph's file", () => {
  const box = (name: string, ...numbers: number[]) => [...new TextEncoder().encode(name), ...numbers];
  const file = (width: number[]) =>
    Uint8Array.from([0, 0, 0, 28, ...box("ftypavif"), ...Array(8).fill(0), ...box("ispe"), 0, 0, 0, 0, ...width, 0, 0, 1, 4]);

  it("tells its size before it is decoded", () => {
    expect(sizeOf(file([0, 0, 2, 0]))).toEqual([512, 260]);
    expect(sizeOf(Uint8Array.from([1, 2, 3]))).toBeUndefined();
    expect(sizeOf(file([0, 0, 2, 0]).subarray(0, 30))).toBeUndefined();
  });

  it("has the luminance of linear light, and none where no fur is", () => {
    const data = Uint8Array.from([255, 255, 255, 0, 188, 0, 0, 0, 0, 10, 0, 0]);
    const photograph = { width: 3, height: 1, channels: 4, data };
    const opaque = { width: 3, height: 1, channels: 1, data: Uint8Array.from([255, 255, 0]) };
    const found = luminanceOf(photograph, opaque);
    expect(found[0]).toBeCloseTo(1, 6);
    expect(found[1]).toBeCloseTo(0.2126 * 0.5029, 4);
    expect(found[2]).toBe(-1);
    expect(luminanceOf(photograph)[2]).toBeCloseTo(0.7152 * (10 / 255 / 12.92), 6);
  });
});
