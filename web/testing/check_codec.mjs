// node testing/check_codec.mjs FOLDER: see check_codec.ts
import { join } from "node:path";
import { bundleForNode } from "./bundle.mjs";

const folder = await bundleForNode("codec", ["testing/check_codec.ts"]);
const { check } = await import(join(folder, "testing/check_codec.mjs"));
await check(process.argv[2]);
