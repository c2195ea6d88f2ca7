/** All systems' live views: each file of this folder. */

import type { SystemViewer } from "../live_view";

const modules = import.meta.glob<{ default: SystemViewer }>(["./*.ts", "!./index.ts"], { eager: true });
const viewers = new Map(Object.values(modules).map((module) => [module.default.name, module.default]));

/** The live view of a system; undefined for a system that has none. */
export function viewerOf(system: string): SystemViewer | undefined {
  return viewers.get(system);
}

/** Makes a live view known that is no file of this folder. */
export function addViewer(viewer: SystemViewer): void {
  viewers.set(viewer.name, viewer);
}
