/** Distances at all lobes of all vertices, decoded on the graphics card before a frame. */

import * as THREE from "three";
import { shaderSource } from "../../shaders";
import type { DistanceTables } from "./distance_tables";
import { lineTexture, tableTexture } from "./tables";

const COLUMNS = 1024; // vertices a row
const LINE = 4096; // texels a row of the tables
/** The least n·o, as of `light/microfacets.py`. */
export const LEAST_VIEW = 1e-3;

/** What the decoding needs of the mesh: (V, 3), (V, 3), (V), (V). */
export interface LobeVertices {
  vertices: Float32Array;
  normals: Float32Array;
  source: Float32Array;
  lobes: Float32Array;
}

/** Lights as the shaders have them. */
export interface LightUniforms {
  /** (N, 4): axes and sharpness. */
  lights: Float32Array;
  /** (N, 3). */
  amplitudes: Float32Array;
}

const VERTEX = "in vec3 position;\nvoid main() { gl_Position = vec4(position.xy, 0.0, 1.0); }\n";
const NOTHING_HIDDEN = new THREE.Color(Math.PI, Math.PI, Math.PI);

/**
 * Makes the texture that `lit_vertex.glsl` fetches: EDGE_ROWS rows for each four lobes. Until there
 * are distances nothing is hidden.
 */
export class EdgePass {
  /** Rows that four lobes of all vertices take. */
  readonly rows: number;
  private readonly target: THREE.WebGLRenderTarget;
  private mesh: THREE.Mesh<THREE.BufferGeometry, THREE.RawShaderMaterial> | undefined;
  private readonly nowhere = new THREE.Camera();
  private readonly groups: number;
  private drawn = "";

  constructor(
    renderer: THREE.WebGLRenderer,
    private readonly vertices: LobeVertices,
    private readonly glossAxes: { values: Float32Array; columns: number },
    private readonly lightCount: number,
  ) {
    const count = vertices.source.length;
    this.rows = Math.ceil(count / COLUMNS);
    this.groups = Math.ceil(lightCount / 4);
    const isFloat = renderer.extensions.has("EXT_color_buffer_float");
    this.target = new THREE.WebGLRenderTarget(COLUMNS, 2 * this.groups * this.rows, {
      type: isFloat ? THREE.FloatType : THREE.HalfFloatType,
      minFilter: THREE.NearestFilter,
      magFilter: THREE.NearestFilter,
      depthBuffer: false,
    });
  }

  /** Takes the distances. */
  load(tables: DistanceTables): void {
    const { vertices: mesh, lightCount } = this;
    const count = mesh.source.length;
    const places = new Float32Array(4 * count);
    const normals = new Float32Array(4 * count);
    for (let v = 0; v < count; v++) {
      places.set(mesh.vertices.subarray(3 * v, 3 * v + 3), 4 * v);
      normals.set(mesh.normals.subarray(3 * v, 3 * v + 3), 4 * v);
      places[4 * v + 3] = mesh.lobes[v];
      normals[4 * v + 3] = mesh.source[v];
    }
    const { values, columns } = this.glossAxes;
    const uniforms = {
      eye: { value: new THREE.Vector4() },
      lights: { value: new Float32Array(4 * lightCount) },
      vertexPlaces: { value: lineTexture(places, COLUMNS) },
      vertexNormals: { value: lineTexture(normals, COLUMNS) },
      vertexSources: { value: lineTexture(tables.sources, COLUMNS) },
      vertexWeights: { value: lineTexture(tables.weights, LINE) },
      clusterVectors: { value: lineTexture(tables.vectors, LINE) },
      glossAxes: { value: tableTexture(values, columns, values.length / 4 / columns) },
      mattAxes: { value: null as THREE.Texture | null },
    };
    const triangle = new THREE.BufferGeometry();
    triangle.setAttribute("position", new THREE.BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
    this.mesh = new THREE.Mesh(
      triangle,
      new THREE.RawShaderMaterial({
        glslVersion: THREE.GLSL3,
        vertexShader: VERTEX,
        fragmentShader: fragment(lightCount, tables.resolution, this.rows, count),
        uniforms,
        depthTest: false,
        depthWrite: false,
        blending: THREE.NoBlending,
      }),
    );
    this.mesh.frustumCulled = false;
    this.drawn = "";
  }

  /** The texture. */
  get texture(): THREE.Texture {
    return this.target.texture;
  }

  /** Draws what has changed since the last call: the gloss follows the view, the matt part does not. */
  draw(
    renderer: THREE.WebGLRenderer,
    eye: THREE.Vector4,
    { lights }: LightUniforms,
    mattAxes: THREE.Texture,
    asked: boolean,
  ): void {
    const { mesh } = this;
    const shadows = asked && mesh !== undefined;
    const ofMatt = `${shadows} ${shadows ? `${lights.join()} ${mattAxes.id}` : ""}`;
    const ofGloss = `${ofMatt} ${shadows ? eye.toArray().join() : ""}`;
    if (ofGloss === this.drawn) return;
    const isMattDrawn = this.drawn.startsWith(`${ofMatt} `);
    const bound = renderer.getRenderTarget();
    const half = this.groups * this.rows;
    const first = isMattDrawn && shadows ? half : 0;
    this.target.scissor.set(0, first, COLUMNS, 2 * half - first);
    this.target.scissorTest = true;
    renderer.setRenderTarget(this.target);
    if (shadows) {
      const { uniforms } = mesh.material;
      uniforms.eye.value.copy(eye);
      uniforms.lights.value = lights;
      uniforms.mattAxes.value = mattAxes;
      mesh.material.uniformsNeedUpdate = true;
      renderer.render(mesh, this.nowhere);
    } else {
      renderer.setClearColor(NOTHING_HIDDEN, Math.PI);
      renderer.clear();
    }
    renderer.setRenderTarget(bound);
    this.drawn = ofGloss;
  }

  /** d (light) at a vertex's matt lobes, of what was drawn last: read back from the card. */
  mattDistances(renderer: THREE.WebGLRenderer): (vertex: number, light: number) => number {
    const rows = this.groups * this.rows;
    const isFloat = this.target.texture.type === THREE.FloatType;
    const values = isFloat ? new Float32Array(4 * COLUMNS * rows) : new Uint16Array(4 * COLUMNS * rows);
    renderer.readRenderTargetPixels(this.target, 0, 0, COLUMNS, rows, values);
    return (vertex, light) => {
      const row = (light >> 2) * this.rows + Math.floor(vertex / COLUMNS);
      const value = values[4 * (row * COLUMNS + (vertex % COLUMNS)) + (light & 3)];
      return isFloat ? value : THREE.DataUtils.fromHalfFloat(value);
    };
  }

  /** Frees what it holds on the graphics card. */
  dispose(): void {
    this.target.dispose();
    if (!this.mesh) return;
    const { geometry, material } = this.mesh;
    geometry.dispose();
    material.dispose();
    for (const [name, { value }] of Object.entries(material.uniforms)) {
      if (name !== "mattAxes" && value instanceof THREE.Texture) value.dispose();
    }
  }
}

function fragment(lightCount: number, resolution: number, rows: number, vertices: number): string {
  return `precision highp float;
precision highp int;
precision highp sampler2D;
out vec4 shown;
${shaderSource("lit_distances.glsl", { LIGHTS: lightCount, SIDE: resolution, LEAST_VIEW })}
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  int vertex = (at.y % ${rows}) * ${COLUMNS} + at.x;
  shown = distancesOf(min(vertex, ${vertices - 1}), at.y / ${rows});
}
`;
}
