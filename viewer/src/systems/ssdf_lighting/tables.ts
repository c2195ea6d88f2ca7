/** Numbers as textures that are only fetched: row 0 is at t = 0, nothing is interpolated. */

import * as THREE from "three";

/** Rows of texels (height, width, 4), as floats or as bytes, which are read as 0 to 1. */
export function tableTexture(values: Float32Array | Uint8Array, width: number, height: number): THREE.DataTexture {
  const type = values instanceof Uint8Array ? THREE.UnsignedByteType : THREE.FloatType;
  const made = new THREE.DataTexture(values as never, width, height, THREE.RGBAFormat, type);
  made.magFilter = made.minFilter = THREE.NearestFilter;
  made.unpackAlignment = 1;
  made.needsUpdate = true;
  return made;
}

/** A line of texels (count, 4), wrapped into rows of so many columns. */
export function lineTexture(values: Float32Array | Uint8Array, columns: number): THREE.DataTexture {
  const rows = Math.max(1, Math.ceil(values.length / 4 / columns));
  const length = 4 * columns * rows;
  const whole = values instanceof Uint8Array ? new Uint8Array(length) : new Float32Array(length);
  whole.set(values);
  return tableTexture(whole, columns, rows);
}
