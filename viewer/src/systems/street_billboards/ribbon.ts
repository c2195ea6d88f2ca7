/** The way that was driven, drawn: a ribbon below the camera's places, a mark at each photograph. */

import { Vector3 } from "three";
import { Surface } from "../../drawing/surface";
import type { Path } from "./path";

/** Metres. */
const BELOW = 1.3;
const HALF_WIDTH = 0.035;
const MARK = 0.16;
/** Linear light. */
const WAY = [0.86, 0.42, 0.09];
const KEPT_FROM_TEXTURES = [0.1, 0.42, 0.95];

/** The ribbon; photographs that made no textures have another colour. */
export function ribbonOf(path: Path, heldOut: ArrayLike<number>): Surface {
  const vertices: number[] = [];
  const triangles: number[] = [];
  const colours: number[] = [];
  const quad = (corners: Vector3[], colour: number[]) => {
    const first = vertices.length / 3;
    for (const corner of corners) {
      vertices.push(...corner);
      colours.push(...colour);
    }
    triangles.push(first, first + 1, first + 2, first, first + 2, first + 3);
  };
  const place = (along: number, left: number, raised = 0) => path.world({ along, left, above: raised - BELOW });
  path.along.forEach((along, frame) => {
    if (frame > 0) {
      const before = path.along[frame - 1];
      quad([place(before, -HALF_WIDTH), place(along, -HALF_WIDTH), place(along, HALF_WIDTH), place(before, HALF_WIDTH)], WAY);
    }
    const colour = heldOut[frame] ? KEPT_FROM_TEXTURES : WAY;
    const mark = [
      [-MARK, 0],
      [0, -MARK],
      [MARK, 0],
      [0, MARK],
    ].map(([ahead, left]) => place(along + ahead, left, 0.01));
    quad(mark, colour);
  });
  return new Surface({
    vertices: Float32Array.from(vertices),
    triangles: Uint32Array.from(triangles),
    attributes: { shown: { values: Float32Array.from(colours), width: 3 } },
    vertex: "painted_vertex.glsl",
    fragment: "painted_fragment.glsl",
  });
}
