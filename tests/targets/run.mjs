// Runs the library built for WebAssembly and prints its checksums, as src/main.rs does for other processors.

import { readFileSync } from "node:fs";

const { instance } = await WebAssembly.instantiate(readFileSync(process.argv[2]));
const { has_simd128, web_checksum } = instance.exports;
if (!has_simd128()) {
    throw new Error("built without simd128");
}
console.error("wasm32: Simd128");
const names = [
    "exact", "long", "network", "learned", "int8", "exact-208", "learned-int8-208", "critical-208", "nodal-pressure", "nodal-strain",
];
for (const [what, name] of names.entries()) {
    for (const level of [0, 1]) {
        const checksum = web_checksum(what, level) >>> 0;
        console.log(`${name} unfused ${checksum.toString(16).padStart(8, "0")}`);
    }
}
