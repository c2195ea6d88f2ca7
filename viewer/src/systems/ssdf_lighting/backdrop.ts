/** The environment behind the scene, turned with the light; few texels, so smoothed by a B-spline. */

import * as THREE from "three";
import { worldToDevice, type DrawingCamera } from "../../drawing/camera";
import { shaderSource } from "../../shaders";
import type { Environment } from "./sphere_map";
import { tableTexture } from "./tables";

const VERTEX = `precision highp float;
in vec3 position;
uniform mat4 fromDevice;
out vec4 nearOut;
out vec4 farOut;
void main() {
  nearOut = fromDevice * vec4(position.xy, -1.0, 1.0);
  farOut = fromDevice * vec4(position.xy, 1.0, 1.0);
  gl_Position = vec4(position.xy, 1.0, 1.0);
}
`;
const FRAGMENT = `precision highp float;
precision highp sampler2D;
${shaderSource("equirectangular.glsl")}
uniform sampler2D environment;         // row 0: the zenith
uniform vec2 turned;                   // cosine and sine of the light's turn
uniform float exposure;
in vec4 nearOut;
in vec4 farOut;
out vec4 shown;
vec4 spline(float part) {
  float rest = 1.0 - part, squared = part * part, cubed = squared * part;
  return vec4(rest * rest * rest, 3.0 * cubed - 6.0 * squared + 4.0,
              -3.0 * cubed + 3.0 * squared + 3.0 * part + 1.0, cubed) / 6.0;
}
void main() {
  vec3 way = normalize(farOut.xyz / farOut.w - nearOut.xyz / nearOut.w);
  way.xy = vec2(turned.x * way.x + turned.y * way.y, turned.x * way.y - turned.y * way.x);
  ivec2 size = textureSize(environment, 0);
  vec2 place = equirectangularPlace(way);
  place = vec2(place.x, 1.0 - place.y) * vec2(size) - 0.5;
  vec2 corner = floor(place);
  vec4 across = spline(place.x - corner.x), down = spline(place.y - corner.y);
  vec3 sum = vec3(0.0);
  for (int y = 0; y < 4; y++) {
    for (int x = 0; x < 4; x++) {
      ivec2 at = ivec2(corner) + ivec2(x, y) - 1;
      at = ivec2((at.x + 2 * size.x) % size.x, clamp(at.y, 0, size.y - 1));
      sum += across[x] * down[y] * texelFetch(environment, at, 0).rgb;
    }
  }
  shown = vec4(exposure * sum, 0.0);
}
`;

/** Put it into a scene. */
export class Backdrop extends THREE.Mesh<THREE.BufferGeometry, THREE.RawShaderMaterial> {
  constructor() {
    const triangle = new THREE.BufferGeometry();
    triangle.setAttribute("position", new THREE.BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
    const uniforms = {
      environment: { value: null as THREE.Texture | null },
      turned: { value: new THREE.Vector2(1, 0) },
      exposure: { value: 1 },
      fromDevice: { value: new THREE.Matrix4() },
    };
    super(
      triangle,
      new THREE.RawShaderMaterial({
        glslVersion: THREE.GLSL3,
        vertexShader: VERTEX,
        fragmentShader: FRAGMENT,
        depthWrite: false,
        uniforms,
      }),
    );
    this.frustumCulled = false;
    this.renderOrder = 1;
    this.onBeforeRender = (_renderer, _scene, camera) => {
      uniforms.fromDevice.value.copy(worldToDevice(camera as DrawingCamera)).invert();
      this.material.uniformsNeedUpdate = true;
    };
  }

  /** Shows another environment. */
  show({ height, data }: Environment): void {
    const texels = new Float32Array((4 * data.length) / 3);
    for (let k = 0; k < data.length; k++) texels[4 * Math.floor(k / 3) + (k % 3)] = data[k];
    const { environment } = this.material.uniforms;
    environment.value?.dispose();
    environment.value = tableTexture(texels, 2 * height, height);
  }

  /** Turns it, in radians, and exposes it. */
  set(turn: number, exposure: number): void {
    this.material.uniforms.turned.value.set(Math.cos(turn), Math.sin(turn));
    this.material.uniforms.exposure.value = exposure;
  }

  /** Frees it and its texture. */
  dispose(): void {
    this.geometry.dispose();
    this.material.uniforms.environment.value?.dispose();
    this.material.dispose();
  }
}
