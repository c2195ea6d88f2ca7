import { readFileSync } from "node:fs";
import { defineConfig, type Plugin } from "vitest/config";

const SHADER = ".glsl?raw";

/** The stage's shaders, without what only people read. */
function shadersWithoutComments(): Plugin {
  return {
    name: "shaders-without-comments",
    enforce: "pre",
    load(id) {
      if (!id.endsWith(SHADER)) return undefined;
      const text = readFileSync(id.slice(0, -"?raw".length), "utf8");
      const lines = text.split("\n").map((line) => line.replace(/\/\/.*$/, "").trim());
      return `export default ${JSON.stringify(`${lines.filter(Boolean).join("\n")}\n`)};`;
    },
  };
}

// One page, one script, one style sheet, named without hashes: `tsuya export --to html` puts them
// into one file. Paths are relative, so that the page runs below any address.
export default defineConfig({
  plugins: [shadersWithoutComments()],
  base: "./",
  build: {
    target: "es2022",
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 900,
    modulePreload: false,
    rolldownOptions: {
      // zip.js says of no module that it only declares: its writer would come along.
      treeshake: { moduleSideEffects: (id) => !id.endsWith("/zip-writer.js") },
      output: {
        codeSplitting: false,
        entryFileNames: "viewer.js",
        assetFileNames: "viewer[extname]",
      },
    },
  },
  test: { include: ["tests/**/*.test.ts"], environment: "node" },
});
