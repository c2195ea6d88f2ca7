/** All packages of the page: what they were made of, what they show, figures beside the papers'. */

import type { Package } from "../package/package";
import { written } from "./address";
import { figureTable } from "./drawer";
import { element } from "./elements";
import { opened, type Listed } from "./packages";
import { partCanvas } from "./pictures";
import { sentenceOf } from "./sentences";

const FIGURES_SHOWN = 3;
const NOT_SHOWN = "what cannot be shown";

/** The gallery; `done` is settled when each package has been read, or has said why not. */
export function gallery(listed: readonly Listed[]): { element: HTMLElement; done: Promise<void> } {
  const groups = element("div", { class: "groups" });
  const table = element("section", { class: "all-figures", hidden: true }, element("h2", {}, "Figures"));
  const page = element(
    "main",
    { class: "gallery" },
    element("header", {}, element("h1", {}, "Tsuya"), element("p", {}, "Measured appearance, live in the browser.")),
    groups,
    table,
  );
  const done = Promise.all(listed.map(async (each, place) => fill(numbered(cardOf(each), place), each, groups, table)));
  return { element: page, done: done.then(() => undefined) };
}

function cardOf({ key }: Listed): HTMLAnchorElement {
  return element("a", { class: "card", href: written({ key }) }, element("div", { class: "poster" }));
}

async function fill(card: HTMLAnchorElement, listed: Listed, groups: HTMLElement, table: HTMLElement): Promise<void> {
  try {
    const pkg = await opened(listed);
    insert(group(groups, pkg.meta.system), card);
    await showPackage(card, pkg);
    if (pkg.meta.figures.length) {
      table.hidden = false;
      const figures = element("div", {}, element("h3", {}, pkg.meta.title), figureTable(pkg.meta.figures));
      insert(table, numbered(figures, Number(card.dataset.place)));
    }
  } catch (error) {
    insert(group(groups, NOT_SHOWN), card);
    card.removeAttribute("href");
    card.replaceChildren(element("p", { class: "broken", role: "alert" }, sentenceOf(error)));
  }
}

/** An element that knows its place: packages are read in any order, and shown in that of the list. */
function numbered<T extends HTMLElement>(made: T, place: number): T {
  made.dataset.place = String(place);
  return made;
}

function insert(parent: HTMLElement, made: HTMLElement): void {
  const isAfter = (child: Element) => Number((child as HTMLElement).dataset.place ?? -1) > Number(made.dataset.place);
  parent.insertBefore(made, [...parent.children].find(isAfter) ?? null);
}

function group(groups: HTMLElement, system: string): HTMLElement {
  const name = system.replaceAll("_", " ");
  const found = [...groups.children].find((child) => (child as HTMLElement).dataset.system === system);
  if (found) return found.querySelector(".cards") as HTMLElement;
  const cards = element("div", { class: "cards" });
  const made = element("section", {}, element("h2", {}, name), cards);
  made.dataset.system = system;
  const after = [...groups.children].find((child) => ((child as HTMLElement).dataset.system ?? "") > system);
  groups.insertBefore(made, after ?? null);
  return cards;
}

async function showPackage(card: HTMLAnchorElement, pkg: Package): Promise<void> {
  const { title, figures, source } = pkg.meta;
  const picture = card.querySelector(".poster") as HTMLElement;
  const facts = figures.slice(0, FIGURES_SHOWN).map(({ name, value, units, paper }) => {
    const beside = paper ? element("small", {}, ` paper ${Number(paper.value.toPrecision(3))}`) : "";
    const shown = units === "1" ? "" : ` ${units}`;
    return element("li", {}, element("span", {}, name), element("b", {}, `${Number(value.toPrecision(3))}${shown}`, beside));
  });
  card.append(
    element("h3", {}, title),
    element("p", {}, source.map(({ name, licence }) => `${name} (${licence})`).join(", ")),
    element("ul", {}, ...facts),
  );
  const [poster, input] = await Promise.all([
    partCanvas(pkg, "poster", `${title}, drawn`),
    partCanvas(pkg, "input", `${title}: what it was made of`),
  ]);
  if (poster) picture.append(poster);
  if (input) picture.append(element("figure", {}, input, element("figcaption", {}, "from this")));
}
