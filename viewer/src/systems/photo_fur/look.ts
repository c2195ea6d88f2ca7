/** What can be set of a fur, and what may be. */

import type { Control, State } from "../../live_view";
import { MOST_LAYERS } from "./codes";

/** Everything that can be set. */
export interface Look {
  /** Patches along the lie and light on hairs, or the paper's shells. */
  look: "full" | "plain";
  /** Of the plain look; of the full one as many shells are drawn as are seen. */
  layers: number;
  /** In the package's thicknesses. */
  thickness: number;
  /** Of the plain look: hairs stand in all layers below their own, or in their own alone. */
  fill: "columns" | "bands";
  /** How far tips are blown, in thicknesses; of the full look, as is what follows. */
  wind: number;
  /** Seconds since the wind began; null: the time runs. */
  moment: number | null;
  /** Radiance from everywhere. */
  sky: number;
  /** Radiance of the lamp along the view. */
  headlight: number;
  /** Radiance of the other lamp. */
  lamp: number;
  /** Unit vector to it. */
  light: [number, number, number];
  /** Name of what is behind the fur. */
  background: string;
}

const LOOKS = ["full", "plain"] as const;
const FILLS = ["columns", "bands"] as const;
const RANGES: Record<string, [number, number]> = {
  layers: [1, 64],
  thickness: [0.1, 3],
  sky: [0, 1],
  headlight: [0, 1.5],
  lamp: [0, 1.5],
  wind: [0, 1.5],
};

/** The controls, for backgrounds by name. */
export function controlsOf(look: Look, backgrounds: readonly string[]): Control[] {
  const slider = (name: string, label: string, step: number, units?: string): Control => {
    const [min, max] = RANGES[name];
    return { kind: "slider", name, label, min, max, step, units };
  };
  const options = (names: readonly string[]) =>
    names.map((value) => ({ value, label: value[0].toUpperCase() + value.slice(1) }));
  const layers = { ...slider("layers", "Layers", 1), max: Math.max(RANGES.layers[1], look.layers) } as Control;
  const fill: Control = { kind: "choice", name: "fill", label: "Fill", options: options(FILLS) };
  const isFull = look.look === "full";
  return [
    { kind: "choice", name: "look", label: "Look", options: options(LOOKS) },
    slider("thickness", "Thickness", 0.05, "×"),
    ...(isFull ? [slider("wind", "Wind", 0.05, "×")] : [layers, fill]),
    { kind: "direction", name: "light", label: "Lamp" },
    slider("lamp", "Lamp's light", 0.05),
    slider("headlight", "Light along the view", 0.05),
    slider("sky", "Light from everywhere", 0.05),
    { kind: "choice", name: "background", label: "Background", options: options(backgrounds) },
  ];
}

/** A look with part of a state set. Throws an Error for what cannot be. */
export function withState(look: Look, state: State, backgrounds: readonly string[]): Look {
  const set = { ...look };
  for (const [name, value] of Object.entries(state)) {
    if (name === "layers") set.layers = wholeNumber(name, value);
    else if (name === "thickness" || name === "sky" || name === "headlight" || name === "lamp" || name === "wind") set[name] = amount(name, value);
    else if (name === "moment") set.moment = value === null ? null : amount(name, value);
    else if (name === "look") set.look = one(name, value, LOOKS);
    else if (name === "fill") set.fill = one(name, value, FILLS);
    else if (name === "background") set.background = one(name, value, backgrounds);
    else if (name === "light") set.light = unit(name, value);
    else throw new Error(`state has ${name}; expected ${Object.keys(look).join(", ")}.`);
  }
  return set;
}

function wholeNumber(name: string, value: unknown): number {
  if (Number.isInteger(value) && (value as number) >= 1 && (value as number) <= MOST_LAYERS) return value as number;
  throw new Error(`${name} is ${JSON.stringify(value)}; expected a whole number of 1 to ${MOST_LAYERS}.`);
}

function amount(name: string, value: unknown): number {
  if (typeof value === "number" && value >= 0 && value < Infinity) return value;
  throw new Error(`${name} is ${JSON.stringify(value)}; expected 0 or more.`);
}

function one<T extends string>(name: string, value: unknown, known: readonly T[]): T {
  const found = known.find((each) => each === value);
  if (found !== undefined) return found;
  throw new Error(`${name} is ${JSON.stringify(value)}; expected one of ${known.join(", ")}.`);
}

function unit(name: string, value: unknown): [number, number, number] {
  const length = Array.isArray(value) && value.length === 3 ? Math.hypot(...(value as number[])) : 0;
  if (!(length > 0 && length < Infinity)) throw new Error(`${name} is ${JSON.stringify(value)}; expected [x, y, z].`);
  return (value as number[]).map((axis) => axis / length) as [number, number, number];
}
