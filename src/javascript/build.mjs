// Makes the folder of the npm package:
//     node build.mjs LIBRARY.wasm FOLDER

import { copyFileSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

import { readHeader, typesOf } from "./header.mjs";

const [wasm, folder] = process.argv.slice(2);
if (!folder) throw new Error("node build.mjs LIBRARY.wasm FOLDER");
const here = fileURLToPath(new URL(".", import.meta.url));
const header = readFileSync(join(here, "../../include/supple.h"), "utf8");
mkdirSync(folder, { recursive: true });
for (const name of ["index.js", "index.d.ts", "library.js", "mesh.js", "simulation.js", "README.md", "LICENSE-MIT", "LICENSE-APACHE"]) {
    copyFileSync(join(here, name), join(folder, name));
}
const { devDependencies, ...manifest } = JSON.parse(readFileSync(join(here, "package.json"), "utf8"));
writeFileSync(join(folder, "package.json"), `${JSON.stringify(manifest, null, 2)}\n`);
writeFileSync(join(folder, "interface.js"), `// Made by build.mjs from include/supple.h.\nexport default ${JSON.stringify(readHeader(header))};\n`);
writeFileSync(join(folder, "interface.d.ts"), typesOf(header));
copyFileSync(wasm, join(folder, "supple.wasm"));
