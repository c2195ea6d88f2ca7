/** A scene of surfaces on a plain background, or before a sky. */

import * as THREE from "three";
import type { Bounds } from "../live_view";
import { drawingCamera, type Camera } from "./camera";

/** Draws a scene into the bound target; `background` is linear radiance. */
export function drawScene(
  renderer: THREE.WebGLRenderer,
  scene: THREE.Scene,
  camera: Camera,
  [width, height]: [number, number],
  bounds: Bounds,
  background: [number, number, number] = [0, 0, 0],
): void {
  renderer.setClearColor(new THREE.Color(...background), 0);
  renderer.clear();
  renderer.render(scene, drawingCamera(camera, width, height, bounds));
}
