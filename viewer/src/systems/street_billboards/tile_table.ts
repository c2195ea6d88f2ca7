/** Where tiles of road lie, and which of them a camera needs. */

import { Box3, Vector3 } from "three";
import type { Camera } from "../../drawing/camera";
import type { Package } from "../../package/package";

/** Metres up to which tiles are loaded. */
const REACH = 160;
/** What is behind the viewer counts as so much farther away. */
const BEHIND = 3;

/** A tile's place. */
export interface TilePlace {
  billboards: number;
  box: Box3;
}

/** Reads the table of tiles. */
export async function tilePlaces(pkg: Package): Promise<TilePlace[]> {
  const [counts, boxes] = await Promise.all([pkg.array("tile_billboards"), pkg.floats("tile_box")]);
  if (boxes.length !== 6 * counts.length) throw new Error(`${pkg.name}: tile_box has not the tiles of tile_billboards.`);
  return Array.from(counts, (billboards, tile) => {
    const [least, most] = [0, 3].map((corner) => new Vector3().fromArray(boxes, 6 * tile + corner));
    return { billboards, box: new Box3(least, most) };
  });
}

/** Numbers of the tiles that a camera needs, the most urgent first. */
export function neededTiles(places: readonly TilePlace[], camera: Camera): number[] {
  const eye = new Vector3(...camera.position);
  const forward = new Vector3(...camera.target).sub(eye).normalize();
  const costs = places.map(({ box }) => cost(box, eye, forward));
  return [...places.keys()].filter((tile) => costs[tile] < REACH).sort((a, b) => costs[a] - costs[b]);
}

/** Metres to the farthest corner of any box. */
export function farthest(boxes: Iterable<Box3>, from: readonly number[]): number {
  const eye = new Vector3(...from);
  let most = 1;
  for (const { min, max } of boxes) {
    const away = ["x", "y", "z"].map((axis) => {
      const key = axis as "x" | "y" | "z";
      return Math.max(Math.abs(min[key] - eye[key]), Math.abs(max[key] - eye[key]));
    });
    most = Math.max(most, Math.hypot(...away));
  }
  return most;
}

function cost(box: Box3, eye: Vector3, forward: Vector3): number {
  const distance = box.distanceToPoint(eye);
  // The corner that is farthest ahead.
  const ahead = new Vector3(
    forward.x > 0 ? box.max.x : box.min.x,
    forward.y > 0 ? box.max.y : box.min.y,
    forward.z > 0 ? box.max.z : box.min.z,
  );
  return ahead.sub(eye).dot(forward) > 0 ? distance : BEHIND * distance;
}
