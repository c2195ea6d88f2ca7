/** An environment around the glass: its picture, its lights, exposed for display. */

import * as THREE from "three";
import { floatOf } from "./halfs";
import { drawnLights, LIGHTS, luminance, meanLuminance, type Lights, type Radiance } from "./lights";
import { softMap } from "./means";

const LARGEST_HALF = 65504;
/** Rows of the soft map, at most: about a bin of a table each. */
const SOFT_ROWS = 64;

/** Light from far away; all of it is multiplied by the exposure. */
export class Environment {
  /** RGBA in halfs, row 0 at the nadir. */
  readonly texture: THREE.DataTexture;
  /** The same with fewer rows, each texel a mean: what a bin of a table sees. */
  readonly soft: THREE.DataTexture;
  /** Exposed. */
  readonly lights: Lights;
  /** Mean radiance all around, exposed: what comes through the glass. */
  readonly through: number;
  /** Mean luminance all around, exposed. */
  readonly mean: number;

  /** exposure: factor on all radiance; lights: those of the package, where it has some for this map. */
  constructor(
    map: Radiance,
    readonly exposure: number,
    lights: Lights = drawnLights(map),
  ) {
    this.mean = exposure * meanLuminance(map);
    this.lights = { power: lights.power.map((power) => power * this.exposure), towards: lights.towards };
    this.through = this.lights.power.reduce((sum, power) => sum + power, 0) / (3 * 4 * Math.PI);
    this.texture = skyTexture(map, this.exposure);
    this.soft = skyTexture(softMap(map, SOFT_ROWS), this.exposure);
  }

  /** Frees its textures. */
  dispose(): void {
    this.texture.dispose();
    this.soft.dispose();
  }
}

/** A map whose numbers are the bits of halfs, as packages hold it. */
export function packedMap(height: number, codes: ArrayLike<number>): Radiance {
  return { height, data: Float32Array.from(codes, floatOf) };
}

/** Lights beside a map, as packages hold them. */
export function packedLights(packed: Float32Array): Lights {
  return { power: packed.slice(0, 3 * LIGHTS), towards: packed.slice(3 * LIGHTS) };
}

/** Radiance of a lamp of some strength beside an environment of some mean, both exposed; edge: cosines
 * at which it is none, and all. */
export function lampRadiance(strength: number, mean: number, edge: readonly number[], colour: readonly number[]): number[] {
  const shown = (strength * Math.PI * mean) / lampSteradians(edge) / luminance(colour);
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
