/** A street: driven through, its tiles loaded ahead and dropped behind. */

import * as THREE from "three";
import { drawingCamera, worldToDevice, type Camera } from "../drawing/camera";
import { drawScene } from "../drawing/scene";
import { Sky } from "../drawing/sky";
import type { Surface } from "../drawing/surface";
import { texture } from "../drawing/textures";
import type { Bounds, Context, Control, LiveView, Motion, State, SystemViewer } from "../live_view";
import type { Package } from "../package/package";
import { driven, flown, turned } from "./street_billboards/driving";
import { Path } from "./street_billboards/path";
import { Residents } from "./street_billboards/residents";
import { ribbonOf } from "./street_billboards/ribbon";
import { codingOf, Tile } from "./street_billboards/tile";
import { farthest, neededTiles, tilePlaces, type TilePlace } from "./street_billboards/tile_table";

/** Tiles that are there before the first frame. */
const FIRST = 2;
/** A first frame must not fail for a tile that is broken: what is wrong is said after it. */
const SILENT_FRAMES = 2;
/** By how much a narrow window's view may be wider than the photographs'. */
const WIDEST = 1.5;

/** Vectors that a vertex hands on beside a tile's weights, billboards shown. */
const OTHER_VARYINGS = 5;
const CHOICES: Record<string, string[]> = { show: ["street", "billboards"], camera: ["road", "free"] };

/** Camera and tiles of one package. */
class StreetView implements LiveView {
  readonly navigation = "drive";
  readonly bounds: Bounds;
  readonly home: Camera;
  readonly controls: Control[] = [
    {
      kind: "choice",
      name: "show",
      label: "Show",
      options: [
        { value: "street", label: "The street" },
        { value: "billboards", label: "Its billboards" },
      ],
    },
    {
      kind: "choice",
      name: "camera",
      label: "Camera",
      options: [
        { value: "road", label: "On the road" },
        { value: "free", label: "Free" },
      ],
    },
    { kind: "slider", name: "speed", label: "Speed", min: 1, max: 30, step: 0.5, units: "m/s" },
    { kind: "toggle", name: "path", label: "The way that was driven" },
  ];

  private readonly scene = new THREE.Scene();
  private readonly tiles: Residents<Tile>;
  private readonly set = { show: "street", camera: "road", speed: 6, path: false };
  private sorted = "";
  private frames = 0;

  constructor(
    pkg: Package,
    private readonly context: Context,
    private readonly places: TilePlace[],
    private readonly path: Path,
    private readonly ribbon: Surface,
    sky: Sky,
  ) {
    const coding = codingOf(pkg);
    this.tiles = new Residents(
      async (number) => {
        const shown = this.set.show === "billboards";
        const tile = await Tile.load(pkg, number, places[number].billboards, coding, shown);
        if (shown !== (this.set.show === "billboards")) tile.showBillboards(!shown);
        this.scene.add(tile.surface);
        return tile;
      },
      () => context.requestDraw(),
    );
    const box = places.reduce((all, place) => all.union(place.box), new THREE.Box3());
    const sphere = box.getBoundingSphere(new THREE.Sphere());
    this.bounds = { centre: sphere.center.toArray(), radius: sphere.radius };
    this.home = widened(pkg.meta.views[0]?.camera ?? firstCamera(path, pkg.parameter("view_angle")), context);
    this.scene.add(sky, ribbon);
    ribbon.visible = false;
  }

  /** Settled when the nearest tiles are there. */
  opened(): Promise<void> {
    return this.tiles.want(neededTiles(this.places, this.home).slice(0, FIRST));
  }

  state(): State {
    return { ...this.set };
  }

  setState(state: State): void {
    const next = { ...this.set, ...state };
    for (const [name, options] of Object.entries(CHOICES)) {
      const given = next[name as "show" | "camera"];
      if (!options.includes(given)) throw new Error(`${name} is ${given}; expected ${options.join(" or ")}.`);
    }
    if (!(next.speed > 0 && next.speed <= 100)) throw new Error(`speed is ${next.speed}; expected metres a second.`);
    if (next.show !== this.set.show) {
      for (const tile of this.tiles.held.values()) tile.showBillboards(next.show === "billboards");
    }
    Object.assign(this.set, { show: next.show, camera: next.camera, speed: next.speed, path: Boolean(next.path) });
    this.ribbon.visible = this.set.path;
  }

  async update(camera: Camera): Promise<void> {
    await this.tiles.want(neededTiles(this.places, camera));
    if (this.frames > SILENT_FRAMES && this.tiles.errors.length) throw this.tiles.errors.shift();
  }

  draw(renderer: THREE.WebGLRenderer, camera: Camera, width: number, height: number): void {
    this.frames++;
    if (this.frames === SILENT_FRAMES + 1 && this.tiles.errors.length) this.context.requestDraw();
    const held = [...this.tiles.held.keys()];
    const boxes = held.map((number) => this.places[number].box);
    // The stage's depths, too, end with what there is, seen from where the camera is.
    const seen = { centre: camera.position, radius: farthest(boxes, camera.position) };
    const device = worldToDevice(drawingCamera(camera, width, height, seen));
    const sorted = JSON.stringify([held, device.elements]);
    if (sorted !== this.sorted) this.sort(camera, device);
    this.sorted = sorted;
    drawScene(renderer, this.scene, camera, [width, height], seen);
  }

  move(camera: Camera, motion: Motion, seconds: number): Camera {
    const metres = this.set.speed * seconds;
    const turnedTo = motion.turn || motion.tilt ? turned(camera, motion.turn, motion.tilt) : camera;
    if (!motion.forward && !motion.side && !motion.up) return turnedTo;
    return this.set.camera === "road" ? driven(turnedTo, motion, metres, this.path) : flown(turnedTo, motion, metres);
  }

  figures(): Record<string, number | string> {
    const held = [...this.tiles.held.values()];
    const sum = (of: (tile: Tile) => number) => held.reduce((so, tile) => so + of(tile), 0);
    return {
      "tiles resident": held.length,
      "tiles resident, at most": this.tiles.most,
      "tiles of the street": this.places.length,
      "tiles loaded so far": this.tiles.loads,
      "tiles dropped so far": this.tiles.drops,
      "billboards in view": sum((tile) => tile.sent),
      "MB on the graphics card": Number((sum((tile) => tile.bytes) / 1e6).toFixed(2)),
    };
  }

  dispose(): void {
    this.tiles.dispose();
    for (const each of [...this.scene.children] as (Sky | Surface)[]) each.dispose();
    this.scene.clear();
  }

  private sort(camera: Camera, device: THREE.Matrix4): void {
    const frustum = new THREE.Frustum().setFromProjectionMatrix(device);
    const eye = new THREE.Vector3(...camera.position);
    const byNearness = [...this.tiles.held].sort(
      ([one], [other]) => this.places[one].box.distanceToPoint(eye) - this.places[other].box.distanceToPoint(eye),
    );
    byNearness.forEach(([, tile], rank) => {
      tile.look(frustum, camera.position);
      tile.surface.renderOrder = rank - byNearness.length; // before the sky
    });
  }
}

/** As wide as the photographs in a wide window; taller in a narrow one. */
function widened(camera: Camera, { renderer }: Context): Camera {
  const { clientWidth, clientHeight } = renderer.domElement;
  const aspect = (clientWidth || window.innerWidth) / (clientHeight || window.innerHeight);
  const tangent = Math.tan(THREE.MathUtils.degToRad(camera.view_angle / 2)) * Math.min(Math.max(1 / aspect, 1), WIDEST);
  return { ...camera, view_angle: 2 * THREE.MathUtils.radToDeg(Math.atan(tangent)) };
}

function firstCamera(path: Path, viewAngle: number): Camera {
  const position = path.at(0);
  const azimuth = path.azimuth(0);
  const target = position.clone().add(new THREE.Vector3(Math.cos(azimuth), Math.sin(azimuth), 0));
  return { position: position.toArray(), target: target.toArray(), up: [0, 0, 1], view_angle: viewAngle, height: null };
}

/** The paper's form hands more from vertex to fragment than some graphics cards can. */
function checkVaryings(pkg: Package, { renderer }: Context): void {
  const gl = renderer.getContext();
  const most = gl.getParameter(gl.MAX_VARYING_VECTORS) as number;
  const { detailTiles, tintTiles } = codingOf(pkg);
  const needed = OTHER_VARYINGS + detailTiles + tintTiles;
  if (needed > most) {
    throw new Error(`${pkg.name}: its billboards hand ${needed} vectors to a fragment; this graphics card has ${most}.`);
  }
}

async function make(pkg: Package, context: Context): Promise<LiveView> {
  const [places, poses, heldOut, sky] = await Promise.all([
    tilePlaces(pkg),
    pkg.floats("path"),
    pkg.array("path_held_out"),
    pkg.floats("sky"),
  ]);
  if (poses.length < 16 || !places.length) throw new Error(`${pkg.name}: path or tiles are empty; expected a street.`);
  checkVaryings(pkg, context);
  const [height, width] = pkg.shape("sky");
  const path = new Path(poses);
  const behind = new Sky(texture({ width, height, channels: 3, data: sky }));
  const view = new StreetView(pkg, context, places, path, ribbonOf(path, heldOut), behind);
  await view.opened();
  return view;
}

export default { name: "street_billboards", make } satisfies SystemViewer;
