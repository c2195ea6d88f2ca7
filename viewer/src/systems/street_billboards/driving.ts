/** Where a person's motion brings the camera: along the road, or freely. */

import { MathUtils, Vector3 } from "three";
import type { Camera } from "../../drawing/camera";
import type { Motion } from "../../live_view";
import type { Path } from "./path";

/** Metres that somebody on the road may step aside of the way, and above and below it. */
const ASIDE = 4;
const HIGHEST = 4;
const LOWEST = -1;
/** Part of the speed at which one steps aside and rises. */
const STEP = 0.4;
const STEEPEST = 85;

/** Looks elsewhere: radians to the left and upwards. */
export function turned(camera: Camera, left: number, up: number): Camera {
  const look = lookOf(camera);
  const azimuth = Math.atan2(look.y, look.x) + left;
  const steepest = MathUtils.degToRad(STEEPEST);
  const elevation = MathUtils.clamp(Math.asin(MathUtils.clamp(look.z, -1, 1)) + up, -steepest, steepest);
  const level = Math.cos(elevation);
  return looking(camera, new Vector3(...camera.position), [
    level * Math.cos(azimuth),
    level * Math.sin(azimuth),
    Math.sin(elevation),
  ]);
}

/** Goes so many metres where one looks; `side` to the right, `up` upwards. */
export function flown(camera: Camera, { forward, side, up }: Motion, metres: number): Camera {
  const look = lookOf(camera);
  const right = new Vector3(look.y, -look.x, 0).normalize();
  const position = new Vector3(...camera.position)
    .addScaledVector(look, forward * metres)
    .addScaledVector(right, side * metres * STEP)
    .add(new Vector3(0, 0, up * metres * STEP));
  return looking(camera, position, look.toArray());
}

/** Goes so many metres along the road, which turns the view; `side` steps aside of the way. */
export function driven(camera: Camera, { forward, side, up }: Motion, metres: number, path: Path): Camera {
  const look = lookOf(camera);
  const from = path.beside(camera.position);
  const before = path.azimuth(from.along);
  const way = Math.cos(before) * look.x + Math.sin(before) * look.y >= 0 ? 1 : -1;
  const along = MathUtils.clamp(from.along + way * forward * metres, 0, path.length);
  const left = MathUtils.clamp(from.left - way * side * metres * STEP, -ASIDE, ASIDE);
  const above = MathUtils.clamp(from.above + up * metres * STEP, LOWEST, HIGHEST);
  const position = path.world({ along, left, above });
  return turned(looking(camera, position, look.toArray()), path.azimuth(along) - before, 0);
}

function lookOf(camera: Camera): Vector3 {
  return new Vector3(...camera.target).sub(new Vector3(...camera.position)).normalize();
}

function looking(camera: Camera, position: Vector3, look: readonly number[]): Camera {
  const target = position.clone().add(new Vector3(...look));
  return { ...camera, position: position.toArray(), target: target.toArray(), up: [0, 0, 1] };
}
