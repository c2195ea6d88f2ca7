/** What a system's live view gives the page, and what the page gives it. */

import type { WebGLRenderer } from "three";
import type { Camera } from "./drawing/camera";
import type { Package } from "./package/package";

/** What a live view shows, as plain JSON: what a URL, a reference view and the slider hold. */
export interface View {
  camera: Camera;
  state: State;
}

/** A live view's own settings: plain JSON. */
export type State = Record<string, unknown>;

/** Something that a person sets; `name` is its key in the state. */
export type Control =
  | { kind: "slider"; name: string; label: string; min: number; max: number; step?: number; units?: string }
  | { kind: "toggle"; name: string; label: string }
  | { kind: "choice"; name: string; label: string; options: { value: string; label: string }[] }
  /** A unit vector [x, y, z], z up: dragged on a pad, or on the picture with the right button. */
  | { kind: "direction"; name: string; label: string }
  /** A user's file. A promise that is rejected shows its error's message in the page. */
  | { kind: "drop"; name: string; label: string; accept: string; take(file: File): Promise<void> }
  | { kind: "button"; name: string; label: string; press(): void };

/** How far a person asks to go, in [-1, 1]; `turn` and `tilt` in radians. */
export interface Motion {
  forward: number;
  side: number;
  up: number;
  turn: number;
  tilt: number;
}

/** One package, shown live. */
export interface LiveView {
  /** What can be set; read again after each `setState`. */
  readonly controls: Control[];
  /** "orbit": the page turns the camera about the bounds. "drive": `move` places it. */
  readonly navigation: "orbit" | "drive";
  /** A sphere about all that is seen, in scene units. */
  readonly bounds: Bounds;
  /** Where the camera is at first; else that of the package's first view. */
  readonly home?: Camera;
  state(): State;
  /** Takes any part of a state; throws where a value cannot be. */
  setState(state: State): void;
  /** Called before a frame, e.g. to load tiles; what is loaded later calls `requestDraw`. */
  update?(camera: Camera): Promise<void> | void;
  /**
   * Draws linear radiance, background and all, into the target that is bound; while something moves
   * (`moving`), it may do so with less care.
   */
  draw(renderer: WebGLRenderer, camera: Camera, width: number, height: number, moving?: boolean): void;
  /** Where a person's motion of so many seconds brings the camera ("drive"). */
  move?(camera: Camera, motion: Motion, seconds: number): Camera;
  /** For the drawer: tiles resident, … */
  figures?(): Record<string, number | string>;
  /** Frees what it holds on the graphics card. */
  dispose(): void;
}

/** A sphere, in scene units. */
export interface Bounds {
  centre: [number, number, number];
  radius: number;
}

/** What the page does for a live view. */
export interface Context {
  readonly renderer: WebGLRenderer;
  /** Draws a frame soon: something has changed. */
  requestDraw(): void;
}

/** One system's live view. `viewer/src/systems/<system>.ts` has it as its default export. */
export interface SystemViewer {
  /** The system's name, as in `meta.json`. */
  name: string;
  make(pkg: Package, context: Context): Promise<LiveView>;
}
