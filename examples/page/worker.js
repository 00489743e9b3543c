// The kernel in a thread of its own, so that the page answers the pointer while steps are computed. It has the library and the
// mesh in it. Messages in: begin, lead, release, method, reset, frame. Out: ready, frame, failed. SI units.

import header from "built:header.json";
import mesh from "built:lobe.json";
import compressed from "built:supple.wasm.gz";

import { Library } from "../../src/javascript/library.js";
import { Simulation } from "./simulation.js";

let simulation;
/** What the library refused in a message, until the next frame tells it. */
let refused = null;

async function start() {
    const stream = new Blob([compressed]).stream().pipeThrough(new DecompressionStream("gzip"));
    const module = await WebAssembly.compile(await new Response(stream).arrayBuffer());
    const [tetrahedra, triangles, groups] = [mesh.tetrahedra, mesh.triangles, mesh.groups].map((numbers) => Uint32Array.from(numbers));
    const lobe = { points: Float32Array.from(mesh.points), tetrahedra, triangles, groups };
    const begin = performance.now();
    simulation = new Simulation(new Library(module, header), lobe);
    postMessage({ type: "ready", lobe, milliseconds: performance.now() - begin });
}

const answers = {
    begin: ({ kind, hit, direction }) => { refused = simulation.begin(kind, hit, direction); },
    lead: ({ way }) => simulation.leading.lead(way),
    release: () => simulation.leading.release(),
    method: ({ method, tolerance }) => simulation.setMethod(method, tolerance),
    reset: () => simulation.reset(),
    frame: () => {
        const frame = simulation.frame();
        frame.refusal ??= refused;
        refused = null;
        postMessage({ type: "frame", frame }, [frame.positions.buffer]);
    },
};

/** Nothing that happens here may leave the page without a word. */
const failed = (error) => postMessage({ type: "failed", text: `${error.name}: ${error.message}` });
addEventListener("message", ({ data }) => {
    try {
        answers[data.type](data);
    } catch (error) {
        failed(error);
    }
});
start().catch(failed);
