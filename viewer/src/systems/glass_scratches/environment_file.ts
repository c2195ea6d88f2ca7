/** A person's own environment: an equirectangular picture, .hdr, .png, .jpg or .webp. */

import { FloatType } from "three";
import { HDRLoader } from "three/examples/jsm/loaders/HDRLoader.js";
import type { Radiance } from "./lights";
import { smaller } from "./means";

/** Endings that are taken. */
export const ENDINGS = ".hdr,.png,.jpg,.jpeg,.webp";
/** Rows of a map that is kept; larger pictures are averaged down to it. */
const MOST_ROWS = 512;
const LARGEST_SIDE = 16384;
/** By which part of it the width may differ from twice the height. */
const NEARLY = 0.01;

/** Colours (height, width, 4), linear, row 0 at the top. */
interface Colours {
  width: number;
  height: number;
  data: ArrayLike<number>;
}

/** Reads a file. Throws an Error of one sentence for what is no such picture. */
export async function readEnvironment(file: File): Promise<Radiance> {
  const isRadiance = file.name.toLowerCase().endsWith(".hdr");
  const colours = isRadiance ? radiancePicture(await file.arrayBuffer(), file.name) : await codedPicture(file);
  return environmentOf(colours, file.name);
}

/** The colours as an environment. Throws an Error where they cannot be one. */
export function environmentOf({ width, height, data }: Colours, name: string): Radiance {
  if (Math.abs(width - 2 * height) > NEARLY * width) {
    throw new Error(`${name} is ${width} x ${height} pixels; expected an equirectangular picture, twice as wide as high.`);
  }
  const rows = Math.min(MOST_ROWS, height);
  const kept = smaller(light(data, 4), [height, width], [rows, 2 * rows]);
  if (!kept.some((value) => value > 0)) throw new Error(`${name} is all black; expected some light.`);
  return { height: rows, data: kept };
}

/** Red, green and blue of colours with `channels` channels; what is no light is 0. */
function light(colours: ArrayLike<number>, channels: number): Float32Array {
  const kept = new Float32Array((colours.length / channels) * 3);
  for (let from = 0, to = 0; to < kept.length; from += channels, to += 3) {
    for (let channel = 0; channel < 3; channel++) {
      const value = colours[from + channel];
      kept[to + channel] = value > 0 && value < Infinity ? value : 0;
    }
  }
  return kept;
}

function radiancePicture(content: ArrayBuffer, name: string): Colours {
  try {
    const { width, height, data } = new HDRLoader().setDataType(FloatType).parse(content) as {
      width: number;
      height: number;
      data: Float32Array;
    };
    if (data.length !== 4 * width * height) throw new Error("cut");
    return { width, height, data };
  } catch {
    throw new Error(`${name} is no whole Radiance picture; expected an .hdr file in RGBE, its rows from the top.`);
  }
}

async function codedPicture(file: File): Promise<Colours> {
  let bitmap: ImageBitmap;
  try {
    bitmap = await createImageBitmap(file, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  } catch {
    throw new Error(`${file.name} is no picture that this browser reads; expected .hdr, .png, .jpg or .webp.`);
  }
  const { width, height } = bitmap;
  if (Math.max(width, height) > LARGEST_SIDE) {
    bitmap.close();
    throw new Error(`${file.name} is ${width} x ${height} pixels; expected sides of at most ${LARGEST_SIDE}.`);
  }
  // What is far larger than the map is made smaller while it is drawn, or its floats would not fit.
  const scale = Math.min(1, (4 * MOST_ROWS) / height);
  const [columns, rows] = [Math.max(1, Math.round(width * scale)), Math.max(1, Math.round(height * scale))];
  const context = new OffscreenCanvas(columns, rows).getContext("2d");
  if (!context) throw new Error(`${file.name}: this browser gives no canvas to read pictures with.`);
  context.drawImage(bitmap, 0, 0, columns, rows);
  bitmap.close();
  const codes = context.getImageData(0, 0, columns, rows).data;
  return { width: columns, height: rows, data: Float32Array.from(codes, (code) => LINEAR[code]) };
}

const LINEAR = Float32Array.from({ length: 256 }, (_, code) => {
  const value = code / 255;
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
});
