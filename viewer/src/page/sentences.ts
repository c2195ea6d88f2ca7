/** Sentences that the page says: instead of a picture, or for some seconds below it. */

import { element } from "./elements";

const SECONDS = 8;
let said: HTMLElement | undefined;

/** Says a sentence in the place of a picture. */
export function sentencePage(sentence: string, way?: Node): HTMLElement {
  return element("main", { class: "sentence", role: "alert" }, element("p", {}, sentence), ...(way ? [way] : []));
}

/** Says a sentence for some seconds. */
export function say(sentence: string): void {
  said?.remove();
  const shown = element("div", { class: "said", role: "status" }, sentence);
  said = document.body.appendChild(shown);
  window.setTimeout(() => shown.remove(), 1000 * SECONDS);
}

/** What an error says, as one sentence. */
export function sentenceOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}
