/** The reader against the packages of `storage/packages/conformance.py`, which `TSUYA_CONFORMANCE` names. */

import { createHash } from "node:crypto";
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { describe, expect, it } from "vitest";
import { BadPackage } from "../src/package/bad_package";
import { Package } from "../src/package/package";

const folder = process.env.TSUYA_CONFORMANCE;

describe.skipIf(!folder)("packages of the conformance suite", () => {
  const files = (kind: string) => (folder ? readdirSync(join(folder, kind)) : []);
  const open = (kind: string, file: string) => Package.open(readFileSync(join(folder ?? "", kind, file)), file);
  const expected = folder ? JSON.parse(readFileSync(join(folder, "expected.json"), "utf8")) : {};

  it.each(files("good"))("reads %s", async (file) => {
    const pkg = await open("good", file);
    expect(await digests(pkg)).toEqual(expected[file]);
  });

  it.each(files("bad"))("refuses %s in one sentence", async (file) => {
    const reading = open("bad", file).then(digests);
    await expect(reading).rejects.toBeInstanceOf(BadPackage);
    const sentence = await reading.catch((error: Error) => error.message);
    expect(sentence).toMatch(new RegExp(`^${file}: .* is .*; expected .*\\.$`));
  });
});

async function digests(pkg: Package): Promise<Record<string, string>> {
  const found: Record<string, string> = {};
  for (const [name, { kind }] of Object.entries(pkg.meta.parts)) {
    if (kind === "array") found[name] = digest(await pkg.array(name));
    if (kind === "picture") found[name] = digest((await pkg.picture(name)).data);
    if (kind === "textures") found[name] = digest((await pkg.textures(name)).data);
    if (kind !== "mesh") continue;
    const { vertices, triangles, normals, uvs, attributes } = await pkg.mesh(name);
    found[`${name}/POSITION`] = digest(vertices);
    found[`${name}/indices`] = digest(triangles);
    if (normals) found[`${name}/NORMAL`] = digest(normals);
    if (uvs) found[`${name}/TEXCOORD_0`] = digest(uvs.map((value, i) => (i % 2 ? 1 - value : value)));
    for (const [key, { values }] of Object.entries(attributes)) found[`${name}/_${key}`] = digest(values);
  }
  return found;
}

function digest(values: ArrayBufferView): string {
  return createHash("sha256").update(new Uint8Array(values.buffer, values.byteOffset, values.byteLength)).digest("hex");
}
