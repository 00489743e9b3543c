// The liver of `supple demo` with an instrument and pins, as a host of the package in src/javascript: the scene, the
// methods, a frame. No page and no clock of its own: worker.js runs it in the page, the tests run it in node. SI units;
// a frame has a sixtieth of a second.

import { Refusal } from "../../src/javascript/library.js";
import { METHODS, Simulation as Body } from "../../src/javascript/simulation.js";
import { Breath } from "./breath.js";
import { Inside } from "./inside.js";
import { Pins } from "./pins.js";
import { Tool } from "./tool.js";

export const FRAME = 1 / 60; // s
export { METHODS };
const TOLERANCE = 0.5e-3; // m, mean error of the nodes
const LONG = 4; // long steps a frame
const MOST_STEPS = 1000; // exact steps a frame: tissue that needs more is torn, and the page would stand still

export class Simulation extends Body {
    /**
     * The liver as it hangs.
     * @param {import("../../src/javascript/library.js").Library} library, @param liver of `supple liver`, as build.mjs
     * leaves it
     * @param {Uint8Array} [hanging] the state of another one that hangs, so that it need not be computed again
     */
    constructor(library, liver, hanging) {
        super(library, liver, liver, { damping: liver.damping, mostSteps: MOST_STEPS });
        const surface = Uint32Array.from(new Set(liver.triangles)).sort();
        this.tool = new Tool(this, surface, liver.probe);
        this.pins = new Pins(this, surface);
        this.breath = new Breath(this, liver);
        this.inside = new Inside(this, liver);
        this.leading = this.tool;
        this.setGravity(liver.gravity);
        this.savedBytes = library.functions.supple_saved_size(this.nodes);
        this.saved = hanging ? library.copy(hanging) : this.#hang(liver.settled);
        this.setMethod("long", TOLERANCE);
        this.reset();
        this.start = this.positions().slice();
        this.target = this.inside.target();
    }

    #hang(metres) {
        this.settle(metres);
        const place = this.library.room(this.savedBytes);
        this.library.call("supple_save", this.state, place, this.savedBytes);
        return place;
    }

    /** The state in which it hangs, for another one. */
    hanging() {
        return new Uint8Array(this.library.memory.buffer, this.saved, this.savedBytes).slice();
    }

    /** From now on these steps. `tolerance` (m) is that of automatic steps, and what the guard of long ones allows. */
    setMethod(method, tolerance) {
        let halted = null;
        try {
            // The kernel knows the length of exact steps best.
            this.set({ method, tolerance, seconds: method === "long" ? FRAME / LONG : 0 });
        } catch (error) {
            halted = refused(error);
        }
        Object.assign(this, { method, tolerance, halted });
    }

    /** As it hangs, at time zero, without an instrument. */
    reset() {
        this.library.call("supple_restore", this.state, this.saved, this.savedBytes);
        this.tool.remove();
        this.pins.remove();
        this.breath.reset();
        this.setMethod(this.method, this.tolerance);
    }

    /**
     * An instrument or a pin where the pointer touches the tissue, which has its nodes at these positions. Gives what
     * the library refused, or null.
     */
    begin(kind, hit, direction, positions) {
        this.leading = kind === "pin" ? this.pins : this.tool;
        return this.leading.begin(...(kind === "pin" ? [hit, positions] : [kind, hit, direction, positions]));
    }

    /** Moves on by a frame; gives what the page shows of it. */
    frame() {
        if (this.halted) return { ...this.#standing(), refusal: this.halted, halted: true };
        const before = this.time();
        const unplaced = this.tool.move(before) ?? this.pins.move(before);
        this.breath.move();
        const begin = performance.now();
        let report;
        let refusal = unplaced;
        try {
            report = this.advance(FRAME);
            if (report.status === "SUPPLE_BEHIND") this.halted = refusal = { name: report.status, text: report.text };
        } catch (error) {
            refusal = refused(error);
            report = { status: refusal.name, text: refusal.text, steps: error.steps, estimate: null };
            // The body goes on without the instrument, to the end of the frame. Anything else needs a reset.
            if (refusal.name === "SUPPLE_E_DIVERGED_INSTRUMENT") this.#withoutTool(before + FRAME);
            else this.halted = refusal;
        }
        return {
            ...this.#standing(),
            name: report.status,
            text: report.text,
            steps: report.steps,
            milliseconds: performance.now() - begin,
            seconds: this.time() - before,
            estimate: report.estimate,
            refusal,
            halted: this.halted !== null,
        };
    }

    #withoutTool(end) {
        this.tool.remove();
        try {
            this.advance(end - this.time());
        } catch (error) {
            this.halted = refused(error);
        }
    }

    /** What the page says of a status. */
    refusal(status) {
        return { name: this.library.name(status), text: this.library.text(status) };
    }

    #standing() {
        return {
            method: this.method,
            time: this.time(),
            tool: this.tool.describe(),
            pins: this.pins.describe(),
            positions: this.positions().slice(),
            inside: this.inside.positions(),
            target: this.inside.target(),
        };
    }
}

/** What the page says of an error of the library; any other is one of the page. */
function refused(error) {
    if (!(error instanceof Refusal)) throw error;
    return { name: error.status, text: error.text };
}
