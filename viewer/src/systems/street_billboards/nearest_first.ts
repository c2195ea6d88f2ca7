/** Which billboards a camera may see, in the order in which they are drawn. */

import type { Frustum } from "three";

/**
 * Numbers of the billboards in view, nearest centres first, so that what is hidden is not decoded.
 * centres (n, 3); reaches (n): radii of spheres about them.
 */
export function byDistance(
  centres: Float32Array,
  reaches: Float32Array,
  { planes }: Frustum,
  [x, y, z]: readonly number[],
): number[] {
  const squared = new Float64Array(reaches.length);
  const seen: number[] = [];
  for (let number = 0; number < reaches.length; number++) {
    const [a, b, c] = [centres[3 * number], centres[3 * number + 1], centres[3 * number + 2]];
    const outside = planes.some(
      ({ normal, constant }) => a * normal.x + b * normal.y + c * normal.z + constant < -reaches[number],
    );
    if (outside) continue;
    squared[number] = (a - x) ** 2 + (b - y) ** 2 + (c - z) ** 2;
    seen.push(number);
  }
  return seen.sort((one, other) => squared[one] - squared[other] || one - other);
}
