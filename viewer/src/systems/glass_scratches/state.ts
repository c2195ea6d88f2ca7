/** What can be set of scratched glass, and what may be. */

import type { Control, State } from "../../live_view";

/** Everything that can be set; layers by `layer_1`, `layer_2` … beside. */
export interface Settings {
  /** Name of an environment. */
  environment: string;
  /** Degrees by which it is turned about up, counter-clockwise seen from above. */
  turn: number;
  /** Factor on its radiance. */
  brightness: number;
  /** Degrees by which the glass leans away from the front, and then turns about up. */
  tilt: number;
  swing: number;
  /** Factor on the layers' coverage. */
  coverage: number;
  /** Share of the light at a scratch that meets its walls. */
  strength: number;
  /** Scene units of a tile of scratches. */
  tile: number;
  /** The lamp's irradiance over the environment's mean; 0: there is no lamp. */
  lamp: number;
  /** Unit vector to it. */
  light: [number, number, number];
  /** Whether each layer is shown. */
  layers: boolean[];
}

const RANGES: Record<string, [number, number]> = {
  turn: [-180, 180],
  brightness: [0, 2],
  tilt: [-60, 60],
  swing: [-180, 180],
  coverage: [0, 4],
  strength: [0, 1],
  tile: [0.1, 4],
  lamp: [0, 12],
};

/** The controls, for environments by name. */
export function controlsOf(settings: Settings, environments: readonly string[], take: (file: File) => Promise<void>, accept: string): Control[] {
  const slider = (name: string, label: string, step: number, units?: string): Control => {
    const [min, max] = RANGES[name];
    return { kind: "slider", name, label, min, max, step, units };
  };
  const options = environments.map((value) => ({ value, label: value[0].toUpperCase() + value.slice(1) }));
  return [
    { kind: "direction", name: "light", label: "Lamp" },
    slider("lamp", "Lamp's light", 0.25),
    slider("tilt", "Tilt", 1, "°"),
    slider("swing", "Swing", 1, "°"),
    { kind: "choice", name: "environment", label: "Environment", options },
    slider("turn", "Turn it", 1, "°"),
    slider("brightness", "Its light", 0.05, "×"),
    { kind: "drop", name: "file", label: "Your own environment", accept, take },
    slider("coverage", "Coverage", 0.05, "×"),
    slider("strength", "Strength", 0.01),
    slider("tile", "Tile", 0.05),
    ...settings.layers.map((_, n): Control => ({ kind: "toggle", name: layerName(n), label: `Layer ${n + 1}` })),
  ];
}

/** As plain JSON. */
export function stateOf({ layers, ...others }: Settings): State {
  const shown = Object.fromEntries(layers.map((layer, n) => [layerName(n), layer]));
  return { ...others, light: [...others.light], ...shown };
}

/** Settings with part of a state set. Throws an Error for what cannot be. */
export function withState(settings: Settings, state: State, environments: readonly string[]): Settings {
  const set = { ...settings, layers: [...settings.layers] };
  for (const [name, value] of Object.entries(state)) {
    const layer = settings.layers.findIndex((_, n) => layerName(n) === name);
    if (name === "environment") set.environment = one(name, value, environments);
    else if (name === "light") set.light = unit(name, value);
    else if (name in RANGES) Object.assign(set, { [name]: number(name, value) });
    else if (layer >= 0) set.layers[layer] = Boolean(value);
    else throw new Error(`state has ${name}; expected ${Object.keys(stateOf(settings)).join(", ")}.`);
  }
  return set;
}

function layerName(n: number): string {
  return `layer_${n + 1}`;
}

function number(name: string, value: unknown): number {
  // A package's own tile may lie outside of what the slider offers.
  if (typeof value === "number" && Number.isFinite(value) && (name !== "tile" || value > 0)) return value;
  throw new Error(`${name} is ${JSON.stringify(value)}; expected a ${name === "tile" ? "positive " : ""}number.`);
}

function one(name: string, value: unknown, known: readonly string[]): string {
  if (typeof value === "string" && known.includes(value)) return value;
  throw new Error(`${name} is ${JSON.stringify(value)}; expected one of ${known.join(", ")}.`);
}

function unit(name: string, value: unknown): [number, number, number] {
  const length = Array.isArray(value) && value.length === 3 ? Math.hypot(...(value as number[])) : 0;
  if (!(length > 0 && length < Infinity)) throw new Error(`${name} is ${JSON.stringify(value)}; expected [x, y, z].`);
  return (value as number[]).map((axis) => axis / length) as [number, number, number];
}
