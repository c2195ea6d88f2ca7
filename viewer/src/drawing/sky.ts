/** What is behind everything: an environment at infinity. */

import * as THREE from "three";
import { shaderSource } from "../shaders";
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
const FRAGMENT = `precision highp float;
precision highp sampler2D;
${shaderSource("equirectangular.glsl")}
uniform sampler2D sky;
uniform float exposure;
in vec4 nearOut;
in vec4 farOut;
out vec4 shown;
void main() {
  vec3 direction = normalize(farOut.xyz / farOut.w - nearOut.xyz / nearOut.w);
  shown = vec4(exposure * textureLod(sky, equirectangularPlace(direction), 0.0).rgb, 0.0);
}
`;

/** Environment in equirectangular layout, z up, drawn behind all else: put it into a scene. */
export class Sky extends THREE.Mesh<THREE.BufferGeometry, THREE.RawShaderMaterial> {
  /** sky: of `texture()`, of a map as the stage's environments; disposed with this. */
  constructor(sky: THREE.Texture) {
    const triangle = new THREE.BufferGeometry();
    const corners = new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]);
    triangle.setAttribute("position", new THREE.BufferAttribute(corners, 3));
    const uniforms = {
      sky: { value: sky },
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

  /** What radiance is multiplied with. */
  set exposure(value: number) {
    this.material.uniforms.exposure.value = value;
  }

  /** Frees it and its texture. */
  dispose(): void {
    this.geometry.dispose();
    this.material.uniforms.sky.value.dispose();
    this.material.dispose();
  }
}
