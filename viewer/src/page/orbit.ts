/** Turning a camera about what it shows, z up. */

import { MathUtils, Vector3 } from "three";
import type { Camera, Vector } from "../drawing/camera";
import type { Bounds } from "../live_view";

const STEEPEST = 89;

/** Turns by degrees: `around` the vertical, `above` the horizon. */
export function turned(camera: Camera, around: number, above: number): Camera {
  const outward = new Vector3(...camera.position).sub(new Vector3(...camera.target));
  const distance = outward.length();
  const azimuth = Math.abs(outward.x) + Math.abs(outward.y) < 1e-6 * distance ? -90 : MathUtils.radToDeg(Math.atan2(outward.y, outward.x));
  const elevation = MathUtils.radToDeg(Math.asin(MathUtils.clamp(outward.z / distance, -1, 1)));
  const a = MathUtils.degToRad(azimuth + around);
  const e = MathUtils.degToRad(MathUtils.clamp(elevation + above, -STEEPEST, STEEPEST));
  const place = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
  return {
    ...camera,
    position: camera.target.map((value, axis) => value + distance * place[axis]) as Vector,
    up: [0, 0, 1],
  };
}

/** Goes nearer (factor < 1) or farther, within reason. */
export function zoomed(camera: Camera, factor: number, bounds: Bounds): Camera {
  if (camera.height !== null) {
    const height = MathUtils.clamp(camera.height * factor, bounds.radius * 0.02, bounds.radius * 20);
    return { ...camera, height };
  }
  const outward = new Vector3(...camera.position).sub(new Vector3(...camera.target));
  const distance = MathUtils.clamp(outward.length() * factor, bounds.radius * 0.05, bounds.radius * 20);
  const position = new Vector3(...camera.target).add(outward.setLength(distance));
  return { ...camera, position: position.toArray() };
}

/** Moves sideways by parts of the picture's height: x to the right, y up. */
export function panned(camera: Camera, x: number, y: number): Camera {
  const back = new Vector3(...camera.position).sub(new Vector3(...camera.target));
  const height = camera.height ?? 2 * back.length() * Math.tan(MathUtils.degToRad(camera.view_angle / 2));
  const right = new Vector3(...camera.up).cross(back).normalize();
  const up = back.clone().cross(right).normalize();
  const by = right.multiplyScalar(-x * height).addScaledVector(up, -y * height);
  const moved = (from: Vector): Vector => new Vector3(...from).add(by).toArray();
  return { ...camera, position: moved(camera.position), target: moved(camera.target) };
}

/** A camera that has all of `bounds` in a picture of this aspect. */
export function framed(bounds: Bounds, aspect: number): Camera {
  const viewAngle = 30;
  const half = MathUtils.degToRad(viewAngle / 2);
  const narrower = Math.min(half, Math.atan(Math.tan(half) * aspect));
  const distance = bounds.radius / Math.sin(narrower);
  const start: Camera = {
    position: [bounds.centre[0], bounds.centre[1] - distance, bounds.centre[2]],
    target: bounds.centre,
    up: [0, 0, 1],
    view_angle: viewAngle,
    height: null,
  };
  return turned(start, 25, 20);
}

/**
 * A camera made for a picture of aspect `from`, gone back for one of a narrower `aspect`: until it
 * has all of `bounds`, or as much of the width as before.
 */
export function fitted(camera: Camera, bounds: Bounds, aspect: number, from = 4 / 3): Camera {
  if (aspect >= from) return camera;
  if (camera.height !== null) {
    const needed = Math.min((2 * bounds.radius) / aspect, (camera.height * from) / aspect);
    return { ...camera, height: Math.max(camera.height, needed) };
  }
  const distance = new Vector3(...camera.position).distanceTo(new Vector3(...camera.target));
  const half = Math.atan(Math.tan(MathUtils.degToRad(camera.view_angle / 2)) * aspect);
  const needed = Math.min(bounds.radius / Math.sin(half), (distance * from) / aspect);
  return needed > distance ? zoomed(camera, needed / distance, bounds) : camera;
}

/** Whether something read from an address is a camera. */
export function isCamera(given: Camera): boolean {
  const vectors = [given.position, given.target, given.up];
  const isVector = (value: unknown) => Array.isArray(value) && value.length === 3 && value.every(Number.isFinite);
  const hasLens = Number.isFinite(given.view_angle) && given.view_angle > 0 && given.view_angle < 180;
  return vectors.every(isVector) && hasLens && (given.height === null || given.height > 0);
}
