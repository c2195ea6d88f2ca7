/** The panel of what can be set. */

import type { Camera, Vector } from "../drawing/camera";
import type { Control, State } from "../live_view";
import { element, withUnits } from "./elements";
import { directionPad } from "./pad";
import { say, sentenceOf } from "./sentences";

/** A panel; `show` brings it up to date with a state. */
export interface Panel {
  element: HTMLElement;
  show(state: State, camera: Camera): void;
}

interface Shown {
  element: HTMLElement;
  show(state: State, camera: Camera): void;
}

/** A panel of controls; `set` takes what was set. */
export function controlPanel(controls: readonly Control[], set: (state: State) => void): Panel {
  const shown = controls.map((control) => shownControl(control, set));
  return {
    element: element("div", { class: "controls" }, ...shown.map((each) => each.element)),
    show: (state, camera) => shown.forEach((each) => each.show(state, camera)),
  };
}

/** What tells one list of controls from another. */
export function signature(controls: readonly Control[]): string {
  return JSON.stringify(controls);
}

function shownControl(control: Control, set: (state: State) => void): Shown {
  switch (control.kind) {
    case "slider":
      return slider(control, set);
    case "toggle":
      return toggle(control, set);
    case "choice":
      return choice(control, set);
    case "direction": {
      const pad = directionPad(control.label, (direction) => set({ [control.name]: direction }));
      return {
        element: pad.element,
        show: (state, camera) => pad.show(state[control.name] as Vector, camera),
      };
    }
    case "drop":
      return fileDrop(control);
    case "button":
      return {
        element: element("button", { class: "control wide", type: "button", onclick: control.press }, control.label),
        show: () => {},
      };
  }
}

function slider(control: Extract<Control, { kind: "slider" }>, set: (state: State) => void): Shown {
  const { name, label, min, max } = control;
  const step = control.step ?? (max - min) / 200;
  const input = element("input", { type: "range", min, max, step, name });
  const reading = element("output", {});
  input.oninput = () => set({ [name]: Number(input.value) });
  return {
    element: element("label", { class: "control" }, element("span", { class: "label" }, label), reading, input),
    show(state) {
      const value = Number(state[name]);
      if (Number(input.value) !== value) input.value = String(value);
      reading.textContent = withUnits(value, control.units);
      input.style.setProperty("--part", String((value - min) / (max - min)));
    },
  };
}

function toggle({ name, label }: Extract<Control, { kind: "toggle" }>, set: (state: State) => void): Shown {
  const input = element("input", { type: "checkbox", name, role: "switch" });
  input.onchange = () => set({ [name]: input.checked });
  return {
    element: element("label", { class: "control toggle" }, element("span", { class: "label" }, label), input),
    show: (state) => void (input.checked = Boolean(state[name])),
  };
}

function choice(control: Extract<Control, { kind: "choice" }>, set: (state: State) => void): Shown {
  const options = control.options.map(({ value, label }) => element("option", { value }, label));
  const select = element("select", { name: control.name }, ...options);
  select.onchange = () => set({ [control.name]: select.value });
  return {
    element: element("label", { class: "control" }, element("span", { class: "label" }, control.label), select),
    show: (state) => void (select.value = String(state[control.name])),
  };
}

function fileDrop(control: Extract<Control, { kind: "drop" }>): Shown {
  const input = element("input", { type: "file", accept: control.accept, name: control.name });
  input.onchange = () => {
    const file = input.files?.[0];
    if (file) void taken(control, file);
    input.value = "";
  };
  return {
    element: element("label", { class: "control drop" }, element("span", {}, control.label), input),
    show: () => {},
  };
}

/** Gives a user's file to a control, and says what is wrong with it. */
export async function taken(control: Extract<Control, { kind: "drop" }>, file: File): Promise<void> {
  try {
    await control.take(file);
  } catch (error) {
    say(sentenceOf(error));
  }
}
