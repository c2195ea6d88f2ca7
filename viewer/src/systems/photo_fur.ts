/** Fur to walk around, in the full look or the paper's, with wind, thickness, layers and light. */

import * as THREE from "three";
import { orbit, type Camera, type Vector } from "../drawing/camera";
import { drawScene } from "../drawing/scene";
import type { Bounds, Context, Control, LiveView, State, SystemViewer } from "../live_view";
import type { MeshData } from "../package/mesh";
import type { Package } from "../package/package";
import { codeSteps, depthCodes, type Medium } from "./photo_fur/codes";
import { LaidShells, type Constants, type Depths } from "./photo_fur/laid_shells";
import { bodyOf, lay } from "./photo_fur/laying";
import { controlsOf, withState, type Look } from "./photo_fur/look";
import { luminanceOf, photographOf, photographTexture, setCodes } from "./photo_fur/photograph";
import { Shells } from "./photo_fur/shells";

/** From the front's left, with all of the bounds in view. */
const HOME = { azimuth: -62, elevation: 24, sine: Math.sin(Math.PI / 12) };
/** Linear radiance; "grey" is that of the stage's pictures. */
const BACKGROUNDS: Record<string, Vector> = {
  night: [0.012, 0.013, 0.016],
  paper: [0.86, 0.84, 0.8],
  moss: [0.05, 0.075, 0.055],
};
/** In radii of the mesh: fur is seen from no nearer when shells are counted. */
const NEAREST = 0.1;

/** What a package's fur is made of. */
interface Parts {
  plain: Shells;
  full: LaidShells;
  photograph: THREE.DataTexture;
  luminance: Float32Array;
  sphere: Bounds;
}

class Fur implements LiveView {
  readonly navigation = "orbit";
  readonly home: Camera;
  private readonly scene = new THREE.Scene();
  private readonly backgrounds: Record<string, Vector>;
  private readonly medium: Medium;
  private readonly thickness: number;
  private readonly layers: number;
  private look: Look;
  /** The number of layers that the depth codes are for. */
  private coded = 0;
  private depths: Depths;

  constructor(
    private readonly pkg: Package,
    private readonly context: Context,
    private readonly parts: Parts,
  ) {
    this.scene.add(parts.plain, parts.full);
    this.backgrounds = { grey: pkg.parameter<Vector>("background"), ...BACKGROUNDS };
    this.medium = { brightest: pkg.parameter("brightest"), darkest: pkg.parameter("darkest") };
    this.thickness = pkg.parameter("thickness");
    this.layers = pkg.parameter("layers");
    this.depths = { codes: 1, attenuation: pkg.parameter("attenuation"), middle: pkg.parameter("middle") };
    this.look = {
      look: pkg.parameter<Look["look"]>("look"),
      layers: this.layers,
      thickness: 1,
      fill: pkg.parameter<Look["fill"]>("fill"),
      wind: 0,
      moment: null,
      sky: 0.15,
      headlight: 0.35,
      lamp: 0.75,
      light: [-0.48, -0.6, 0.64],
      background: "night",
    };
    this.code(this.layers, this.look.look === "full");
    this.home = orbit(this.bounds.centre, this.bounds.radius / HOME.sine, HOME.azimuth, HOME.elevation);
  }

  get controls(): Control[] {
    return controlsOf(this.look, Object.keys(this.backgrounds));
  }

  get bounds(): Bounds {
    const { sphere } = this.parts;
    return { ...sphere, radius: sphere.radius + this.thickness * this.look.thickness };
  }

  state(): State {
    return { ...this.look, light: [...this.look.light] };
  }

  setState(state: State): void {
    this.look = withState(this.look, state, Object.keys(this.backgrounds));
  }

  /** While wind blows, each frame asks for the next. */
  update(): void {
    if (this.look.look === "full" && this.look.wind > 0 && this.look.moment === null) this.context.requestDraw();
  }

  draw(renderer: THREE.WebGLRenderer, camera: Camera, width: number, height: number): void {
    const { look, parts } = this;
    const isFull = look.look === "full";
    const thickness = this.thickness * look.thickness;
    parts.full.visible = isFull;
    parts.plain.visible = !isFull;
    // In the plain look each layer is a step of the codes; in the full one shells are any number,
    // and the photograph has mipmaps.
    this.code(isFull ? this.layers : look.layers, isFull);
    if (isFull) {
      const shells = parts.full.shellsSeen(rowsOfFur(camera, parts.sphere, thickness, height));
      const moment = look.moment ?? performance.now() / 1000;
      parts.full.setLook(look, shells, thickness, parts.sphere.radius, moment, this.depths);
    } else parts.plain.setLook(look, this.coded, thickness, this.depths.attenuation);
    drawScene(renderer, this.scene, camera, [width, height], this.bounds, this.backgrounds[look.background]);
  }

  figures(): Record<string, number | string> {
    const { plain, full, photograph } = this.parts;
    const { width, height } = photograph.image as { width: number; height: number };
    return {
      "draw calls": 1,
      triangles: (this.look.look === "full" ? full : plain).triangles,
      "thickness, mesh units": Number((this.thickness * this.look.thickness).toPrecision(4)),
      "photograph on the graphics card, bytes": 4 * width * height,
    };
  }

  dispose(): void {
    this.parts.plain.dispose();
    this.parts.full.dispose();
  }

  private code(layers: number, mipmap: boolean): void {
    if (layers === this.coded && mipmap === this.parts.photograph.generateMipmaps) return;
    const dropped = this.pkg.parameter<string>("tails") === "dropped";
    const codes = depthCodes(this.parts.luminance, this.medium, layers, dropped);
    setCodes(this.parts.photograph, codes, mipmap);
    this.coded = layers;
    this.depths.codes = codeSteps(layers) * layers;
  }
}

/** Rows of samples that fur so thick takes where the sphere about the mesh is nearest. */
function rowsOfFur({ position, view_angle, height: high }: Camera, sphere: Bounds, thickness: number, height: number): number {
  if (high !== null) return (thickness * height) / high;
  const away = Math.hypot(...position.map((axis, i) => axis - sphere.centre[i]));
  const nearest = Math.max(away - sphere.radius, NEAREST * sphere.radius);
  return (thickness * height) / (2 * Math.tan((view_angle * Math.PI) / 360) * nearest);
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

async function partsOf(pkg: Package): Promise<Parts> {
  const array = async <T>(name: string) => (await pkg.array(name)) as T;
  const [mesh, photograph, codes, middles, places, directions, opaque] = await Promise.all([
    pkg.mesh("mesh"),
    photographOf(pkg),
    array<Uint8Array>("lie"),
    array<Uint32Array>("patch_vertex"),
    array<Float32Array>("patch_place"),
    array<Float32Array>("patch_direction"),
    pkg.has("opaque") ? pkg.picture("opaque") : undefined,
  ]);
  const count = mesh.vertices.length / 3;
  const [patches, pixels] = [middles.length, photograph.width * photograph.height];
  const isWhole =
    codes.length === 2 * count &&
    places.length === 2 * patches &&
    directions.length === patches &&
    middles.every((vertex) => vertex < count) &&
    (!opaque || opaque.data.length === pixels);
  if (!mesh.normals || !mesh.uvs || !isWhole) {
    throw new Error(`${pkg.name}: expected normals, texture coordinates, hair for each vertex and patches on them.`);
  }
  const whole = mesh as Required<MeshData>;
  const body = bodyOf(whole, codes, pkg.parameter<number[]>("backwards"));
  const spacing = pkg.parameter("patch_spacing");
  const width = pkg.parameter("photograph_width");
  const laying = lay(body, { middles, places, directions, spacing, width });
  const lengths = Float32Array.from(codes.subarray(count), (code) => code / 255);
  const image = photographTexture(photograph);
  return {
    plain: new Shells(whole, image),
    full: new LaidShells(whole, body, lengths, laying, image, pkg.parameter<Constants>("constants")),
    photograph: image,
    luminance: luminanceOf(photograph, opaque),
    sphere: sphereAbout(mesh.vertices),
  };
}

/** The system's live view. */
const viewer: SystemViewer = {
  name: "photo_fur",
  make: async (pkg, context) => new Fur(pkg, context, await partsOf(pkg)),
};

export default viewer;
