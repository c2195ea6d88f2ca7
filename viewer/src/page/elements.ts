/** Elements of the page, made in one line. */

/** Properties of an element, `class` and `aria` attributes among them. */
export type Properties = Record<string, unknown>;

/** An element with properties and children; what begins with a dash or `aria` is an attribute. */
export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Properties = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name === "class") made.className = String(value);
    else if (name.includes("-") || name === "role" || name === "for") made.setAttribute(name, String(value));
    else Object.assign(made, { [name]: value });
  }
  made.append(...children);
  return made;
}

const SIGNS = {
  back: "M15 5l-7 7 7 7",
  light: "M12 8a4 4 0 1 0 0 8 4 4 0 0 0 0-8zM12 2v3M12 19v3M2 12h3M19 12h3M5 5l2 2M17 17l2 2M19 5l-2 2M7 17l-2 2",
  save: "M12 4v11M7 10l5 5 5-5M5 20h14",
  full: "M9 4H4v5M15 4h5v5M9 20H4v-5M15 20h5v-5",
  about: "M12 11v6M12 7v.5M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18z",
};

/** A sign, drawn in the colour of the text. */
export function sign(name: keyof typeof SIGNS): SVGSVGElement {
  const drawn = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  drawn.setAttribute("viewBox", "0 0 24 24");
  drawn.setAttribute("class", "sign");
  path.setAttribute("d", SIGNS[name]);
  drawn.append(path);
  return drawn;
}

/** A button with a sign, which `title` explains. */
export function button(name: keyof typeof SIGNS, title: string, press: () => void): HTMLButtonElement {
  return element("button", { type: "button", title, "aria-label": title, onclick: press }, sign(name));
}

/** A number as a person reads it: four digits, no more. */
export function shownNumber(value: number): string {
  if (Number.isInteger(value) && Math.abs(value) < 1e6) return value.toLocaleString("en-GB");
  const text = value.toPrecision(4);
  return text.includes("e") ? text : String(Number(text));
}

/** A number with its units, which are left out where they are "1"; bytes are told in kB, MB or GB. */
export function withUnits(value: number, units: string | undefined): string {
  if (units === "byte" || units === "bytes") return shownBytes(value);
  return units && units !== "1" ? `${shownNumber(value)} ${units}` : shownNumber(value);
}

function shownBytes(value: number): string {
  const power = Math.min(3, Math.floor(Math.log10(Math.max(value, 1)) / 3));
  return `${shownNumber(value / 1000 ** power)} ${["bytes", "kB", "MB", "GB"][power]}`;
}
