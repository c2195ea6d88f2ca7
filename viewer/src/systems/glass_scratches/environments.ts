/** The environments of a package, each made when it is first shown, and a person's own. */

import type { Package } from "../../package/package";
import { Environment, packedLights, packedMap } from "./environment";
import { typicalLuminance, type Lights, type Radiance } from "./lights";

const PART = "environment_";

/** Environments by name. All are exposed to the same typical luminance. */
export class Environments {
  private readonly made = new Map<string, Environment>();

  private constructor(
    private readonly pkg: Package,
    /** Of the package, and those that were added. */
    readonly names: string[],
    /** The one that is drawn. */
    public shown: Environment,
    /** Their typical luminance, exposed. */
    private readonly level: number,
  ) {}

  /** Those of a package; `first` is shown, with an exposure. Throws BadPackage. */
  static async of(pkg: Package, first: string, exposure: number): Promise<Environments> {
    const parts = Object.keys(pkg.meta.parts).filter((part) => part.startsWith(PART));
    const others = parts.map((part) => part.slice(PART.length)).filter((name) => name !== first);
    const { map, lights } = await read(pkg, first);
    const shown = new Environment(map, exposure, lights);
    const level = exposure * typicalLuminance(map);
    const environments = new Environments(pkg, [first, ...others.sort()], shown, level);
    environments.made.set(first, shown);
    return environments;
  }

  /** Shows one of them, loading it if need be; whether that changes anything. Throws BadPackage. */
  async show(name: string): Promise<boolean> {
    const wanted = this.made.get(name) ?? this.exposed(await read(this.pkg, name));
    this.made.set(name, wanted);
    const changes = this.shown !== wanted;
    this.shown = wanted;
    return changes;
  }

  /** Adds one, or puts it in place of another of its name. */
  add(name: string, map: Radiance): void {
    this.made.get(name)?.dispose();
    this.made.set(name, this.exposed({ map }));
    if (!this.names.includes(name)) this.names.push(name);
  }

  private exposed({ map, lights }: Lit): Environment {
    return new Environment(map, this.level / typicalLuminance(map), lights);
  }

  /** Frees their textures. */
  dispose(): void {
    for (const environment of this.made.values()) environment.dispose();
  }
}

interface Lit {
  map: Radiance;
  lights?: Lights;
}

async function read(pkg: Package, name: string): Promise<Lit> {
  const [{ height, data }, lights] = await Promise.all([pkg.picture(PART + name), pkg.floats(`lights_${name}`)]);
  return { map: packedMap(height, data), lights: packedLights(lights) };
}
