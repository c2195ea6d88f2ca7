/** The environments of a package, each made when it is first shown, and a person's own. */

import type { Package } from "../../package/package";
import { packedEnvironment, type Environment } from "./environment";

const PART = "environment_";

/** Environments by name. */
export class Environments {
  private readonly made = new Map<string, Environment>();

  private constructor(
    private readonly pkg: Package,
    /** Of the package, and those that were added. */
    readonly names: string[],
    /** The one that is drawn. */
    public shown: Environment,
  ) {}

  /** Those of a package; `first` is shown. Throws BadPackage. */
  static async of(pkg: Package, first: string): Promise<Environments> {
    const parts = Object.keys(pkg.meta.parts).filter((part) => part.startsWith(PART));
    const others = parts.map((part) => part.slice(PART.length)).filter((name) => name !== first);
    const shown = await read(pkg, first);
    const environments = new Environments(pkg, [first, ...others.sort()], shown);
    environments.made.set(first, shown);
    return environments;
  }

  /** Shows one of them, loading it if need be; whether that changes anything. Throws BadPackage. */
  async show(name: string): Promise<boolean> {
    const wanted = this.made.get(name) ?? (await read(this.pkg, name));
    this.made.set(name, wanted);
    const changes = this.shown !== wanted;
    this.shown = wanted;
    return changes;
  }

  /** Adds one, or puts it in place of another of its name. */
  add(name: string, environment: Environment): void {
    this.made.get(name)?.dispose();
    this.made.set(name, environment);
    if (!this.names.includes(name)) this.names.push(name);
  }

  /** Frees their textures. */
  dispose(): void {
    for (const environment of this.made.values()) environment.dispose();
  }
}

async function read(pkg: Package, name: string): Promise<Environment> {
  const [{ height, data }, lights] = await Promise.all([pkg.picture(PART + name), pkg.floats(`lights_${name}`)]);
  return packedEnvironment(height, data, lights);
}
