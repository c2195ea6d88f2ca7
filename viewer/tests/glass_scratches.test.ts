import { describe, expect, it } from "vitest";
import { Environment, lampRadiance, lampSteradians } from "../src/systems/glass_scratches/environment";
import { environmentOf } from "../src/systems/glass_scratches/environment_file";
import { drawnLights, LIGHTS, luminance, meanLuminance, typicalLuminance } from "../src/systems/glass_scratches/lights";
import { smaller, softMap } from "../src/systems/glass_scratches/means";
import { controlsOf, stateOf, withState, type Settings } from "../src/systems/glass_scratches/state";
import { TREE_WIDTH, triangleTree } from "../src/systems/glass_scratches/triangle_tree";
import fixture from "./glass_scratches_lights.json";

const map = { height: fixture.height, data: Float32Array.from(fixture.radiance) };

describe("lights of an environment", () => {
  it("are those that the stage draws", () => {
    const { power, towards } = drawnLights(map);
    expect(power.length).toBe(3 * LIGHTS);
    power.forEach((value, n) => expect(value).toBeCloseTo(fixture.power[n], 5));
    towards.forEach((value, n) => expect(value).toBeCloseTo(fixture.towards[n], 5));
  });

  it("carry what comes from all around", () => {
    const environment = new Environment(map, 2.5);
    expect(environment.through).toBeCloseTo(fixture.through * 2.5, 5);
    expect(environment.mean).toBeCloseTo(meanLuminance(map) * 2.5, 9);
  });

  it("are joined by a lamp of the light that it is asked for", () => {
    const { edge, colour } = fixture.lamp;
    const radiance = lampRadiance(3, meanLuminance(map), edge, colour);
    expect(luminance(radiance) * lampSteradians(edge)).toBeCloseTo(3 * Math.PI * meanLuminance(map), 9);
    radiance.forEach((value, n) => expect(value / fixture.lamp.radiance[n]).toBeCloseTo(1, 5));
  });
});

describe("a soft environment", () => {
  it("has the means of areas that the stage has", () => {
    const { rows, radiance } = fixture.soft;
    const found = smaller(map.data, [16, 32], [rows, 2 * rows]);
    expect(found.length).toBe(radiance.length);
    found.forEach((value, n) => expect(value).toBeCloseTo(radiance[n], 3));
  });

  it("is the environment where that is no larger", () => {
    expect(softMap(map, 64)).toEqual(map);
    expect(softMap(map, 4).data.length).toBe(3 * 4 * 8);
  });
});

describe("the tree of triangles", () => {
  const { places, normals, nodes, corners } = fixture.tree;
  const [given, beside] = [Float32Array.from(places), Float32Array.from(normals)];

  it("is the stage's, node for node", () => {
    const tree = triangleTree(given, beside);
    expect(tree.nodes.length).toBe(4 * TREE_WIDTH);
    expect(tree.nodes.subarray(0, nodes.length)).toEqual(Float32Array.from(nodes));
    expect(tree.corners.subarray(0, corners.length)).toEqual(Float32Array.from(corners));
  });

  it("is another of other triangles", () => {
    const tree = triangleTree(given.map((value, n) => (n < 9 ? -value : value)), beside);
    expect(tree.nodes.subarray(0, nodes.length)).not.toEqual(Float32Array.from(nodes));
  });

  it("fills whole rows of texels, and refuses what it cannot hold", () => {
    const many = Float32Array.from({ length: 9 * 300 }, (_, n) => Math.sin(n * n));
    expect(triangleTree(many, many).corners.length).toBe(4 * TREE_WIDTH * 4);
    expect(() => triangleTree(new Float32Array(0), new Float32Array(0))).toThrow("expected 9 each of both");
  });
});

describe("what is typical of an environment", () => {
  const grey = (of: (texel: number) => number) => ({
    height: 16,
    data: Float32Array.from({ length: 3 * 16 * 32 }, (_, n) => of(Math.floor(n / 3))),
  });

  it("is its radiance where that is even", () => {
    expect(typicalLuminance(grey(() => 0.25))).toBeCloseTo(0.25, 6);
  });

  it("is not its lamp's, which is most of the mean", () => {
    const lit = grey((texel) => (texel === 200 ? 900 : 0.25));
    expect(meanLuminance(lit)).toBeGreaterThan(1.5);
    expect(typicalLuminance(lit)).toBeLessThan(0.27);
  });

  it("is more than nothing among black", () => {
    expect(typicalLuminance(grey((texel) => (texel === 200 ? 900 : 0)))).toBeGreaterThan(1e-4);
  });
});

describe("an environment of a person's own", () => {
  const colours = (width: number, height: number, of: (x: number, y: number) => number) => ({
    width,
    height,
    data: Float32Array.from({ length: 4 * width * height }, (_, n) => of((n >> 2) % width, Math.floor((n >> 2) / width))),
  });

  it("is kept as it is where it is small", () => {
    const read = environmentOf(colours(16, 8, (x, y) => x + 100 * y), "small.hdr");
    expect(read.height).toBe(8);
    expect(read.data[3 * (16 * 3 + 5)]).toBe(305);
  });

  it("is averaged where it is large, with the same light", () => {
    const read = environmentOf(colours(1028, 514, (x) => (x % 2 ? 4 : 0)), "large.hdr");
    expect(read.height).toBe(512);
    const mean = read.data.reduce((sum, value) => sum + value, 0) / read.data.length;
    expect(mean).toBeCloseTo(2, 4);
  });

  it("is refused in a sentence where it is none", () => {
    expect(() => environmentOf(colours(8, 8, () => 1), "a.png")).toThrow("a.png is 8 x 8 pixels; expected an equirectangular");
    expect(() => environmentOf(colours(16, 8, () => 0), "b.png")).toThrow("b.png is all black");
    expect(() => environmentOf(colours(16, 8, () => NaN), "c.hdr")).toThrow("c.hdr is all black");
  });
});

describe("the state", () => {
  const settings: Settings = {
    environment: "lamps",
    turn: 0,
    brightness: 1,
    tilt: 0,
    swing: 0,
    coverage: 1,
    strength: 1,
    tile: 1,
    lamp: 2,
    light: [0, 0, 1],
    layers: [true, true],
  };

  it("comes back as it was set", () => {
    const asked = { ...stateOf(settings), tilt: 12, layer_2: false, light: [0, -2, 0] };
    const set = withState(settings, asked, ["lamps", "sky"]);
    expect(stateOf(set)).toEqual({ ...asked, light: [0, -1, 0] });
    expect(settings.layers).toEqual([true, true]);
  });

  it("has a control for each of its values", () => {
    const controls = controlsOf(settings, ["lamps"], async () => {}, ".hdr");
    const named = controls.filter(({ kind }) => kind !== "drop").map(({ name }) => name);
    expect(named.sort()).toEqual(Object.keys(stateOf(settings)).sort());
  });

  it.each([
    [{ environment: "moon" }, 'environment is "moon"; expected one of lamps, sky.'],
    [{ turn: "left" }, 'turn is "left"; expected a number.'],
    [{ tile: 0 }, "tile is 0; expected a positive number."],
    [{ light: [0, 0, 0] }, "light is [0,0,0]; expected [x, y, z]."],
    [{ mood: 1 }, "state has mood; expected environment"],
  ])("refuses %j", (state, sentence) => {
    expect(() => withState(settings, state, ["lamps", "sky"])).toThrow(sentence);
  });
});
