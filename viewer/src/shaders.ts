/**
 * The stage's GLSL for WebGL2. Files of `pipelines/drawing/shaders` are bundled as they are; here
 * includes are resolved, names in capitals defined, and loops between three.js's unroll pragmas
 * written out, as `pipelines/drawing/glsl.py` does.
 */

/** What a name in capitals stands for; a string is GLSL as it is, e.g. the name of a uniform. */
export type Value = boolean | number | readonly number[] | string;

/** Values by name. Whole numbers are written as integers: wrap a float in `float()`. */
export type Values = Readonly<Record<string, Value>>;

const imported = import.meta.glob<string>("../../pipelines/drawing/shaders/*.glsl", {
  query: "?raw",
  import: "default",
  eager: true,
});
const files = new Map(Object.entries(imported).map(([path, text]) => [path.replace(/^.*\//, ""), text]));

const INCLUDE = /^[ \t]*#include[ \t]+"([^"\n]*)"[ \t]*$/gm;
const LOOP =
  /^[ \t]*#pragma unroll_loop_start\n[ \t]*for \(int i = 0; i < (\w+); i\+\+\) \{\n([^]*?)[ \t]*\}\n[ \t]*#pragma unroll_loop_end$/gm;
const PRECISION = ["float", "int", "sampler2D", "sampler2DArray", "isampler2D", "usampler2D"]
  .map((type) => `precision highp ${type};\n`)
  .join("");

/** A number as a float of GLSL. */
export function float(value: number): string {
  const text = value.toString();
  return wrapped(/[.e]/.test(text) ? text : `${text}.0`);
}

/** The text of a shader file, before it the files that it includes, each once. */
export function shaderSource(name: string, values: Values = {}): string {
  const text = withIncluded(name, [], new Set());
  const written: Record<string, string> = {};
  for (const [key, value] of Object.entries(values)) {
    if (uses(text, key)) written[key] = writtenValue(key, value);
  }
  const defined = Object.entries(written).map(([key, value]) => `#define ${key} ${value}\n`);
  return (
    defined.join("") +
    text.replace(LOOP, (_, count: string, body: string) => {
      const turns = Number(written[count] ?? count);
      if (!Number.isInteger(turns)) throw new Error(`${name}: ${count} of a loop has no value.`);
      return Array.from({ length: turns }, (_, i) => `  {\n${body.replace(/\bi\b/g, String(i))}  }\n`).join("");
    })
  );
}

/**
 * A surface's vertex shader: a file with `placeVertex()`. It finds `vertexMC` and `MCDCMatrix`, may
 * declare `uniform mat4 MCVCMatrix`, and is called after `gl_Position` was set. `declared`: GLSL
 * that stands before the file.
 */
export function vertexShader(name: string, values: Values, lit: boolean, declared = ""): string {
  const normal = "in vec3 normal;\nuniform mat3 normalMatrixVC;\nout vec3 normalVC;\n";
  return `${PRECISION}in vec3 position;
vec4 vertexMC;
uniform mat4 MCDCMatrix;
${lit ? normal : ""}${declared}
${shaderSource(name, values)}
void main() {
  vertexMC = vec4(position, 1.0);
  gl_Position = MCDCMatrix * vertexMC;
${lit ? "  normalVC = normalMatrixVC * normal;\n" : ""}  placeVertex();
}
`;
}

/**
 * A surface's fragment shader: a file with `vec3 surfaceColour()`, which is radiance, or where
 * `lit` the albedo under a lamp beside the eye, as the stage's headlight.
 */
export function fragmentShader(name: string, values: Values, lit: boolean, declared = ""): string {
  const shading = `  vec3 normal = normalize(normalVC);
  shown.rgb *= max(gl_FrontFacing ? normal.z : -normal.z, 0.0);
`;
  return `${PRECISION}${lit ? "in vec3 normalVC;\n" : ""}out vec4 shown;
${declared}
${shaderSource(name, values)}
void main() {
  shown = vec4(surfaceColour(), 1.0);
${lit ? shading : ""}}
`;
}

function withIncluded(name: string, users: string[], included: Set<string>): string {
  const text = files.get(name);
  if (text === undefined) throw new Error(`shader ${name} is not in pipelines/drawing/shaders.`);
  if (users.includes(name)) throw new Error(`shaders include each other: ${[...users, name].join(" > ")}.`);
  if (included.has(name)) return "";
  included.add(name);
  return text.replace(INCLUDE, (_, other: string) => withIncluded(other, [...users, name], included));
}

function uses(text: string, name: string): boolean {
  return new RegExp(`\\b${name}\\b`).test(text);
}

function writtenValue(name: string, value: Value): string {
  if (typeof value === "string") return value;
  if (typeof value === "boolean") return value ? "1" : "0";
  if (typeof value === "number") {
    if (!Number.isFinite(value)) throw new Error(`${name} is ${value}; expected a finite number.`);
    return Number.isInteger(value) ? wrapped(String(value)) : float(value);
  }
  return value.map(float).join(", ");
}

function wrapped(text: string): string {
  return text.startsWith("-") ? `(${text})` : text;
}
