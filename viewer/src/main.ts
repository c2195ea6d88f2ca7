/** The page: opens a package and shows it live. */

import { makeRenderer } from "./drawing/frame";
import { Live } from "./page/live";
import { framed, turned, zoomed } from "./page/orbit";
import { listedPackages, opened } from "./page/packages";
import { viewerOf } from "./systems";
import { testHook } from "./test_hook";

const ready = start();
testHook.ready = ready;
ready.catch((error: unknown) => (document.body.textContent = (error as Error).message));

async function start(): Promise<void> {
  const canvas = document.body.appendChild(document.createElement("canvas"));
  canvas.className = "live";
  const renderer = makeRenderer(canvas);
  const pkg = await opened((await listedPackages())[0]);
  const viewer = viewerOf(pkg.meta.system);
  if (!viewer) throw new Error(`${pkg.name}: there is no live view of ${pkg.meta.system}.`);
  let live: Live | undefined;
  const view = await viewer.make(pkg, { renderer, requestDraw: () => live?.change() });
  const camera = view.home ?? pkg.meta.views[0]?.camera ?? framed(view.bounds, canvas.clientWidth / canvas.clientHeight);
  live = new Live(renderer, view, camera);
  testHook.live = live;
  await new Promise<void>((resolve, reject) => {
    live.onFrame = resolve;
    live.onError = reject;
  });
  canvas.onpointermove = (event) => {
    if (!event.buttons) return;
    live.camera = turned(live.camera, -event.movementX / 3, event.movementY / 3);
    live.change();
  };
  canvas.onwheel = (event) => {
    live.camera = zoomed(live.camera, Math.exp(event.deltaY / 800), view.bounds);
    live.change();
  };
}
