// A liver lobe, an instrument and pins, as a host of the package in src/javascript: the scene, the methods, a frame. No page and no
// clock of its own: worker.js runs it in the page, the tests run it in node. SI units; a frame has a sixtieth of a second.

import { Refusal } from "../../src/javascript/library.js";
import { METHODS, Simulation as Body } from "../../src/javascript/simulation.js";
import { Pins } from "./pins.js";
import { Tool } from "./tool.js";

export const FRAME = 1 / 60; // s
export { METHODS };
export const TOLERANCE = { least: 0.05e-3, most: 5e-3, usual: 0.5e-3 }; // m, mean error of the nodes

// Neo-Hookean and liver-like: half the shear modulus and half the bulk modulus (Pa); kg/m^3. It does not stiffen when it is pulled.
const TISSUE = { constants: [750, 40000], density: 1060 };
const DAMPING = 20; // 1/s, proportional to mass
const BACK = 0.03; // nodes behind y = 30 mm hang on the diaphragm
const LONG = 4; // long steps a frame
const MARGIN = 0.7; // exact steps, in critical steps at rest: deformed tissue is stiffer

export class Simulation extends Body {
    /** @param {import("../../src/javascript/library.js").Library} library, @param mesh of readMesh */
    constructor(library, mesh) {
        const fixed = [];
        for (let node = 0; node < mesh.points.length / 3; node++) if (mesh.points[3 * node + 1] > BACK) fixed.push(node);
        // Nodal strain bends nearly right on coarse meshes, and takes the least time.
        super(library, mesh, { ...TISSUE, element: "nodal-strain", fixed }, { damping: DAMPING });
        const surface = Uint32Array.from(new Set(mesh.triangles)).sort();
        this.exact = Math.ceil(FRAME / (MARGIN * this.criticalStep())); // steps a frame
        this.tool = new Tool(this, surface);
        this.pins = new Pins(this, surface);
        this.leading = this.tool;
        this.halted = null;
        this.setMethod("long", TOLERANCE.usual);
    }

    /** From now on these steps. `tolerance` (m) is that of automatic steps, and what the guard of long ones allows. */
    setMethod(method, tolerance) {
        let halted = null;
        try {
            this.set({ method, tolerance, seconds: method === "exact" ? FRAME / this.exact : FRAME / LONG });
        } catch (error) {
            halted = refused(error);
        }
        Object.assign(this, { method, tolerance, halted });
    }

    /** The lobe at rest at time zero, without an instrument. */
    reset() {
        super.reset();
        this.tool.remove();
        this.pins.remove();
        this.setMethod(this.method, this.tolerance);
    }

    /** An instrument or a pin where the pointer touches the tissue. Gives what the library refused, or null. */
    begin(kind, hit, direction) {
        this.leading = kind === "pin" ? this.pins : this.tool;
        return this.leading.begin(...(kind === "pin" ? [hit] : [kind, hit, direction]));
    }

    /** Moves on by a frame; gives what the page shows of it. */
    frame() {
        if (this.halted) return { ...this.#standing(), refusal: this.halted, halted: true };
        const before = this.time();
        const unplaced = this.tool.move(before);
        this.pins.move(before);
        const begin = performance.now();
        let report;
        let refusal = unplaced;
        try {
            report = this.advance(FRAME);
        } catch (error) {
            refusal = refused(error);
            report = { status: refusal.name, text: refusal.text, steps: error.steps, estimate: null };
            // Nothing has moved: the body goes on without the instrument. Anything else needs a reset.
            if (refusal.name === "SUPPLE_E_DIVERGED_INSTRUMENT") this.tool.remove();
            else this.halted = refusal;
        }
        const milliseconds = performance.now() - begin;
        return {
            ...this.#standing(), name: report.status, text: report.text, steps: report.steps, milliseconds,
            seconds: this.time() - before, estimate: report.estimate, refusal, halted: this.halted !== null,
        };
    }

    #standing() {
        return { method: this.method, time: this.time(), tool: this.tool.describe(), pins: this.pins.describe(), positions: this.positions().slice() };
    }
}

/** What the page says of an error of the library; any other is one of the page. */
function refused(error) {
    if (!(error instanceof Refusal)) throw error;
    return { status: error.code, name: error.status, text: error.text };
}
