/** Scratched glass in its environment, tilted under a lamp. */

import * as THREE from "three";
import { eyeOf, orbit, type Camera } from "../drawing/camera";
import { drawScene } from "../drawing/scene";
import type { Bounds, Context, Control, LiveView, State, SystemViewer } from "../live_view";
import { lampRadiance, lampSteradians } from "./glass_scratches/environment";
import { ENDINGS, readEnvironment } from "./glass_scratches/environment_file";
import { Environments } from "./glass_scratches/environments";
import { glassOf, type Glass } from "./glass_scratches/glass";
import { controlsOf, stateOf, withState, type Settings } from "./glass_scratches/state";
import { Surroundings } from "./glass_scratches/surroundings";

/** The name of a person's own environment. */
const DROPPED = "yours";
/** A dark set: the lamps' room is dimmed, one of them stands behind the glass, the lamp beside it. */
const DARK_SET = { turn: -84, brightness: 0.18, tilt: 14, lamp: 7 };
const BRIGHT_SET = { turn: 0, brightness: 1, tilt: 0, lamp: 2 };
const HOME_LIGHT: [number, number, number] = [0.64, 0.48, 0.6];
const UP = new THREE.Vector3(0, 0, 1);

class ScratchedGlass implements LiveView {
  readonly navigation = "orbit";
  readonly bounds: Bounds = { centre: [0, 0, 0], radius: 1 };
  readonly home = orbit([0, 0, 0], 2.7, -75, 1, { view_angle: 36 });
  private readonly scene = new THREE.Scene();
  private readonly surroundings: Surroundings;

  constructor(
    private readonly context: Context,
    private readonly glass: Glass,
    private readonly environments: Environments,
    private readonly edge: readonly number[],
    private readonly lampColour: readonly number[],
    private settings: Settings,
  ) {
    this.surroundings = new Surroundings(edge);
    this.scene.add(glass.surface, this.surroundings);
  }

  get controls(): Control[] {
    return controlsOf(this.settings, this.environments.names, (file) => this.take(file), ENDINGS);
  }

  state(): State {
    return stateOf(this.settings);
  }

  setState(state: State): void {
    this.settings = withState(this.settings, state, this.environments.names);
  }

  async update(): Promise<void> {
    if (await this.environments.show(this.settings.environment)) this.context.requestDraw();
  }

  draw(renderer: THREE.WebGLRenderer, camera: Camera, width: number, height: number): void {
    this.place(camera);
    drawScene(renderer, this.scene, camera, [width, height], this.bounds);
  }

  figures(): Record<string, number | string> {
    return { "exposure of the environment": Number(this.environments.shown.exposure.toPrecision(4)) };
  }

  dispose(): void {
    this.glass.surface.dispose();
    this.surroundings.dispose();
    this.environments.dispose();
  }

  private async take(file: File): Promise<void> {
    this.environments.add(DROPPED, await readEnvironment(file));
    this.settings = { ...this.settings, environment: DROPPED };
    this.context.requestDraw();
  }

  /** Writes all that is set to the uniforms. */
  private place(camera: Camera): void {
    const { surface } = this.glass;
    const { turn, brightness, tilt, swing, lamp, light, tile, strength } = this.settings;
    const leant = new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(1, 0, 0), THREE.MathUtils.degToRad(-tilt));
    surface.quaternion.setFromAxisAngle(UP, THREE.MathUtils.degToRad(swing)).multiply(leant);
    const intoGlass = surface.quaternion.clone().invert();
    const turned = new THREE.Quaternion().setFromAxisAngle(UP, THREE.MathUtils.degToRad(turn));
    const radiance = lampRadiance(lamp, this.environments.shown.mean, this.edge, this.lampColour);
    const behind = this.surroundings.uniforms;
    behind.sky.value = this.environments.shown.texture;
    behind.brightness.value = brightness;
    behind.toSky.value.copy(matrix(turned.clone().invert()));
    behind.lamp.value.set(...light);
    behind.lampRadiance.value.set(...radiance);
    const shown = surface.uniforms;
    shown.sky.value = this.environments.shown.texture;
    shown.softSky.value = this.environments.shown.soft;
    shown.brightness.value = brightness;
    shown.toSky.value.copy(matrix(turned.clone().invert().multiply(surface.quaternion)));
    shown.lamp.value.set(...light).applyQuaternion(intoGlass);
    shown.lampRadiance.value.set(...radiance);
    shown.eye.value.copy(eyeOf(camera)).applyQuaternion(intoGlass);
    shown.tileSide.value = tile;
    shown.allAround.value = brightness * this.environments.shown.through;
    shown.strength.value = strength;
    shown.coveredA.value.fromArray(this.covered(0));
    shown.coveredB.value.fromArray(this.covered(4));
    this.writeLights(intoGlass.clone().multiply(turned), shown.lamp.value, radiance);
  }

  private covered(first: number): number[] {
    const { layers, coverage } = this.settings;
    return [0, 1, 2, 3].map((n) => (layers[first + n] ? coverage : 0));
  }

  /** Lights in the texture, as the glass has them: powers in row 0, directions in row 1. */
  private writeLights(turn: THREE.Quaternion, lamp: THREE.Vector3, radiance: number[]): void {
    const { power, towards } = this.environments.shown.lights;
    const { brightness } = this.settings;
    const { data, width } = this.glass.lights.image as { data: Float32Array; width: number };
    const direction = new THREE.Vector3();
    for (let n = 0; n < width - 1; n++) {
      for (let channel = 0; channel < 3; channel++) data[4 * n + channel] = brightness * power[3 * n + channel];
      direction.fromArray(towards, 3 * n).applyQuaternion(turn).toArray(data, 4 * (width + n));
    }
    const steradians = lampSteradians(this.edge);
    data.set(radiance.map((value) => value * steradians), 4 * (width - 1));
    lamp.toArray(data, 4 * (2 * width - 1));
    this.glass.lights.needsUpdate = true;
  }
}

function matrix(turn: THREE.Quaternion): THREE.Matrix3 {
  return new THREE.Matrix3().setFromMatrix4(new THREE.Matrix4().makeRotationFromQuaternion(turn));
}

/** The system's live view. */
const viewer: SystemViewer = {
  name: "glass_scratches",
  async make(pkg, context) {
    const edge = pkg.parameter<number[]>("lamp_edge");
    const environment = pkg.parameter<string>("environment");
    const exposure = pkg.parameter<number>("exposure");
    const [glass, environments] = await Promise.all([glassOf(pkg, edge), Environments.of(pkg, environment, exposure)]);
    return new ScratchedGlass(context, glass, environments, edge, pkg.parameter<number[]>("lamp_colour"), {
      ...(environment === "lamps" ? DARK_SET : BRIGHT_SET),
      environment,
      swing: 0,
      coverage: 1,
      strength: 1,
      tile: pkg.parameter("tile"),
      light: HOME_LIGHT,
      layers: Array.from({ length: glass.layers }, () => true),
    });
  },
};

export default viewer;
