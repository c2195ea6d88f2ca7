/** What is behind the glass: the environment, turned, and the lamp. */

import * as THREE from "three";
import { Backdrop } from "../../drawing/backdrop";
import { shaderSource } from "../../shaders";

const RADIANCE = `${shaderSource("surroundings.glsl")}
uniform sampler2D sky;
uniform float brightness;
uniform mat3 toSky;
uniform vec3 lamp;
uniform vec2 edge;
uniform vec3 lampRadiance;
vec3 radianceFrom(vec3 direction) {
  return surroundings(sky, toSky, brightness, lamp, edge, lampRadiance, direction);
}
`;

/** A mesh that fills what nothing else covers; the environment's texture is not its own. */
export class Surroundings extends Backdrop<Record<string, THREE.IUniform>> {
  constructor(edge: readonly number[]) {
    super(RADIANCE, {
      sky: { value: null },
      brightness: { value: 1 },
      toSky: { value: new THREE.Matrix3() },
      lamp: { value: new THREE.Vector3(0, 0, 1) },
      edge: { value: new THREE.Vector2(edge[0], edge[1]) },
      lampRadiance: { value: new THREE.Vector3() },
    });
  }
}
