/**
 * The photograph laid over a body in patches, as `pipelines/photo_fur/laying.py` and `lie_codes.py`:
 * a package holds which patches there are, and what follows from that is found here.
 */

import type { MeshData } from "../../package/mesh";

/** Patches at a place. */
export const SLOTS = 3;
/** Radius of a patch in distances between neighbouring patches' middles. */
const REACH = 1.5;
/** Along the surface, in radii: so far a patch is followed. */
const FOLLOWED = 1.5;
const SHARPNESS = 4;
/** Of the way from nose to tail along the surface, that has a direction. */
const LEAST = 1e-3;

/** Which patches a mesh has. */
export interface Patches {
  /** (P,): the vertex in the middle of each. */
  middles: Uint32Array;
  /** (P, 2): what of the photograph is there, in its widths, from the lower left. */
  places: Float32Array;
  /** (P,): how the hair lies there, radians from the photograph's x towards its y (up). */
  directions: Float32Array;
  /** Between patches' middles, mesh units. */
  spacing: number;
  /** Of the photograph on the surface, mesh units. */
  width: number;
}

/** Patches on a mesh; vertices are split where the patches at a place are others. */
export interface Laying {
  /** (N,): the mesh's vertex that each is. */
  vertex: Uint32Array;
  /** (F, 3). */
  triangles: Uint32Array;
  /** (N, SLOTS, 2): places in the photograph, in its widths, from the lower left. */
  uvs: Float32Array;
  /** (N, SLOTS): of the patches, adding up to 1. */
  weights: Float32Array;
}

/** What patches are laid over; flat arrays of three numbers a vertex. */
export interface Body {
  vertices: Float32Array;
  triangles: Uint32Array;
  normals: Float32Array;
  tangents: Float64Array;
}

/** Unit vectors (V, 3) towards the tips, of codes (2, V). */
export function tangentsOf(codes: Uint8Array, normals: Float32Array, backwards: readonly number[]): Float64Array {
  const count = normals.length / 3;
  const least = backwards.map(Math.abs);
  const other = [0, 0, 0];
  other[least.indexOf(Math.min(...least))] = 1;
  const far = Math.hypot(...backwards);
  const tangents = new Float64Array(3 * count);
  for (let v = 0; v < count; v++) {
    const up = Array.from(normals.subarray(3 * v, 3 * v + 3));
    let east = inPlane(backwards, up);
    if (Math.hypot(...east) < LEAST * far) east = inPlane(other, up);
    const length = Math.max(Math.hypot(...east), 1e-30);
    east = east.map((axis) => axis / length);
    const north = cross(up, east);
    const angle = (codes[v] * 2 * Math.PI) / 256;
    for (let axis = 0; axis < 3; axis++) {
      tangents[3 * v + axis] = Math.cos(angle) * east[axis] + Math.sin(angle) * north[axis];
    }
  }
  return tangents;
}

/** Lays patches over their body. */
export function lay(body: Body, patches: Patches): Laying {
  const joined = join(body);
  const around = neighbours(body, joined);
  const middles = Array.from(patches.middles, (vertex) => joined.position[vertex]);
  const charts = chartsAbout(around, middles, REACH * patches.spacing);
  return split(body.triangles, joined, charts, patches);
}

// ---- the surface -------------------------------------------------------------------------------

interface Joined {
  /** The vertex that each position has first. */
  first: number[];
  /** Of each vertex. */
  position: Uint32Array;
}

/** Vertices without copies: those of equal position and normal are one. */
function join({ vertices, normals }: Body): Joined {
  const found = new Map<string, number>();
  const first: number[] = [];
  const position = Uint32Array.from({ length: vertices.length / 3 }, (_, v) => {
    const at = 3 * v;
    // + 0: no -0.
    const key = [0, 1, 2].map((axis) => `${vertices[at + axis] + 0},${normals[at + axis] + 0}`).join();
    let number = found.get(key);
    if (number === undefined) {
      number = first.length;
      found.set(key, number);
      first.push(v);
    }
    return number;
  });
  return { first, position };
}

/** Edges out of each position: those of p are first[p] to first[p + 1]. */
interface Neighbours {
  first: Uint32Array;
  to: Uint32Array;
  length: Float64Array;
  /** (E, 2): along the lie, and across it, to the left. */
  step: Float64Array;
}

function neighbours({ vertices, triangles, normals, tangents }: Body, { first, position }: Joined): Neighbours {
  const sets = first.map(() => new Set<number>());
  for (let f = 0; f < triangles.length; f += 3) {
    const corners = [0, 1, 2].map((corner) => position[triangles[f + corner]]);
    corners.forEach((begin, corner) => {
      const end = corners[(corner + 1) % 3];
      const other = corners[(corner + 2) % 3];
      if (begin === end || begin === other || end === other) return;
      sets[begin].add(end);
      sets[end].add(begin);
    });
  }
  const start = new Uint32Array(first.length + 1);
  sets.forEach((each, p) => (start[p + 1] = start[p] + each.size));
  const edges = start[first.length];
  const made = { first: start, to: new Uint32Array(edges), length: new Float64Array(edges), step: new Float64Array(2 * edges) };
  const at = (values: ArrayLike<number>, p: number) => [0, 1, 2].map((axis) => values[3 * first[p] + axis]);
  const frames = first.map((_, p) => {
    const along = at(tangents, p);
    return { along, left: cross(at(normals, p), along), point: at(vertices, p) };
  });
  sets.forEach((each, begin) => {
    [...each].sort((a, b) => a - b).forEach((end, n) => {
      const edge = start[begin] + n;
      const [from, to] = [frames[begin], frames[end]];
      const way = to.point.map((axis, i) => axis - from.point[i]);
      const flat = [0, 1].map((i) =>
        i === 0 ? dot(way, mean(from.along, to.along)) : dot(way, mean(from.left, to.left)),
      );
      made.to[edge] = end;
      made.length[edge] = Math.sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
      const scale = made.length[edge] / Math.max(Math.hypot(...flat), 1e-30);
      made.step.set([flat[0] * scale, flat[1] * scale], 2 * edge);
    });
  });
  return made;
}

// ---- patches -----------------------------------------------------------------------------------

/** What a patch has at a position. */
interface Share {
  patch: number;
  /** Lengths along and across the lie from the patch's middle. */
  x: number;
  y: number;
  /** From there, in radii. */
  distance: number;
  weight: number;
}

/** Of each position the patches that reach it, in the order of their numbers. */
type Charts = Share[][];

function chartsAbout(around: Neighbours, middles: readonly number[], radius: number): Charts {
  const count = around.first.length - 1;
  const charts: Charts = Array.from({ length: count }, () => []);
  const far = new Float64Array(count).fill(Infinity);
  const place = new Float64Array(2 * count);
  middles.forEach((middle, patch) => {
    const order = reached(around, middle, FOLLOWED * radius, far);
    follow(around, order, far, place);
    for (const p of order) {
      const [x, y] = [place[2 * p], place[2 * p + 1]];
      charts[p].push({ patch, x, y, distance: Math.hypot(x, y) / radius, weight: 0 });
      far[p] = Infinity;
      place[2 * p] = place[2 * p + 1] = 0;
    }
  });
  charts.forEach(weigh);
  return charts;
}

/** Positions within a distance along edges, nearest first; `far` gets their distances (Dijkstra). */
function reached({ first, to, length }: Neighbours, start: number, limit: number, far: Float64Array): number[] {
  const heap: [number, number][] = [[0, start]];
  const done: number[] = [];
  const seen = new Set<number>();
  far[start] = 0;
  while (heap.length) {
    const [distance, p] = pop(heap);
    if (seen.has(p)) continue;
    seen.add(p);
    done.push(p);
    for (let edge = first[p]; edge < first[p + 1]; edge++) {
      const longer = distance + length[edge];
      if (longer <= limit && longer < far[to[edge]]) {
        far[to[edge]] = longer;
        push(heap, [longer, to[edge]]);
      }
    }
  }
  return done;
}

/** Places in the order of distance: the mean of what the neighbours before say. */
function follow({ first, to, length, step }: Neighbours, order: readonly number[], far: Float64Array, place: Float64Array): void {
  for (const p of order.slice(1)) {
    let [x, y, total] = [0, 0, 0];
    for (let edge = first[p]; edge < first[p + 1]; edge++) {
      const before = to[edge];
      if (!(far[before] < far[p])) continue;
      const weight = 1 / (far[before] + length[edge] - far[p] + 0.1 * length[edge]);
      x += weight * (place[2 * before] - step[2 * edge]);
      y += weight * (place[2 * before + 1] - step[2 * edge + 1]);
      total += weight;
    }
    if (total > 0) place.set([x / total, y / total], 2 * p);
  }
}

/** Weights of the nearest `SLOTS` patches, fading to 0 at a patch's rim; they add up to 1. */
function weigh(shares: Share[]): void {
  const nearest = [...shares].sort((a, b) => a.distance - b.distance);
  const fading = nearest.map(({ distance }) => Math.max(1 - distance, 0) ** SHARPNESS);
  const without = fading[SLOTS] ?? 0;
  const left = fading.map((each) => Math.max(each - without, 0));
  const total = left.reduce((sum, each) => sum + each, 0);
  nearest.forEach((share, rank) => (share.weight = total > 1e-12 ? left[rank] / total : Number(rank === 0)));
}

/** The patches that weigh most on a triangle's corners, ascending; -1 for none. */
function shownBy(corners: readonly number[], charts: Charts): number[] {
  const totals = new Map<number, number>();
  for (const p of corners) {
    for (const { patch, weight } of charts[p]) {
      if (weight > 0) totals.set(patch, (totals.get(patch) ?? 0) + weight);
    }
  }
  const heaviest = [...totals].sort((a, b) => b[1] - a[1]).slice(0, SLOTS);
  const shown = heaviest.map(([patch]) => patch).sort((a, b) => a - b);
  return [...shown, -1, -1, -1].slice(0, SLOTS);
}

function split(triangles: Uint32Array, { first, position }: Joined, charts: Charts, patches: Patches): Laying {
  const found = new Map<string, number>();
  const vertex: number[] = [];
  const uvs: number[] = [];
  const weights: number[] = [];
  const made = new Uint32Array(triangles.length);
  for (let f = 0; f < triangles.length; f += 3) {
    const corners = [0, 1, 2].map((corner) => position[triangles[f + corner]]);
    const shown = shownBy(corners, charts);
    corners.forEach((p, corner) => {
      const key = `${p},${shown.join()}`;
      let number = found.get(key);
      if (number === undefined) {
        number = vertex.length;
        found.set(key, number);
        vertex.push(first[p]);
        const shares = shown.map((patch) => charts[p].find((share) => share.patch === patch));
        const total = shares.reduce((sum, share) => sum + (share?.weight ?? 0), 0);
        shown.forEach((patch, slot) => {
          const share = shares[slot];
          uvs.push(...placeOf(share, patch, patches));
          weights.push((share?.weight ?? 0) / (total > 0 ? total : 1));
        });
      }
      made[f + corner] = number;
    });
  }
  return {
    vertex: Uint32Array.from(vertex),
    triangles: made,
    uvs: Float32Array.from(uvs),
    weights: Float32Array.from(weights),
  };
}

function placeOf(share: Share | undefined, patch: number, { places, directions, width }: Patches): [number, number] {
  if (patch < 0) return [0, 0];
  const [x, y] = [(share?.x ?? 0) / width, (share?.y ?? 0) / width];
  const [cosine, sine] = [Math.cos(directions[patch]), Math.sin(directions[patch])];
  return [places[2 * patch] + cosine * x - sine * y, places[2 * patch + 1] + sine * x + cosine * y];
}

// ---- vectors, and a heap -----------------------------------------------------------------------

function dot(a: readonly number[], b: readonly number[]): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

function mean(a: readonly number[], b: readonly number[]): number[] {
  return a.map((axis, i) => (axis + b[i]) / 2);
}

function cross(a: readonly number[], b: readonly number[]): number[] {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/** A direction without its part along a unit vector. */
function inPlane(way: readonly number[], up: readonly number[]): number[] {
  const out = dot(way, up);
  return way.map((axis, i) => axis - up[i] * out);
}

function push(heap: [number, number][], item: [number, number]): void {
  let place = heap.push(item) - 1;
  while (place > 0) {
    const parent = (place - 1) >> 1;
    if (heap[parent][0] <= heap[place][0]) return;
    [heap[parent], heap[place]] = [heap[place], heap[parent]];
    place = parent;
  }
}

function pop(heap: [number, number][]): [number, number] {
  const [top, last] = [heap[0], heap.pop()!];
  if (!heap.length) return top;
  heap[0] = last;
  for (let place = 0; ; ) {
    const left = 2 * place + 1;
    const smaller = left + 1 < heap.length && heap[left + 1][0] < heap[left][0] ? left + 1 : left;
    if (smaller >= heap.length || heap[place][0] <= heap[smaller][0]) return top;
    [heap[place], heap[smaller]] = [heap[smaller], heap[place]];
    place = smaller;
  }
}

/** What a mesh, its codes and the way from nose to tail make a body of. */
export function bodyOf(mesh: Required<MeshData>, codes: Uint8Array, backwards: readonly number[]): Body {
  const { vertices, triangles, normals } = mesh;
  return { vertices, triangles, normals, tangents: tangentsOf(codes, normals, backwards) };
}
