/** The part of the address behind `#`: which package, and the view of it. */

import type { View } from "../live_view";

/** What an address says. */
export interface Address {
  key?: string;
  view?: Partial<View>;
}

const DIGITS = 5;

/** What a fragment says. Throws an Error where its view is no JSON. */
export function read(fragment: string): Address {
  const fields = new URLSearchParams(fragment.replace(/^#/, ""));
  const key = fields.get("package") ?? undefined;
  const text = fields.get("view");
  if (!text) return { key };
  try {
    return { key, view: JSON.parse(text) as Partial<View> };
  } catch {
    throw new Error("address: view is no JSON; expected an address as the page made it.");
  }
}

/** The fragment of a package, or of a view of it; numbers to five digits. */
export function written({ key, view }: Address): string {
  const fields = new URLSearchParams();
  if (key) fields.set("package", key);
  if (view) fields.set("view", JSON.stringify(view, rounded));
  return `#${fields}`;
}

function rounded(_key: string, value: unknown): unknown {
  return typeof value === "number" ? Number(value.toPrecision(DIGITS)) : value;
}
