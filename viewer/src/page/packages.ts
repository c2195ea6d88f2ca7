/** The packages of this page: inside it, or listed in `packages.json` beside it. */

import { Package } from "../package/package";

/** A package that the page can open. */
export interface Listed {
  /** Of the asset, or of the file. */
  key: string;
  /** Its address, relative to the page. */
  file?: string;
  /** The bytes, where they are inside the page. */
  content?: Uint8Array;
}

const FROM_DISK =
  "This page was opened from disk, where browsers let it read no other file; expected a web server, " +
  "or the one file that `tsuya export KEY --to html` writes.";

/** All packages of the page. Throws an Error where the list cannot be read. */
export async function listedPackages(): Promise<Listed[]> {
  const inside = document.querySelectorAll<HTMLScriptElement>('script[type="application/vnd.tsuya;base64"]');
  if (inside.length) {
    return [...inside].map((element) => ({ key: element.dataset.key ?? "package", content: decoded(element) }));
  }
  if (location.protocol === "file:") throw new Error(FROM_DISK);
  const answer = await fetch("packages.json", { cache: "no-store" });
  if (!answer.ok) throw new Error(`packages.json: answered with ${answer.status}; expected the list of packages.`);
  const list = (await answer.json()) as { packages: Listed[] };
  return list.packages;
}

/** Opens a package of the list. Throws BadPackage. */
export function opened({ key, file, content }: Listed): Promise<Package> {
  return Package.open(content ?? new URL(file ?? "", document.baseURI).href, key);
}

function decoded(element: HTMLScriptElement): Uint8Array {
  const text = atob((element.textContent ?? "").trim());
  return Uint8Array.from(text, (character) => character.charCodeAt(0));
}
