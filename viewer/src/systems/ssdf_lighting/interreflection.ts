/** Light that surfaces reflect onto each other, after `light/interreflection.py`. */

import type { Package } from "../../package/package";
import type { Surface } from "../../drawing/surface";
import { edgeShare, FINE } from "./lobe_tables";

const ORDERS = 5;

/** Form factors of V vertices and P patches: codes times steps times vectors. */
export interface BounceFactors {
  /** (V, R). */
  codes: Int8Array;
  /** (R). */
  steps: Float32Array;
  /** (R, P). */
  vectors: Float32Array;
  /** (P, R). */
  between: Float32Array;
  /** (P, 3). */
  albedo: Float32Array;
  /** (P, S). */
  samples: Int32Array;
}

/** Lights and their tables, as the shaders have them. */
export interface MattLights {
  /** (N, 4): axes and sharpness. */
  lights: Float32Array;
  /** (N, 3). */
  amplitudes: Float32Array;
  /** (N, FINE + 1, 4), see `lobe_tables.ts`. */
  radiance: Float32Array;
}

/** Reads the factors of a package. */
export async function readBounce(pkg: Package): Promise<BounceFactors> {
  const [codes, samples] = await Promise.all([pkg.array("bounce_codes"), pkg.array("bounce_samples")]);
  const [steps, vectors, between, albedo] = await Promise.all(
    ["bounce_steps", "bounce_vectors", "bounce_between", "bounce_albedo"].map((name) => pkg.floats(name)),
  );
  return { codes: codes as Int8Array, samples: samples as Int32Array, steps, vectors, between, albedo };
}

/**
 * Radiance (3) of an albedo of 1 under direct light, as `sg_matt.glsl` has it.
 * distance: d at the axis of a light's matt lobe.
 */
export function mattLight(normal: ArrayLike<number>, { lights, amplitudes, radiance }: MattLights, distance: (light: number) => number): number[] {
  const found = [0, 0, 0];
  for (let light = 0; 4 * light < lights.length; light++) {
    const [x, y, z] = lights.subarray(4 * light, 4 * light + 3);
    const cosine = normal[0] * x + normal[1] * y + normal[2] * z;
    const column = Math.floor(Math.min(Math.max(cosine * 0.5 + 0.5, 0), 1) * FINE + 0.5);
    const at = 4 * (light * (FINE + 1) + column);
    const share = edgeShare(distance(light), radiance[at + 1] ** 2 - 1);
    const value = radiance[at] * Math.min(share * radiance[at + 2], 1);
    for (let channel = 0; channel < 3; channel++) found[channel] += value * amplitudes[3 * light + channel];
  }
  return found;
}

/** What reflected light adds at the vertices, (V, 3); direct: (P, S, 3), of the samples. */
export function bounced({ codes, steps, vectors, between, albedo }: BounceFactors, direct: Float64Array): Float32Array {
  const rank = steps.length;
  const patches = albedo.length / 3;
  const each = direct.length / 3 / patches;
  const light = new Float64Array(3 * patches);
  for (let k = 0; k < direct.length; k++) light[3 * Math.floor(k / 3 / each) + (k % 3)] += direct[k] / each;
  const gather = (sent: Float64Array) => {
    const found = new Float64Array(3 * rank);
    for (let r = 0; r < rank; r++) {
      for (let p = 0; p < patches; p++) {
        for (let c = 0; c < 3; c++) found[3 * r + c] += vectors[r * patches + p] * sent[3 * p + c];
      }
    }
    return found;
  };
  let gathered = gather(light.map((value, k) => value * albedo[k]));
  for (let order = 1; order < ORDERS; order++) {
    const sent = Float64Array.from(light);
    for (let p = 0; p < patches; p++) {
      for (let r = 0; r < rank; r++) {
        for (let c = 0; c < 3; c++) sent[3 * p + c] += between[p * rank + r] * gathered[3 * r + c];
      }
    }
    gathered = gather(sent.map((value, k) => value * albedo[k]));
  }
  const found = new Float32Array((3 * codes.length) / rank);
  const scaled = gathered.map((value, k) => value * steps[Math.floor(k / 3)]);
  for (let v = 0; 3 * v < found.length; v++) {
    for (let c = 0; c < 3; c++) {
      let sum = 0;
      for (let r = 0; r < rank; r++) sum += codes[v * rank + r] * scaled[3 * r + c];
      found[3 * v + c] = Math.max(sum, 0);
    }
  }
  return found;
}

/** Gives surfaces the light of their vertices' rows; source: row of each vertex of the mesh. */
export function showBounced(parts: Surface[], source: Float32Array, light: Float32Array): void {
  for (const { geometry } of parts) {
    const numbers = geometry.getAttribute("number").array;
    const shown = geometry.getAttribute("bounced");
    for (let v = 0; v < numbers.length; v++) {
      const row = 3 * source[numbers[v]];
      shown.setXYZ(v, light[row], light[row + 1], light[row + 2]);
    }
    shown.needsUpdate = true;
  }
}
