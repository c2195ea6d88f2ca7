/**
 * The picture of one or two live views: drawn when something changes, at a lower resolution while
 * it moves slowly, refined while it is still.
 */

import type { WebGLRenderTarget, WebGLRenderer } from "three";
import type { Camera } from "../drawing/camera";
import { Frames, type Frame } from "../drawing/frame";
import type { LiveView, State, View } from "../live_view";

/** Milliseconds that a frame may take while something moves, and a strip of a still one. */
const MOVING = 40;
const STRIP = 60;
/** Milliseconds without a change after which a picture is still. */
const STILL = 180;
const FEWEST_ROWS = 4;
const LOWEST_SCALE = 0.125;
/** Of the first frame, before it is known how long one takes. */
const FIRST_SCALE = 0.2;
/** Samples of a refined pixel lie on a grid of so many a side. */
const SAMPLES_A_SIDE = 4;

interface Pane {
  view: LiveView;
  frames: Frames;
}

/** The drawing of one canvas. */
export class Live {
  camera: Camera;
  /** Milliseconds that the last whole frame took on the graphics card. */
  frameTime = 0;
  /** Where the second view begins, as a part of the width. */
  split = 0.5;
  /** How far the picture's middle is moved to the right, as a part of the width. */
  offset = 0;
  /** Called after each frame that was shown. */
  onFrame: () => void = () => {};
  /** Called with what went wrong in a frame. */
  onError: (error: unknown) => void = () => {};

  private readonly panes: Pane[] = [];
  private scale = FIRST_SCALE;
  private changed = 0;
  private generation = 0;
  private refined = -1;
  private awake: (() => void) | undefined;
  private ended = false;
  private warm = false;
  private pixelsAStrip = 20_000;

  constructor(
    private readonly renderer: WebGLRenderer,
    view: LiveView,
    camera: Camera,
  ) {
    this.camera = camera;
    this.panes.push({ view, frames: new Frames(renderer) });
    void this.run();
  }

  /** Whether the picture has all of its samples. */
  get still(): boolean {
    return this.refined === this.generation;
  }

  /** The view that the controls belong to. */
  get view(): LiveView {
    return this.panes[0].view;
  }

  /** The view beside it, if there is one. */
  get other(): LiveView | undefined {
    return this.panes[1]?.view;
  }

  /** Puts another view beside the first, or takes it away. */
  compare(view: LiveView | undefined): void {
    for (const { view: old, frames } of this.panes.splice(1)) {
      old.dispose();
      frames.dispose();
    }
    if (view) this.panes.push({ view, frames: new Frames(this.renderer) });
    this.change();
  }

  /** What draws: the graphics card's name. */
  get rendererName(): string {
    const gl = this.renderer.getContext();
    const named = gl.getExtension("WEBGL_debug_renderer_info");
    return String(gl.getParameter(named ? named.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  }

  /** Camera and state, as a URL holds them. */
  shown(): View {
    return { camera: this.camera, state: this.view.state() };
  }

  /** Sets part of the state, of both views. */
  setState(state: State): void {
    for (const { view } of this.panes) view.setState(state);
    this.change();
  }

  /** Something has changed: a frame is drawn soon. */
  change(): void {
    this.generation++;
    this.changed = performance.now();
    this.awake?.();
  }

  /** A frame of the first view as the stage draws it, with all that it loads. */
  async capture(width: number, height: number, supersampling: number, moving = false): Promise<Frame> {
    await this.view.update?.(this.camera);
    return this.panes[0].frames.capture(this.view, this.camera, [width, height], supersampling, moving);
  }

  /** Ends the drawing and frees what it holds. */
  dispose(): void {
    this.ended = true;
    this.awake?.();
    for (const { view, frames } of this.panes.splice(0)) {
      view.dispose();
      frames.dispose();
    }
  }

  private async run(): Promise<void> {
    let drawn = -1;
    while (!this.ended) {
      if (drawn === this.generation) {
        await this.refine(drawn);
        if (drawn === this.generation) await new Promise<void>((resolve) => (this.awake = resolve));
        this.awake = undefined;
        continue;
      }
      await nextFrame();
      if (this.ended) return;
      drawn = this.generation;
      try {
        await this.drawMoving();
      } catch (error) {
        this.onError(error);
      }
    }
  }

  private async drawMoving(): Promise<void> {
    for (const { view } of this.panes) {
      const loading = view.update?.(this.camera);
      loading?.catch((error: unknown) => this.onError(error));
    }
    const size = this.sizeAt(this.scale);
    const camera = this.cameraAt(size[0], [0, 0]);
    const begun = performance.now();
    this.show(this.panes.map(({ view, frames }) => frames.draw(view, camera, ...size, { moving: true })), 1);
    await this.finished();
    this.frameTime = performance.now() - begun;
    this.onFrame();
    if (!this.warm) { // the first compiles shaders: its time says nothing
      this.warm = true;
      this.change();
      return;
    }
    const wanted = this.scale * Math.sqrt(MOVING / Math.max(this.frameTime, 1));
    if (this.frameTime > MOVING * 1.3 || wanted > this.scale * 1.2) {
      this.scale = Math.min(1, Math.max(LOWEST_SCALE, wanted));
    }
  }

  /**
   * Draws a still picture until something changes: at twice the resolution, and so on up to the
   * full one, then sample by sample.
   */
  private async refine(generation: number): Promise<void> {
    while (performance.now() - this.changed < STILL) {
      await nextFrame();
      if (generation !== this.generation || this.ended) return;
    }
    try {
      for (let scale = 2 * this.scale; scale < 1; scale *= 2) {
        const targets = await this.drawStrips(this.sizeAt(scale), [0, 0], generation);
        if (!targets) return;
        this.show(targets, 1);
        this.onFrame();
      }
      for (let sample = 0; sample < SAMPLES_A_SIDE ** 2; sample++) {
        const targets = await this.drawStrips(this.size(), shiftOf(sample), generation);
        if (!targets) return;
        this.show(this.panes.map(({ frames }, i) => frames.accumulate(targets[i], sample === 0)), sample + 1);
        this.onFrame();
      }
      this.refined = generation;
    } catch (error) {
      this.onError(error);
    }
  }

  /** Draws a few rows after the other; undefined when something has changed meanwhile. */
  private async drawStrips(
    [width, height]: [number, number],
    shift: [number, number],
    generation: number,
  ): Promise<WebGLRenderTarget[] | undefined> {
    const camera = this.cameraAt(width, shift);
    let targets: WebGLRenderTarget[] = [];
    for (let bottom = 0; bottom < height; ) {
      const top = Math.min(height, bottom + Math.max(FEWEST_ROWS, Math.round(this.pixelsAStrip / width)));
      const begun = performance.now();
      targets = this.panes.map(({ view, frames }) => frames.draw(view, camera, width, height, { bottom, top }));
      await this.finished();
      if (generation !== this.generation || this.ended) return undefined;
      const pixels = (top - bottom) * width;
      const wanted = (pixels * STRIP) / Math.max(performance.now() - begun, 1);
      this.pixelsAStrip = Math.min(wanted, 4 * this.pixelsAStrip);
      bottom = top;
    }
    return targets;
  }

  private cameraAt(width: number, [right, down]: [number, number]): Camera {
    return { ...this.camera, shift: [right + this.offset * width, down] };
  }

  private show(radiance: WebGLRenderTarget[], samples: number): void {
    const size = this.size();
    const middle = Math.round(size[0] * this.split);
    this.panes.forEach(({ frames }, i) => {
      const columns: [number, number] = this.panes.length === 1 ? [0, 1e6] : i === 0 ? [0, middle] : [middle, 1e6];
      frames.encode(radiance[i], null, { samples, columns, size });
    });
  }

  /** The canvas's size in pixels, which follows the page's. */
  private size(): [number, number] {
    const canvas = this.renderer.domElement;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) this.renderer.setSize(width, height, false);
    return [width, height];
  }

  private sizeAt(scale: number): [number, number] {
    const [width, height] = this.size();
    return [Math.max(1, Math.round(width * scale)), Math.max(1, Math.round(height * scale))];
  }

  /** Waits until the graphics card has drawn all. */
  private async finished(): Promise<void> {
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    if (!fence) return;
    gl.flush();
    while (gl.clientWaitSync(fence, 0, 0) === gl.TIMEOUT_EXPIRED) await turn();
    gl.deleteSync(fence);
  }
}

/** Samples in an order in which any first few lie far apart, by pixels from the middle. */
function shiftOf(sample: number): [number, number] {
  const order = (sample * 7 + 5) % SAMPLES_A_SIDE ** 2;
  const place = (index: number) => (index + 0.5) / SAMPLES_A_SIDE - 0.5;
  return [place(order % SAMPLES_A_SIDE), place(Math.floor(order / SAMPLES_A_SIDE))];
}

function nextFrame(): Promise<unknown> {
  return new Promise((resolve) => requestAnimationFrame(resolve));
}

const channel = new MessageChannel();
const waiting: (() => void)[] = [];
channel.port1.onmessage = () => waiting.shift()?.();

/** Lets the browser do other things; unlike a timer it does not wait for milliseconds. */
function turn(): Promise<void> {
  return new Promise((resolve) => {
    waiting.push(resolve);
    channel.port2.postMessage(null);
  });
}
