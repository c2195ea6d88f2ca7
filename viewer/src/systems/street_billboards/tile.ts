/** One tile of road on the graphics card: billboards whose textures the stage's shader decodes. */

import * as THREE from "three";
import { Surface } from "../../drawing/surface";
import type { Package } from "../../package/package";
import type { Values } from "../../shaders";
import { byDistance } from "./nearest_first";

const QUAD = [0, 1, 2, 0, 2, 3];
const HEADER_TEXELS = 5;
const SIDE = 32;

/** What all tiles of a package have in common: their shader is compiled once. */
export interface Coding {
  ycocg: boolean;
  detailSide: number;
  tintSide: number;
  detailTiles: number;
  tintTiles: number;
}

/** Reads how textures are coded. */
export function codingOf(pkg: Package): Coding {
  return {
    ycocg: pkg.parameter<string>("colour") === "ycocg",
    detailSide: pkg.parameter("detail_side"),
    tintSide: pkg.parameter("tint_side"),
    detailTiles: pkg.parameter("detail_tiles"),
    tintTiles: pkg.parameter("tint_tiles"),
  };
}

/** A tile's billboards; put `surface` into a scene. */
export class Tile {
  readonly surface: Surface;
  /** Bytes of its textures. */
  readonly bytes: number;
  /** Billboards that were sent last. */
  sent = 0;

  private readonly centres: Float32Array;
  private readonly reaches: Float32Array;

  private constructor(
    readonly count: number,
    headers: Float32Array,
    textures: Record<string, THREE.DataTexture>,
    private readonly coding: Coding,
    showBillboards: boolean,
  ) {
    this.bytes = Object.values(textures).reduce((sum, { image }) => sum + (image.data?.byteLength ?? 0), 0);
    this.centres = new Float32Array(3 * count);
    this.reaches = new Float32Array(count);
    for (let number = 0; number < count; number++) {
      const at = 4 * HEADER_TEXELS * number;
      this.centres.set(headers.subarray(at, at + 3), 3 * number);
      const half = (texel: number) => Math.hypot(...headers.subarray(at + 4 * texel, at + 4 * texel + 3));
      this.reaches[number] = Math.hypot(half(1), half(2));
    }
    this.surface = new Surface({
      vertices: new Float32Array(12 * count), // the shader places them
      triangles: new Uint32Array(6 * count),
      vertex: "street_vertex.glsl",
      fragment: "street_fragment.glsl",
      values: this.values(showBillboards),
      textures,
      uniforms: {
        headerColumns: { type: "int", value: textures.headers.image.width / HEADER_TEXELS },
        viewColumns: { type: "int", value: textures.views.image.width },
        maskColumns: { type: "int", value: textures.masks.image.width / SIDE },
        ...atlasUniforms("detail", textures.detailScales),
        ...atlasUniforms("tint", textures.tintScales),
      },
    });
    (this.surface.geometry.index as THREE.BufferAttribute).setUsage(THREE.DynamicDrawUsage);
  }

  /** Loads a tile. Throws BadPackage. */
  static async load(pkg: Package, number: number, count: number, coding: Coding, shown: boolean): Promise<Tile> {
    const folder = `tile_${String(number).padStart(3, "0")}/`;
    const read = async (name: string, interpolate = false) => {
      const { width, height, data } = await pkg.textures(folder + name);
      return dataTexture(data as Uint8Array | Float32Array, width, height, interpolate);
    };
    const atlas = (name: string, interpolate: boolean) =>
      pkg.has(folder + name) ? read(name, interpolate) : dataTexture(new Float32Array(4), 1, 1, false);
    const [headers, views, masks, detail, detailScales, tint, tintScales] = await Promise.all([
      read("headers"),
      read("views"),
      read("masks"),
      atlas("detail", true),
      atlas("detail_scales", false),
      atlas("tint", true),
      atlas("tint_scales", false),
    ]);
    const content = headers.image.data as unknown as Float32Array;
    if (content.length < 4 * HEADER_TEXELS * count) {
      throw new Error(`${pkg.name}: part ${folder}headers holds fewer billboards than tile_billboards says, ${count}.`);
    }
    return new Tile(count, content, { headers, views, masks, detail, detailScales, tint, tintScales }, coding, shown);
  }

  /** Shows billboards in colours of their own, or what they show. */
  showBillboards(shown: boolean): void {
    this.surface.setValues(this.values(shown));
  }

  /** Sends the triangles of what a camera sees, the nearest first. */
  look(frustum: THREE.Frustum, eye: readonly number[]): void {
    const seen = byDistance(this.centres, this.reaches, frustum, eye);
    const index = this.surface.geometry.index as THREE.BufferAttribute;
    const corners = index.array as Uint32Array;
    seen.forEach((number, place) => {
      for (let corner = 0; corner < 6; corner++) corners[6 * place + corner] = 4 * number + QUAD[corner];
    });
    this.sent = seen.length;
    index.needsUpdate = true;
    this.surface.geometry.setDrawRange(0, 6 * seen.length);
    this.surface.visible = seen.length > 0;
  }

  /** Frees what it holds. */
  dispose(): void {
    this.surface.removeFromParent();
    this.surface.dispose();
  }

  private values(showBillboards: boolean): Values {
    const { ycocg, detailSide, tintSide, detailTiles, tintTiles } = this.coding;
    return {
      SHOW_BILLBOARDS: showBillboards,
      YCOCG: ycocg,
      NEUTRAL: ycocg ? [0, 128, 128] : [0, 0, 0],
      HEADER_COLUMNS: "headerColumns",
      VIEW_COLUMNS: "viewColumns",
      MASK_COLUMNS: "maskColumns",
      DETAIL_TILES: detailTiles,
      DETAIL_SIDE: detailSide,
      DETAIL_COLUMNS: "detailColumns",
      DETAIL_SIZE: "detailSize",
      TINT_TILES: tintTiles,
      TINT_SIDE: tintSide,
      TINT_COLUMNS: "tintColumns",
      TINT_SIZE: "tintSize",
    };
  }
}

function atlasUniforms(name: string, scales: THREE.DataTexture) {
  const { width, height } = scales.image;
  return {
    [`${name}Columns`]: { type: "int", value: width },
    [`${name}Size`]: { type: "vec2", value: new THREE.Vector2(1 / width, 1 / height) },
  };
}

/** Four channels, row 0 at t = 0. */
function dataTexture(data: Uint8Array | Float32Array, width: number, height: number, interpolate: boolean) {
  const type = data instanceof Float32Array ? THREE.FloatType : THREE.UnsignedByteType;
  const made = new THREE.DataTexture(data as never, width, height, THREE.RGBAFormat, type);
  made.magFilter = made.minFilter = interpolate ? THREE.LinearFilter : THREE.NearestFilter;
  made.needsUpdate = true;
  return made;
}
