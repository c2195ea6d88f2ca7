import { describe, expect, it } from "vitest";
import type { State } from "../src/live_view";
import { codeSteps, depthCodes, DROPPED } from "../src/systems/photo_fur/codes";
import { controlsOf, withState, type Look } from "../src/systems/photo_fur/look";
import python from "./photo_fur_codes.json";

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
    [{ fill: "waves" }, 'fill is "waves"; expected one of columns, bands.'],
    [{ background: "sea" }, 'background is "sea"; expected one of grey, night.'],
    [{ light: [1, 2] }, "light is [1,2]; expected [x, y, z]."],
    [{ hair: 1 }, "state has hair; expected layers, thickness, fill, sky, headlight, lamp, light, background."],
  ])("refuses %o", (state, said) => {
    expect(() => withState(look, state, backgrounds)).toThrow(said);
  });

  it("has a control for each setting, with all of the package's own layers in reach", () => {
    const controls = controlsOf({ ...look, layers: 120 }, backgrounds);
    expect(controls.map((control) => control.name).sort()).toEqual(Object.keys(look).sort());
    expect(controls.find((control) => control.name === "layers")).toMatchObject({ min: 1, max: 120 });
  });
});
