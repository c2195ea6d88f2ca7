/** A `.tsuya` package: what `meta.json` says, and its parts, each checked when it is read. */

import { sha256 } from "@noble/hashes/sha2.js";
import { bytesToHex } from "@noble/hashes/utils.js";
import { decode } from "fast-png";
import { read as readKtx2 } from "ktx-parse";
import { Archive, LARGEST_PART } from "./archive";
import { AGAIN, BadPackage } from "./bad_package";
import { meshOf, type MeshData } from "./mesh";
import { metaOf, type Meta, type PartMeta } from "./meta";
import { Bytes, Remote } from "./source";
import { layersOf, type Layers } from "./textures";

/** Values of an array part; halfs as they are stored, in 16 bits. */
export type Values =
  | Int8Array
  | Uint8Array
  | Int16Array
  | Uint16Array
  | Int32Array
  | Uint32Array
  | Float32Array;

/** A picture (height, width, channels), row 0 at the top. */
export interface Picture<T extends Values = Values> {
  width: number;
  height: number;
  channels: number;
  data: T;
}

/** The first bytes of a PNG. */
const PNG = 0x89504e47;
const LARGEST_META = 16 << 20;
const TYPES: Record<string, { new (buffer: ArrayBuffer): Values; BYTES_PER_ELEMENT: number }> = {
  int8: Int8Array,
  uint8: Uint8Array,
  int16: Int16Array,
  uint16: Uint16Array,
  int32: Int32Array,
  uint32: Uint32Array,
  float16: Uint16Array,
  float32: Float32Array,
};

/** An open package. */
export class Package {
  private constructor(
    private readonly archive: Archive,
    /** `meta.json`. */
    readonly meta: Meta,
  ) {}

  /**
   * Opens a package: its address, or its bytes. Throws BadPackage for what is cut or altered, of a
   * newer format, or names files or sizes that no package has.
   */
  static async open(source: string | Uint8Array, name: string): Promise<Package> {
    const bytes = typeof source === "string" ? await Remote.open(source, name) : new Bytes(source);
    const archive = await Archive.open(bytes, name);
    const text = new TextDecoder().decode(await archive.read("meta.json", LARGEST_META));
    const meta = metaOf(text, name);
    for (const [part, stated] of Object.entries(meta.parts)) {
      const size = archive.sizeOf(stated.file);
      if (size === undefined) throw new BadPackage(name, `part ${part}`, "missing", AGAIN);
      if (size !== stated.bytes) {
        throw new BadPackage(name, `part ${part}`, `${size} bytes`, `${stated.bytes}, as meta.json says`);
      }
    }
    return new Package(archive, meta);
  }

  /** Of its file. */
  get name(): string {
    return this.archive.name;
  }

  /** Whether there is a part of this name. */
  has(name: string): boolean {
    return Object.hasOwn(this.meta.parts, name);
  }

  /** A parameter's value. Throws BadPackage where there is none. */
  parameter<T = number>(name: string): T {
    if (!Object.hasOwn(this.meta.parameters, name)) throw this.bad(`parameter ${name}`, "missing");
    return this.meta.parameters[name].value as T;
  }

  /** What `meta.json` says of a part. Throws BadPackage where there is none. */
  part(name: string): PartMeta {
    if (!this.has(name)) throw this.bad(`part ${name}`, "missing");
    return this.meta.parts[name];
  }

  /** The bytes of a part's file. Throws BadPackage where they are not what was written. */
  async content(name: string): Promise<Uint8Array<ArrayBuffer>> {
    const part = this.part(name);
    const content = await this.archive.read(part.file, LARGEST_PART);
    if ((await hash(content)) !== part.sha256) throw this.bad(`part ${name}`, "not what its hash says");
    return content;
  }

  /** The shape of a part. Throws BadPackage for what is no shape, or larger than any part. */
  shape(name: string): number[] {
    const { shape } = this.part(name);
    const isShape = Array.isArray(shape) && shape.every((side) => Number.isInteger(side) && side >= 0);
    if (!isShape || product(shape) > LARGEST_PART) {
      throw this.bad(`shape of ${name}`, JSON.stringify(shape) ?? "missing", "whole numbers");
    }
    return shape;
  }

  /** An array part, C order; float16 as 16-bit codes, `floats` decodes them. */
  async array(name: string): Promise<Values> {
    const part = this.of(name, "array");
    const type = TYPES[part.dtype ?? ""];
    if (!type) throw this.bad(`dtype of ${name}`, `${part.dtype}`, Object.keys(TYPES).join(", "));
    const count = product(this.shape(name));
    const content = await this.content(name);
    if (content.length !== count * type.BYTES_PER_ELEMENT) {
      throw this.bad(`part ${name}`, `${content.length} bytes`, `${part.dtype} (${part.shape})`);
    }
    return new type(content.slice().buffer);
  }

  /** An array part of floats, halfs widened. */
  async floats(name: string): Promise<Float32Array> {
    const values = await this.array(name);
    return this.part(name).dtype === "float16" ? widened(values as Uint16Array) : Float32Array.from(values);
  }

  /** A picture part: the raw codes. */
  async picture(name: string): Promise<Picture<Uint8Array | Uint16Array>> {
    const part = this.of(name, "picture");
    const shape = this.shape(name);
    const content = await this.content(name);
    // What it announces is looked at before it is decoded, which takes so much memory.
    const head = new DataView(content.buffer, content.byteOffset, content.byteLength);
    if (content.length < 24 || head.getUint32(0) !== PNG) throw this.bad(`part ${name}`, "no PNG");
    if (head.getUint32(16) !== shape[1] || head.getUint32(20) !== shape[0]) {
      throw this.bad(`part ${name}`, "a PNG of another size", `(${shape}), as meta.json says`);
    }
    let png: ReturnType<typeof decode>;
    try {
      png = decode(content);
    } catch {
      throw this.bad(`part ${name}`, "no PNG");
    }
    const { width, height, channels, depth } = png;
    const data = png.data as Uint8Array | Uint16Array;
    const found = `uint${depth} (${height},${width},${channels})`;
    if (found !== `${part.dtype} (${part.shape})` || data.length !== width * height * channels) {
      throw this.bad(`part ${name}`, found, `${part.dtype} (${part.shape}), as meta.json says`);
    }
    return { width, height, channels, data };
  }

  /** A textures part (layer, y, x, channel). */
  async textures(name: string): Promise<Layers> {
    const part = this.of(name, "textures");
    this.shape(name);
    const content = await this.content(name);
    let layers: Layers;
    try {
      layers = layersOf(readKtx2(content));
    } catch (error) {
      throw this.bad(`part ${name}`, (error as Error).message);
    }
    const found = `${layers.dtype} (${layers.count},${layers.height},${layers.width},${layers.channels})`;
    if (found !== `${part.dtype} (${part.shape})`) {
      throw this.bad(`part ${name}`, found, `${part.dtype} (${part.shape}), as meta.json says`);
    }
    return layers;
  }

  /** A mesh part, z up. */
  async mesh(name: string): Promise<MeshData> {
    this.of(name, "mesh");
    const content = await this.content(name);
    try {
      return meshOf(content);
    } catch (error) {
      throw this.bad(`part ${name}`, (error as Error).message);
    }
  }

  private of(name: string, kind: PartMeta["kind"]): PartMeta {
    const part = this.part(name);
    if (part.kind !== kind) throw this.bad(`part ${name}`, `of kind ${part.kind}`, kind);
    return part;
  }

  private bad(field: string, found: string, expected = AGAIN): BadPackage {
    return new BadPackage(this.name, field, found, expected);
  }
}

/** Halfs, as 16-bit codes, as floats. */
export function widened(halfs: Uint16Array): Float32Array {
  return Float32Array.from(halfs, (code) => {
    const sign = code & 0x8000 ? -1 : 1;
    const exponent = (code >> 10) & 31;
    const fraction = code & 1023;
    if (exponent === 31) return fraction ? NaN : sign * Infinity;
    return sign * (exponent ? 2 ** (exponent - 15) * (1 + fraction / 1024) : 2 ** -14 * (fraction / 1024));
  });
}

function product(sides: number[]): number {
  return sides.reduce((so, side) => so * side, 1);
}

async function hash(content: Uint8Array<ArrayBuffer>): Promise<string> {
  // Pages that did not come by a secure way have no `subtle`.
  const subtle = globalThis.crypto?.subtle;
  return bytesToHex(subtle ? new Uint8Array(await subtle.digest("SHA-256", content)) : sha256(content));
}
