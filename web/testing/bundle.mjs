// Bundles TypeScript for node beside the installed packages and returns where it is.
import { build } from "esbuild";
import { mkdir, readdir, rm } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

export const WEB = join(dirname(fileURLToPath(import.meta.url)), "..");

/** `name`: of the folder that is filled; sources are relative to web/. */
export async function bundleForNode(name, sources) {
  const folder = join(WEB, "node_modules/.cache/housemartin", name);
  await rm(folder, { recursive: true, force: true });
  await mkdir(folder, { recursive: true });
  await build({
    entryPoints: sources.map(source => join(WEB, source)), bundle: true, platform: "node", format: "esm", target: "node18",
    outdir: folder, outbase: WEB, outExtension: { ".js": ".mjs" }, external: ["ws", "esbuild", "meshoptimizer", "meshoptimizer/*", "three"], sourcemap: "inline",
    logLevel: "warning",
  });
  return folder;
}

/** All files below `folder` of web/ whose names end like this. */
export async function findSources(folder, ending) {
  const entries = await readdir(join(WEB, folder), { withFileTypes: true });
  const found = await Promise.all(entries.map(entry => entry.isDirectory() ? findSources(`${folder}/${entry.name}`, ending)
    : entry.name.endsWith(ending) ? [`${folder}/${entry.name}`] : []));
  return found.flat().sort();
}
