import { afterEach, describe, expect, it, vi } from "vitest";
import { Remote } from "../src/package/source";

const content = Uint8Array.from({ length: 200_000 }, (_, i) => (i * 31) % 251);
const asked: string[] = [];

/** A host that knows ranges, or does not. */
function host(ranges: boolean): void {
  asked.length = 0;
  vi.stubGlobal("fetch", async (_address: string, { headers }: { headers: { Range: string } }) => {
    asked.push(headers.Range);
    if (!ranges) return new Response(content);
    const [, from, to] = /^bytes=(\d*)-(\d*)$/.exec(headers.Range) ?? [];
    const start = from === "" ? content.length - Number(to) : Number(from);
    const end = from === "" ? content.length : Number(to) + 1;
    const stated = { "Content-Range": `bytes ${start}-${end - 1}/${content.length}` };
    return new Response(content.slice(start, end), { status: 206, headers: stated });
  });
}

afterEach(() => vi.unstubAllGlobals());

describe("a package at an address", () => {
  it("is read by ranges: the end first, then what is asked for, once", async () => {
    host(true);
    const remote = await Remote.open("a.tsuya", "a");
    await remote.ahead(1000, 500);
    expect(await remote.readUint8Array(1100, 50)).toEqual(content.slice(1100, 1150));
    expect(await remote.readUint8Array(1200, 300)).toEqual(content.slice(1200, 1500));
    expect(await remote.readUint8Array(199_990, 10)).toEqual(content.slice(199_990));
    expect(asked).toEqual(["bytes=-65536", "bytes=1000-1499"]);
    expect(remote.size).toBe(content.length);
    remote.release(1000);
    await remote.readUint8Array(1100, 50);
    expect(asked[2]).toBe("bytes=1100-1149");
  });

  it("is fetched as a whole, once, where the host knows no ranges", async () => {
    host(false);
    const remote = await Remote.open("a.tsuya", "a");
    await remote.ahead(1000, 500);
    expect(await remote.readUint8Array(1100, 50)).toEqual(content.slice(1100, 1150));
    expect(asked).toHaveLength(1);
  });

  it("says what the host answered", async () => {
    vi.stubGlobal("fetch", async () => new Response("", { status: 404 }));
    await expect(Remote.open("a.tsuya", "a")).rejects.toThrow("a: address is answered with 404; expected");
  });
});
