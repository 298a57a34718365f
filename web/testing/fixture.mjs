// Serves the page with a model made up here, for tests and for work on the page: node testing/fixture.mjs --help
import { join } from "node:path";
import { bundlePage } from "../build.mjs";
import { bundleForNode } from "./bundle.mjs";

const folder = await bundleForNode(`fixture_${process.pid}`, ["testing/fixture_server.ts"]);
const { serve } = await import(join(folder, "testing/fixture_server.mjs"));
await serve(await bundlePage(), process.argv.slice(2));
