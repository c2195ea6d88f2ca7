/** Frames: linear radiance into a float target, averaged, encoded as 8-bit sRGB. */

import * as THREE from "three";
import type { LiveView } from "../live_view";
import type { Camera } from "./camera";
import { useRenderer } from "./textures";

/** A picture in 8-bit sRGB, RGBA, row 0 at the top. */
export interface Frame {
  width: number;
  height: number;
  data: Uint8ClampedArray<ArrayBuffer>;
}

const ENCODE = `precision highp float;
precision highp sampler2D;
uniform sampler2D radiance;
uniform int side;
uniform float weight;
uniform vec2 ratio;
uniform vec2 columns;
out vec4 shown;
vec3 averaged(ivec2 pixel) {
  vec3 sum = vec3(0.0);
  for (int y = 0; y < side; y++)
    for (int x = 0; x < side; x++)
      sum += texelFetch(radiance, pixel * side + ivec2(x, y), 0).rgb;
  return sum;
}
vec3 at(ivec2 pixel) {
  return texelFetch(radiance, clamp(pixel, ivec2(0), textureSize(radiance, 0) - 1), 0).rgb;
}
vec3 enlarged(vec2 place) {
  vec2 corner = floor(place - 0.5), part = place - 0.5 - corner;
  ivec2 pixel = ivec2(corner);
  return mix(mix(at(pixel), at(pixel + ivec2(1, 0)), part.x),
    mix(at(pixel + ivec2(0, 1)), at(pixel + ivec2(1, 1)), part.x), part.y);
}
void main() {
  if (gl_FragCoord.x < columns.x || gl_FragCoord.x >= columns.y) discard;
  vec3 sum = ratio == vec2(1.0) ? averaged(ivec2(gl_FragCoord.xy)) : enlarged(gl_FragCoord.xy * ratio);
  vec3 linear = clamp(sum * weight, 0.0, 1.0);
  vec3 codes = mix(1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055, 12.92 * linear,
    vec3(lessThanEqual(linear, vec3(0.0031308))));
  shown = vec4(codes, 1.0);
}
`;
const ADD = `precision highp float;
precision highp sampler2D;
uniform sampler2D radiance;
out vec4 shown;
void main() { shown = texelFetch(radiance, ivec2(gl_FragCoord.xy), 0); }
`;
const WHOLE = "in vec3 position;\nvoid main() { gl_Position = vec4(position.xy, 0.0, 1.0); }\n";

/** A renderer that leaves colours as they are. Throws where the browser has no WebGL2. */
export function makeRenderer(canvas: HTMLCanvasElement): THREE.WebGLRenderer {
  THREE.ColorManagement.enabled = false;
  const renderer = new THREE.WebGLRenderer({
    canvas,
    antialias: false,
    premultipliedAlpha: false, // or a clear colour of coverage 0 would be black
    powerPreference: "high-performance",
  });
  renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
  renderer.toneMapping = THREE.NoToneMapping;
  renderer.autoClear = false;
  renderer.setPixelRatio(1);
  useRenderer(renderer);
  return renderer;
}

/** A float target with depth, or one to add to without; of halfs where the browser has no better. */
function makeTarget(renderer: THREE.WebGLRenderer, width: number, height: number, depth = true) {
  const isFloat = renderer.extensions.has(depth ? "EXT_color_buffer_float" : "EXT_float_blend");
  return new THREE.WebGLRenderTarget(width, height, {
    type: isFloat ? THREE.FloatType : THREE.HalfFloatType,
    minFilter: THREE.NearestFilter,
    magFilter: THREE.NearestFilter,
    depthBuffer: depth,
    depthTexture: depth ? new THREE.DepthTexture(width, height, THREE.FloatType) : null,
  });
}

function disposeTarget(target: THREE.WebGLRenderTarget): void {
  target.depthTexture?.dispose();
  target.dispose();
}

function pass(fragmentShader: string, uniforms: Record<string, THREE.IUniform>, additive = false) {
  const triangle = new THREE.BufferGeometry();
  const corners = new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]);
  triangle.setAttribute("position", new THREE.BufferAttribute(corners, 3));
  const material = new THREE.RawShaderMaterial({
    glslVersion: THREE.GLSL3,
    vertexShader: WHOLE,
    fragmentShader,
    uniforms,
    depthTest: false,
    depthWrite: false,
    blending: additive ? THREE.CustomBlending : THREE.NoBlending,
    blendSrc: THREE.OneFactor,
    blendDst: THREE.OneFactor,
    blendSrcAlpha: THREE.OneFactor,
    blendDstAlpha: THREE.OneFactor,
  });
  const mesh = new THREE.Mesh(triangle, material);
  mesh.frustumCulled = false;
  return mesh;
}

/** What `Frames.encode` does with radiance. */
interface Encoding {
  /** So many samples of a pixel lie beside each other, and below each other. */
  side?: number;
  /** So many samples were added up. */
  samples?: number;
  /** The columns that are written, of the size that is written to. */
  columns?: [number, number];
  /** Width and height that are written, where they are not the radiance's. */
  size?: [number, number];
}

/** What `Frames.draw` draws: rows from `bottom` up to `top`, all without them. */
export interface Drawing {
  bottom?: number;
  top?: number;
  /** As of `LiveView.draw`. */
  moving?: boolean;
}

/** Draws frames of one live view. */
export class Frames {
  private target: THREE.WebGLRenderTarget | undefined;
  private sum: THREE.WebGLRenderTarget | undefined;
  private readonly nowhere = new THREE.Camera();
  private readonly encoding = pass(ENCODE, {
    radiance: { value: null },
    side: { value: 1 },
    weight: { value: 1 },
    ratio: { value: new THREE.Vector2() },
    columns: { value: new THREE.Vector2() },
  });
  private readonly adding = pass(ADD, { radiance: { value: null } }, true);

  constructor(private readonly renderer: THREE.WebGLRenderer) {}

  /** Draws a picture's radiance, or some of its rows, and keeps it. */
  draw(view: LiveView, camera: Camera, width: number, height: number, how: Drawing = {}): THREE.WebGLRenderTarget {
    if (this.target?.width !== width || this.target.height !== height) {
      if (this.target) disposeTarget(this.target);
      this.target = makeTarget(this.renderer, width, height);
    }
    const { bottom = 0, top = height, moving } = how;
    this.target.scissor.set(0, bottom, width, top - bottom);
    this.target.scissorTest = true;
    this.renderer.setRenderTarget(this.target);
    view.draw(this.renderer, camera, width, height, moving);
    return this.target;
  }

  /** Encodes radiance into a target, or the canvas. */
  encode(radiance: THREE.WebGLRenderTarget, into: THREE.WebGLRenderTarget | null, how: Encoding = {}): void {
    const { side = 1, samples = 1, columns = [0, 1e6] } = how;
    const [width, height] = how.size ?? [radiance.width / side, radiance.height / side];
    const { uniforms } = this.encoding.material;
    uniforms.radiance.value = radiance.texture;
    uniforms.side.value = side;
    uniforms.weight.value = 1 / (side * side * samples);
    uniforms.ratio.value.set(radiance.width / side / width, radiance.height / side / height);
    uniforms.columns.value.set(...columns);
    this.renderer.setRenderTarget(into);
    this.renderer.render(this.encoding, this.nowhere);
  }

  /** Adds what was drawn to the sum of a still picture's samples; `first` starts it anew. */
  accumulate(drawn: THREE.WebGLRenderTarget, first: boolean): THREE.WebGLRenderTarget {
    const { width, height } = drawn;
    if (this.sum?.width !== width || this.sum.height !== height) {
      this.sum?.dispose();
      this.sum = makeTarget(this.renderer, width, height, false);
    }
    this.adding.material.uniforms.radiance.value = drawn.texture;
    this.renderer.setRenderTarget(this.sum);
    if (first) {
      this.renderer.setClearColor(0, 0);
      this.renderer.clear();
    }
    this.renderer.render(this.adding, this.nowhere);
    return this.sum;
  }

  /** A frame as the stage draws it, `supersampling` samples beside and below each other a pixel. */
  capture(view: LiveView, camera: Camera, [width, height]: [number, number], supersampling: number, moving: boolean): Frame {
    const n = supersampling;
    const large = makeTarget(this.renderer, width * n, height * n);
    const small = new THREE.WebGLRenderTarget(width, height, { depthBuffer: false });
    this.renderer.setRenderTarget(large);
    view.draw(this.renderer, camera, width * n, height * n, moving);
    this.encode(large, small, { side: n });
    const codes = new Uint8Array(width * height * 4);
    this.renderer.readRenderTargetPixels(small, 0, 0, width, height, codes);
    this.renderer.setRenderTarget(null);
    disposeTarget(large);
    small.dispose();
    const data = new Uint8ClampedArray(codes.length);
    for (let row = 0; row < height; row++) {
      data.set(codes.subarray((height - 1 - row) * width * 4, (height - row) * width * 4), row * width * 4);
    }
    return { width, height, data };
  }

  /** Frees its targets. */
  dispose(): void {
    if (this.target) disposeTarget(this.target);
    this.sum?.dispose();
    for (const mesh of [this.encoding, this.adding]) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
  }
}
