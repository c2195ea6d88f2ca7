/** What can be set of a hanging cloth, and what may be. */

import type { Vector } from "../../drawing/camera";
import type { Control, State } from "../../live_view";

/** Everything that can be set. */
export interface Settings {
  /** Unit vector towards the light. */
  light: Vector;
  /** Tiles of the material over the cloth's width. */
  tiles: number;
  /** Stops over the package's exposure. */
  exposure: number;
}

/** The controls. */
export const CONTROLS: Control[] = [
  { kind: "direction", name: "light", label: "Light" },
  { kind: "slider", name: "tiles", label: "Tiles", min: 0.5, max: 12, step: 0.5 },
  { kind: "slider", name: "exposure", label: "Exposure", min: -3, max: 3, step: 0.1, units: "stops" },
];

/** Settings with part of a state set. Throws an Error for what cannot be. */
export function withState(settings: Settings, state: State): Settings {
  const set = { ...settings };
  for (const [name, value] of Object.entries(state)) {
    if (name === "light") set.light = unit(value);
    else if (name === "tiles") set.tiles = number(name, value, 0);
    else if (name === "exposure") set.exposure = number(name, value, -Infinity);
    else throw new Error(`state has ${name}; expected light, tiles, exposure.`);
  }
  return set;
}

function number(name: string, value: unknown, least: number): number {
  if (typeof value === "number" && Number.isFinite(value) && value > least) return value;
  throw new Error(`${name} is ${JSON.stringify(value)}; expected a ${least === 0 ? "positive " : ""}number.`);
}

function unit(value: unknown): Vector {
  const length = Array.isArray(value) && value.length === 3 ? Math.hypot(...(value as number[])) : 0;
  if (!(length > 0 && length < Infinity)) throw new Error(`light is ${JSON.stringify(value)}; expected [x, y, z].`);
  return (value as number[]).map((axis) => axis / length) as Vector;
}
