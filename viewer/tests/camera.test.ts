import { Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { drawingCamera, orbit, worldToDevice, type Camera } from "../src/drawing/camera";
import { fitted, isCamera, panned, turned, zoomed } from "../src/page/orbit";
import { dragged } from "../src/page/pad";

const bounds = { centre: [0, 0, 0] as [number, number, number], radius: 1 };
const camera: Camera = { position: [4, 0, 0], target: [0, 0, 0], up: [0, 0, 1], view_angle: 90, height: null };

/** Where a point is in the picture, from -1 to 1, x to the right, y up. */
function seen(from: Camera, point: [number, number, number], width = 200, height = 100): number[] {
  const place = new Vector3(...point).applyMatrix4(worldToDevice(drawingCamera(from, width, height, bounds)));
  return [place.x, place.y];
}

function near(found: number[], expected: number[]): void {
  found.forEach((value, i) => expect(value).toBeCloseTo(expected[i], 9));
}

describe("a camera", () => {
  it("sees what the stage's sees", () => {
    // From +x, z up, +y is to the right; at a right angle half the height is the distance.
    near(seen(camera, [0, 2, 1]), [2 / 4 / 2, 1 / 4]);
    near(seen({ ...camera, height: 4 }, [0, 2, 1]), [2 / 2 / 2, 1 / 2]);
  });

  it("is shifted by pixels", () => {
    near(seen({ ...camera, shift: [1, 1] }, [0, 0, 0]), [2 / 200, -2 / 100]);
  });

  it("has all of its bounds between near and far", () => {
    const made = drawingCamera(camera, 2, 1, bounds);
    expect(made.near).toBeLessThan(3);
    expect(made.near).toBeGreaterThan(2.8);
    expect(made.far).toBeGreaterThan(5);
    expect(made.far).toBeLessThan(5.2);
  });

  it("orbits as the stage's", () => {
    near(orbit([0, 0, 1], 4, -90, 0).position, [0, -4, 1]);
    expect(orbit([0, 0, 0], 1, 0, 90).up).toEqual([0, 1, 0]);
  });
});

describe("moving a camera", () => {
  it("turns about the target, not over the poles", () => {
    near(turned(camera, 90, 0).position, [0, 4, 0]);
    const above = turned(camera, 0, 200).position;
    expect(above[2]).toBeGreaterThan(3.99);
    expect(above[0]).toBeGreaterThan(0);
  });

  it("zooms within bounds and pans in the picture's plane", () => {
    expect(zoomed(camera, 0.5, bounds).position[0]).toBeCloseTo(2);
    expect(zoomed(camera, 1e-9, bounds).position[0]).toBeCloseTo(0.05);
    const moved = panned(camera, 0.25, 0);
    near(seen(moved, [0, 0, 0]), [0.25, 0]);
  });

  it("goes back until a narrow picture has all", () => {
    const narrow = fitted(camera, bounds, 0.5);
    const reach = Math.hypot(...narrow.position) * Math.sin(Math.atan(0.5));
    expect(reach).toBeGreaterThanOrEqual(1);
    expect(fitted(camera, bounds, 1.5)).toEqual(camera);
  });

  it("is told from what is none", () => {
    expect(isCamera(camera)).toBe(true);
    expect(isCamera({ ...camera, position: [1, 2] as never })).toBe(false);
    expect(isCamera({ ...camera, view_angle: NaN })).toBe(false);
    expect(isCamera({ ...camera, height: undefined as never })).toBe(false);
  });
});

it("drags a direction with the pointer", () => {
  near(dragged([1, 0, 0], camera, Math.PI / 2, 0), [0, 1, 0]);
  near(dragged([1, 0, 0], camera, 0, Math.PI / 4), [Math.SQRT1_2, 0, Math.SQRT1_2]);
});
