/** The glass with its scratches, as the stage's `ScratchedActor`. */

import * as THREE from "three";
import { Surface } from "../../drawing/surface";
import { BadPackage } from "../../package/bad_package";
import type { Package, Values } from "../../package/package";
import type { Layers } from "../../package/textures";
import { float } from "../../shaders";
import { HALF_OF_BYTE } from "./halfs";
import { LIGHTS } from "./lights";
import { TREE_WIDTH, triangleTree } from "./triangle_tree";

const SCHEMA = 2;

/** Layers of two textures of four channels. */
const A_TEXTURE = 4;
/** Surfaces that a ray through a pixel is followed to. */
const EVENTS = 8;
/** Least distance to the next of them, in a solid of radius 1. */
const NEAREST = 1e-4;
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
  if (pkg.meta.schema !== SCHEMA) {
    throw new BadPackage(pkg.name, "schema", `${pkg.meta.schema}`, `${SCHEMA}: make the package again`);
  }
  const [mesh, coverage, table, leans, angles] = await Promise.all([
    pkg.mesh("object"),
    pkg.textures("coverage"),
    pkg.array("table"),
    pkg.floats("leans"),
    pkg.floats("angles"),
  ]);
  const [tables, views, columns] = pkg.shape("table");
  const lights = floats(new Float32Array(4 * 2 * ALL_LIGHTS), ALL_LIGHTS, 2);
  if (!mesh.normals) throw new Error(`${pkg.name}: object has no normals; expected those of shading.`);
  const tree = triangleTree(...apart(mesh.triangles, mesh.vertices, mesh.normals));
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
      INDEX: float(pkg.parameter("refractive_index")),
      BINS: columns / 2,
      LEANS: tables,
      LEAN_VALUES: Array.from(leans),
      KEEPS: pkg.parameter<boolean>("keeps_lean"),
      EVENTS,
      NEAREST: float(NEAREST),
      TREE_WIDTH,
      LAMP_EDGE: edge,
      EYE: "eye",
      TILE: "tileSide",
      THROUGH: "allAround", // not `through`, which the shader has of its own
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
      softSky: new THREE.Texture(),
      lights,
      table: tableTexture(table as Uint16Array, columns, tables * views),
      tree: treeTexture(tree.nodes),
      corners: treeTexture(tree.corners),
      coverageA: coverageTexture(coverage, 0),
      coverageB: coverageTexture(coverage, A_TEXTURE),
    },
    uniforms: {
      eye: { type: "vec3", value: new THREE.Vector3() },
      brightness: { type: "float", value: 1 },
      tileSide: { type: "float", value: 1 },
      allAround: { type: "float", value: 0 },
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
  return made;
}

/** A row for each lean and view, a column for each light. */
function tableTexture(table: Uint16Array, columns: number, rows: number): THREE.DataTexture {
  const made = halfs(table, columns, rows, THREE.RedFormat);
  made.wrapS = made.wrapT = THREE.ClampToEdgeWrapping;
  return made;
}

function treeTexture(texels: Float32Array): THREE.DataTexture {
  return floats(texels, TREE_WIDTH, texels.length / (4 * TREE_WIDTH));
}

/** Places and normals of the corners of each triangle for itself. */
function apart(triangles: Uint32Array, ...each: Float32Array[]): [Float32Array, Float32Array] {
  const [places, normals] = each.map((values) => {
    const made = new Float32Array(3 * triangles.length);
    triangles.forEach((vertex, n) => made.set(values.subarray(3 * vertex, 3 * vertex + 3), 3 * n));
    return made;
  });
  return [places, normals];
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
  made.magFilter = made.minFilter = THREE.NearestFilter;
  made.needsUpdate = true;
  return made;
}
