/** Triangles in the colours of their clusters (figure 2), as the stage's `cluster_picture`. */

import { Surface } from "../../drawing/surface";
import type { MeshData } from "../../package/mesh";

const LIGHT = [0.3, -0.4, 0.85].map((value) => value / 0.986);

/** The mesh, painted. */
export function clusterSurface(mesh: MeshData, cluster: ArrayLike<number>): Surface {
  const corners = mesh.triangles.length;
  const vertices = new Float32Array(3 * corners);
  const shown = new Float32Array(3 * corners);
  mesh.triangles.forEach((vertex, corner) => {
    const normal = mesh.normals!.subarray(3 * vertex, 3 * vertex + 3);
    const facing = LIGHT.reduce((sum, value, axis) => sum + value * normal[axis], 0);
    const light = Math.max(facing, 0) * 0.6 + 0.4;
    vertices.set(mesh.vertices.subarray(3 * vertex, 3 * vertex + 3), 3 * corner);
    shown.set(clusterColour(cluster[Math.floor(corner / 3)]).map((value) => value * light), 3 * corner);
  });
  return new Surface({
    vertices,
    triangles: Uint32Array.from({ length: corners }, (_, corner) => corner),
    attributes: { shown: { values: shown, width: 3 } },
    vertex: "painted_vertex.glsl",
    fragment: "painted_fragment.glsl",
  });
}

/** A linear colour: hues a golden angle apart. */
export function clusterColour(number: number): number[] {
  const hue = ((number * 0.61803399) % 1) * 6;
  const saturation = 0.55 + (number % 3 === 0 ? 0.35 : 0);
  const value = 0.95 - (number % 2 ? 0.3 : 0);
  return [5, 3, 1].map((offset) => {
    const k = (offset + hue) % 6;
    return (value - value * saturation * Math.max(0, Math.min(k, 4 - k, 1))) ** 2.2;
  });
}
