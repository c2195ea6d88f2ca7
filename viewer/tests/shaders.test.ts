import { describe, expect, it } from "vitest";
import { float, fragmentShader, shaderSource, vertexShader } from "../src/shaders";

describe("shaderSource", () => {
  it("includes each file once, before who includes it", () => {
    const text = shaderSource("fur_fragment.glsl");
    expect(text.match(/float depthCode\(float alpha\)/g)).toHaveLength(1);
    expect(text.indexOf("float depthCode")).toBeLessThan(text.indexOf("vec3 surfaceColour"));
    expect(text).not.toContain("#include");
  });

  it("defines what a line uses", () => {
    const text = shaderSource("fur_fragment.glsl", { CODE_STEPS: float(3), COLUMNS: true, DECAY: -0.5, OTHER: 1 });
    expect(text.split("\n").slice(0, 3)).toEqual([
      "#define CODE_STEPS 3.0",
      "#define COLUMNS 1",
      "#define DECAY (-0.5)",
    ]);
  });

  it("writes loops out", () => {
    const text = shaderSource("lit_vertex.glsl", { EDGES: 2, TEXTURED: false });
    expect(text).toContain("edges[0] = given[0];");
    expect(text).toContain("edges[1] = given[1];");
    expect(text).not.toContain("edges[2] =");
    expect(text).not.toContain("unroll_loop_start");
  });

  it("names a file that is not there", () => {
    expect(() => shaderSource("no.glsl")).toThrow("shader no.glsl is not in pipelines/drawing/shaders.");
  });
});

it("calls the files' functions after the place is set", () => {
  const text = vertexShader("painted_vertex.glsl", {}, false);
  expect(text.indexOf("gl_Position =")).toBeLessThan(text.lastIndexOf("placeVertex();"));
  expect(fragmentShader("painted_fragment.glsl", {}, true)).toContain("normalVC");
});
