/** Meshes of .glb files: the raw arrays, z up. */

/** A mesh: flat arrays, `width` numbers a vertex. */
export interface MeshData {
  /** (V, 3), z up. */
  vertices: Float32Array;
  /** (F, 3). */
  triangles: Uint32Array;
  normals?: Float32Array;
  /** (V, 2), v from the bottom. */
  uvs?: Float32Array;
  /** By name, without the underscore. */
  attributes: Record<string, { values: Float32Array; width: number }>;
}

interface Accessor {
  bufferView: number;
  byteOffset?: number;
  componentType: number;
  count: number;
  type: string;
}

interface Document {
  accessors: Accessor[];
  bufferViews: { byteOffset?: number; byteLength: number; byteStride?: number }[];
  meshes: { primitives: { attributes: Record<string, number>; indices: number }[] }[];
}

const WIDTHS: Record<string, number> = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };
const FLOAT = 5126;
const UNSIGNED_INT = 5125;
const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
const BIN_CHUNK = 0x004e4942;

/** The mesh of a .glb of a package. Throws an Error that says what is wrong. */
export function meshOf(content: Uint8Array<ArrayBuffer>): MeshData {
  const [document, binary] = chunks(content);
  const primitive = document.meshes?.[0]?.primitives?.[0];
  if (!primitive) throw new Error("without a mesh");
  const read = (number: number) => accessor(document, binary, number);
  const { POSITION, NORMAL, TEXCOORD_0, ...others } = primitive.attributes;
  if (POSITION === undefined || primitive.indices === undefined) throw new Error("without positions or indices");
  const vertices = read(POSITION).values as Float32Array;
  const mesh: MeshData = { vertices, triangles: read(primitive.indices).values as Uint32Array, attributes: {} };
  if (NORMAL !== undefined) mesh.normals = read(NORMAL).values as Float32Array;
  if (TEXCOORD_0 !== undefined) {
    mesh.uvs = read(TEXCOORD_0).values as Float32Array;
    for (let i = 1; i < mesh.uvs.length; i += 2) mesh.uvs[i] = 1 - mesh.uvs[i];
  }
  for (const [name, number] of Object.entries(others)) {
    mesh.attributes[name.replace(/^_/, "")] = read(number) as { values: Float32Array; width: number };
  }
  const count = vertices.length / 3;
  if (mesh.triangles.some((corner) => corner >= count)) throw new Error("with corners that are no vertices");
  return mesh;
}

function chunks(content: Uint8Array<ArrayBuffer>): [Document, Uint8Array<ArrayBuffer>] {
  const data = new DataView(content.buffer, content.byteOffset, content.byteLength);
  if (content.length < 28 || data.getUint32(0, true) !== MAGIC) throw new Error("no .glb");
  const length = data.getUint32(12, true);
  const start = 20 + length;
  if (data.getUint32(16, true) !== JSON_CHUNK || start + 8 > content.length) throw new Error("a .glb that is cut");
  const size = data.getUint32(start, true);
  if (data.getUint32(start + 4, true) !== BIN_CHUNK || start + 8 + size > content.length) {
    throw new Error("a .glb that is cut");
  }
  const text = new TextDecoder().decode(content.subarray(20, start));
  return [JSON.parse(text) as Document, content.subarray(start + 8, start + 8 + size)];
}

function accessor(document: Document, binary: Uint8Array<ArrayBuffer>, number: number) {
  const found = document.accessors?.[number];
  const view = document.bufferViews?.[found?.bufferView ?? -1];
  const width = WIDTHS[found?.type ?? ""];
  if (!found || !view || !width || view.byteStride !== undefined) throw new Error("with accessors of another kind");
  if (found.componentType !== FLOAT && found.componentType !== UNSIGNED_INT) {
    throw new Error("with numbers of another kind");
  }
  const offset = (view.byteOffset ?? 0) + (found.byteOffset ?? 0);
  const bytes = 4 * width * found.count;
  if (!(offset >= 0 && bytes >= 0 && offset + bytes <= binary.length)) throw new Error("a .glb that is cut");
  const own = binary.slice(offset, offset + bytes).buffer;
  return { values: found.componentType === FLOAT ? new Float32Array(own) : new Uint32Array(own), width };
}
