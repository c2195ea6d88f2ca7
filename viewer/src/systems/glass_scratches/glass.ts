/** The glass with its scratches, as the stage's `ScratchedActor`. */

import * as THREE from "three";
import { Surface } from "../../drawing/surface";
import type { Package, Values } from "../../package/package";
import type { Layers } from "../../package/textures";
import { float } from "../../shaders";
import { HALF_OF_BYTE } from "./halfs";
import { LIGHTS } from "./lights";

/** Layers of two textures of four channels. */
const A_TEXTURE = 4;
const ANISOTROPY = 4;
/** The environment's lights and the lamp's. */
const ALL_LIGHTS = LIGHTS + 1;

/** The glass of a package, and the texture that its lights are written to. */
export interface Glass {
  surface: Surface;
  lights: THREE.DataTexture;
  layers: number;
}

/** Makes the glass of a package. Throws BadPackage. */
export async function glassOf(pkg: Package, edge: readonly number[]): Promise<Glass> {
  const [mesh, coverage, table, leaning, angles] = await Promise.all([
    pkg.mesh("object"),
    pkg.textures("coverage"),
    pkg.array("table"),
    pkg.floats("leaning"),
    pkg.floats("angles"),
  ]);
  const bins = pkg.shape("table")[0];
  const index = pkg.parameter("refractive_index");
  const lights = floats(new Float32Array(4 * 2 * ALL_LIGHTS), ALL_LIGHTS, 2);
  lights.magFilter = lights.minFilter = THREE.NearestFilter;
  if (!mesh.normals) throw new Error(`${pkg.name}: object has no normals; expected those of shading.`);
  const surface = new Surface({
    vertices: mesh.vertices,
    triangles: mesh.triangles,
    attributes: { shading: { values: mesh.normals, width: 3 }, facing: mesh.attributes.FACING },
    vertex: "scratched_glass_vertex.glsl",
    fragment: "scratched_glass_fragment.glsl",
    values: {
      LAYERS: angles.length,
      ANGLES: Array.from(angles),
      LIGHTS: ALL_LIGHTS,
      RELATIVE_INDEX: float(1 / index),
      BASE_REFLECTANCE: float(((index - 1) / (index + 1)) ** 2),
      LAMP_EDGE: edge,
      EYE: "eye",
      TILE: "tileSide",
      THROUGH: "through",
      TO_SKY: "toSky",
      LAMP: "lamp",
      LAMP_RADIANCE: "lampRadiance",
      COVERED_A: "coveredA",
      COVERED_B: "coveredB",
      STRENGTH: "strength",
      BRIGHTNESS: "brightness",
    },
    textures: {
      sky: new THREE.Texture(),
      lights,
      table: halfs(table as Uint16Array, bins, bins, THREE.RedFormat),
      leaning: leaningTexture(leaning, bins),
      coverageA: coverageTexture(coverage, 0),
      coverageB: coverageTexture(coverage, A_TEXTURE),
    },
    uniforms: {
      eye: { type: "vec3", value: new THREE.Vector3() },
      brightness: { type: "float", value: 1 },
      tileSide: { type: "float", value: 1 },
      through: { type: "float", value: 0 },
      toSky: { type: "mat3", value: new THREE.Matrix3() },
      lamp: { type: "vec3", value: new THREE.Vector3(0, 0, 1) },
      lampRadiance: { type: "vec3", value: new THREE.Vector3() },
      coveredA: { type: "vec4", value: new THREE.Vector4() },
      coveredB: { type: "vec4", value: new THREE.Vector4() },
      strength: { type: "float", value: 1 },
    },
  });
  return { surface, lights, layers: angles.length };
}

/** Four layers from one on, as halfs: bytes would be rounded again in each mipmap. */
function coverageTexture({ count, width, height, data }: Layers, first: number): THREE.DataTexture {
  const texels = width * height;
  if (first >= count) return halfs(new Uint16Array(4), 1, 1, THREE.RGBAFormat);
  const content = new Uint16Array(4 * texels);
  for (let layer = first; layer < Math.min(count, first + A_TEXTURE); layer++) {
    for (let texel = 0; texel < texels; texel++) {
      content[4 * texel + layer - first] = HALF_OF_BYTE[data[layer * texels + texel]];
    }
  }
  const made = halfs(content, width, height, THREE.RGBAFormat);
  made.minFilter = THREE.LinearMipmapLinearFilter;
  made.generateMipmaps = true;
  made.anisotropy = ANISOTROPY;
  return made;
}

function leaningTexture(rows: Float32Array, bins: number): THREE.DataTexture {
  const content = new Uint16Array(2 * bins);
  for (let bin = 0; bin < bins; bin++) {
    content[2 * bin] = THREE.DataUtils.toHalfFloat(rows[bin]);
    content[2 * bin + 1] = THREE.DataUtils.toHalfFloat(rows[bins + bin]);
  }
  return halfs(content, bins, 1, THREE.RGFormat);
}

function halfs(content: Uint16Array, width: number, height: number, format: THREE.PixelFormat): THREE.DataTexture {
  const made = new THREE.DataTexture(content as Uint16Array<ArrayBuffer>, width, height, format, THREE.HalfFloatType);
  made.magFilter = made.minFilter = THREE.LinearFilter;
  made.wrapS = made.wrapT = THREE.RepeatWrapping;
  made.unpackAlignment = 1;
  made.needsUpdate = true;
  return made;
}

function floats(content: Values, width: number, height: number): THREE.DataTexture {
  const made = new THREE.DataTexture(content as Float32Array<ArrayBuffer>, width, height, THREE.RGBAFormat, THREE.FloatType);
  made.needsUpdate = true;
  return made;
}
