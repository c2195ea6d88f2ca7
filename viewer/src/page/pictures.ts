/** Pictures of packages for people: posters, inputs, references; values go no further. */

import type { Package, Picture } from "../package/package";
import { element } from "./elements";

/** A picture as a canvas, alpha left out; 16-bit codes lose their lower half. */
export function pictureCanvas({ width, height, channels, data }: Picture<Uint8Array | Uint16Array>): HTMLCanvasElement {
  const canvas = element("canvas", { width, height });
  const image = new ImageData(width, height);
  const scale = data instanceof Uint16Array ? 257 : 1;
  for (let pixel = 0; pixel < width * height; pixel++) {
    for (let channel = 0; channel < 3; channel++) {
      image.data[4 * pixel + channel] = data[channels * pixel + (channels < 3 ? 0 : channel)] / scale;
    }
    image.data[4 * pixel + 3] = 255;
  }
  canvas.getContext("2d")?.putImageData(image, 0, 0);
  return canvas;
}

/** A picture part as a canvas that a reader hears described; undefined where there is none. */
export async function partCanvas(pkg: Package, part: string, described: string): Promise<HTMLCanvasElement | undefined> {
  if (!pkg.has(part)) return undefined;
  const canvas = pictureCanvas(await pkg.picture(part));
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", described);
  return canvas;
}
