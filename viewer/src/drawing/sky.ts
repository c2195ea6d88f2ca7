/** An environment at infinity. */

import * as THREE from "three";
import { shaderSource } from "../shaders";
import { Backdrop } from "./backdrop";

const RADIANCE = `${shaderSource("equirectangular.glsl")}
uniform sampler2D sky;
uniform float exposure;
vec3 radianceFrom(vec3 direction) {
  return exposure * textureLod(sky, equirectangularPlace(direction), 0.0).rgb;
}
`;

/** Environment in equirectangular layout, z up, drawn behind all else: put it into a scene. */
export class Sky extends Backdrop<{ sky: { value: THREE.Texture }; exposure: { value: number } }> {
  /** sky: of `texture()`, of a map as the stage's environments; disposed with this. */
  constructor(sky: THREE.Texture) {
    super(RADIANCE, { sky: { value: sky }, exposure: { value: 1 } });
  }

  /** What radiance is multiplied with. */
  set exposure(value: number) {
    this.uniforms.exposure.value = value;
  }

  /** Frees it and its texture. */
  override dispose(): void {
    this.uniforms.sky.value.dispose();
    super.dispose();
  }
}
