/** The zip of a package: entries by name, each with its size checked before it is unpacked. */

import { configure, Uint8ArrayWriter, ZipReader, type FileEntry } from "@zip.js/zip.js/lib/zip-core-native.js";
import { AGAIN, BadPackage } from "./bad_package";
import { Bytes } from "./source";

configure({ useWebWorkers: false });

/** Bytes of a part, unpacked. */
export const LARGEST_PART = 1 << 30;
/** Times a part may be larger than what is stored of it: deflate cannot do more. */
const MOST_UNFOLDED = 1100;
const HEADER_SLACK = 1024;

/** An open zip. */
export class Archive {
  private constructor(
    private readonly bytes: Bytes,
    private readonly entries: ReadonlyMap<string, FileEntry>,
    /** Of the file, for errors. */
    readonly name: string,
  ) {}

  /** Reads the directory of a zip. Throws BadPackage for what is no whole zip. */
  static async open(bytes: Bytes, name: string): Promise<Archive> {
    const entries = new Map<string, FileEntry>();
    try {
      for (const entry of await new ZipReader(bytes).getEntries()) {
        if (!entry.directory) entries.set(entry.filename, entry);
      }
    } catch (error) {
      if (error instanceof BadPackage) throw error;
      throw new BadPackage(name, "file", "no whole zip", "a .tsuya package, complete");
    }
    return new Archive(bytes, entries, name);
  }

  /** Bytes of an entry, unpacked; undefined where there is no such entry. */
  sizeOf(file: string): number | undefined {
    return this.entries.get(file)?.uncompressedSize;
  }

  /** An entry's bytes. Throws BadPackage for one that is missing, damaged or absurdly large. */
  async read(file: string, largest: number): Promise<Uint8Array<ArrayBuffer>> {
    const entry = this.entries.get(file);
    if (!entry) throw new BadPackage(this.name, file, "missing", AGAIN);
    const { uncompressedSize: size, compressedSize: stored, offset } = entry;
    const allowed = Math.min(largest, MOST_UNFOLDED * Math.max(stored, 1));
    if (size > allowed) {
      throw new BadPackage(this.name, file, `${size} bytes`, `at most ${allowed} bytes`);
    }
    let content: Uint8Array;
    try {
      await this.bytes.ahead(offset, stored + HEADER_SLACK);
      content = await entry.getData(new Uint8ArrayWriter(), { checkSignature: true });
    } catch (error) {
      if (error instanceof BadPackage) throw error;
      throw new BadPackage(this.name, file, "damaged", AGAIN);
    } finally {
      this.bytes.release(offset);
    }
    if (content.length !== size) throw new BadPackage(this.name, file, "not as long as announced", AGAIN);
    return content as Uint8Array<ArrayBuffer>;
  }
}
