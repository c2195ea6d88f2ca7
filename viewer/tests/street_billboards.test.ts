import { describe, expect, it } from "vitest";
import { Box3, Frustum, Matrix4, PerspectiveCamera, Vector3 } from "three";
import type { Camera } from "../src/drawing/camera";
import { driven, flown, turned } from "../src/systems/street_billboards/driving";
import { byDistance } from "../src/systems/street_billboards/nearest_first";
import { Path } from "../src/systems/street_billboards/path";
import { Residents } from "../src/systems/street_billboards/residents";
import { neededTiles } from "../src/systems/street_billboards/tile_table";

const STILL = { forward: 0, side: 0, up: 0, turn: 0, tilt: 0 };

function camera(x: number, y = 0, ahead = 1): Camera {
  return { position: [x, y, 1.9], target: [x + ahead, y, 1.9], up: [0, 0, 1], view_angle: 50, height: null };
}

function path(places: [number, number][]): Path {
  return new Path(Float32Array.from(places.flatMap(([x, y]) => [1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, 1.9, 0, 0, 0, 1])));
}

function road(metres: number, tile = 24) {
  return Array.from({ length: Math.ceil(metres / tile) }, (_, number) => ({
    billboards: 1,
    box: new Box3(new Vector3(number * tile, -8, 0), new Vector3((number + 1) * tile, 8, 9)),
  }));
}

/** Residents that note what is loaded; tiles of `broken` cannot be. */
function noting(most: number, broken: number[] = []) {
  const noted = { loaded: [] as number[], disposed: 0, most: 0 };
  const residents = new Residents(
    async (number) => {
      noted.loaded.push(number);
      await Promise.resolve();
      if (broken.includes(number)) throw new Error(`tile ${number} is broken.`);
      return { dispose: () => void noted.disposed++ };
    },
    () => (noted.most = Math.max(noted.most, residents.held.size)),
    most,
  );
  return { noted, residents };
}

describe("tiles of road", () => {
  it("stay few while 300 m are driven, and are loaded once", async () => {
    const places = road(312);
    const { noted, residents } = noting(8);
    for (let x = 0; x <= 300; x += 2) {
      await residents.want(neededTiles(places, camera(x)));
      const own = Math.floor(x / 24);
      for (const near of [own, own + 1, own + 2]) if (near < places.length) expect(residents.held.has(near)).toBe(true);
    }
    expect(noted.most).toBeLessThanOrEqual(8);
    expect(noted.loaded).toEqual([...places.keys()]);
    expect(noted.disposed).toBe(places.length - residents.held.size);
  });

  it("are not loaded twice in a row by who drives to and fro, or looks around", async () => {
    const places = road(600);
    const { noted, residents } = noting(8);
    for (let step = 0; step < 400; step++) {
      await residents.want(neededTiles(places, camera(300 + 250 * Math.sin(step / 30), 0, step % 7 ? 1 : -1)));
    }
    noted.loaded.forEach((number, place) => expect(noted.loaded[place + 1]).not.toBe(number));
    expect(noted.most).toBeLessThanOrEqual(8);
    expect(noted.disposed).toBe(noted.loaded.length - residents.held.size);
  });

  it("that are broken are tried once, and the others are held", async () => {
    const { noted, residents } = noting(8, [1]);
    for (let x = 0; x < 48; x += 4) await residents.want(neededTiles(road(96), camera(x)));
    expect(noted.loaded.filter((number) => number === 1)).toHaveLength(1);
    expect([...residents.held.keys()].sort()).toEqual([0, 2, 3]);
    expect(residents.errors.map(String)).toEqual(["Error: tile 1 is broken."]);
  });

  it("that nobody wants any more when they arrive take no place of those that are wanted", async () => {
    const { residents } = noting(2);
    const first = residents.want([0, 1]);
    residents.want([5, 6]);
    await first;
    await residents.want([5, 6]);
    expect([...residents.held.keys()].sort()).toEqual([5, 6]);
    residents.dispose();
    expect(residents.held.size).toBe(0);
  });

  it("behind are less urgent than those ahead", () => {
    expect(neededTiles(road(300), camera(150))[0]).toBe(6);
    expect(neededTiles(road(300), camera(153)).slice(0, 4)).toEqual([6, 7, 5, 8]);
    expect(neededTiles(road(300), camera(150, 0, -1)).slice(0, 4)).toEqual([6, 5, 4, 3]);
    expect(neededTiles(road(3000), camera(0))).toHaveLength(7);
  });
});

describe("driving", () => {
  const straight = path([
    [0, 0],
    [10, 0],
    [40, 0],
  ]);
  const bend = path(
    Array.from({ length: 13 }, (_, n) => [20 * Math.sin((n * Math.PI) / 24), 20 - 20 * Math.cos((n * Math.PI) / 24)]),
  );

  it("follows the road and turns with it", () => {
    let at = camera(0, 1);
    for (let step = 0; step < 400; step++) at = driven(at, { ...STILL, forward: 1 }, 0.1, bend);
    expect(Math.abs(bend.beside(at.position).left - 1)).toBeLessThan(0.1);
    expect(at.position[0]).toBeCloseTo(19, 0);
    expect(at.position[1]).toBeCloseTo(20, 0);
    expect(at.target[1] - at.position[1]).toBeGreaterThan(0.99);
  });

  it("ends where the way ends, and goes back", () => {
    const end = driven(camera(1), { ...STILL, forward: 1 }, 1000, straight);
    expect(straight.beside(end.position).along).toBeCloseTo(40);
    expect(driven(camera(1), { ...STILL, forward: -1 }, 1000, straight).position[0]).toBeCloseTo(0);
  });

  it("goes where one looks: towards the beginning where one looks back", () => {
    expect(driven(camera(8, 0, -1), { ...STILL, forward: 1 }, 3, straight).position[0]).toBeCloseTo(5);
    expect(driven(camera(8), { ...STILL, side: 1 }, 2.5, straight).position[1]).toBeCloseTo(-1);
    expect(driven(camera(8, 0, -1), { ...STILL, side: 1 }, 2.5, straight).position[1]).toBeCloseTo(1);
    expect(driven(camera(8), { ...STILL, side: 1 }, 1000, straight).position[1]).toBeCloseTo(-4);
  });

  it("is free where one flies", () => {
    const up = turned(camera(0), 0, Math.PI / 6);
    const flight = flown(up, { ...STILL, forward: 1 }, 2);
    expect(flight.position[0]).toBeCloseTo(Math.sqrt(3));
    expect(flight.position[2]).toBeCloseTo(2.9);
    const left = turned(camera(0), Math.PI / 2, 0);
    expect(left.target[1] - left.position[1]).toBeCloseTo(1);
    expect(turned(camera(0), 0, 9).target[2]).toBeLessThan(2.9);
  });
});

it("billboards in view come nearest first, and those outside not at all", () => {
  const lens = new PerspectiveCamera(60, 1, 0.1, 100);
  lens.updateMatrixWorld();
  const frustum = new Frustum().setFromProjectionMatrix(
    new Matrix4().multiplyMatrices(lens.projectionMatrix, lens.matrixWorldInverse),
  );
  const centres = Float32Array.from([[0, 0, -9], [0, 0, 9], [0, 0, -2], [40, 0, -5], [3.4, 0, -5]].flat());
  const reaches = new Float32Array([1, 1, 1, 1, 1]);
  expect(byDistance(centres, reaches, frustum, [0, 0, 0])).toEqual([2, 4, 0]);
});
