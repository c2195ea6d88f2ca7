/**
 * A hanging cloth of a neural BTF, decoded at each pixel, under a light that is dragged. While
 * something moves, the student decodes, where there is one.
 */

import * as THREE from "three";
import { eyeOf, type Camera } from "../drawing/camera";
import { drawScene } from "../drawing/scene";
import { Surface } from "../drawing/surface";
import { texture } from "../drawing/textures";
import type { Bounds, LiveView, State, SystemViewer } from "../live_view";
import type { MeshData } from "../package/mesh";
import type { Package } from "../package/package";
import { float } from "../shaders";
import { latentTexels, latentVectors, upsideDown, vectorsOf, weightTexels, type Layer } from "./neural_btf/decoder_texels";
import { packedBtf, type PackedBtf } from "./neural_btf/packed_btf";
import { CONTROLS, withState, type Settings } from "./neural_btf/state";

/** The cloth by one of a package's decoders. */
interface DecodedCloth {
  surface: Surface;
  /** For the drawer. */
  decoder: string;
}

class HangingCloth implements LiveView {
  readonly navigation = "orbit";
  readonly bounds: Bounds = { centre: [0, 0, 0], radius: 1.35 };
  readonly controls = CONTROLS;
  private readonly scene = new THREE.Scene();
  private readonly room: Bounds;
  private drawn: DecodedCloth;

  constructor(
    private readonly whole: DecodedCloth,
    private readonly student: DecodedCloth | undefined,
    private readonly around: Surface,
    private readonly btf: PackedBtf,
    /** What the decoder's colours are multiplied with, at exposure 0. */
    private readonly scale: number,
    private settings: Settings,
  ) {
    this.drawn = whole;
    for (const { surface } of this.cloths) this.scene.add(surface);
    this.scene.add(around);
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

  draw(renderer: THREE.WebGLRenderer, camera: Camera, width: number, height: number, moving = false): void {
    const { light, tiles, exposure } = this.settings;
    this.drawn = (moving && this.student) || this.whole;
    for (const cloth of this.cloths) cloth.surface.visible = cloth === this.drawn;
    const { uniforms } = this.drawn.surface;
    uniforms.light.value.set(...light);
    uniforms.eye.value.copy(eyeOf(camera));
    uniforms.tiles.value = tiles;
    uniforms.scale.value = this.scale * 2 ** exposure;
    drawScene(renderer, this.scene, camera, [width, height], this.room);
  }

  figures(): Record<string, number | string> {
    const { texels, vectors, channels, levels } = this.btf;
    return {
      "decoded by": this.drawn.decoder,
      texels: `${texels[0]} × ${texels[1]}`,
      "latent vectors": `${vectors}, of ${channels} latents`,
      "levels of latents": levels,
    };
  }

  dispose(): void {
    for (const { surface } of this.cloths) surface.dispose();
    this.around.dispose();
  }

  private get cloths(): DecodedCloth[] {
    return this.student ? [this.whole, this.student] : [this.whole];
  }
}

function clothOf(
  mesh: MeshData,
  btf: PackedBtf,
  layers: Layer[],
  latents: THREE.Texture,
  who: string,
): DecodedCloth {
  const weights = texture(upsideDown(weightTexels(layers)), { interpolate: false });
  const surface = new Surface({
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
      VECTORS: vectorsOf(layers),
      LATENT_VECTORS: latentVectors(btf.channels),
      TEXELS: btf.texels,
      LEVELS: btf.levels,
      PARALLAX: btf.parallax,
      LEAST: float(btf.least),
      LARGEST: float(btf.largest),
      PLACES: false,
      TILES: "tiles",
      LIGHT: "light",
      EYE: "eye",
      SCALE: "scale",
    },
    textures: { weights, latentVectors: latents },
    uniforms: {
      light: { type: "vec3", value: new THREE.Vector3() },
      eye: { type: "vec3", value: new THREE.Vector3() },
      tiles: { type: "float", value: 1 },
      scale: { type: "float", value: 1 },
    },
  });
  return { surface, decoder: `${who}, 3 × ${layers[0].bias.length} neurons` };
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
    const [btf, mesh, around] = await Promise.all([packedBtf(pkg), pkg.mesh("cloth"), roomOf(pkg)]);
    const latents = texture(upsideDown(latentTexels(btf.latents, btf.channels)), { interpolate: false });
    const whole = clothOf(mesh, btf, btf.decoder, latents, "the whole decoder");
    const student = btf.student && clothOf(mesh, btf, btf.student, latents, "its student");
    const inFront: Settings = { light: [0, -1, 0], tiles: pkg.parameter("tiles"), exposure: 0 };
    const settings = withState(inFront, pkg.meta.views[0]?.state ?? {});
    const scale = btf.alpha * pkg.parameter("exposure");
    return new HangingCloth(whole, student, around, btf, scale, settings);
  },
};

export default viewer;
