/** Tasks in a thread of their own. */

import type { Answer, Task } from "./worker";
import TaskWorker from "./worker?worker&inline";

/** Does a task beside the page. Rejects with an Error that says what is wrong. */
export function ask<T extends Task>(task: T): Promise<Answer<T>> {
  const worker = new TaskWorker();
  return new Promise<Answer<T>>((resolve, reject) => {
    worker.onmessage = ({ data }: MessageEvent<{ value?: Answer<T>; error?: string }>) =>
      data.error === undefined ? resolve(data.value as Answer<T>) : reject(new Error(data.error));
    worker.onerror = (event) => reject(new Error(event.message || "the browser starts no worker"));
    worker.postMessage(task);
  }).finally(() => worker.terminate());
}
