/** The page of one package: its live view, what can be set, the comparison and the drawer. */

import type { Camera } from "../drawing/camera";
import type { LiveView, State, View } from "../live_view";
import type { ReferenceView } from "../package/meta";
import type { Package } from "../package/package";
import { viewerOf } from "../systems";
import { written } from "./address";
import { comparisonMenu, line, type Other } from "./comparison";
import { controlPanel, signature, taken, type Panel } from "./controls";
import { drawerOf, pairs } from "./drawer";
import { button, element, sign } from "./elements";
import { Live } from "./live";
import { navigate } from "./navigation";
import { fitted, framed, isCamera } from "./orbit";
import { pictureCanvas } from "./pictures";
import { say, sentenceOf } from "./sentences";
import type { Stage } from "./stage";

const NOTED_AFTER = 400;
/** Pixels of width up to which the page is a phone's, as the style sheet has it. */
const NARROW = 640;
const PANEL_WIDTH = 280;

/** What the page of a package is given. */
export interface Given {
  stage: Stage;
  pkg: Package;
  /** Keys of the other packages of the page. */
  others: readonly string[];
  open(key: string): Promise<Package>;
}

/** The page of a package. */
export class Viewing {
  readonly element: HTMLElement;
  readonly live: Live;
  private readonly frame: HTMLElement;
  private readonly panelPlace = element(
    "details",
    { class: "panel", open: window.innerWidth > NARROW },
    element("summary", {}, "Settings"),
  );
  private readonly readout = element("output", { class: "readout" });
  private readonly liveFacts = element("dl", {});
  private readonly drawer: HTMLElement;
  private readonly menu: HTMLSelectElement;
  private readonly first: View;
  private readonly endNavigation: () => void;
  private readonly resized: ResizeObserver;
  private panel: Panel | undefined;
  private panelSignature = "";
  private turnsDirection = false;
  private beside: HTMLElement[] = [];
  private noting = 0;

  private constructor(
    private readonly given: Given,
    view: LiveView,
    requester: { change(): void },
  ) {
    const { stage, pkg, others } = given;
    const { canvas, renderer } = stage;
    this.frame = element("div", { class: "frame" }, canvas);
    this.drawer = drawerOf(pkg.meta, this.liveFacts);
    this.drawer.hidden = true;
    this.menu = comparisonMenu(pkg.meta.views, others, (other) => void this.compare(other));
    this.element = element(
      "main",
      { class: "viewing" },
      element("div", { class: "theatre" }, this.frame),
      this.bar(),
      this.panelPlace,
      this.readout,
      this.drawer,
    );
    this.live = new Live(renderer, view, this.firstCamera(view));
    requester.change = () => this.live.change();
    this.first = { camera: this.live.camera, state: view.state() };
    if (view.navigation === "drive") this.frame.append(driveButtons(canvas));
    this.endNavigation = navigate(canvas, this.live, {
      direction: (event) => this.turnedDirection(event),
      moved: () => this.changed(),
    });
    canvas.onkeyup = (event) => this.pressed(event);
    this.resized = new ResizeObserver(() => this.centre());
    this.resized.observe(canvas);
    this.live.onFrame = () => this.drawn();
    this.live.onError = (error) => say(sentenceOf(error));
    this.panelPlace.ontoggle = () => this.centre();
    this.showPanel();
  }

  /** Makes the live view of a package. Throws an Error that says why it cannot be shown. */
  static async open(given: Given): Promise<Viewing> {
    const requester = { change: () => {} };
    const view = await made(given.pkg, given.stage, requester);
    return new Viewing(given, view, requester);
  }

  /** Settled with the first frame that is shown. */
  firstFrame(): Promise<void> {
    return new Promise((resolve, reject) => {
      const say = this.live.onError;
      this.live.onFrame = () => {
        this.live.onError = say;
        this.live.onFrame = () => this.drawn();
        this.drawn();
        resolve();
      };
      this.live.onError = (error) => {
        this.live.onError = say;
        reject(error);
      };
    });
  }

  /** Shows a view, or part of one. Says what cannot be shown. */
  show(view: Partial<View>): void {
    try {
      if (view.state) this.live.setState(view.state);
      if (view.camera) {
        if (!isCamera(view.camera)) throw new Error("camera of the view is not as the page makes it.");
        this.live.camera = view.camera;
      }
    } catch (error) {
      say(sentenceOf(error));
    }
    this.live.change();
    this.showPanel();
  }

  /** Gives a file to the first control that takes its kind; false where none does. */
  drop(file: File): boolean {
    for (const control of this.live.view.controls) {
      if (control.kind !== "drop") continue;
      const endings = control.accept.split(",").map((ending) => ending.trim().toLowerCase());
      if (!endings.some((ending) => file.name.toLowerCase().endsWith(ending))) continue;
      void taken(control, file).then(() => this.changed());
      return true;
    }
    return false;
  }

  /** Ends it and frees what it holds. */
  dispose(): void {
    window.clearTimeout(this.noting);
    this.resized.disconnect();
    this.endNavigation();
    this.live.dispose();
    this.element.remove();
  }

  private firstCamera(view: LiveView): Camera {
    const panel = view.controls.length && window.innerWidth > NARROW ? PANEL_WIDTH : 0;
    const aspect = (window.innerWidth - panel) / window.innerHeight;
    const reference = this.given.pkg.meta.views[0];
    const camera = view.home ?? reference?.camera;
    if (!camera) return framed(view.bounds, aspect);
    if (view.navigation === "drive") return camera;
    return fitted(camera, view.bounds, aspect, reference && reference.width / reference.height);
  }

  private bar(): HTMLElement {
    const { pkg, others } = this.given;
    const back = element("a", { class: "back", href: "#gallery", title: "All packages", "aria-label": "All packages" }, sign("back"));
    return element(
      "header",
      { class: "bar" },
      ...(others.length ? [back] : []),
      element("h1", {}, pkg.meta.title),
      this.menu,
      this.lightButton(),
      button("save", "Save the picture (P)", () => void this.save()),
      button("full", "Full screen (F)", () => void fullScreen()),
      button("about", "Figures and lineage (I)", () => this.toggleDrawer()),
    );
  }

  private lightButton(): HTMLButtonElement {
    const made = button("light", "Drag turns the light (L)", () => this.toggleLight());
    made.classList.add("light");
    made.setAttribute("aria-pressed", "false");
    return made;
  }

  private toggleLight(): void {
    this.turnsDirection = !this.turnsDirection;
    this.element.querySelector(".light")?.setAttribute("aria-pressed", String(this.turnsDirection));
  }

  private toggleDrawer(): void {
    this.drawer.hidden = !this.drawer.hidden;
    this.drawn();
  }

  private turnedDirection(event: PointerEvent | KeyboardEvent): string | undefined {
    const asked = this.turnsDirection || event.shiftKey || ("buttons" in event && (event.buttons & 2) !== 0);
    return asked ? this.live.view.controls.find(({ kind }) => kind === "direction")?.name : undefined;
  }

  private pressed(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const drives = this.live.view.navigation === "drive";
    const actions: Record<string, () => void> = {
      0: () => this.show(this.first),
      c: () => this.menu.focus(),
      i: () => this.toggleDrawer(),
      f: () => void fullScreen(),
      p: () => void this.save(),
      l: () => this.toggleLight(),
      h: () => document.body.classList.toggle("bare"),
    };
    const key = event.key.toLowerCase();
    if (!drives || !"wasdqe".includes(key)) actions[key]?.();
  }

  private set(state: State): void {
    try {
      this.live.setState(state);
    } catch (error) {
      say(sentenceOf(error));
    }
    this.changed();
  }

  /** Someone moved or set something. */
  private changed(): void {
    if (this.beside.some((each) => each instanceof HTMLCanvasElement)) this.endComparison();
    this.showPanel();
    window.clearTimeout(this.noting);
    this.noting = window.setTimeout(() => {
      history.replaceState(null, "", written({ key: this.given.pkg.name, view: this.live.shown() }));
    }, NOTED_AFTER);
  }

  /** Has what is turned about in the middle of what the panel leaves free. */
  private centre(): void {
    const isBeside = this.panelPlace.open && !this.panelPlace.hidden && window.innerWidth > NARROW;
    const isMoved = isBeside && this.live.view.navigation === "orbit" && !this.beside.length;
    const { canvas } = this.given.stage;
    this.live.offset = isMoved ? this.panelPlace.offsetWidth / 2 / canvas.clientWidth : 0;
    this.live.change();
  }

  private showPanel(): void {
    const { controls } = this.live.view;
    if (!this.panel || signature(controls) !== this.panelSignature) {
      this.panel?.element.remove();
      this.panel = controlPanel(controls, (state) => this.set(state));
      this.panelSignature = signature(controls);
      this.panelPlace.append(this.panel.element);
      this.panelPlace.hidden = controls.length === 0;
      const light = this.element.querySelector<HTMLElement>(".light");
      if (light) light.hidden = !controls.some(({ kind }) => kind === "direction");
    }
    this.panel.show(this.live.view.state(), this.live.camera);
  }

  private drawn(): void {
    const time = `${this.live.frameTime.toFixed(this.live.frameTime < 10 ? 1 : 0)} ms`;
    this.readout.textContent = time;
    this.panel?.show(this.live.view.state(), this.live.camera);
    if (this.drawer.hidden) return;
    const facts = { "a frame": time, "drawn by": this.live.rendererName, ...this.live.view.figures?.() };
    this.liveFacts.replaceChildren(...pairs(facts));
  }

  private async compare(other: Other | undefined): Promise<void> {
    this.endComparison();
    if (!other) return;
    try {
      if (other.kind === "view") await this.compareWithFrame(other.view);
      else await this.compareWithPackage(other.key);
    } catch (error) {
      this.endComparison();
      say(sentenceOf(error));
    }
  }

  private async compareWithFrame(view: ReferenceView): Promise<void> {
    const canvas = pictureCanvas(await this.given.pkg.picture(view.picture));
    canvas.className = "reference";
    this.show({ camera: view.camera, state: view.state });
    this.frame.classList.add("fixed");
    this.frame.style.setProperty("--aspect", String(view.width / view.height));
    const divider = line((part) => (canvas.style.clipPath = `inset(0 0 0 ${100 * part}%)`));
    this.put(canvas, divider.element);
    divider.put(0.5);
  }

  private async compareWithPackage(key: string): Promise<void> {
    const pkg = await this.given.open(key);
    const view = await made(pkg, this.given.stage, this.live);
    if (pkg.meta.system === this.given.pkg.meta.system) view.setState(this.live.view.state());
    this.live.compare(view);
    const divider = line((part) => {
      this.live.split = part;
      this.live.change();
    });
    const names = element("div", { class: "names" }, element("span", {}, this.given.pkg.meta.title), element("span", {}, pkg.meta.title));
    this.put(names, divider.element);
    divider.put(0.5);
  }

  private put(...elements: HTMLElement[]): void {
    this.beside = elements;
    this.frame.append(...elements);
    this.centre();
  }

  private endComparison(): void {
    for (const each of this.beside.splice(0)) each.remove();
    this.frame.classList.remove("fixed");
    if (this.live.other) this.live.compare(undefined);
    this.menu.value = "";
    this.centre();
  }

  private async save(): Promise<void> {
    const { canvas } = this.given.stage;
    try {
      const { width, height, data } = await this.live.capture(canvas.width, canvas.height, 2);
      this.live.change();
      const picture = pictureCanvas({ width, height, channels: 4, data: new Uint8Array(data.buffer) });
      const file = await new Promise<Blob | null>((resolve) => picture.toBlob(resolve, "image/png"));
      if (!file) throw new Error("the browser made no PNG of the picture; expected a smaller window.");
      const link = element("a", { href: URL.createObjectURL(file), download: `${this.given.pkg.meta.title}.png` });
      link.click();
      window.setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    } catch (error) {
      say(sentenceOf(error));
    }
  }
}

function made(pkg: Package, { renderer }: Stage, requester: { change(): void }): Promise<LiveView> {
  const viewer = viewerOf(pkg.meta.system);
  if (!viewer) throw new Error(`${pkg.name}: system is ${pkg.meta.system}; expected one that has a live view.`);
  return viewer.make(pkg, { renderer, requestDraw: () => requester.change() });
}

async function fullScreen(): Promise<void> {
  if (document.fullscreenElement) await document.exitFullscreen();
  else await document.documentElement.requestFullscreen?.();
}

/** For thumbs, and to show them: the keys that drive, while they are held. */
function driveButtons(canvas: HTMLCanvasElement): HTMLElement {
  const pad = (key: string, shown: string, label: string) => {
    const made = element("button", { type: "button", class: key, "aria-label": label, title: `${label} (${key.replace("Arrow", "").toUpperCase()})` }, shown);
    const send = (kind: string) => canvas.dispatchEvent(new KeyboardEvent(kind, { key }));
    made.onpointerdown = (event) => {
      made.setPointerCapture(event.pointerId);
      send("keydown");
    };
    made.onpointerup = made.onpointercancel = () => send("keyup");
    made.oncontextmenu = (event) => event.preventDefault();
    made.onmousedown = (event) => event.preventDefault(); // the canvas keeps the focus, or its keys are let go
    return made;
  };
  return element(
    "div",
    { class: "drive" },
    element(
      "div",
      {},
      pad("ArrowLeft", "↰", "Turn left"),
      pad("ArrowRight", "↱", "Turn right"),
      pad("a", "◀", "Step left"),
      pad("d", "▶", "Step right"),
    ),
    element("div", {}, pad("ArrowUp", "▲", "Drive"), pad("ArrowDown", "▼", "Drive back")),
  );
}
