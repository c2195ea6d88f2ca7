// Fur of a photograph for three.js 0.160 and newer: one draw call.
//
//     import { loadFur, setFur } from "./fur/fur.js";
//     const fur = await loadFur(new URL("./fur/", import.meta.url));
//     scene.add(fur);
//     setFur(fur, { thickness: 0.05, lamp: 0.8, light: [-0.5, -0.6, 0.6] });
//
// vertex.glsl lifts the surface onto each of the shells, fragment.glsl shows of the photograph what
// stands there. Lamps of the scene are not looked at: the fur has two of its own, and a sky. Give
// setFur wind and the seconds that have passed and it moves; far away fewer shells are drawn.

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
  CODES: "codeCount",
  DECAY: "decay",
  MIDDLE: "middle",
  WIND: "wind",
  MOMENT: "moment",
  GUST: "gust",
  SKY: "sky",
  HEADLIGHT: "headlight",
  LAMP: "lampRadiance",
  LAMP_TOWARDS: "lampTowards",
};
const UNIFORMS = `uniform float thickness, layers, codeSteps, codeCount, decay, middle, wind, moment, gust;
uniform float sky, headlight, lampRadiance;
uniform vec3 lampTowards;
`;
// The surface's vertices have: their names in the file, and in the shader.
const ATTRIBUTES = {
  normal: "outward",
  uv: "uv",
  _along: "along",
  _hairlength: "hairLength",
  _uvs: "uvs",
  _uvthird: "uvThird",
  _weights: "weights",
};
const MOST_LAYERS = 250;
// In radii: fur is seen from no nearer when shells are counted.
const NEAREST = 0.1;
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
    fetched(folder, "photograph.png").then((answer) => answer.blob()),
    new GLTFLoader().loadAsync(new URL("surface.glb", folder).href),
  ]);
  const image = await photographTexture(photograph, about.look === "full");
  let surface;
  gltf.scene.updateMatrixWorld();
  gltf.scene.traverse((each) => (surface = each.isMesh ? each : surface));
  const geometry = onceALayer(surface.geometry);
  const fur = new THREE.Mesh(geometry, material(about, vertex, fragment, image));
  fur.applyMatrix4(surface.matrixWorld);
  fur.frustumCulled = false;
  fur.userData = { about };
  geometry.computeBoundingBox();
  fur.onBeforeRender = (renderer, scene, camera) => {
    const target = renderer.getRenderTarget();
    fur.material.uniforms.encode.value = target === null && renderer.outputColorSpace === THREE.SRGBColorSpace;
    const height = target === null ? renderer.getDrawingBufferSize(new THREE.Vector2()).y : target.height;
    drawShells(fur, about.look === "full" ? shellsSeen(fur, camera, height) : about.layers);
    fur.material.uniformsNeedUpdate = true;
  };
  return fur;
}

/**
 * Sets any of: thickness (mesh units), sky, headlight and lamp (radiance from everywhere, of the lamp
 * along the view, and of the other one), light (towards that one, in the mesh's own axes: z is up),
 * wind (how far tips are blown, in thicknesses) and moment (seconds since it began), of the full look.
 */
export function setFur(fur, { thickness, sky, headlight, lamp, light, wind, moment }) {
  const { uniforms } = fur.material;
  const given = { thickness, sky, headlight, lampRadiance: lamp, wind, moment };
  for (const [name, value] of Object.entries(given)) if (value !== undefined) uniforms[name].value = value;
  if (light !== undefined) uniforms.lampTowards.value.set(...light).normalize();
}

/** Shells that a picture of so many rows needs: fewer where the fur is few pixels thick. */
function shellsSeen(fur, camera, height) {
  const { about } = fur.userData;
  const { FEWEST_SHELLS, MOST_SHELLS, SHELLS_A_PIXEL } = about.constants;
  const scale = fur.matrixWorld.getMaxScaleOnAxis();
  const middle = fur.geometry.boundingBox.getCenter(new THREE.Vector3()).applyMatrix4(fur.matrixWorld);
  const away = middle.distanceTo(new THREE.Vector3().setFromMatrixPosition(camera.matrixWorld));
  const radius = scale * about.radius;
  const nearest = camera.isPerspectiveCamera ? Math.max(away - radius, NEAREST * radius) : 1;
  // The projection's second number is 2 over the picture's height a unit away.
  const pixels = (scale * fur.material.uniforms.thickness.value * height * camera.projectionMatrix.elements[5]) / (2 * nearest);
  return Math.min(MOST_SHELLS, Math.max(FEWEST_SHELLS, Math.ceil(SHELLS_A_PIXEL * pixels)));
}

function drawShells(fur, shells) {
  fur.geometry.instanceCount = shells;
  fur.material.uniforms.layers.value = shells;
}

async function fetched(folder, name) {
  const answer = await fetch(new URL(name, folder));
  if (!answer.ok) throw new Error(`${name}: ${answer.status}; expected a file of the exported folder.`);
  return answer;
}

/** Alpha is a depth, no opacity: colours must not be multiplied by it. */
async function photographTexture(file, mipmap) {
  const options = { premultiplyAlpha: "none", colorSpaceConversion: "none", imageOrientation: "flipY" };
  const texture = new THREE.Texture(await createImageBitmap(file, options));
  texture.wrapS = texture.wrapT = THREE.MirroredRepeatWrapping;
  texture.magFilter = THREE.LinearFilter;
  texture.minFilter = mipmap ? THREE.LinearMipmapLinearFilter : THREE.LinearFilter;
  texture.generateMipmaps = mipmap;
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.needsUpdate = true;
  return texture;
}

/** Instances of the surface, numbered by layers, tips first. */
function onceALayer(surface) {
  const made = new THREE.InstancedBufferGeometry();
  made.setIndex(surface.index);
  made.setAttribute("position", surface.getAttribute("position"));
  for (const [name, shaderName] of Object.entries(ATTRIBUTES)) {
    if (surface.hasAttribute(name)) made.setAttribute(shaderName, surface.getAttribute(name).clone());
  }
  const uv = made.getAttribute("uv");
  for (let n = 0; n < (uv?.count ?? 0); n++) uv.setY(n, 1 - uv.getY(n)); // glTF counts v from the top
  const numbers = Float32Array.from({ length: MOST_LAYERS }, (_, n) => n + 1);
  made.setAttribute("layer", new THREE.InstancedBufferAttribute(numbers, 1));
  return made;
}

function material(about, vertex, fragment, photograph) {
  const { look, layers, thickness, attenuation, fill, middle, radius, constants } = about;
  const steps = Math.floor(255 / layers);
  const used = (name) => new RegExp(`\\b${name}\\b`).test(vertex + fragment);
  const fixed = Object.entries(constants).map(([name, value]) => [name, Number(value).toExponential()]);
  const defined = [...Object.entries(NAMES), ...fixed].filter(([name]) => used(name));
  const head = `${HEAD}${UNIFORMS}${defined.map(([name, value]) => `#define ${name} ${value}\n`).join("")}
#define COLUMNS ${fill === "columns" ? 1 : 0}
`;
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
      codeSteps: { value: steps },
      codeCount: { value: steps * layers },
      decay: { value: look === "full" ? attenuation : attenuation / layers },
      middle: { value: middle },
      wind: { value: 0 },
      moment: { value: 0 },
      gust: { value: constants.GUSTS / radius },
      sky: { value: 0 },
      headlight: { value: 1 },
      lampRadiance: { value: 0 },
      lampTowards: { value: new THREE.Vector3(0, 0, 1) },
      encode: { value: false },
    },
  });
}
