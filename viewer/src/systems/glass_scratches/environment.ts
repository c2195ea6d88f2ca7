/** An environment around the glass: its picture, its lights, exposed for display. */

import * as THREE from "three";
import { floatOf } from "./halfs";
import { drawnLights, LIGHTS, luminance, meanLuminance, type Lights, type Radiance } from "./lights";

/** What the mean luminance all around is shown as: the stage's `environment_exposure`. */
export const SHOWN_MEAN = 0.35;
const LARGEST_HALF = 65504;

/** Light from far away; all of it is multiplied by the exposure. */
export class Environment {
  /** RGBA in halfs, row 0 at the nadir. */
  readonly texture: THREE.DataTexture;
  /** The factor that shows a white matt surface in it as 0.35. */
  readonly exposure: number;
  /** Exposed. */
  readonly lights: Lights;
  /** Mean radiance all around, exposed: what comes through the glass. */
  readonly through: number;

  /** lights: those of the package, where it has some for this map. */
  constructor(map: Radiance, lights: Lights = drawnLights(map)) {
    this.exposure = SHOWN_MEAN / meanLuminance(map);
    this.lights = { power: lights.power.map((power) => power * this.exposure), towards: lights.towards };
    this.through = this.lights.power.reduce((sum, power) => sum + power, 0) / (3 * 4 * Math.PI);
    this.texture = skyTexture(map, this.exposure);
  }

  /** Frees its texture. */
  dispose(): void {
    this.texture.dispose();
  }
}

/** A map whose numbers are the bits of halfs, and the lights beside it, as packages hold them. */
export function packedEnvironment(height: number, codes: ArrayLike<number>, packed: Float32Array): Environment {
  const lights = { power: packed.slice(0, 3 * LIGHTS), towards: packed.slice(3 * LIGHTS) };
  return new Environment({ height, data: Float32Array.from(codes, floatOf) }, lights);
}

/** Radiance of a lamp of some strength, exposed; edge: cosines at which it is none, and all. */
export function lampRadiance(strength: number, edge: readonly number[], colour: readonly number[]): number[] {
  const shown = (strength * Math.PI * SHOWN_MEAN) / lampSteradians(edge) / luminance(colour);
  return colour.map((value) => value * shown);
}

/** Those of a lamp of even radiance that gives the same light. */
export function lampSteradians(edge: readonly number[]): number {
  return Math.PI * (2 - edge[0] - edge[1]);
}

function skyTexture({ height, data }: Radiance, exposure: number): THREE.DataTexture {
  const width = 2 * height;
  const content = new Uint16Array(4 * width * height);
  const one = THREE.DataUtils.toHalfFloat(1);
  for (let row = 0; row < height; row++) {
    let to = (height - 1 - row) * width * 4;
    for (let from = row * width * 3; from < (row + 1) * width * 3; from += 3, to += 4) {
      for (let channel = 0; channel < 3; channel++) {
        const shown = Math.min(data[from + channel] * exposure, LARGEST_HALF);
        content[to + channel] = THREE.DataUtils.toHalfFloat(shown);
      }
      content[to + 3] = one;
    }
  }
  const made = new THREE.DataTexture(content, width, height, THREE.RGBAFormat, THREE.HalfFloatType);
  made.magFilter = made.minFilter = THREE.LinearFilter;
  made.wrapS = THREE.RepeatWrapping; // turned, its edges may be anywhere
  made.needsUpdate = true;
  return made;
}
