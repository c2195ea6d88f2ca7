/** `meta.json`: its types, and what is checked before it is believed. */

import type { Camera } from "../drawing/camera";
import { BadPackage } from "./bad_package";

/** The newest format that this viewer knows. */
export const NEWEST_FORMAT = 1;

/** A part, as `meta.json` has it. */
export interface PartMeta {
  file: string;
  kind: "array" | "picture" | "mesh" | "textures";
  sha256: string;
  bytes: number;
  dtype?: string;
  shape?: number[];
  dims?: string[];
  units?: string;
  meaning?: string;
  attributes?: Record<string, string>;
}

/** A frame of the stage that a live view can draw again. */
export interface ReferenceView {
  name: string;
  picture: string;
  width: number;
  height: number;
  supersampling: number;
  camera: Camera;
  state: Record<string, unknown>;
}

/** A figure, beside the paper's where it states one. */
export interface Figure {
  name: string;
  value: number;
  units: string;
  paper: { value: number; where: string } | null;
}

/** A version that the package was made of. */
export interface LineageStep {
  asset: string;
  partition: string;
  version: string;
  content: string;
  settings?: Record<string, unknown>;
  checks?: Record<string, { passed: boolean; figure?: number | null }>;
}

/** `meta.json`. */
export interface Meta {
  format: number;
  system: string;
  schema: number;
  title: string;
  source: { name: string; licence: string }[];
  colour_space: string;
  up: string;
  parameters: Record<string, { value: unknown; units: string; meaning: string }>;
  parts: Record<string, PartMeta>;
  views: ReferenceView[];
  figures: Figure[];
  lineage: LineageStep[];
}

const KINDS = ["array", "picture", "mesh", "textures"];
const LISTS = ["views", "figures", "lineage", "source"];
const OBJECTS = ["parameters", "parts"];

/** The text of `meta.json`, read. Throws BadPackage for what is not as the format says. */
export function metaOf(text: string, name: string): Meta {
  let meta: Record<string, unknown>;
  try {
    meta = JSON.parse(text);
  } catch {
    throw new BadPackage(name, "meta.json", "no JSON", "a .tsuya package");
  }
  if (!isObject(meta) || !Number.isInteger(meta.format)) {
    throw new BadPackage(name, "meta.json", "without a format", "a .tsuya package");
  }
  if ((meta.format as number) > NEWEST_FORMAT) {
    const expected = `at most ${NEWEST_FORMAT}: update Tsuya, or export the package again`;
    throw new BadPackage(name, "format", `${meta.format}`, expected);
  }
  for (const field of ["system", "title"]) {
    if (typeof meta[field] !== "string") throw new BadPackage(name, field, "missing", "a name");
  }
  for (const field of LISTS) {
    if (!Array.isArray(meta[field])) throw new BadPackage(name, field, "missing", "a list");
  }
  for (const field of OBJECTS) {
    if (!isObject(meta[field])) throw new BadPackage(name, field, "missing", "an object");
  }
  for (const [part, stated] of Object.entries(meta.parts as object)) checkPart(part, stated, name);
  return meta as unknown as Meta;
}

function checkPart(part: string, stated: unknown, name: string): void {
  const field = `part ${part}`;
  if (!isObject(stated) || !KINDS.includes(stated.kind as string)) {
    throw new BadPackage(name, field, "of no known kind", KINDS.join(", "));
  }
  if (typeof stated.file !== "string" || !isPlain(stated.file)) {
    throw new BadPackage(name, field, `in ${JSON.stringify(stated.file)}`, "a path inside the package");
  }
}

function isPlain(file: string): boolean {
  return file !== "" && !file.startsWith("/") && !/[\\:\0]/.test(file) && !file.split("/").includes("..");
}

function isObject(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}
