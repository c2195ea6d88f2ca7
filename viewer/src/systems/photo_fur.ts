/** Fur to walk around, with thickness, layers and light to change. */

import * as THREE from "three";
import { orbit, type Camera, type Vector } from "../drawing/camera";
import { drawScene } from "../drawing/scene";
import type { Bounds, Context, Control, LiveView, State, SystemViewer } from "../live_view";
import type { MeshData } from "../package/mesh";
import type { Package, Picture } from "../package/package";
import { depthCodes, type Medium } from "./photo_fur/codes";
import { controlsOf, withState, type Look } from "./photo_fur/look";
import { Shells } from "./photo_fur/shells";

/** From the front's left, with all of the bounds in view. */
const HOME = { azimuth: -62, elevation: 24, sine: Math.sin(Math.PI / 12) };
/** Linear radiance; "grey" is that of the stage's pictures. */
const BACKGROUNDS: Record<string, Vector> = {
  night: [0.012, 0.013, 0.016],
  paper: [0.86, 0.84, 0.8],
  moss: [0.05, 0.075, 0.055],
};

class Fur implements LiveView {
  readonly navigation = "orbit";
  readonly home: Camera;
  private readonly scene = new THREE.Scene();
  private readonly backgrounds: Record<string, Vector>;
  private readonly medium: Medium;
  private readonly attenuation: number;
  private readonly thickness: number;
  private readonly sphere: Bounds;
  private look: Look;
  /** The number of layers that the depth codes are for. */
  private coded: number;
  private luminance: Float32Array | undefined;

  constructor(
    private readonly pkg: Package,
    private readonly context: Context,
    private readonly shells: Shells,
    mesh: MeshData,
    private readonly photograph: Picture,
  ) {
    this.scene.add(shells);
    this.backgrounds = { grey: pkg.parameter<Vector>("background"), ...BACKGROUNDS };
    this.medium = { brightest: pkg.parameter("brightest"), darkest: pkg.parameter("darkest") };
    this.attenuation = pkg.parameter("attenuation");
    this.thickness = pkg.parameter("thickness");
    this.sphere = sphereAbout(mesh.vertices);
    this.coded = pkg.parameter("layers");
    this.look = {
      layers: this.coded,
      thickness: 1,
      fill: pkg.parameter<Look["fill"]>("fill"),
      sky: 0.15,
      headlight: 0.35,
      lamp: 0.75,
      light: [-0.48, -0.6, 0.64],
      background: "night",
    };
    this.home = orbit(this.bounds.centre, this.bounds.radius / HOME.sine, HOME.azimuth, HOME.elevation);
  }

  get controls(): Control[] {
    return controlsOf(this.look, Object.keys(this.backgrounds));
  }

  get bounds(): Bounds {
    return { ...this.sphere, radius: this.sphere.radius + this.thickness * this.look.thickness };
  }

  state(): State {
    return { ...this.look, light: [...this.look.light] };
  }

  setState(state: State): void {
    this.look = withState(this.look, state, Object.keys(this.backgrounds));
  }

  /** Depth codes for another number of layers; what they are made of is read once it is needed. */
  async update(): Promise<void> {
    if (this.luminance === undefined && this.look.layers !== this.coded) {
      const luminance = await this.pkg.floats("luminance");
      if (luminance.length !== this.photograph.width * this.photograph.height) {
        throw new Error(`${this.pkg.name}: luminance has ${luminance.length} pixels; expected the photograph's.`);
      }
      this.luminance = luminance;
      this.context.requestDraw();
    }
    if (this.look.layers !== this.coded) this.code(this.look.layers);
  }

  draw(renderer: THREE.WebGLRenderer, camera: Camera, width: number, height: number): void {
    this.shells.setLook(this.look, this.coded, this.thickness * this.look.thickness, this.attenuation);
    drawScene(renderer, this.scene, camera, [width, height], this.bounds, this.backgrounds[this.look.background]);
  }

  figures(): Record<string, number | string> {
    return {
      "draw calls": 1,
      triangles: this.shells.triangles,
      "thickness, mesh units": Number((this.thickness * this.look.thickness).toPrecision(4)),
      "photograph on the graphics card, bytes": 4 * this.photograph.width * this.photograph.height,
    };
  }

  dispose(): void {
    this.shells.dispose();
  }

  private code(layers: number): void {
    const dropped = this.pkg.parameter<string>("tails") === "dropped";
    this.shells.setCodes(depthCodes(this.luminance as Float32Array, this.medium, layers, dropped));
    this.coded = layers;
  }
}

function sphereAbout(vertices: Float32Array): Bounds {
  const points = new THREE.BufferAttribute(vertices, 3);
  const centre = new THREE.Box3().setFromBufferAttribute(points).getCenter(new THREE.Vector3());
  const point = new THREE.Vector3();
  let radius = 0;
  for (let n = 0; n < points.count; n++) {
    radius = Math.max(radius, point.fromBufferAttribute(points, n).distanceTo(centre));
  }
  return { centre: centre.toArray(), radius };
}

/** The system's live view. */
const viewer: SystemViewer = {
  name: "photo_fur",
  async make(pkg, context) {
    const [mesh, photograph] = await Promise.all([pkg.mesh("mesh"), pkg.picture("photograph")]);
    if (!mesh.normals || !mesh.uvs || photograph.channels !== 4 || !(photograph.data instanceof Uint8Array)) {
      throw new Error(`${pkg.name}: expected normals, texture coordinates and a photograph of 4 channels of bytes.`);
    }
    const shells = new Shells(mesh as Required<MeshData>, photograph as Picture<Uint8Array>);
    return new Fur(pkg, context, shells, mesh, photograph);
  },
};

export default viewer;
