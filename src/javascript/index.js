// The package: the kernel with what is needed to call it.

import header from "./interface.js";
import { Library } from "./library.js";

export { Library, Refusal } from "./library.js";
export { readMesh } from "./mesh.js";
export { METHODS, Simulation } from "./simulation.js";

/**
 * The library, with memory of its own.
 * @param {WebAssembly.Module | BufferSource} [given] supple.wasm, where the page has fetched it by itself
 */
export async function load(given) {
    const bytes = given ?? await read(new URL("supple.wasm", import.meta.url));
    return new Library(bytes instanceof WebAssembly.Module ? bytes : await WebAssembly.compile(bytes), header);
}

async function read(url) {
    // node fetches no files.
    if (url.protocol === "file:") return (await import("node:fs/promises")).readFile(url);
    const response = await fetch(url);
    if (!response.ok) throw new Error(`${url}: ${response.status} ${response.statusText}`);
    return response.arrayBuffer();
}
