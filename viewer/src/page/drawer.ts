/** The drawer: figures beside the paper's, where it comes from, what its checks said. */

import type { Meta } from "../package/meta";
import { element, shownNumber, withUnits } from "./elements";

/** A table of figures, with the paper's where it states one. */
export function figureTable(figures: Meta["figures"]): HTMLElement {
  const rows = figures.map(({ name, value, units, paper }) =>
    element(
      "tr",
      {},
      element("th", { scope: "row" }, name),
      element("td", {}, withUnits(value, units)),
      element("td", {}, paper ? `${withUnits(paper.value, units)} ` : "–", ...(paper ? [where(paper.where)] : [])),
    ),
  );
  const head = ["", "here", "the paper"].map((text) => element("th", { scope: "col" }, text));
  return element("table", { class: "figures" }, element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...rows));
}

/** What `meta.json` says for people; `live` is filled by the page while it draws. */
export function drawerOf(meta: Meta, live: HTMLElement): HTMLElement {
  return element(
    "aside",
    { class: "drawer", "aria-label": "About this package" },
    element("h2", {}, meta.title),
    ...meta.source.map(({ name, licence }) => element("p", { class: "source" }, name, element("small", {}, licence))),
    section("Figures", meta.figures.length ? figureTable(meta.figures) : undefined),
    section("This picture", live),
    section("Parameters", parameterList(meta)),
    section("Made of", lineageList(meta)),
    section("Keys", keyList()),
  );
}

/** Pairs of a name and a value. */
export function pairs(values: Record<string, string | number>): Node[] {
  return Object.entries(values).flatMap(([name, value]) => [
    element("dt", {}, name),
    element("dd", {}, typeof value === "number" ? shownNumber(value) : value),
  ]);
}

function where(text: string): HTMLElement {
  return element("small", {}, text);
}

function section(title: string, content: HTMLElement | undefined): HTMLElement {
  return content ? element("section", {}, element("h3", {}, title), content) : element("section", { hidden: true });
}

function parameterList(meta: Meta): HTMLElement | undefined {
  const entries = Object.entries(meta.parameters).filter(([, { value }]) => ["number", "string", "boolean"].includes(typeof value));
  if (!entries.length) return undefined;
  const shown = entries.flatMap(([name, { value, units, meaning }]) => [
    element("dt", { title: meaning }, name),
    element("dd", {}, typeof value === "number" ? withUnits(value, units) : String(value)),
  ]);
  return element("dl", {}, ...shown);
}

function lineageList(meta: Meta): HTMLElement | undefined {
  if (!meta.lineage.length) return undefined;
  const steps = meta.lineage.map((step) => {
    const checks = Object.entries(step.checks ?? {}).map(([name, { passed, figure }]) =>
      element(
        "li",
        { class: passed ? "passed" : "failed" },
        name.replaceAll("_", " "),
        ...(typeof figure === "number" ? [element("small", {}, shownNumber(figure))] : []),
      ),
    );
    const title = element("strong", {}, `${step.asset}/${step.partition}`);
    return element("li", {}, title, element("small", {}, step.version), element("ul", { class: "checks" }, ...checks));
  });
  return element("ol", { class: "lineage" }, ...steps);
}

function keyList(): HTMLElement {
  return element(
    "dl",
    { class: "keys" },
    ...pairs({
      "drag, arrows": "turn, or drive",
      "wheel, + −": "nearer, farther",
      "right drag, Shift": "turn the light",
      "0": "the first view",
      C: "compare",
      I: "this drawer",
      F: "full screen",
      P: "save the picture",
      H: "hide all but the picture",
    }),
  );
}
