// Fur of a photograph for three.js 0.160 and newer: one draw call.
//
//     import { loadFur, setFur } from "./fur/fur.js";
//     const fur = await loadFur(new URL("./fur/", import.meta.url));
//     scene.add(fur);
//     setFur(fur, { thickness: 0.05, lamp: 0.8, light: [-0.5, -0.6, 0.6] });
//
// vertex.glsl lifts the surface onto each of the layers, fragment.glsl shows of the photograph what
// stands there. Lamps of the scene are not looked at: the fur has two of its own, and a sky.

import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const HEAD = "precision highp float;\nprecision highp int;\nprecision highp sampler2D;\n";
// What names of the shaders stand for in three.js.
const NAMES = {
  MCVCMatrix: "modelViewMatrix",
  MCDCMatrix: "(projectionMatrix * modelViewMatrix)",
  THICKNESS: "thickness",
  LAYERS: "layers",
  CODE_STEPS: "codeSteps",
  DECAY: "decay",
  SKY: "sky",
  HEADLIGHT: "headlight",
  LAMP: "lampRadiance",
  LAMP_TOWARDS: "lampTowards",
};
const UNIFORMS = `uniform float thickness, layers, codeSteps, decay, sky, headlight, lampRadiance;
uniform vec3 lampTowards;
`;
const VERTEX_MAIN = `void main() {
  vertexMC = vec4(position, 1.0);
  placeVertex();
}
`;
// A canvas shows codes of sRGB, a render target radiance.
const FRAGMENT_MAIN = `uniform bool encode;
out vec4 shown;
void main() {
  vec3 radiance = surfaceColour();
  vec3 code = mix(1.055 * pow(radiance, vec3(1.0 / 2.4)) - 0.055, 12.92 * radiance,
    vec3(lessThanEqual(radiance, vec3(0.0031308))));
  shown = vec4(encode ? code : radiance, 1.0);
}
`;

/** The fur of an exported folder, given with its last slash, as a mesh for a scene; y is up. */
export async function loadFur(folder) {
  const [about, vertex, fragment, photograph, gltf] = await Promise.all([
    fetched(folder, "fur.json").then((answer) => answer.json()),
    fetched(folder, "vertex.glsl").then((answer) => answer.text()),
    fetched(folder, "fragment.glsl").then((answer) => answer.text()),
    fetched(folder, "photograph.png").then((answer) => photographTexture(answer)),
    new GLTFLoader().loadAsync(new URL("surface.glb", folder).href),
  ]);
  let surface;
  gltf.scene.updateMatrixWorld();
  gltf.scene.traverse((each) => (surface = each.isMesh ? each : surface));
  const fur = new THREE.Mesh(onceALayer(surface.geometry, about.layers), material(about, vertex, fragment, photograph));
  fur.applyMatrix4(surface.matrixWorld);
  fur.frustumCulled = false;
  fur.onBeforeRender = (renderer) => {
    const isCanvas = renderer.getRenderTarget() === null;
    fur.material.uniforms.encode.value = isCanvas && renderer.outputColorSpace === THREE.SRGBColorSpace;
    fur.material.uniformsNeedUpdate = true;
  };
  return fur;
}

/**
 * Sets any of: thickness (mesh units), sky, headlight and lamp (radiance from everywhere, of the lamp
 * along the view, and of the other one), light (towards that one, in the mesh's own axes: z is up).
 */
export function setFur(fur, { thickness, sky, headlight, lamp, light }) {
  const { uniforms } = fur.material;
  if (sky !== undefined) uniforms.sky.value = sky;
  if (thickness !== undefined) uniforms.thickness.value = thickness;
  if (headlight !== undefined) uniforms.headlight.value = headlight;
  if (lamp !== undefined) uniforms.lampRadiance.value = lamp;
  if (light !== undefined) uniforms.lampTowards.value.set(...light).normalize();
}

async function fetched(folder, name) {
  const answer = await fetch(new URL(name, folder));
  if (!answer.ok) throw new Error(`${name}: ${answer.status}; expected a file of the exported folder.`);
  return answer;
}

/** Alpha is a depth, no opacity: colours must not be multiplied by it. */
async function photographTexture(answer) {
  const options = { premultiplyAlpha: "none", colorSpaceConversion: "none", imageOrientation: "flipY" };
  const texture = new THREE.Texture(await createImageBitmap(await answer.blob(), options));
  texture.wrapS = texture.wrapT = THREE.MirroredRepeatWrapping;
  texture.minFilter = texture.magFilter = THREE.LinearFilter;
  texture.generateMipmaps = false;
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.needsUpdate = true;
  return texture;
}

/** Instances of the surface, numbered by layers, tips first. */
function onceALayer(surface, layers) {
  const made = new THREE.InstancedBufferGeometry();
  made.setIndex(surface.index);
  made.setAttribute("position", surface.getAttribute("position"));
  made.setAttribute("outward", surface.getAttribute("normal"));
  const uv = surface.getAttribute("uv").clone();
  for (let n = 0; n < uv.count; n++) uv.setY(n, 1 - uv.getY(n)); // glTF counts v from the top
  made.setAttribute("uv", uv);
  const numbers = Float32Array.from({ length: layers }, (_, n) => n + 1);
  made.setAttribute("layer", new THREE.InstancedBufferAttribute(numbers, 1));
  made.instanceCount = layers;
  return made;
}

function material({ layers, thickness, attenuation, fill }, vertex, fragment, photograph) {
  const defined = Object.entries(NAMES).map(([name, value]) => `#define ${name} ${value}\n`);
  const head = `${HEAD}${UNIFORMS}${defined.join("")}#define COLUMNS ${fill === "columns" ? 1 : 0}\n`;
  return new THREE.RawShaderMaterial({
    glslVersion: THREE.GLSL3,
    vertexShader: `${head}in vec3 position;\nvec4 vertexMC;\nuniform mat4 projectionMatrix;\n${vertex}${VERTEX_MAIN}`,
    fragmentShader: `${head}${fragment}${FRAGMENT_MAIN}`,
    side: THREE.DoubleSide,
    toneMapped: false,
    uniforms: {
      photograph: { value: photograph },
      thickness: { value: thickness },
      layers: { value: layers },
      codeSteps: { value: Math.floor(255 / layers) },
      decay: { value: attenuation / layers },
      sky: { value: 0 },
      headlight: { value: 1 },
      lampRadiance: { value: 0 },
      lampTowards: { value: new THREE.Vector3(0, 0, 1) },
      encode: { value: false },
    },
  });
}
