/** What is wrong with a package, in one sentence. */

/** A package that cannot be used: its file, the field, what was found, what was expected. */
export class BadPackage extends Error {
  constructor(file: string, field: string, found: string, expected: string) {
    super(`${file}: ${field} is ${found}; expected ${expected}.`);
    this.name = "BadPackage";
  }
}

/** What to do about most damage. */
export const AGAIN = "the whole package: export or download it again";
