/** `window.tsuya`: what tests in a browser ask of the page. */

import { encode } from "fast-png";
import type { View } from "./live_view";
import type { Live } from "./page/live";

/** The hook; `live` is what is shown now. */
export const testHook = {
  /** Settled when the page has drawn its first frame, or the gallery. */
  ready: undefined as Promise<void> | undefined,
  live: undefined as Live | undefined,
  /** The package that is shown. */
  key: undefined as string | undefined,
  /** Milliseconds from the opening of the page to the first frame of a package. */
  firstPicture: undefined as number | undefined,

  /** Camera and state. */
  view(): View {
    return shown().shown();
  },

  /** Sets camera, state, or both. */
  setView(view: Partial<View>): void {
    const live = shown();
    if (view.camera) live.camera = { ...live.camera, ...view.camera };
    if (view.state) live.setState(view.state);
    live.change();
  },

  /** A frame as the stage draws it: a PNG (RGBA) in base64; `moving`: as while something moves. */
  async capture(width: number, height: number, supersampling = 1, moving = false): Promise<string> {
    const frame = await shown().capture(width, height, supersampling, moving);
    const png = encode({ width, height, data: frame.data, channels: 4, depth: 8 });
    let text = "";
    for (let start = 0; start < png.length; start += 8192) {
      text += String.fromCharCode(...png.subarray(start, start + 8192));
    }
    return btoa(text);
  },

  /** Milliseconds that the last frame took. */
  get frameTime(): number {
    return shown().frameTime;
  },

  /** What draws: the graphics card's name. */
  get renderer(): string {
    return shown().rendererName;
  },

  /** The live view's own figures. */
  figures(): Record<string, number | string> {
    return shown().view.figures?.() ?? {};
  },
};

function shown(): Live {
  if (!testHook.live) throw new Error("no package is shown; expected `ready` to be waited for.");
  return testHook.live;
}

(window as unknown as { tsuya: typeof testHook }).tsuya = testHook;
