/** The photograph of a package: its colours, the luminance that its depths come from, its texture. */

import * as THREE from "three";
import { texture } from "../../drawing/textures";
import { BadPackage } from "../../package/bad_package";
import type { Package, Picture } from "../../package/package";

const LARGEST_SIDE = 1 << 14;
/** The box of an AVIF file that tells its size, and where in it width and height stand. */
const SIZE_BOX = "ispe";
const WIDTH_AT = 8;

/** The photograph, four channels, alpha for depth codes. Throws BadPackage for what is no AVIF. */
export async function photographOf(pkg: Package): Promise<Picture<Uint8Array>> {
  const content = await pkg.content("photograph");
  const bad = (found: string) => new BadPackage(pkg.name, "part photograph", found, "an AVIF file, as it was packed");
  const size = sizeOf(content);
  if (!size || Math.max(...size) > LARGEST_SIDE) throw bad(size ? size.join(" x ") : "no AVIF");
  const [width, height] = size;
  let bitmap: ImageBitmap;
  try {
    bitmap = await createImageBitmap(new Blob([content], { type: "image/avif" }), { colorSpaceConversion: "none" });
  } catch {
    throw bad("no AVIF that this browser reads");
  }
  const context = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true, alpha: false })!;
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  const data = new Uint8Array(context.getImageData(0, 0, width, height).data.buffer);
  return { width, height, channels: 4, data };
}

/** Width and height that an AVIF file announces. */
export function sizeOf(content: Uint8Array): [number, number] | undefined {
  const text = String.fromCharCode(...content.subarray(0, 1024));
  const at = text.indexOf(SIZE_BOX) + WIDTH_AT;
  if (text.slice(4, 8) !== "ftyp" || at < WIDTH_AT || at + 8 > content.length) return undefined;
  const data = new DataView(content.buffer, content.byteOffset, content.byteLength);
  return [data.getUint32(at), data.getUint32(at + 4)];
}

/** Linear luminance of a photograph (Rec. 709); -1 where `opaque` says that no fur is. */
export function luminanceOf({ data }: Picture<Uint8Array>, opaque?: Picture): Float32Array {
  const linear = Float64Array.from({ length: 256 }, (_, code) => {
    const light = code / 255;
    return light <= 0.04045 ? light / 12.92 : ((light + 0.055) / 1.055) ** 2.4;
  });
  return Float32Array.from({ length: data.length / 4 }, (_, pixel) => {
    if (opaque && opaque.data[pixel] < 128) return -1;
    const at = 4 * pixel;
    return 0.2126 * linear[data[at]] + 0.7152 * linear[data[at + 1]] + 0.0722 * linear[data[at + 2]];
  });
}

/** Its texture, mirrored beyond its borders. */
export function photographTexture(photograph: Picture<Uint8Array>): THREE.DataTexture {
  return texture(photograph, { wrap: "mirrored", srgb: true });
}

/** Other depth codes, row 0 at the top, into the texture's alpha; with mipmaps, or without. */
export function setCodes(photograph: THREE.DataTexture, codes: Uint8Array, mipmap: boolean): void {
  const { width, height, data } = photograph.image as { width: number; height: number; data: Uint8Array };
  for (let row = 0; row < height; row++) {
    const from = (height - 1 - row) * width;
    for (let column = 0; column < width; column++) data[4 * (row * width + column) + 3] = codes[from + column];
  }
  photograph.minFilter = mipmap ? THREE.LinearMipmapLinearFilter : THREE.LinearFilter;
  photograph.generateMipmaps = mipmap;
  photograph.needsUpdate = true;
}
