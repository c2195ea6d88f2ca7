/** All packages of the page: what they were made of, what they show, figures beside the papers'. */

import type { Package } from "../package/package";
import { written } from "./address";
import { figureTable } from "./drawer";
import { element, withUnits } from "./elements";
import { opened, type Listed } from "./packages";
import { partCanvas } from "./pictures";
import { sentenceOf } from "./sentences";

const FIGURES_SHOWN = 3;

/** The gallery; `done` is settled when each package has been read, or has said why not. */
export function gallery(listed: readonly Listed[]): { element: HTMLElement; done: Promise<void> } {
  const cards = element("div", { class: "cards" });
  const table = element("section", { class: "all-figures", hidden: true }, element("h2", {}, "Figures"));
  const page = element(
    "main",
    { class: "gallery" },
    element("header", {}, element("h1", {}, "Tsuya"), element("p", {}, "Measured appearance, live in the browser.")),
    cards,
    table,
  );
  const done = Promise.all(listed.map(async (each, place) => fill(each, String(place).padStart(6, "0"), cards, table)));
  return { element: page, done: done.then(() => undefined) };
}

/** Reads a package and puts its card, and its figures, in their place: by system, then as listed. */
async function fill(listed: Listed, place: string, cards: HTMLElement, table: HTMLElement): Promise<void> {
  const card = element("a", { class: "card", href: written({ key: listed.key }) }, element("div", { class: "poster" }));
  try {
    const pkg = await opened(listed);
    const { system, title, figures } = pkg.meta;
    insert(cards, card, `${system} ${place}`);
    await showPackage(card, pkg);
    if (figures.length) {
      table.hidden = false;
      insert(table, element("div", {}, element("h3", {}, title), figureTable(figures)), `${system} ${place}`);
    }
  } catch (error) {
    card.removeAttribute("href");
    card.replaceChildren(element("p", { class: "broken", role: "alert" }, sentenceOf(error)));
    insert(cards, card, `~ ${place}`); // behind all systems
  }
}

/** Packages are read in any order, and shown in one. */
function insert(parent: HTMLElement, made: HTMLElement, order: string): void {
  made.dataset.order = order;
  const isAfter = (child: Element) => ((child as HTMLElement).dataset.order ?? "") > order;
  parent.insertBefore(made, [...parent.children].find(isAfter) ?? null);
}

async function showPackage(card: HTMLAnchorElement, pkg: Package): Promise<void> {
  const { system, title, figures, source } = pkg.meta;
  const picture = card.querySelector(".poster") as HTMLElement;
  const facts = figures.slice(0, FIGURES_SHOWN).map(({ name, value, units, paper }) => {
    const beside = paper ? element("small", {}, ` paper ${withUnits(paper.value, units)}`) : "";
    return element("li", {}, element("span", {}, name), element("b", {}, withUnits(value, units), beside));
  });
  card.append(
    element("small", {}, system.replaceAll("_", " ")),
    element("h3", {}, title),
    element("p", {}, source.map(({ name }) => name).join(", ")),
    element("ul", {}, ...facts),
  );
  const [poster, input] = await Promise.all([
    partCanvas(pkg, "poster", `${title}, drawn`),
    partCanvas(pkg, "input", `${title}: what it was made of`),
  ]);
  if (poster) picture.append(poster);
  if (input) picture.append(element("figure", {}, input, element("figcaption", {}, "from this")));
}
