/** A user's environment: Radiance .hdr, or a picture of sRGB codes. */

import { BadPackage } from "../../package/bad_package";
import type { Environment } from "./sphere_map";

const LARGEST = 1 << 29; // texels
const WAY_OUT = "an equirectangular picture, twice as wide as high: .hdr, .png or .jpg";

/** Reads a file. Throws BadPackage, one sentence, for what is no environment. */
export async function readProbe(file: File): Promise<Environment> {
  const ending = file.name.toLowerCase().replace(/^.*\./, "");
  if (ending === "exr") {
    throw new BadPackage(file.name, "file", "an OpenEXR", "a Radiance .hdr of it, or `tsuya run` with the .exr");
  }
  if (ending === "hdr") return readRadiance(new Uint8Array(await file.arrayBuffer()), file.name);
  return readPicture(file);
}

/** A Radiance picture, run-length encoded or not. Throws BadPackage. */
export function readRadiance(content: Uint8Array, name: string): Environment {
  const bad = (field: string, found: string, expected = WAY_OUT) => new BadPackage(name, field, found, expected);
  const head = new TextDecoder("latin1").decode(content.subarray(0, 4096));
  if (!/^#\?(RADIANCE|RGBE)/.test(head)) throw bad("file", "no Radiance picture");
  const size = /\n\n-Y (\d+) \+X (\d+)\n/.exec(head);
  if (!size) throw bad("size", "not stated as -Y height +X width");
  if (/FORMAT=32-bit_rle_xyze/.test(head)) throw bad("FORMAT", "XYZ", "RGB");
  const [height, width] = [Number(size[1]), Number(size[2])];
  checkSize(width, height, bad);
  const codes = new Uint8Array(4 * width * height);
  let at = size.index + size[0].length;
  for (let row = 0; row < height; row++) at = readLine(content, at, codes.subarray(4 * row * width, 4 * (row + 1) * width));
  if (at > content.length) throw bad("file", "cut", "all of it");
  const data = new Float32Array(3 * width * height);
  for (let p = 0; p < width * height; p++) {
    const exponent = codes[4 * p + 3];
    const scale = exponent ? 2 ** (exponent - 136) : 0;
    for (let channel = 0; channel < 3; channel++) data[3 * p + channel] = codes[4 * p + channel] * scale;
  }
  return { height, data };
}

/** One line of codes (width, 4); returns where the next begins. */
function readLine(content: Uint8Array, start: number, codes: Uint8Array): number {
  const width = codes.length / 4;
  const isPacked =
    width >= 8 && width < 32768 && content[start] === 2 && content[start + 1] === 2 && content[start + 2] < 128;
  if (!isPacked) {
    codes.set(content.subarray(start, start + codes.length));
    return start + codes.length;
  }
  let at = start + 4;
  for (let channel = 0; channel < 4; channel++) {
    for (let column = 0; column < width && at < content.length; ) {
      const count = content[at++];
      const isRun = count > 128;
      for (let k = 0; k < (isRun ? count - 128 : count) && column < width; k++) {
        codes[4 * column++ + channel] = content[isRun ? at : at + k];
      }
      at += isRun ? 1 : count;
    }
  }
  return at;
}

async function readPicture(file: File): Promise<Environment> {
  const bad = (field: string, found: string, expected = WAY_OUT) => new BadPackage(file.name, field, found, expected);
  let bitmap: ImageBitmap;
  try {
    bitmap = await createImageBitmap(file, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  } catch {
    throw bad("file", "no picture that the browser reads");
  }
  const { width, height } = bitmap;
  checkSize(width, height, bad);
  const context = new OffscreenCanvas(width, height).getContext("2d")!;
  context.drawImage(bitmap, 0, 0);
  const codes = context.getImageData(0, 0, width, height).data;
  const data = new Float32Array(3 * width * height);
  for (let k = 0; k < data.length; k++) {
    const code = codes[4 * Math.floor(k / 3) + (k % 3)] / 255;
    data[k] = code <= 0.04045 ? code / 12.92 : ((code + 0.055) / 1.055) ** 2.4;
  }
  return { height, data };
}

function checkSize(width: number, height: number, bad: (field: string, found: string) => Error): void {
  if (width !== 2 * height || height < 4 || width * height > LARGEST) throw bad("size", `${width} x ${height}`);
}
