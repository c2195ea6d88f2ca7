/** Which tiles of road are held: loaded before they are needed, dropped when others need their place. */

/** Tiles that are held at the same time, at most. */
export const MOST_RESIDENT = 8;

/** What was loaded of a tile. */
export interface Resident {
  dispose(): void;
}

/** Tiles by number, no more than `most` at a time, loaded one after the other. */
export class Residents<T extends Resident> {
  /** Those that are held. */
  readonly held = new Map<number, T>();
  /** What went wrong, tile by tile; whoever says it takes it away. */
  readonly errors: unknown[] = [];
  /** Tiles that were loaded and dropped since the beginning. */
  loads = 0;
  drops = 0;

  private readonly broken = new Set<number>();
  private wanted: readonly number[] = [];
  private loading: Promise<void> | undefined;
  private ended = false;

  /** load: one tile; changed: called when there is one more. */
  constructor(
    private readonly load: (number: number) => Promise<T>,
    private readonly changed: () => void,
    readonly most = MOST_RESIDENT,
  ) {}

  /** Settled when these tiles are held, the most urgent first, but for those that are broken. */
  want(numbers: readonly number[]): Promise<void> {
    this.wanted = numbers.slice(0, this.most);
    this.loading ??= this.loadWanted().finally(() => (this.loading = undefined));
    return this.loading;
  }

  /** Drops all. */
  dispose(): void {
    this.ended = true;
    for (const number of [...this.held.keys()]) this.drop(number);
  }

  private async loadWanted(): Promise<void> {
    while (!this.ended) {
      const next = this.wanted.find((number) => !this.held.has(number) && !this.broken.has(number));
      if (next === undefined) return;
      try {
        this.take(next, await this.load(next));
      } catch (error) {
        this.broken.add(next);
        this.errors.push(error);
      }
      this.changed();
    }
  }

  private take(number: number, tile: T): void {
    this.loads++;
    // Those that were wanted longest ago go first; a Map keeps the order in which tiles came.
    for (const other of [...this.held.keys()]) {
      if (this.held.size < this.most) break;
      if (!this.wanted.includes(other)) this.drop(other);
    }
    if (this.ended || this.held.size >= this.most) {
      this.drops++;
      tile.dispose();
    } else {
      this.held.set(number, tile);
    }
  }

  private drop(number: number): void {
    this.held.get(number)?.dispose();
    this.held.delete(number);
    this.drops++;
  }
}
