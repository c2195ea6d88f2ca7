/** The mesh's parts, each with the shader of its material: as the stage's `finishes.py`. */

import * as THREE from "three";
import { Surface } from "../../drawing/surface";
import { texture } from "../../drawing/textures";
import type { MeshData } from "../../package/mesh";
import type { Package, Picture } from "../../package/package";
import { float, type Values } from "../../shaders";
import { LEAST_VIEW, type LightUniforms } from "./edge_pass";
import { FINE } from "./lobe_tables";
import { tableTexture } from "./tables";

const LEAST_SLOPE = 0.05;
const MOST_SPECULAR = 0.99;
const ROUGHNESSES = { start: 0.05, end: 1, count: 12 };
const SPECULARS = { start: 0.02, end: 0.99, count: 5 };
const ANISOTROPY = 8;
const ANYWHERE = 1e30;
const KINDS = ["colour", "surface", "normal"] as const;

/** A package's materials. */
export interface Materials {
  count: number;
  albedo: Float32Array;
  specular: Float32Array;
  roughness: Float32Array;
  tint: Float32Array;
  /** (rows, columns, 4). */
  gloss: Float32Array;
  glossColumns: number;
  varying: Varying[];
}

interface Map {
  picture: Picture<Uint8Array>;
  wrap: [number, number];
  mapping: number;
}

/** A material that varies over the surface. */
interface Varying {
  row: number;
  factors: Float32Array;
  maps: Partial<Record<(typeof KINDS)[number], Map>>;
}

/** Reads the materials of a package. */
export async function readMaterials(pkg: Package): Promise<Materials> {
  const [albedo, specular, roughness, tint, gloss] = await Promise.all(
    ["albedo", "specular", "roughness", "tint", "gloss_lobes"].map((name) => pkg.floats(name)),
  );
  const glossColumns = pkg.shape("gloss_lobes")[1];
  const varying = pkg.has("varying") ? await readVarying(pkg) : [];
  return { count: specular.length, albedo, specular, roughness, tint, gloss, glossColumns, varying };
}

async function readVarying(pkg: Package): Promise<Varying[]> {
  const [rows, factors, of, wrap, mapping] = await Promise.all(
    ["varying", "factors", "map_of", "map_wrap", "map_mapping"].map((name) => pkg.array(name)),
  );
  const made: Varying[] = Array.from(rows, (row, k) => ({
    row,
    factors: Float32Array.from(factors.subarray(9 * k, 9 * k + 9)),
    maps: {},
  }));
  for (let k = 0; k < mapping.length; k++) {
    const picture = (await pkg.picture(`map_${String(k).padStart(3, "0")}`)) as Picture<Uint8Array>;
    made[of[2 * k]].maps[KINDS[of[2 * k + 1]]] = {
      picture,
      wrap: [wrap[2 * k], wrap[2 * k + 1]],
      mapping: mapping[k],
    };
  }
  return made;
}

/** What the parts share: the lights' number, and the distances' texture and its rows. */
export interface Shared {
  lightCount: number;
  edges: THREE.Texture;
  edgeRows: number;
}

/** Surfaces, glossy ones first: what is likely in front. */
export function litParts(mesh: MeshData, materials: Materials, shared: Shared): Surface[] {
  const material = mesh.attributes.MATERIAL.values;
  const isVarying = new Set(materials.varying.map(({ row }) => row));
  const plain = (isGlossy: boolean) => (row: number) => !isVarying.has(row) && materials.specular[row] > 0 === isGlossy;
  const found: (Surface | undefined)[] = [true, false].map((isGlossy) =>
    part(mesh, shared, plain(isGlossy), material, plainFinish(materials, isGlossy)),
  );
  for (const own of materials.varying) {
    found.push(part(mesh, shared, (row) => row === own.row, material, variedFinish(own, materials)));
  }
  return found.filter((surface) => surface !== undefined);
}

/** Sets what the parts show. */
export function lightParts(parts: Surface[], eye: THREE.Vector4, lights: LightUniforms, matt: THREE.Texture): void {
  for (const { uniforms } of parts) {
    uniforms.eye.value = eye;
    uniforms.lights.value = lights.lights;
    uniforms.amplitudes.value = lights.amplitudes;
    uniforms.matt.value = matt;
  }
}

interface Finish {
  isGlossy: boolean;
  isVaried: boolean;
  values: Values;
  textures: Record<string, THREE.Texture>;
  vectors: Record<string, number[]>;
}

function part(
  mesh: MeshData,
  { lightCount, edges, edgeRows }: Shared,
  chosen: (row: number) => boolean,
  material: Float32Array,
  finish: Finish,
): Surface | undefined {
  const corners: number[] = [];
  const places = new Int32Array(mesh.vertices.length / 3).fill(-1);
  const own: number[] = []; // vertices of the part
  for (let k = 0; k < mesh.triangles.length; k += 3) {
    if (!chosen(material[mesh.triangles[k]])) continue;
    for (const vertex of mesh.triangles.subarray(k, k + 3)) {
      if (places[vertex] < 0) places[vertex] = own.push(vertex) - 1;
      corners.push(places[vertex]);
    }
  }
  if (!corners.length) return undefined;
  const { PAINT, UV1, MATERIAL } = mesh.attributes;
  const uvs = gathered(own, mesh.uvs!, 2);
  const others = gathered(own, UV1.values, 2);
  const mappings = Float32Array.from({ length: 4 * own.length }, (_, k) => {
    const from = 2 * Math.floor(k / 4) + (k % 2);
    return k % 4 < 2 ? uvs[from] : others[from];
  });
  const surface = new Surface({
    vertices: gathered(own, mesh.vertices, 3),
    triangles: Uint32Array.from(corners),
    attributes: {
      shading: { values: gathered(own, mesh.normals!, 3), width: 3 },
      bounced: { values: new Float32Array(3 * own.length), width: 3 },
      number: { values: Float32Array.from(own), width: 1 },
      ...(finish.isVaried
        ? { paint: { values: gathered(own, PAINT.values, 3), width: 3 }, mappings: { values: mappings, width: 4 } }
        : { object: { values: gathered(own, MATERIAL.values, 1), width: 1 } }),
    },
    vertex: "lit_vertex.glsl",
    fragment: "lit_fragment.glsl",
    values: {
      LIGHTS: lightCount,
      EDGES: Math.ceil(lightCount / 4) * (finish.isGlossy ? 2 : 1),
      EDGES_FETCHED: true,
      EDGE_ROWS: edgeRows,
      MATT_HALF: float(FINE / 2),
      TEXTURED: finish.isVaried,
      GLOSS: finish.isGlossy,
      ...finish.values,
    },
    textures: finish.textures,
  });
  const named: Record<string, unknown> = { fetchedEdges: edges, matt: null, eye: new THREE.Vector4(), lights: null, amplitudes: null };
  for (const [name, vector] of Object.entries(finish.vectors)) named[name] = new THREE.Vector4(...vector);
  // The files declare them.
  for (const [name, value] of Object.entries(named)) surface.uniforms[name] = { value };
  return surface;
}

/** Values of some vertices, `width` each. */
function gathered(vertices: number[], values: Float32Array, width: number): Float32Array {
  const found = new Float32Array(vertices.length * width);
  vertices.forEach((from, to) => found.set(values.subarray(from * width, (from + 1) * width), to * width));
  return found;
}

function plainFinish(materials: Materials, isGlossy: boolean): Finish {
  const { count } = materials;
  const rows = new Float32Array(8 * count);
  for (let row = 0; row < count; row++) {
    rows.set(materials.albedo.subarray(3 * row, 3 * row + 3), 4 * row);
    rows[4 * row + 3] = materials.specular[row];
    rows[4 * (count + row)] = materials.roughness[row];
    rows.set(materials.tint.subarray(3 * row, 3 * row + 3), 4 * (count + row) + 1);
  }
  const textures: Record<string, THREE.Texture> = { materials: tableTexture(rows, count, 2) };
  const { gloss, glossColumns } = materials;
  if (isGlossy) textures.gloss = tableTexture(gloss.slice(0, 4 * count * glossColumns), glossColumns, count);
  return { isGlossy, isVaried: false, values: glossValues(isGlossy, glossColumns), textures, vectors: {} };
}

function variedFinish({ factors, maps }: Varying, materials: Materials): Finish {
  const f = Array.from(factors);
  const isGlossy = Math.max(f[4], f[5], f[6]) > 0 || f[3] > 0;
  const finish: Finish = {
    isGlossy,
    isVaried: true,
    values: { LEAST_SLOPE, MOST_SPECULAR, ...glossValues(isGlossy, materials.glossColumns) },
    textures: {},
    vectors: { factors: f.slice(0, 4), finish: f.slice(4, 8) },
  };
  const values: Record<string, boolean> = {};
  for (const kind of KINDS) {
    const map = maps[kind];
    values[`${kind.toUpperCase()}_MAP`] = map !== undefined;
    if (!map) continue;
    const { made, place, limits } = mapTexture(map, kind === "colour");
    finish.textures[`${kind}Map`] = made;
    finish.vectors[`${kind}Place`] = [...place, map.mapping, f[8]];
    finish.vectors[`${kind}Limits`] = limits;
  }
  const grid = [ROUGHNESSES, SPECULARS];
  finish.values = {
    ...finish.values,
    ...values,
    GRID_START: grid.map(({ start }) => start),
    GRID_END: grid.map(({ end }) => end),
    GRID_STEPS: grid.map(({ count }) => count),
  };
  if (isGlossy) finish.textures.gloss = gridTexture(materials);
  return finish;
}

function glossValues(isGlossy: boolean, columns: number): Values {
  return isGlossy ? { LEAST_VIEW, GLOSS_COLUMNS: columns } : {};
}

/** The rows behind the materials', with the logarithm of the sharpness, interpolated. */
function gridTexture({ gloss, glossColumns, count }: Materials): THREE.DataTexture {
  const rows = gloss.slice(4 * count * glossColumns);
  for (let k = 0; k < rows.length; k += 4) rows[k] = Math.log(rows[k]);
  const height = rows.length / 4 / glossColumns;
  // Row 0 is at t = 0: `texture` puts the first row at the top.
  const flipped = new Float32Array(rows.length);
  const row = 4 * glossColumns;
  for (let y = 0; y < height; y++) flipped.set(rows.subarray(y * row, (y + 1) * row), (height - 1 - y) * row);
  return texture({ width: glossColumns, height, channels: 4, data: flipped });
}

/**
 * A map, and the shader's factors and limits of its coordinates. As on the stage both axes wrap
 * alike: of two that differ the card repeats, what is mirrored is written out twice, and the shader
 * clamps.
 */
function mapTexture({ picture, wrap }: Map, srgb: boolean) {
  const modes = ["repeat", "mirrored", "clamp"] as const;
  const place = [1, 1];
  const low = [-ANYWHERE, -ANYWHERE];
  const high = [ANYWHERE, ANYWHERE];
  let shown = picture;
  const isSame = wrap[0] === wrap[1];
  wrap.forEach((mode, axis) => {
    if (isSame) return;
    const count = axis === 0 ? shown.width : shown.height;
    if (modes[mode] === "clamp") [low[axis], high[axis]] = [0.5 / count, 1 - 0.5 / count];
    if (modes[mode] === "mirrored") {
      shown = mirrored(shown, axis);
      place[axis] = 0.5;
    }
  });
  const made = texture(shown, { wrap: isSame ? modes[wrap[0]] : "repeat", mipmap: true, srgb });
  made.anisotropy = ANISOTROPY;
  return { made, place, limits: [...low, ...high] };
}

/** A picture with its mirror image on the right of it, or above it. */
function mirrored(picture: Picture<Uint8Array>, axis: number): Picture<Uint8Array> {
  const { width, height, channels } = picture;
  const size = axis === 0 ? { width: 2 * width, height } : { width, height: 2 * height };
  const data = new Uint8Array(2 * picture.data.length);
  for (let y = 0; y < size.height; y++) {
    for (let x = 0; x < size.width; x++) {
      const fromX = x < width ? x : 2 * width - 1 - x;
      const fromY = axis === 0 ? y : y < height ? height - 1 - y : y - height;
      const from = channels * (fromY * width + fromX);
      data.set(picture.data.subarray(from, from + channels), channels * (y * size.width + x));
    }
  }
  return { ...size, channels, data };
}
