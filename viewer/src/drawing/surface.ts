/** Triangle meshes with the stage's shaders, as the stage's `surface`. */

import * as THREE from "three";
import { fragmentShader, vertexShader, type Values } from "../shaders";
import { worldToDevice, type DrawingCamera } from "./camera";

/** What a surface is made of; arrays are flat. */
export interface SurfaceParts {
  /** (V, 3). */
  vertices: Float32Array;
  /** (F, 3). */
  triangles: Uint32Array;
  /** (V, 3); needed where `lit`. */
  normals?: Float32Array;
  /** Of floats, `width` numbers a vertex: the vertex shader has them under their names. */
  attributes?: Record<string, { values: Float32Array; width: number }>;
  /** Names of files of `pipelines/drawing/shaders`. */
  vertex: string;
  fragment: string;
  /** What names in capitals stand for. */
  values?: Values;
  /** Samplers by name. */
  textures?: Record<string, THREE.Texture>;
  /** Uniforms that the files do not declare: GLSL type and value; set `.uniforms[name].value`. */
  uniforms?: Record<string, { type: string; value: unknown }>;
  /** Lambertian under a lamp beside the eye, as the stage's default light. */
  lit?: boolean;
}

/** A mesh with its shaders: put it into a `THREE.Scene`. */
export class Surface extends THREE.Mesh<THREE.BufferGeometry, THREE.RawShaderMaterial> {
  constructor(private readonly parts: SurfaceParts) {
    super(geometryOf(parts));
    this.frustumCulled = false;
    this.onBeforeRender = (_renderer, _scene, camera) => this.place(camera as DrawingCamera);
    this.setValues(parts.values ?? {});
  }

  /** Samplers and uniforms by name. */
  get uniforms(): Record<string, THREE.IUniform> {
    return this.material.uniforms;
  }

  /** Other values for names in capitals: the shader is compiled again. */
  setValues(values: Values): void {
    const { vertex, fragment, lit = false, uniforms = {}, textures = {} } = this.parts;
    const declared = Object.entries(uniforms).map(([name, { type }]) => `uniform ${type} ${name};\n`).join("");
    const old = this.material.uniforms as Record<string, THREE.IUniform> | undefined;
    this.material.dispose();
    this.material = new THREE.RawShaderMaterial({
      glslVersion: THREE.GLSL3,
      vertexShader: vertexShader(vertex, values, lit, declared),
      fragmentShader: fragmentShader(fragment, values, lit, declared),
      side: THREE.DoubleSide,
      toneMapped: false,
      uniforms: old ?? {
        MCDCMatrix: { value: new THREE.Matrix4() },
        MCVCMatrix: { value: new THREE.Matrix4() },
        normalMatrixVC: { value: new THREE.Matrix3() },
        ...Object.fromEntries(Object.entries(uniforms).map(([name, { value }]) => [name, { value }])),
        ...Object.fromEntries(Object.entries(textures).map(([name, value]) => [name, { value }])),
      },
    });
  }

  /** Frees geometry, shader and textures. */
  dispose(): void {
    this.geometry.dispose();
    this.material.dispose();
    for (const { value } of Object.values(this.uniforms)) if (value instanceof THREE.Texture) value.dispose();
  }

  private place(camera: DrawingCamera): void {
    const { MCDCMatrix, MCVCMatrix, normalMatrixVC } = this.uniforms;
    // Multiplied in double precision, as the stage does: a street is far from its origin.
    MCDCMatrix.value.multiplyMatrices(worldToDevice(camera), this.matrixWorld);
    MCVCMatrix.value.multiplyMatrices(camera.matrixWorldInverse, this.matrixWorld);
    normalMatrixVC.value.getNormalMatrix(MCVCMatrix.value);
    this.material.uniformsNeedUpdate = true;
  }
}

function geometryOf({ vertices, triangles, normals, attributes = {} }: SurfaceParts): THREE.BufferGeometry {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(vertices, 3));
  geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
  if (normals) geometry.setAttribute("normal", new THREE.BufferAttribute(normals, 3));
  for (const [name, { values, width }] of Object.entries(attributes)) {
    geometry.setAttribute(name, new THREE.BufferAttribute(values, width));
  }
  return geometry;
}
