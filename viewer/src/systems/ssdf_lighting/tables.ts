/** Numbers as textures that are only fetched: row 0 is at t = 0, nothing is interpolated. */

import * as THREE from "three";

/** Rows of texels (height, width, 4), as floats or, half as large, as halfs. */
export function tableTexture(values: Float32Array, width: number, height: number, halfs = false): THREE.DataTexture {
  const content = halfs ? Uint16Array.from(values, (value) => THREE.DataUtils.toHalfFloat(value)) : values;
  const type = halfs ? THREE.HalfFloatType : THREE.FloatType;
  const made = new THREE.DataTexture(content as never, width, height, THREE.RGBAFormat, type);
  made.magFilter = made.minFilter = THREE.NearestFilter;
  made.unpackAlignment = 1;
  made.needsUpdate = true;
  return made;
}

/** A line of texels (count, 4), wrapped into rows of so many columns. */
export function lineTexture(values: Float32Array, columns: number, halfs = false): THREE.DataTexture {
  const rows = Math.max(1, Math.ceil(values.length / 4 / columns));
  const whole = new Float32Array(4 * columns * rows);
  whole.set(values);
  return tableTexture(whole, columns, rows, halfs);
}
