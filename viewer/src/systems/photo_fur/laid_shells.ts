/** Fur laid in patches, in one draw call: the full look. */

import * as THREE from "three";
import { Surface } from "../../drawing/surface";
import type { MeshData } from "../../package/mesh";
import { float } from "../../shaders";
import type { Body, Laying } from "./laying";
import { SLOTS } from "./laying";
import type { Look } from "./look";
import { MOST_LAYERS } from "./codes";
import { onceALayer } from "./shells";

/** What names in capitals of the shaders stand for: uniforms. */
const NAMES = {
  CODES: "codeCount",
  DECAY: "decay",
  MIDDLE: "middle",
  THICKNESS: "thickness",
  LAYERS: "layers",
  WIND: "wind",
  MOMENT: "moment",
  GUST: "gust",
  SKY: "skyRadiance",
  HEADLIGHT: "headlight",
  LAMP: "lampRadiance",
  LAMP_TOWARDS: "lampTowards",
};
/** Of these numbers the page itself makes use; the others are the shader's. */
export type Constants = Record<string, number> & {
  GUSTS: number;
  FEWEST_SHELLS: number;
  MOST_SHELLS: number;
  SHELLS_A_PIXEL: number;
};

/** What the medium of a photograph tells the shader. */
export interface Depths {
  /** Codes from the tips to the skin. */
  codes: number;
  /** Of ln I over the thickness. */
  attenuation: number;
  /** Mean depth of the hair, thicknesses. */
  middle: number;
}

/** The fur of a body: put it into a `THREE.Scene`. */
export class LaidShells extends Surface {
  constructor(
    mesh: Required<MeshData>,
    body: Body,
    lengths: Float32Array,
    laying: Laying,
    photograph: THREE.DataTexture,
    private readonly constants: Constants,
  ) {
    const { vertex } = laying;
    const values = Object.fromEntries(Object.entries(constants).map(([name, value]) => [name, float(Number(value))]));
    super({
      vertices: of(mesh.vertices, vertex, 3),
      triangles: laying.triangles,
      attributes: {
        hairLength: { values: of(lengths, vertex, 1), width: 1 },
        outward: { values: of(mesh.normals, vertex, 3), width: 3 },
        along: { values: of(body.tangents, vertex, 3), width: 3 },
        ...coordinates(laying, photograph.image as { width: number; height: number }),
        weights: { values: laying.weights, width: 3 },
      },
      vertex: "fur_laid_vertex.glsl",
      fragment: "fur_laid_fragment.glsl",
      values: { ...values, ...NAMES },
      textures: { photograph },
      uniforms: {
        ...Object.fromEntries(Object.values(NAMES).map((name) => [name, { type: "float", value: 0 }])),
        lampTowards: { type: "vec3", value: new THREE.Vector3(0, 0, 1) },
      },
    });
    this.geometry = onceALayer(this.geometry);
  }

  /** Triangles that are drawn. */
  get triangles(): number {
    const { index, instanceCount } = this.geometry as THREE.InstancedBufferGeometry;
    return (index!.count / 3) * instanceCount;
  }

  /** Shells that fur needs whose thickness is so many rows of samples. */
  shellsSeen(rows: number): number {
    const { FEWEST_SHELLS, MOST_SHELLS, SHELLS_A_PIXEL } = this.constants;
    return Math.min(MOST_SHELLS, MOST_LAYERS, Math.max(FEWEST_SHELLS, Math.ceil(SHELLS_A_PIXEL * rows)));
  }

  /** Sets a look of so many shells; radius: the mesh's; thickness: in scene units. */
  setLook(look: Look, shells: number, thickness: number, radius: number, moment: number, depths: Depths): void {
    const { uniforms } = this;
    uniforms.codeCount.value = depths.codes;
    uniforms.decay.value = depths.attenuation;
    uniforms.middle.value = depths.middle;
    uniforms.thickness.value = thickness;
    uniforms.layers.value = shells;
    uniforms.wind.value = look.wind;
    uniforms.moment.value = moment;
    uniforms.gust.value = this.constants.GUSTS / radius;
    uniforms.skyRadiance.value = look.sky;
    uniforms.headlight.value = look.headlight;
    uniforms.lampRadiance.value = look.lamp;
    uniforms.lampTowards.value.set(...look.light);
    (this.geometry as THREE.InstancedBufferGeometry).instanceCount = shells;
  }
}

/** Values of vertices, `width` each, of those that were split. */
function of(values: ArrayLike<number>, vertex: Uint32Array, width: number): Float32Array {
  const made = new Float32Array(vertex.length * width);
  vertex.forEach((from, to) => {
    for (let n = 0; n < width; n++) made[to * width + n] = values[from * width + n];
  });
  return made;
}

/** Places in widths of the photograph as texture coordinates of two attributes. */
function coordinates({ uvs }: Laying, { width, height }: { width: number; height: number }) {
  const count = uvs.length / (2 * SLOTS);
  const [two, third] = [new Float32Array(4 * count), new Float32Array(2 * count)];
  for (let n = 0; n < count; n++) {
    for (let slot = 0; slot < SLOTS; slot++) {
      const [from, to, at] = [2 * (n * SLOTS + slot), slot < 2 ? two : third, slot < 2 ? 4 * n + 2 * slot : 2 * n];
      to[at] = uvs[from];
      to[at + 1] = Math.fround(uvs[from + 1] * Math.fround(width / height));
    }
  }
  return { uvs: { values: two, width: 4 }, uvThird: { values: third, width: 2 } };
}
