// Runs the unit tests (src/**/*_test.ts) with node's own runner: node test.mjs
import { spawnSync } from "node:child_process";
import { join } from "node:path";
import { bundleForNode, findSources } from "./testing/bundle.mjs";

const sources = await findSources("src", "_test.ts"), folder = await bundleForNode("tests", sources);
const files = sources.map(source => join(folder, source.replace(/\.ts$/, ".mjs")));
process.exit(spawnSync(process.execPath, ["--enable-source-maps", "--test", "--test-reporter=tap", ...files], { stdio: "inherit" }).status ?? 1);
