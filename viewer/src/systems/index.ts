/** All systems' live views: each file of this folder. */

import type { SystemViewer } from "../live_view";

const modules = import.meta.glob<{ default: SystemViewer }>(["./*.ts", "!./index.ts"], { eager: true });
const viewers = Object.values(modules).map((module) => module.default);

declare global {
  /** Live views that another script brings: of other systems, or a test's. */
  var tsuyaViewers: SystemViewer[] | undefined;
}

/** The live view of a system; undefined for a system that has none. */
export function viewerOf(system: string): SystemViewer | undefined {
  return [...viewers, ...(globalThis.tsuyaViewers ?? [])].find((viewer) => viewer.name === system);
}
