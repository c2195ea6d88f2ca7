/** The plain look in one draw call: the surface once a layer, lifted in the vertex shader. */

import * as THREE from "three";
import { Surface } from "../../drawing/surface";
import type { MeshData } from "../../package/mesh";
import { codeSteps, MOST_LAYERS } from "./codes";
import type { Look } from "./look";

/** What names in capitals of the shaders stand for: uniforms, but for the fill. */
const NAMES = {
  CODE_STEPS: "codeSteps",
  DECAY: "decay",
  THICKNESS: "thickness",
  LAYERS: "layers",
  SKY: "skyRadiance",
  HEADLIGHT: "headlight",
  LAMP: "lampRadiance",
  LAMP_TOWARDS: "lampTowards",
};

/** The fur of a surface: put it into a `THREE.Scene`. */
export class Shells extends Surface {
  private columns = true;

  /** photograph: colours as sRGB codes, depth codes in alpha. */
  constructor(mesh: Required<MeshData>, photograph: THREE.DataTexture) {
    super({
      vertices: mesh.vertices,
      triangles: mesh.triangles,
      attributes: { uv: { values: mesh.uvs, width: 2 }, outward: { values: mesh.normals, width: 3 } },
      vertex: "fur_shell_vertex.glsl",
      fragment: "fur_shell_fragment.glsl",
      values: { ...NAMES, COLUMNS: true },
      textures: { photograph },
      uniforms: {
        codeSteps: { type: "float", value: 1 },
        decay: { type: "float", value: 0 },
        thickness: { type: "float", value: 0 },
        layers: { type: "float", value: 1 },
        skyRadiance: { type: "float", value: 0 },
        headlight: { type: "float", value: 1 },
        lampRadiance: { type: "float", value: 0 },
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

  /** Sets a look, for the number of layers that the codes are for; thickness: in scene units. */
  setLook(look: Look, layers: number, thickness: number, attenuation: number): void {
    const columns = look.fill === "columns";
    if (columns !== this.columns) this.setValues({ ...NAMES, COLUMNS: columns });
    this.columns = columns;
    const { uniforms } = this;
    uniforms.codeSteps.value = codeSteps(layers);
    uniforms.decay.value = attenuation / layers;
    uniforms.thickness.value = thickness;
    uniforms.layers.value = layers;
    uniforms.skyRadiance.value = look.sky;
    uniforms.headlight.value = look.headlight;
    uniforms.lampRadiance.value = look.lamp;
    uniforms.lampTowards.value.set(...look.light);
    (this.geometry as THREE.InstancedBufferGeometry).instanceCount = layers;
  }
}

/** A geometry as instances, numbered by layers from the tips: what is in front is drawn first. */
export function onceALayer(geometry: THREE.BufferGeometry): THREE.InstancedBufferGeometry {
  const made = new THREE.InstancedBufferGeometry();
  made.setIndex(geometry.index);
  for (const [name, attribute] of Object.entries(geometry.attributes)) made.setAttribute(name, attribute);
  const numbers = Float32Array.from({ length: MOST_LAYERS }, (_, n) => n + 1);
  made.setAttribute("layer", new THREE.InstancedBufferAttribute(numbers, 1));
  return made;
}
