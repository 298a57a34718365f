// Bundles the page into build/web and writes it, compressed, as a C++ file that the program embeds.
//   node build.mjs [--out DIRECTORY]
import { build } from "esbuild";
import { createHash } from "node:crypto";
import { mkdir, readFile, rm, writeFile } from "node:fs/promises";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

const WEB = dirname(fileURLToPath(import.meta.url));
const MOST_BYTES = 250_000;  // of all files, compressed
const TYPES = { js: "text/javascript; charset=utf-8", css: "text/css; charset=utf-8", html: "text/html; charset=utf-8", svg: "image/svg+xml", txt: "text/plain; charset=utf-8" };
// Path of the page -> source.
const BUNDLES = { "page.js": "src/main.ts", "live_worker.js": "src/live/live_worker.ts", "pilot_worker.js": "src/pilot/pilot_worker.ts", "page.css": "src/page.css" };
const LIBRARIES = ["three", "uplot", "meshoptimizer"];  // what is bundled; their licences go along
const COPIES = { "index.html": "src/index.html", "icon.svg": "src/icon.svg" };

/** Path -> bytes of every file of the page. */
export async function bundlePage() {
  const files = new Map();
  for (const [path, source] of Object.entries(BUNDLES)) {
    const { outputFiles } = await build({
      entryPoints: [join(WEB, source)], bundle: true, minify: true, write: false, format: "esm", target: ["es2022"],
      legalComments: "none", logLevel: "warning", absWorkingDir: WEB,
    });
    files.set(path, Buffer.from(outputFiles[0].contents));
  }
  for (const [path, source] of Object.entries(COPIES)) files.set(path, await readFile(join(WEB, source)));
  files.set("licences.txt", Buffer.from((await Promise.all(LIBRARIES.map(licenceOf))).join("\n")));
  return files;
}

async function licenceOf(name) {
  const folder = join(WEB, "node_modules", name), { version } = JSON.parse(await readFile(join(folder, "package.json"), "utf8"));
  const whole = await readFile(join(folder, "LICENSE"), "utf8").catch(() => readFile(join(folder, "LICENSE.md"), "utf8"));
  return `${name} ${version}\n\n${whole}`;
}

const literal = bytes => {
  const lines = [];
  for (let i = 0; i < bytes.length; i += 32) lines.push(Array.from(bytes.subarray(i, i + 32)).join(","));
  return lines.join(",\n");
};

/** The C++ file: hm::page_files() of hm/station/page_files.hpp. */
function sourceOf(files) {
  const entries = [...files].map(([path, bytes], i) => {
    const etag = createHash("sha256").update(bytes).digest("hex").slice(0, 16), compressed = gzipSync(bytes, { level: 9 });
    return { path, type: TYPES[path.split(".").pop()], etag, compressed, name: `kFile${i}` };
  });
  const arrays = entries.map(e => `constexpr unsigned char ${e.name}[] = {\n${literal(e.compressed)}};\n`).join("");
  const rows = entries.map(e => `    {"/${e.path}", "${e.type}", "${e.etag}", ${e.name}},\n`).join("");
  const text = `// Written by web/build.mjs.\n#include "hm/station/page_files.hpp"\n\nnamespace hm {\nnamespace {\n\n${arrays}\n` +
    `constexpr PageFile kFiles[] = {\n${rows}};\n\n}  // namespace\n\nstd::span<const PageFile> page_files() { return kFiles; }\n\n}  // namespace hm\n`;
  return { text, bytes: entries.reduce((sum, e) => sum + e.compressed.length, 0), entries };
}

async function main() {
  const at = process.argv.indexOf("--out"), out = at > 0 ? resolve(process.argv[at + 1]) : resolve(WEB, "../build/web");
  const files = await bundlePage(), { text, bytes, entries } = sourceOf(files), page = join(out, "page");
  if (bytes > MOST_BYTES) throw new Error(`the page has ${bytes} bytes compressed, more than ${MOST_BYTES}`);
  await rm(page, { recursive: true, force: true });
  await mkdir(page, { recursive: true });
  for (const [path, content] of files) await writeFile(join(page, path), content);
  // Left alone where it is the same: the program is not compiled again.
  const source = join(out, "page_files.cpp"), old = await readFile(source, "utf8").catch(() => "");
  if (old !== text) await writeFile(source, text);
  for (const e of entries) console.log(`${String(e.compressed.length).padStart(8)} ${e.path}`);
  console.log(`${String(bytes).padStart(8)} in all, compressed`);
}

if (process.argv[1] === fileURLToPath(import.meta.url)) await main();
