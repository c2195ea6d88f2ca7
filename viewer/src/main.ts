/** The page: the gallery, or one package, as the address says. */

import { Package } from "./package/package";
import { read, type Address } from "./page/address";
import { element } from "./page/elements";
import { gallery } from "./page/gallery";
import { listedPackages, opened, type Listed } from "./page/packages";
import { partCanvas } from "./page/pictures";
import { say, sentenceOf, sentencePage } from "./page/sentences";
import { makeStage, type Stage } from "./page/stage";
import { Viewing } from "./page/viewing";
import { testHook } from "./test_hook";

const ENDING = ".tsuya";

let stage: Stage | undefined;
let listed: Listed[] = [];
let shown: Viewing | undefined;
let asked = 0;

/** Shows what the address says; a later call ends an earlier one. */
async function show(): Promise<void> {
  const number = ++asked;
  const isLast = () => number === asked;
  let address: Address = {};
  try {
    address = read(location.hash);
    const key = address.key ?? (listed.length === 1 && location.hash !== "#gallery" ? listed[0].key : undefined);
    if (shown && address.key === testHook.key) {
      shown.show(address.view ?? {});
      return;
    }
    leave();
    if (key === undefined) await showGallery();
    else await showPackage(key, address, isLast);
  } catch (error) {
    if (!isLast()) return;
    leave();
    const back = element("a", { href: "#gallery" }, "all packages");
    document.body.replaceChildren(sentencePage(sentenceOf(error), listed.length > 1 ? back : undefined));
    throw error;
  }
}

async function showGallery(): Promise<void> {
  document.title = "Tsuya";
  if (!listed.length) throw new Error("There is no package here; drop a .tsuya file on the page.");
  const { element: page, done } = gallery(listed);
  document.body.replaceChildren(page);
  await done;
}

async function showPackage(key: string, address: Address, isLast: () => boolean): Promise<void> {
  const waiting = element("div", { class: "waiting", role: "status" }, "opening …");
  document.body.replaceChildren(waiting);
  stage ??= watched(makeStage());
  const pkg = await find(key);
  document.title = `${pkg.meta.title} · Tsuya`;
  const poster = await partCanvas(pkg, "poster", pkg.meta.title);
  if (poster) waiting.append(poster);
  const others = listed.map((each) => each.key).filter((other) => other !== key);
  const viewing = await Viewing.open({ stage, pkg, others, open: find });
  if (!isLast()) {
    viewing.dispose();
    return;
  }
  shown = viewing;
  testHook.live = viewing.live;
  testHook.key = key;
  document.body.prepend(viewing.element);
  if (address.view) viewing.show(address.view);
  await viewing.firstFrame();
  testHook.firstPicture ??= performance.now();
  waiting.remove();
  stage.canvas.focus({ preventScroll: true });
}

/** A graphics driver that starts again, or a page that took too much, ends all drawing. */
function watched(made: Stage): Stage {
  made.canvas.addEventListener("webglcontextlost", () => {
    leave();
    document.body.replaceChildren(sentencePage("The graphics card has dropped this page; load it again."));
  });
  return made;
}

function find(key: string): Promise<Package> {
  const found = listed.find((each) => each.key === key);
  if (!found) throw new Error(`address: package is ${key}; expected one of the packages of this page.`);
  return opened(found);
}

function leave(): void {
  shown?.dispose();
  shown = testHook.live = testHook.key = undefined;
}

async function dropped(file: File): Promise<void> {
  if (file.name.toLowerCase().endsWith(ENDING)) {
    const content = new Uint8Array(await file.arrayBuffer());
    listed = [...listed.filter(({ key }) => key !== file.name), { key: file.name, content }];
    leave();
    location.hash = new URLSearchParams({ package: file.name }).toString();
  } else if (!shown?.drop(file)) {
    say(`${file.name} is of no kind that this page takes; expected a ${ENDING} file.`);
  }
}

async function start(): Promise<void> {
  document.body.replaceChildren(element("div", { class: "waiting", role: "status" }, "opening …"));
  try {
    listed = await listedPackages();
  } catch (error) {
    document.body.replaceChildren(sentencePage(sentenceOf(error)));
    throw error;
  }
  await show();
}

/** What is being shown; what went wrong stands in the page. */
function note(showing: Promise<void>): void {
  testHook.ready = showing;
  showing.catch(() => {});
}

window.addEventListener("hashchange", () => note(show()));
window.addEventListener("dragover", (event) => event.preventDefault());
window.addEventListener("drop", (event) => {
  event.preventDefault();
  for (const file of event.dataTransfer?.files ?? []) void dropped(file);
});
note(start());
