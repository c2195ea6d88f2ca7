// A live view of the conformance suite's packages: one colour, which shows camera and state.
globalThis.tsuyaViewers = [{
  name: "conformance",
  async make(pkg, context) {
    const state = { light: [0, 0, 1], red: 0.5, banded: true, shape: "round" };
    await pkg.mesh("mesh");
    await pkg.floats("float16");
    const take = async (file) => {
      if (file.size > 3) throw new Error(`${file.name}: file is too long; expected 3 bytes.`);
      state.red = 1;
      context.requestDraw();
    };
    const own = { kind: "drop", name: "own", label: "Yours", accept: ".txt", take };
    return {
      get controls() {
        return [
          { kind: "direction", name: "light", label: "Light" },
          { kind: "slider", name: "red", label: "Red", min: 0, max: 1, step: 0.01 },
          { kind: "toggle", name: "banded", label: "Bands" },
          { kind: "choice", name: "shape", label: "Shape", options: [
            { value: "round", label: "Round" }, { value: "flat", label: "Flat" }] },
          ...(state.banded ? [own] : []),
        ];
      },
      navigation: "orbit",
      bounds: { centre: [0, 0, 0], radius: 1 },
      state: () => structuredClone(state),
      setState(given) {
        if (given.red > 1) throw new Error("red is above 1; expected at most 1.");
        Object.assign(state, given);
      },
      draw(renderer, camera, width, height) {
        const code = (value) => Math.round(255 * Math.min(1, Math.max(0, value)));
        const green = 0.5 + 0.5 * camera.position[0] / Math.hypot(...camera.position);
        const blue = 0.5 + 0.5 * state.light[2];
        renderer.setClearColor((code(state.red) << 16) | (code(green) << 8) | code(blue), 0);
        renderer.clear();
      },
      figures: () => ({ "tiles resident": 7 }),
      dispose() {},
    };
  },
}];
