/** Cameras, as the stage's (`pipelines/drawing/stage.py`). */

import { Matrix4, OrthographicCamera, PerspectiveCamera, Vector3 } from "three";
import type { Bounds } from "../live_view";

export type Vector = [number, number, number];

/** In distances to its target: how far an orthographic camera is away. */
const FAR_AWAY = 1e4;

/** Where the picture is taken from; scene units, degrees. Plain JSON. */
export interface Camera {
  position: Vector;
  target: Vector;
  up: Vector;
  /** Vertical field of view of a perspective camera. */
  view_angle: number;
  /** Height of the picture in scene units, of an orthographic camera; else null. */
  height: number | null;
  /** The page's own: by how many pixels the picture is shifted, x to the right, y down. */
  shift?: [number, number];
}

/** A camera of three.js: projection and view for a picture of so many pixels. */
export type DrawingCamera = PerspectiveCamera | OrthographicCamera;

/**
 * The camera for a picture of width x height pixels, its depth range about `bounds`. Whoever draws
 * takes its camera from here: it holds the shift by which a still picture is refined.
 */
export function drawingCamera(camera: Camera, width: number, height: number, bounds: Bounds): DrawingCamera {
  const made = camera.height === null ? perspective(camera, width / height) : orthographic(camera, width / height);
  made.position.set(...camera.position);
  made.up.set(...camera.up);
  made.lookAt(...camera.target);
  made.updateMatrixWorld();
  const forward = made.getWorldDirection(new Vector3());
  const depth = new Vector3(...bounds.centre).sub(made.position).dot(forward);
  made.far = Math.max(depth + bounds.radius, bounds.radius * 1e-3) * 1.01;
  made.near = Math.max((depth - bounds.radius) * 0.99, made.far * 1e-3);
  if (camera.shift) made.setViewOffset(width, height, -camera.shift[0], -camera.shift[1], width, height);
  made.updateProjectionMatrix();
  return made;
}

/** Where the eye is; that of an orthographic camera as far away as the stage has it. */
export function eyeOf({ position, target, height }: Camera): Vector3 {
  const eye = new Vector3(...position);
  if (height === null) return eye;
  const middle = new Vector3(...target);
  return eye.sub(middle).multiplyScalar(FAR_AWAY).add(middle);
}

/** World to device coordinates. */
export function worldToDevice(camera: DrawingCamera): Matrix4 {
  return new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
}

/** A camera on a sphere about the target, z up; angles in degrees, as the stage's `orbit`. */
export function orbit(
  target: Vector,
  distance: number,
  azimuth: number,
  elevation: number,
  lens: { view_angle?: number; height?: number | null } = {},
): Camera {
  const around = (azimuth * Math.PI) / 180;
  const above = (elevation * Math.PI) / 180;
  const outward = [Math.cos(above) * Math.cos(around), Math.cos(above) * Math.sin(around), Math.sin(above)];
  return {
    position: target.map((value, axis) => value + distance * outward[axis]) as Vector,
    target,
    up: Math.abs(elevation) > 89.9 ? [0, 1, 0] : [0, 0, 1],
    view_angle: lens.view_angle ?? 30,
    height: lens.height ?? null,
  };
}

function perspective(camera: Camera, aspect: number): PerspectiveCamera {
  return new PerspectiveCamera(camera.view_angle, aspect);
}

function orthographic(camera: Camera, aspect: number): OrthographicCamera {
  const half = (camera.height ?? 1) / 2;
  return new OrthographicCamera(-half * aspect, half * aspect, half, -half);
}
