/** What takes longer than a frame: distances decoded, lights fitted. */

import { readCompactFile } from "./compact_file";
import { tablesOfCodes, tablesOfPaper, type DistanceTables, type PapersForm } from "./distance_tables";
import { fitLights, type Fit } from "./environment_fit";
import { mattTables, type MattTables } from "./lobe_tables";
import type { Environment } from "./sphere_map";

/** What can be asked for. */
export type Task =
  | { kind: "file"; file: Uint8Array; rootWeight: Float32Array }
  | { kind: "paper"; form: PapersForm; vertices: number }
  | { kind: "lobes"; sharpness: Float32Array }
  | { kind: "fit"; environment: Environment; count: number };
/** The answers, in the order of the tasks. */
export type Answer<T extends Task> = T extends { kind: "fit" }
  ? Fit
  : T extends { kind: "lobes" }
    ? MattTables
    : DistanceTables;

/** Does a task. Throws an Error that says what is wrong. */
export function done(task: Task): Fit | MattTables | DistanceTables {
  switch (task.kind) {
    case "file":
      return tablesOfCodes(readCompactFile(task.file), task.rootWeight);
    case "paper":
      return tablesOfPaper(task.form, task.vertices);
    case "lobes":
      return mattTables(task.sharpness);
    case "fit":
      return fitLights(task.environment, task.count);
  }
}

if (typeof self !== "undefined" && typeof document === "undefined") {
  self.onmessage = ({ data }: MessageEvent<Task>) => {
    try {
      self.postMessage({ value: done(data) });
    } catch (error) {
      self.postMessage({ error: (error as Error).message });
    }
  };
}
