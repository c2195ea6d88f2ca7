/** Moving the camera by mouse, touch and keys. */

import type { Vector } from "../drawing/camera";
import type { Motion } from "../live_view";
import type { Live } from "./live";
import { panned, turned, zoomed } from "./orbit";
import { dragged } from "./pad";

const DEGREES_A_HEIGHT = 180;
const KEY_DEGREES = 4;
const TURN_A_SECOND = 1.1;
const DRIVE_KEYS: Record<string, [keyof Motion, number]> = {
  ArrowUp: ["forward", 1],
  w: ["forward", 1],
  ArrowDown: ["forward", -1],
  s: ["forward", -1],
  ArrowLeft: ["turn", 1],
  ArrowRight: ["turn", -1],
  a: ["side", -1],
  d: ["side", 1],
  q: ["up", -1],
  e: ["up", 1],
};

/** What navigation tells the page, and asks of it. */
export interface Navigated {
  /** The name of the direction that a drag turns now, if it turns one. */
  direction(event: PointerEvent | KeyboardEvent): string | undefined;
  /** Something was moved. */
  moved(): void;
}

/** Has a canvas move the camera of what is drawn on it; returns what ends that. */
export function navigate(canvas: HTMLCanvasElement, live: Live, page: Navigated): () => void {
  const end = new AbortController();
  const { signal } = end;
  const fingers = new Map<number, PointerEvent>();
  const held = new Set<string>();
  let driving = false;

  const turn = (right: number, down: number) => {
    const { view } = live;
    if (view.navigation === "drive" && view.move) {
      const part = Math.PI / 2 / canvas.clientHeight;
      const motion = { forward: 0, side: 0, up: 0, turn: right * part, tilt: down * part };
      live.camera = view.move(live.camera, motion, 0);
    } else {
      const part = DEGREES_A_HEIGHT / canvas.clientHeight;
      live.camera = turned(live.camera, -right * part, down * part);
    }
  };
  const zoom = (factor: number) => {
    const { view } = live;
    if (view.navigation === "drive" && view.move) {
      const motion = { forward: factor < 1 ? 1 : -1, side: 0, up: 0, turn: 0, tilt: 0 };
      live.camera = view.move(live.camera, motion, Math.abs(Math.log(factor)));
    } else {
      live.camera = zoomed(live.camera, factor, view.bounds);
    }
  };
  const changed = () => {
    live.change();
    page.moved();
  };
  const turnDirection = (name: string, right: number, up: number) => {
    const direction = live.view.state()[name] as Vector;
    live.setState({ [name]: dragged(direction, live.camera, right, up) });
  };

  const down = (event: PointerEvent) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, event);
    canvas.focus({ preventScroll: true });
  };
  const move = (event: PointerEvent) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const right = event.clientX - before.clientX;
    const below = event.clientY - before.clientY;
    const other = [...fingers.values()].find((finger) => finger.pointerId !== event.pointerId);
    const name = page.direction(event);
    if (other) {
      const distance = (from: PointerEvent) => Math.hypot(from.clientX - other.clientX, from.clientY - other.clientY);
      zoom(Math.max(distance(before), 1) / Math.max(distance(event), 1));
      if (live.view.navigation === "orbit") pan(right / 2, below / 2);
    } else if (name) {
      const part = Math.PI / canvas.clientHeight;
      turnDirection(name, right * part, -below * part);
    } else if (live.view.navigation === "orbit" && (event.buttons & 4 || event.ctrlKey)) {
      pan(right, below);
    } else {
      turn(right, below);
    }
    fingers.set(event.pointerId, event);
    changed();
  };
  const pan = (right: number, below: number) => {
    live.camera = panned(live.camera, right / canvas.clientHeight, -below / canvas.clientHeight);
  };
  const up = (event: PointerEvent) => void fingers.delete(event.pointerId);

  const drive = (then: number) => {
    driving = held.size > 0;
    if (!driving || signal.aborted) return;
    requestAnimationFrame((now) => {
      const seconds = Math.min(Math.max(now - then, 0) / 1000, 0.25);
      const motion: Motion = { forward: 0, side: 0, up: 0, turn: 0, tilt: 0 };
      for (const key of held) motion[DRIVE_KEYS[key][0]] += DRIVE_KEYS[key][1];
      motion.turn *= TURN_A_SECOND * seconds;
      live.camera = live.view.move?.(live.camera, motion, seconds) ?? live.camera;
      changed();
      drive(now);
    });
  };
  const keyOf = (event: KeyboardEvent) => (event.key.length === 1 ? event.key.toLowerCase() : event.key);
  const press = (event: KeyboardEvent) => {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const key = keyOf(event);
    if (live.view.navigation === "drive" && key in DRIVE_KEYS) {
      held.add(key);
      if (!driving) drive(performance.now());
    } else if (key.startsWith("Arrow")) {
      const right = key === "ArrowRight" ? 1 : key === "ArrowLeft" ? -1 : 0;
      const above = key === "ArrowUp" ? 1 : key === "ArrowDown" ? -1 : 0;
      const name = page.direction(event);
      if (name) turnDirection(name, right * 0.1, above * 0.1);
      else live.camera = turned(live.camera, right * KEY_DEGREES, above * KEY_DEGREES);
      changed();
    } else if ("+=-".includes(key)) {
      zoom(key === "-" ? 1.1 : 1 / 1.1);
      changed();
    } else {
      return;
    }
    event.preventDefault();
  };
  const wheel = (event: WheelEvent) => {
    event.preventDefault();
    zoom(Math.exp((event.deltaMode ? 20 : 1) * event.deltaY * 0.0012));
    changed();
  };

  canvas.addEventListener("pointerdown", down, { signal });
  canvas.addEventListener("pointermove", move, { signal });
  canvas.addEventListener("pointerup", up, { signal });
  canvas.addEventListener("pointercancel", up, { signal });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault(), { signal });
  canvas.addEventListener("wheel", wheel, { signal, passive: false });
  canvas.addEventListener("keydown", press, { signal });
  canvas.addEventListener("keyup", (event) => void held.delete(keyOf(event)), { signal });
  canvas.addEventListener("blur", () => held.clear(), { signal });
  return () => end.abort();
}
