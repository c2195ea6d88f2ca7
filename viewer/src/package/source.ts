/** Where a package's bytes come from: a buffer, or an address, read by HTTP ranges. */

import { Reader } from "@zip.js/zip.js/lib/zip-core-native.js";
import { BadPackage } from "./bad_package";

const TAIL = 64 << 10;
const LARGEST = 2 ** 31;

/** Bytes of a zip: what zip.js reads from, with `ahead` to fetch a stretch in one request. */
export class Bytes extends Reader<void> {
  constructor(protected content: Uint8Array = new Uint8Array()) {
    super();
    this.size = content.length;
  }

  override async readUint8Array(offset: number, length: number): Promise<Uint8Array> {
    return this.content.subarray(offset, offset + length);
  }

  /** Fetches bytes that are about to be read, in one go; `release` when they were. */
  async ahead(_offset: number, _length: number): Promise<void> {}

  /** Forgets bytes that were fetched ahead. */
  release(_offset: number): void {}
}

/**
 * A package at an address. The end is fetched first, and then what is asked for; a host that knows
 * no ranges answers with the whole file, which is then kept.
 */
export class Remote extends Bytes {
  /** Bytes that were fetched. */
  fetched = 0;
  private start = 0;
  private whole = false;
  private readonly stretches = new Map<number, Uint8Array>();

  private constructor(
    private readonly address: string,
    private readonly name: string,
  ) {
    super();
  }

  /** Opens an address. Throws BadPackage where nothing is there. */
  static async open(address: string, name: string): Promise<Remote> {
    const remote = new Remote(address, name);
    const { content, total, whole } = await remote.fetch(`bytes=-${TAIL}`);
    remote.content = content;
    remote.whole = whole;
    remote.size = total;
    remote.start = total - content.length;
    return remote;
  }

  override async readUint8Array(offset: number, length: number): Promise<Uint8Array> {
    const end = Math.min(offset + length, this.size);
    if (offset >= this.start) return this.content.subarray(offset - this.start, end - this.start);
    for (const [start, kept] of this.stretches) {
      if (offset >= start && end <= start + kept.length) return kept.subarray(offset - start, end - start);
    }
    return this.range(offset, end);
  }

  override async ahead(offset: number, length: number): Promise<void> {
    if (offset >= this.start) return;
    const end = Math.min(offset + length, this.size);
    this.stretches.set(offset, await this.range(offset, end));
  }

  override release(offset: number): void {
    this.stretches.delete(offset);
  }

  private async range(offset: number, end: number): Promise<Uint8Array> {
    if (this.whole) return this.content.subarray(offset, end);
    const { content, whole } = await this.fetch(`bytes=${offset}-${end - 1}`);
    if (whole) {
      this.content = content;
      this.start = 0;
      this.whole = true;
      return content.subarray(offset, end);
    }
    return content;
  }

  private async fetch(range: string): Promise<{ content: Uint8Array; total: number; whole: boolean }> {
    let answer: Response;
    try {
      answer = await fetch(this.address, { headers: { Range: range } });
    } catch {
      throw new BadPackage(this.name, "address", "not answering", "the package there");
    }
    if (answer.status !== 206 && answer.status !== 200) {
      throw new BadPackage(this.name, "address", `answered with ${answer.status}`, "the package there");
    }
    const content = new Uint8Array(await answer.arrayBuffer());
    this.fetched += content.length;
    const stated = /\/(\d+)$/.exec(answer.headers.get("Content-Range") ?? "");
    const total = stated ? Number(stated[1]) : content.length;
    if (total > LARGEST) throw new BadPackage(this.name, "size", `${total} bytes`, `at most ${LARGEST}`);
    return { content, total, whole: answer.status === 200 };
  }
}
