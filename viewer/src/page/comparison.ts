/** The comparison: a line to drag, right of it another package or a frame of the stage. */

import type { ReferenceView } from "../package/meta";
import { element } from "./elements";

/** What can stand to the right of the line. */
export type Other = { kind: "view"; view: ReferenceView } | { kind: "package"; key: string };

/** The line; `split` in [0, 1] is called back while it is dragged. */
export function line(split: (part: number) => void): { element: HTMLElement; put(part: number): void } {
  const handle = element("div", {
    class: "line",
    tabIndex: 0,
    role: "slider",
    "aria-label": "Comparison: drag, or use the arrow keys",
    "aria-valuemin": 0,
    "aria-valuemax": 100,
  });
  let part = 0.5;
  const put = (to: number) => {
    part = Math.min(1, Math.max(0, to));
    handle.style.left = `${100 * part}%`;
    handle.setAttribute("aria-valuenow", String(Math.round(100 * part)));
    split(part);
  };
  handle.onpointerdown = (event) => handle.setPointerCapture(event.pointerId);
  handle.onpointermove = (event) => {
    if (!event.buttons) return;
    const box = (handle.parentElement as HTMLElement).getBoundingClientRect();
    put((event.clientX - box.left) / box.width);
  };
  handle.onkeydown = (event) => {
    const step = event.key === "ArrowLeft" ? -0.02 : event.key === "ArrowRight" ? 0.02 : 0;
    if (!step) return;
    event.preventDefault();
    put(part + step);
  };
  return { element: handle, put };
}

/** A menu of what can be compared with; `choose` gets undefined for nothing. */
export function comparisonMenu(
  views: readonly ReferenceView[],
  keys: readonly string[],
  choose: (other: Other | undefined) => void,
): HTMLSelectElement {
  const others: Other[] = [
    ...views.map((view): Other => ({ kind: "view", view })),
    ...keys.map((key): Other => ({ kind: "package", key })),
  ];
  const name = (other: Other) => (other.kind === "view" ? `the stage's frame: ${other.view.name}` : other.key);
  const menu = element(
    "select",
    { class: "comparison", title: "Compare with", "aria-label": "Compare with" },
    element("option", { value: "" }, "compare with …"),
    ...others.map((other, i) => element("option", { value: String(i) }, name(other))),
  );
  menu.onchange = () => choose(menu.value === "" ? undefined : others[Number(menu.value)]);
  return menu;
}
