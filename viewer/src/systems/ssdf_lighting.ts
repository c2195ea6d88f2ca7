/** A scene under an environment that can be turned, or brought along. */

import * as THREE from "three";
import type { Camera, Vector } from "../drawing/camera";
import { drawScene } from "../drawing/scene";
import type { Surface } from "../drawing/surface";
import type { Bounds, Context, Control, LiveView, State, SystemViewer } from "../live_view";
import { BadPackage } from "../package/bad_package";
import type { MeshData } from "../package/mesh";
import type { Package } from "../package/package";
import { ask } from "./ssdf_lighting/ask";
import { TurnedEnvironment } from "./ssdf_lighting/turned_environment";
import { clusterSurface } from "./ssdf_lighting/clusters";
import type { DistanceTables } from "./ssdf_lighting/distance_tables";
import { EdgePass, type LightUniforms } from "./ssdf_lighting/edge_pass";
import { bounced, mattLight, readBounce, showBounced, type BounceFactors } from "./ssdf_lighting/interreflection";
import { lightParts, litParts, readMaterials, type Materials } from "./ssdf_lighting/lit_parts";
import { COLUMNS, FINE, type MattTables } from "./ssdf_lighting/lobe_tables";
import { readProbe } from "./ssdf_lighting/probe_files";
import { downsampled, Sphere, type Environment } from "./ssdf_lighting/sphere_map";
import { softened } from "./ssdf_lighting/suns";
import { tableTexture } from "./ssdf_lighting/tables";

/** What can be set. */
interface LitState {
  /** Degrees, counter-clockwise from above. */
  turn: number;
  shadows: boolean;
  reflected: boolean;
  clusters: boolean;
  behind: boolean;
  /** Stops. */
  exposure: number;
}

/** The lights of an environment, with their tables. */
interface Probe {
  name: string;
  environment: Environment;
  axes: Float32Array;
  sharpness: Float32Array;
  amplitudes: Float32Array;
  tables: MattTables;
  irradianceError: number;
}

const SCHEMA = 2;
const SHOWN_ROWS = 128; // of a user's environment

/** What was read; the distances may still be decoded when the first frame is drawn. */
interface Loaded {
  mesh: MeshData;
  materials: Materials;
  distances: Promise<DistanceTables>;
  triangleCluster: ArrayLike<number>;
  probe: Probe;
  bounce: BounceFactors;
}

const viewer: SystemViewer = {
  name: "ssdf_lighting",
  async make(pkg, context) {
    if (pkg.meta.schema !== SCHEMA) {
      throw new BadPackage(pkg.name, "schema", `${pkg.meta.schema}`, `${SCHEMA}: make the package again`);
    }
    const distances = readDistances(pkg);
    distances.catch(() => {}); // told by `update`
    const [mesh, materials, probe, triangleCluster, bounce] = await Promise.all([
      pkg.mesh("mesh"),
      readMaterials(pkg),
      readOwnProbe(pkg),
      pkg.array("triangle_cluster"),
      readBounce(pkg),
    ]);
    return new LitView(pkg, context, { mesh, materials, distances, triangleCluster, probe, bounce });
  },
};
export default viewer;

async function readDistances(pkg: Package): Promise<DistanceTables> {
  if (pkg.has("ssdf")) {
    const [file, rootWeight] = await Promise.all([pkg.array("ssdf"), pkg.floats("root_weight")]);
    return ask({ kind: "file", file: file as Uint8Array, rootWeight });
  }
  const [first, rowVertex, rowFirst] = (await Promise.all(
    ["first", "row_vertex", "row_first"].map((name) => pkg.array(name)),
  )) as Int32Array[];
  const [vectors, weights] = await Promise.all([pkg.floats("vectors"), pkg.floats("weights")]);
  const vertices = rowVertex.reduce((most, vertex) => Math.max(most, vertex), 0) + 1;
  const form = { vectors, directions: pkg.shape("vectors")[1], first, rowVertex, rowFirst, weights };
  return ask({ kind: "paper", form, vertices });
}

async function readOwnProbe(pkg: Package): Promise<Probe> {
  const [axes, sharpness, amplitudes, data] = await Promise.all(
    ["light_axes", "light_sharpness", "light_amplitudes", "environment"].map((name) => pkg.floats(name)),
  );
  const environment = { height: pkg.shape("environment")[0], data };
  const name = pkg.meta.source[1]?.name ?? "the package's";
  const tables = await ask({ kind: "lobes", sharpness });
  const irradianceError = pkg.parameter("irradiance_error");
  return { name, environment, axes, sharpness, amplitudes, tables, irradianceError };
}

/** One package, live. */
class LitView implements LiveView {
  readonly navigation = "orbit";
  readonly bounds: Bounds = { centre: [0, 0, 0], radius: 1 };
  readonly home?: Camera;
  private readonly settings: LitState = { turn: 0, shadows: true, reflected: true, clusters: false, behind: false, exposure: 0 };
  private readonly scene = new THREE.Scene();
  private readonly parts: Surface[];
  private readonly backdrop = new TurnedEnvironment();
  private readonly edges: EdgePass;
  private readonly exposure: number;
  private readonly rmse: number;
  private readonly background: Vector;
  private readonly count: number;
  private readonly vertexOfRow: Int32Array;
  private shownBounce = "";
  private clusterScene: THREE.Scene | undefined;
  private readonly whole: Promise<void>;
  private ended = false;
  private distanceBytes: number | undefined;
  private probe: Probe;
  private mattAxes!: THREE.DataTexture;
  private matt!: THREE.DataTexture;

  constructor(
    pkg: Package,
    private readonly context: Context,
    private readonly loaded: Loaded,
  ) {
    this.exposure = pkg.parameter("exposure");
    this.rmse = pkg.parameter("rmse");
    this.background = pkg.parameter<Vector>("background");
    this.probe = loaded.probe;
    this.count = loaded.probe.sharpness.length;
    const { mesh, materials } = loaded;
    const { SOURCE, LOBES } = mesh.attributes;
    const vertices = { vertices: mesh.vertices, normals: mesh.normals!, source: SOURCE.values, lobes: LOBES.values };
    const gloss = { values: glossAxes(materials), columns: materials.glossColumns };
    this.edges = new EdgePass(context.renderer, vertices, gloss, this.count);
    const shared = { lightCount: this.count, edges: this.edges.texture, edgeRows: this.edges.rows };
    this.parts = litParts(mesh, materials, shared);
    this.scene.add(...this.parts, this.backdrop);
    this.vertexOfRow = new Int32Array(loaded.bounce.codes.length / loaded.bounce.steps.length);
    SOURCE.values.forEach((row, vertex) => (this.vertexOfRow[row] = vertex));
    this.show(loaded.probe);
    this.whole = loaded.distances.then((tables) => {
      this.distanceBytes = tables.vectors.length + 4 * (tables.weights.length + tables.sources.length);
      if (this.ended) return;
      this.edges.load(tables);
      context.requestDraw();
    });
    this.whole.catch(() => {}); // told by `update`
  }

  /** Settled when shadows are there. */
  update(): Promise<void> {
    return this.whole;
  }

  get controls(): Control[] {
    return [
      { kind: "slider", name: "turn", label: "Turn of the light", min: 0, max: 360, step: 1, units: "°" },
      { kind: "slider", name: "exposure", label: "Exposure", min: -3, max: 3, step: 0.1, units: "stops" },
      { kind: "toggle", name: "shadows", label: "Shadows" },
      { kind: "toggle", name: "reflected", label: "Light between surfaces" },
      { kind: "toggle", name: "behind", label: "Environment behind" },
      { kind: "toggle", name: "clusters", label: "Clusters" },
      {
        kind: "drop",
        name: "probe",
        label: "Light of your own: .hdr, .png, .jpg",
        accept: ".hdr,.png,.jpg,.jpeg,.exr",
        take: (file) => this.take(file),
      },
      { kind: "button", name: "own", label: "The package's light", press: () => this.show(this.loaded.probe) },
    ];
  }

  state(): State {
    return { ...this.settings };
  }

  setState(state: State): void {
    for (const [name, value] of Object.entries(state)) {
      if (!(name in this.settings)) continue;
      const known = this.settings as unknown as Record<string, unknown>;
      if (typeof value !== typeof known[name] || Number.isNaN(value)) {
        throw new Error(`${name} is ${JSON.stringify(value)}; expected a ${typeof known[name]}.`);
      }
      known[name] = value;
    }
  }

  draw(renderer: THREE.WebGLRenderer, camera: Camera, width: number, height: number): void {
    const size: [number, number] = [width, height];
    if (this.settings.clusters) {
      this.clusterScene ??= new THREE.Scene().add(clusterSurface(this.loaded.mesh, this.loaded.triangleCluster));
      drawScene(renderer, this.clusterScene, camera, size, this.bounds, this.background);
      return;
    }
    const exposure = this.exposure * 2 ** this.settings.exposure;
    const turn = (this.settings.turn * Math.PI) / 180;
    const lights = turned(this.probe, turn, exposure);
    const eye = eyeOf(camera);
    this.edges.draw(renderer, eye, lights, this.mattAxes, this.settings.shadows);
    lightParts(this.parts, eye, lights, this.matt);
    this.reflect(renderer, lights);
    this.backdrop.visible = this.settings.behind;
    this.backdrop.set(turn, exposure);
    const plain = this.background.map((value) => value * exposure) as Vector;
    drawScene(renderer, this.scene, camera, size, this.bounds, plain);
  }

  /** Lets surfaces light each other, where that has changed since the last frame. */
  private reflect(renderer: THREE.WebGLRenderer, lights: LightUniforms): void {
    const { mesh, bounce } = this.loaded;
    const { reflected, shadows } = this.settings;
    const known = `${reflected} ${shadows && this.distanceBytes} ${lights.lights.join()} ${lights.amplitudes.join()}`;
    if (known === this.shownBounce) return;
    this.shownBounce = known;
    const direct = new Float64Array(3 * bounce.samples.length);
    if (reflected) {
      const distance = this.edges.mattDistances(renderer);
      const matt = { ...lights, radiance: this.probe.tables.radiance };
      bounce.samples.forEach((row, k) => {
        const vertex = this.vertexOfRow[row];
        const normal = mesh.normals!.subarray(3 * vertex, 3 * vertex + 3);
        direct.set(mattLight(normal, matt, (light) => distance(vertex, light)), 3 * k);
      });
    }
    showBounced(this.parts, mesh.attributes.SOURCE.values, bounced(bounce, direct));
  }

  figures(): Record<string, number | string> {
    return {
      light: this.probe.name,
      "spherical Gaussians": this.count,
      "relative error of their irradiance": this.probe.irradianceError,
      "distances on the graphics card, bytes": this.distanceBytes ?? "are being decoded",
    };
  }

  dispose(): void {
    this.ended = true;
    for (const part of this.parts) part.dispose();
    for (const surface of this.clusterScene?.children ?? []) (surface as Surface).dispose();
    this.backdrop.dispose();
    this.edges.dispose();
    this.mattAxes.dispose();
    this.matt.dispose();
  }

  /** Lights the scene by a user's file, as bright on the whole as the package's environment. */
  private async take(file: File): Promise<void> {
    const given = await readProbe(file);
    const rows = Math.min(given.height, SHOWN_ROWS);
    const environment = downsampled(given, rows);
    const own = this.loaded.probe.environment;
    const scale = brightness(own) / brightness(environment);
    if (!Number.isFinite(scale)) throw new Error(`${file.name}: radiance is 0 everywhere; expected some light.`);
    environment.data.forEach((value, k, data) => (data[k] = value * scale));
    const whole = { height: given.height, data: given.data.map((value) => value * scale) };
    const fit = await ask({ kind: "fit", environment: whole, count: this.count });
    const amplitudes = Float32Array.from(fit.lights.amplitudes);
    const soft = softened(Float32Array.from(fit.lights.sharpness), amplitudes, this.rmse);
    this.show({
      name: file.name,
      environment,
      axes: Float32Array.from(fit.lights.axes),
      ...soft,
      tables: await ask({ kind: "lobes", sharpness: soft.sharpness }),
      irradianceError: fit.irradianceError,
    });
  }

  private show(probe: Probe): void {
    this.probe = probe;
    this.mattAxes?.dispose();
    this.matt?.dispose();
    this.mattAxes = tableTexture(probe.tables.axes, COLUMNS, this.count);
    this.matt = tableTexture(probe.tables.radiance, FINE + 1, this.count);
    this.backdrop.show(probe.environment);
    this.context.requestDraw();
  }
}

/** Sharpness -1 where a material has no gloss. */
function glossAxes({ gloss, glossColumns, specular, count }: Materials): Float32Array {
  const values = Float32Array.from(gloss);
  for (let row = 0; row < count; row++) {
    if (specular[row] > 0) continue;
    for (let column = 0; column < glossColumns; column++) values[4 * (row * glossColumns + column)] = -1;
  }
  return values;
}

/** Lights as the shaders have them, turned about z, exposed. */
function turned({ axes, sharpness, amplitudes }: Probe, turn: number, exposure: number) {
  const [cosine, sine] = [Math.cos(turn), Math.sin(turn)];
  const lights = new Float32Array(4 * sharpness.length);
  sharpness.forEach((sharp, k) => {
    const [x, y, z] = axes.subarray(3 * k, 3 * k + 3);
    lights.set([cosine * x - sine * y, sine * x + cosine * y, z, sharp], 4 * k);
  });
  return { lights, amplitudes: amplitudes.map((value) => value * exposure) };
}

/** The view vector of a point x is the direction of eye.xyz - eye.w x. */
function eyeOf({ position, target, height }: Camera): THREE.Vector4 {
  if (height === null) return new THREE.Vector4(...position, 1);
  const away = new THREE.Vector3(...position).sub(new THREE.Vector3(...target)).normalize();
  return new THREE.Vector4(away.x, away.y, away.z, 0);
}

/** Mean luminance. */
function brightness({ height, data }: Environment): number {
  const [red, green, blue] = new Sphere(height).flux(data);
  return (0.2126 * red + 0.7152 * green + 0.0722 * blue) / (4 * Math.PI);
}
