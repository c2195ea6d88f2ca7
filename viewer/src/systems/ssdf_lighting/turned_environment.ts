/** The environment behind the scene, turned with the light; few texels, so smoothed by a B-spline. */

import * as THREE from "three";
import { Backdrop } from "../../drawing/backdrop";
import { shaderSource } from "../../shaders";
import type { Environment } from "./sphere_map";
import { tableTexture } from "./tables";

const RADIANCE = `${shaderSource("equirectangular.glsl")}
uniform sampler2D environment;         // row 0: the zenith
uniform vec2 turned;                   // cosine and sine of the light's turn
uniform float exposure;
vec4 spline(float part) {
  float rest = 1.0 - part, squared = part * part, cubed = squared * part;
  return vec4(rest * rest * rest, 3.0 * cubed - 6.0 * squared + 4.0,
              -3.0 * cubed + 3.0 * squared + 3.0 * part + 1.0, cubed) / 6.0;
}
vec3 radianceFrom(vec3 way) {
  way.xy = vec2(turned.x * way.x + turned.y * way.y, turned.x * way.y - turned.y * way.x);
  ivec2 size = textureSize(environment, 0);
  vec2 place = equirectangularPlace(way);
  place = vec2(place.x, 1.0 - place.y) * vec2(size) - 0.5;
  vec2 corner = floor(place);
  vec4 across = spline(place.x - corner.x), down = spline(place.y - corner.y);
  vec3 sum = vec3(0.0);
  for (int y = 0; y < 4; y++) {
    for (int x = 0; x < 4; x++) {
      ivec2 at = ivec2(corner) + ivec2(x, y) - 1;
      at = ivec2((at.x + 2 * size.x) % size.x, clamp(at.y, 0, size.y - 1));
      sum += across[x] * down[y] * texelFetch(environment, at, 0).rgb;
    }
  }
  return exposure * sum;
}
`;

/** Put it into a scene. */
export class TurnedEnvironment extends Backdrop<{
  environment: { value: THREE.Texture | null };
  turned: { value: THREE.Vector2 };
  exposure: { value: number };
}> {
  constructor() {
    super(RADIANCE, {
      environment: { value: null },
      turned: { value: new THREE.Vector2(1, 0) },
      exposure: { value: 1 },
    });
  }

  /** Shows another environment. */
  show({ height, data }: Environment): void {
    const texels = new Float32Array((4 * data.length) / 3);
    for (let k = 0; k < data.length; k++) texels[4 * Math.floor(k / 3) + (k % 3)] = data[k];
    const { environment } = this.uniforms;
    environment.value?.dispose();
    environment.value = tableTexture(texels, 2 * height, height);
  }

  /** Turns it, in radians, and exposes it. */
  set(turn: number, exposure: number): void {
    this.uniforms.turned.value.set(Math.cos(turn), Math.sin(turn));
    this.uniforms.exposure.value = exposure;
  }

  /** Frees it and its texture. */
  override dispose(): void {
    this.uniforms.environment.value?.dispose();
    super.dispose();
  }
}
