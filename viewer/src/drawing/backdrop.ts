/** What is behind everything: radiance that depends on the direction alone. */

import * as THREE from "three";
import { worldToDevice, type DrawingCamera } from "./camera";

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
const FRAGMENT = `in vec4 nearOut;
in vec4 farOut;
out vec4 shown;
void main() {
  vec3 direction = normalize(farOut.xyz / farOut.w - nearOut.xyz / nearOut.w);
  shown = vec4(radianceFrom(direction), 0.0);
}
`;

/** A mesh that fills what nothing else covers: put it into a scene. */
export class Backdrop<Uniforms extends Record<string, THREE.IUniform>> extends THREE.Mesh<
  THREE.BufferGeometry,
  THREE.RawShaderMaterial
> {
  /** glsl: declares `uniforms` and has `vec3 radianceFrom(vec3 direction)`, z up. */
  constructor(
    glsl: string,
    readonly uniforms: Uniforms,
  ) {
    const triangle = new THREE.BufferGeometry();
    const corners = new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]);
    triangle.setAttribute("position", new THREE.BufferAttribute(corners, 3));
    const fromDevice = { value: new THREE.Matrix4() };
    super(
      triangle,
      new THREE.RawShaderMaterial({
        glslVersion: THREE.GLSL3,
        vertexShader: VERTEX,
        fragmentShader: `precision highp float;\nprecision highp sampler2D;\n${glsl}\n${FRAGMENT}`,
        depthWrite: false,
        uniforms: { ...uniforms, fromDevice },
      }),
    );
    this.frustumCulled = false;
    this.renderOrder = 1;
    this.onBeforeRender = (_renderer, _scene, camera) => {
      fromDevice.value.copy(worldToDevice(camera as DrawingCamera)).invert();
      this.material.uniformsNeedUpdate = true;
    };
  }

  /** Frees it; textures are not its own. */
  dispose(): void {
    this.geometry.dispose();
    this.material.dispose();
  }
}
