// Makes the page: one HTML file with the kernel, the liver, three.js and the style in it, so that it works from any
// folder or server.
//     node build.mjs LIBRARY.wasm LIVER.json OUT.html

import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";

import { build } from "esbuild";

import { readHeader } from "../../src/javascript/header.mjs";

const [wasm, liver, out] = process.argv.slice(2);
if (!out) throw new Error("node build.mjs LIBRARY.wasm LIVER.json OUT.html");
const here = fileURLToPath(new URL(".", import.meta.url));
const read = (path, ...options) => readFileSync(join(here, path), ...options);
const built = mkdtempSync(join(tmpdir(), "supple-page-"));
const put = (name, contents) => writeFileSync(join(built, name), contents);

/** What the page imports as "built:NAME". */
const fromBuilt = {
    name: "built",
    setup: ({ onResolve }) =>
        onResolve({ filter: /^built:/ }, ({ path }) => ({ path: join(built, path.slice("built:".length)) })),
};
async function bundle(entry) {
    const {
        outputFiles: [{ text }],
    } = await build({
        entryPoints: [join(here, entry)],
        bundle: true,
        minify: true,
        write: false,
        format: "iife",
        target: "es2022",
        charset: "utf8",
        legalComments: "inline",
        plugins: [fromBuilt],
        loader: { ".gz": "binary" },
        logLevel: "warning",
    });
    return text;
}

try {
    put("liver.json", readFileSync(liver));
    put("header.json", JSON.stringify(readHeader(read("../../include/supple.h", "utf8"))));
    put("supple.wasm.gz", gzipSync(readFileSync(wasm), { level: 9 }));
    put("worker.txt", await bundle("worker.js"));
    const script = await bundle("main.js");
    const page = read("index.html", "utf8")
        .replace("/* style */", () => read("style.css", "utf8"))
        .replace("/* script */", () => script);
    writeFileSync(out, page);
} finally {
    rmSync(built, { recursive: true });
}
