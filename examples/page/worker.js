// The kernel in a thread of its own, so that the page answers the pointer while steps are computed. It has the library
// and the liver in it. Messages in: begin, lead, release, breathe, method, compare, reset, frame. Out: ready, frame,
// failed. SI units.

import header from "built:header.json";
import scene from "built:liver.json";
import compressed from "built:supple.wasm.gz";

import { Compared } from "./compared.js";

let compared;
/** What the library refused in a message, until the next frame tells it. */
let refused = null;

async function start() {
    const stream = new Blob([compressed]).stream().pipeThrough(new DecompressionStream("gzip"));
    const module = await WebAssembly.compile(await new Response(stream).arrayBuffer());
    const liver = {
        ...scene,
        tetrahedra: Uint32Array.from(scene.tetrahedra),
        triangles: Uint32Array.from(scene.triangles),
    };
    const begin = performance.now();
    compared = new Compared(module, header, liver);
    const { start: points, target, inside } = compared.shown;
    postMessage({
        type: "ready",
        milliseconds: performance.now() - begin,
        liver: {
            points,
            triangles: liver.triangles,
            tetrahedra: liver.tetrahedra.length / 4,
            target,
            radius: liver.tumour.radius,
            surfaces: inside.surfaces,
            inside: inside.positions(),
        },
    });
}

const answers = {
    begin: ({ kind, hit, direction }) => {
        refused = compared.begin(kind, hit, direction);
    },
    lead: ({ way }) => compared.lead(way),
    release: () => compared.release(),
    breathe: ({ goes }) => compared.breathe(goes),
    method: ({ method, tolerance }) => compared.setMethod(method, tolerance),
    compare: ({ goes }) => compared.compare(goes),
    reset: () => compared.reset(),
    frame: () => {
        const frame = compared.frame();
        frame.refusal ??= refused;
        refused = null;
        postMessage({ type: "frame", frame }, [frame.positions.buffer, frame.inside.buffer]);
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
