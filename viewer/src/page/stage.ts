/** The one canvas of the page, with its renderer. */

import type { WebGLRenderer } from "three";
import { makeRenderer } from "../drawing/frame";
import { element } from "./elements";

/** A canvas and what draws on it. */
export interface Stage {
  canvas: HTMLCanvasElement;
  renderer: WebGLRenderer;
}

const MISSING =
  "This browser has no WebGL2, with which packages are drawn; expected a browser of 2021 or later " +
  "with its graphics acceleration switched on.";

/** Makes the canvas. Throws an Error with a sentence where the browser has no WebGL2. */
export function makeStage(): Stage {
  const tried = document.createElement("canvas").getContext("webgl2");
  if (!tried) throw new Error(MISSING);
  tried.getExtension("WEBGL_lose_context")?.loseContext();
  const canvas = element("canvas", { class: "live", tabIndex: 0, "aria-label": "The live view: drag to turn" });
  return { canvas, renderer: makeRenderer(canvas) };
}
