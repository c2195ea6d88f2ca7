/** A hanging cloth of a neural BTF, decoded at each pixel, under a light that is dragged. */

import * as THREE from "three";
import { eyeOf, type Camera } from "../drawing/camera";
import { drawScene } from "../drawing/scene";
import { Surface } from "../drawing/surface";
import { texture } from "../drawing/textures";
import type { Bounds, LiveView, State, SystemViewer } from "../live_view";
import type { Package } from "../package/package";
import { LAYERS, latentTexels, upsideDown, weightTexels, type Layer } from "./neural_btf/decoder_texels";
import { CONTROLS, withState, type Settings } from "./neural_btf/state";

/** What a package says of itself, for the drawer. */
interface Material {
  texels: [number, number];
  latents: number;
  /** What the decoder's colours are multiplied with, at exposure 0. */
  scale: number;
}

class HangingCloth implements LiveView {
  readonly navigation = "orbit";
  readonly bounds: Bounds = { centre: [0, 0, 0], radius: 1.35 };
  readonly controls = CONTROLS;
  private readonly scene = new THREE.Scene();
  private readonly room: Bounds;

  constructor(
    private readonly cloth: Surface,
    private readonly around: Surface,
    private readonly material: Material,
    private settings: Settings,
  ) {
    this.scene.add(cloth, around);
    around.geometry.computeBoundingSphere();
    const { center, radius } = around.geometry.boundingSphere as THREE.Sphere;
    this.room = { centre: center.toArray(), radius };
  }

  state(): State {
    return { ...this.settings, light: [...this.settings.light] };
  }

  setState(state: State): void {
    this.settings = withState(this.settings, state);
  }

  draw(renderer: THREE.WebGLRenderer, camera: Camera, width: number, height: number): void {
    const { light, tiles, exposure } = this.settings;
    const { uniforms } = this.cloth;
    uniforms.light.value.set(...light);
    uniforms.eye.value.copy(eyeOf(camera));
    uniforms.tiles.value = tiles;
    uniforms.scale.value = this.material.scale * 2 ** exposure;
    drawScene(renderer, this.scene, camera, [width, height], this.room);
  }

  figures(): Record<string, number | string> {
    const { texels, latents } = this.material;
    return { texels: `${texels[0]} × ${texels[1]}`, "latent vectors": latents };
  }

  dispose(): void {
    this.cloth.dispose();
    this.around.dispose();
  }
}

async function clothOf(pkg: Package, [columns, rows]: [number, number], latents: Float32Array): Promise<Surface> {
  const numbers = LAYERS.slice(1).map((_, n) => n + 1);
  const [mesh, owners, ...layers] = await Promise.all([
    pkg.mesh("cloth"),
    pkg.has("ids") ? pkg.floats("ids") : undefined,
    ...numbers.map((n): Promise<Layer> => layerOf(pkg, n)),
  ]);
  const lines = { weights: weightTexels(layers), latentVectors: latentTexels(latents) };
  const shared = owners && { owners: { width: columns, height: rows, channels: 1, data: owners } };
  const textures = Object.entries({ ...lines, ...shared }).map(([name, picture]): [string, THREE.Texture] => [
    name,
    texture(upsideDown(picture), { interpolate: false }),
  ]);
  return new Surface({
    vertices: mesh.vertices,
    triangles: mesh.triangles,
    attributes: {
      upright: { values: mesh.normals as Float32Array, width: 3 },
      tangent: mesh.attributes.TANGENT,
      place: { values: mesh.uvs as Float32Array, width: 2 },
    },
    vertex: "btf_cloth_vertex.glsl",
    fragment: "btf_cloth_fragment.glsl",
    values: {
      SHARED: owners !== undefined,
      TEXELS: [columns, rows],
      TILES: "tiles",
      LIGHT: "light",
      EYE: "eye",
      SCALE: "scale",
    },
    textures: Object.fromEntries(textures),
    uniforms: {
      light: { type: "vec3", value: new THREE.Vector3() },
      eye: { type: "vec3", value: new THREE.Vector3() },
      tiles: { type: "float", value: 1 },
      scale: { type: "float", value: 1 },
    },
  });
}

async function layerOf(pkg: Package, n: number): Promise<Layer> {
  const [weight, bias] = await Promise.all([pkg.floats(`weight_${n}`), pkg.floats(`bias_${n}`)]);
  return { weight, bias };
}

async function roomOf(pkg: Package): Promise<Surface> {
  const { vertices, triangles, attributes } = await pkg.mesh("room");
  return new Surface({
    vertices,
    triangles,
    attributes: { shown: attributes.RADIANCE },
    vertex: "painted_vertex.glsl",
    fragment: "painted_fragment.glsl",
  });
}

/** The system's live view. */
const viewer: SystemViewer = {
  name: "neural_btf",
  async make(pkg) {
    const texels: [number, number] = [pkg.parameter("width"), pkg.parameter("height")];
    const latents = await pkg.floats("latents");
    const [cloth, around] = await Promise.all([clothOf(pkg, texels, latents), roomOf(pkg)]);
    const material = {
      texels,
      latents: latents.length / 8,
      scale: pkg.parameter("alpha") * pkg.parameter("exposure"),
    };
    const inFront: Settings = { light: [0, -1, 0], tiles: pkg.parameter("tiles"), exposure: 0 };
    const settings = withState(inFront, pkg.meta.views[0]?.state ?? {});
    return new HangingCloth(cloth, around, material, settings);
  },
};

export default viewer;
