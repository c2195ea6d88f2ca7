/** What is behind the glass: the environment, turned, and the lamp. */

import * as THREE from "three";
import { worldToDevice, type DrawingCamera } from "../../drawing/camera";
import { shaderSource } from "../../shaders";

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
${shaderSource("surroundings.glsl")}
uniform sampler2D sky;
uniform float brightness;
uniform mat3 toSky;
uniform vec3 lamp;
uniform vec2 edge;
uniform vec3 lampRadiance;
in vec4 nearOut;
in vec4 farOut;
out vec4 shown;
void main() {
  vec3 direction = normalize(farOut.xyz / farOut.w - nearOut.xyz / nearOut.w);
  shown = vec4(surroundings(sky, toSky, brightness, lamp, edge, lampRadiance, direction), 0.0);
}
`;

/** A mesh that fills what nothing else covers. */
export class Surroundings extends THREE.Mesh<THREE.BufferGeometry, THREE.RawShaderMaterial> {
  constructor(edge: readonly number[]) {
    const triangle = new THREE.BufferGeometry();
    triangle.setAttribute("position", new THREE.BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
    const uniforms = {
      sky: { value: null },
      brightness: { value: 1 },
      toSky: { value: new THREE.Matrix3() },
      lamp: { value: new THREE.Vector3(0, 0, 1) },
      edge: { value: new THREE.Vector2(edge[0], edge[1]) },
      lampRadiance: { value: new THREE.Vector3() },
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

  /** By name. */
  get uniforms(): Record<string, THREE.IUniform> {
    return this.material.uniforms;
  }

  /** Frees it; the environment's texture is not its own. */
  dispose(): void {
    this.geometry.dispose();
    this.material.dispose();
  }
}
