/** A pad on which a direction is dragged: the middle is the viewer, the rim is behind the scene. */

import { Matrix3, Vector3 } from "three";
import type { Camera, Vector } from "../drawing/camera";
import { element } from "./elements";

const SIDE = 132;
const STEP = 0.06;

/** A pad; `show` puts its dot where a direction lies from a camera. */
export interface Pad {
  element: HTMLElement;
  show(direction: Vector, camera: Camera): void;
}

/** A pad that calls `turn` with the unit vector that is dragged to. */
export function directionPad(label: string, turn: (direction: Vector) => void): Pad {
  const dot = element("span", { class: "dot" });
  const pad = element(
    "div",
    { class: "pad", tabIndex: 0, role: "application", "aria-label": `${label}: drag, or use the arrow keys` },
    element("span", { class: "horizon" }),
    dot,
  );
  let axes = new Matrix3();
  let place: [number, number] = [0, 0];
  const put = (x: number, y: number) => turn(directionAt(x, y, axes));
  const drag = (event: PointerEvent) => {
    const box = pad.getBoundingClientRect();
    put((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height);
  };
  pad.onpointerdown = (event) => {
    pad.setPointerCapture(event.pointerId);
    drag(event);
  };
  pad.onpointermove = (event) => {
    if (event.buttons) drag(event);
  };
  pad.onkeydown = (event) => {
    const step: Record<string, [number, number]> = {
      ArrowLeft: [-STEP, 0],
      ArrowRight: [STEP, 0],
      ArrowUp: [0, STEP],
      ArrowDown: [0, -STEP],
    };
    const [x, y] = step[event.key] ?? [0, 0];
    if (!x && !y) return;
    event.preventDefault();
    event.stopPropagation();
    put(place[0] + x, place[1] + y);
  };
  return {
    element: element("div", { class: "control direction" }, element("span", { class: "label" }, label), pad),
    show(direction, camera) {
      axes = cameraAxes(camera);
      place = placeOf(direction, axes);
      dot.style.transform = `translate(${(place[0] * SIDE) / 2}px, ${(-place[1] * SIDE) / 2}px)`;
    },
  };
}

/** Turns a direction as a drag of so many radians to the right and up would. */
export function dragged(direction: Vector, camera: Camera, right: number, up: number): Vector {
  const [x, y] = placeOf(direction, cameraAxes(camera));
  return directionAt(x + right / Math.PI, y + up / Math.PI, cameraAxes(camera));
}

/** Columns: to the right, up, and towards the viewer. */
function cameraAxes(camera: Camera): Matrix3 {
  const back = new Vector3(...camera.position).sub(new Vector3(...camera.target)).normalize();
  const right = new Vector3(...camera.up).cross(back).normalize();
  const up = back.clone().cross(right);
  return new Matrix3().set(right.x, up.x, back.x, right.y, up.y, back.y, right.z, up.z, back.z);
}

function directionAt(x: number, y: number, axes: Matrix3): Vector {
  const radius = Math.hypot(x, y);
  const angle = Math.PI * Math.min(radius, 0.995);
  const part = radius > 1e-9 ? Math.sin(angle) / radius : 0;
  return new Vector3(x * part, y * part, Math.cos(angle)).applyMatrix3(axes).normalize().toArray();
}

function placeOf(direction: Vector, axes: Matrix3): [number, number] {
  const seen = new Vector3(...direction).normalize().applyMatrix3(axes.clone().transpose());
  const part = Math.acos(Math.min(1, Math.max(-1, seen.z))) / Math.PI / Math.max(Math.hypot(seen.x, seen.y), 1e-9);
  return [seen.x * part, seen.y * part];
}
