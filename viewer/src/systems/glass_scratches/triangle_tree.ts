/** A tree of boxes around triangles, as `pipelines/geometry/triangle_tree.py` grows it, node for node. */

/** Texels of a row. */
export const TREE_WIDTH = 512;
const LEAF = 4;

/** Texels of four floats in rows of `TREE_WIDTH`, as `triangle_tree.glsl` reads them. */
export interface TriangleTree {
  nodes: Float32Array;
  corners: Float32Array;
}

/** The tree of triangles (F, 3, 3) with a normal at each corner. Throws an Error for none. */
export function triangleTree(places: Float32Array, normals: Float32Array): TriangleTree {
  const count = places.length / 9;
  if (!count || normals.length !== places.length) {
    throw new Error(`triangles have ${places.length} numbers, their normals ${normals.length}; expected 9 each of both.`);
  }
  const [low, high] = [bounds(places, Math.min), bounds(places, Math.max)];
  const middle = low.map((value, n) => Math.fround(value + high[n]) / 2);
  const order = Array.from({ length: count }, (_, n) => n);
  const nodes: number[] = [];

  const grow = (first: number, after: number): void => {
    const mine = order.slice(first, after);
    const node = nodes.length;
    nodes.push(...least(low, mine), 0, ...most(high, mine), 0);
    if (after - first <= LEAF) {
      nodes[node + 7] = 8 * first + after - first;
    } else {
      const [from, to] = [least(middle, mine), most(middle, mine)];
      const sides = to.map((value, axis) => Math.fround(value - from[axis]));
      const axis = sides.indexOf(Math.max(...sides));
      mine.sort((one, other) => middle[3 * one + axis] - middle[3 * other + axis]);
      mine.forEach((triangle, n) => (order[first + n] = triangle));
      const half = (first + after) >> 1;
      grow(first, half);
      grow(half, after);
    }
    nodes[node + 3] = nodes.length / 8;
  };

  grow(0, count);
  const corners = rows(6 * count);
  order.forEach((triangle, n) => {
    for (let corner = 0; corner < 3; corner++) {
      const from = 9 * triangle + 3 * corner;
      corners.set(places.subarray(from, from + 3), 4 * (6 * n + corner));
      corners.set(normals.subarray(from, from + 3), 4 * (6 * n + 3 + corner));
    }
  });
  const texels = rows(nodes.length / 4);
  texels.set(nodes);
  return { nodes: texels, corners };
}

/** An extreme of each triangle's corners, (F, 3). */
function bounds(places: Float32Array, extreme: (...values: number[]) => number): Float32Array {
  return Float32Array.from({ length: places.length / 3 }, (_, n) => {
    const at = 9 * Math.floor(n / 3) + (n % 3);
    return extreme(places[at], places[at + 3], places[at + 6]);
  });
}

function least(values: Float32Array, triangles: readonly number[]): number[] {
  return [0, 1, 2].map((axis) => triangles.reduce((found, n) => Math.min(found, values[3 * n + axis]), Infinity));
}

function most(values: Float32Array, triangles: readonly number[]): number[] {
  return [0, 1, 2].map((axis) => triangles.reduce((found, n) => Math.max(found, values[3 * n + axis]), -Infinity));
}

function rows(texels: number): Float32Array {
  return new Float32Array(4 * TREE_WIDTH * Math.ceil(texels / TREE_WIDTH));
}
