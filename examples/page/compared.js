// The liver twice: by the steps that were chosen, which is the one shown, and by exact ones, under the same hand. How
// far apart the middle of the tumour is in both is the error at the target. Metres.

import { Library } from "../../src/javascript/library.js";
import { Simulation } from "./simulation.js";
import { apart } from "./vectors.js";

export class Compared {
    /**
     * @param {WebAssembly.Module} module the library, @param header its interface, @param liver of `supple liver`, as
     * build.mjs leaves it
     */
    constructor(module, header, liver) {
        this.shown = new Simulation(new Library(module, header), liver);
        this.exact = new Simulation(new Library(module, header), liver, this.shown.hanging());
        this.exact.setMethod("exact", this.exact.tolerance);
        this.compares = true;
        /** Why exact steps stand still since the last reset: there is nothing to compare with. */
        this.refused = null;
        /** The largest error since then. */
        this.worst = 0;
    }

    #both(does) {
        const given = does(this.shown);
        does(this.exact);
        return given;
    }

    /** Gives what the library refused, or null. */
    begin(kind, hit, direction) {
        // The same place in both, by what is seen.
        const positions = this.shown.positions().slice();
        return this.#both((simulation) => simulation.begin(kind, hit, direction, positions));
    }

    lead(way) {
        this.#both(({ leading }) => leading.lead(way));
    }

    release() {
        this.#both(({ leading }) => leading.release());
    }

    breathe(goes) {
        this.#both(({ breath }) => breath.let(goes));
    }

    setMethod(method, tolerance) {
        this.shown.setMethod(method, tolerance);
    }

    /** Whether exact steps go along. They have to begin together: then both hang again. */
    compare(goes) {
        if (goes && !this.compares) this.reset();
        this.compares = goes;
    }

    reset() {
        this.#both((simulation) => simulation.reset());
        this.refused = null;
        this.worst = 0;
    }

    /** Moves on by a frame; gives what the page shows of it. */
    frame() {
        const slipped = this.shown.tool.slips();
        if (slipped) this.release();
        const shown = this.shown.frame();
        const goes = this.compares && !this.refused && !shown.halted;
        const exact = goes ? this.exact.frame() : null;
        if (exact?.halted) this.refused = exact.refusal;
        // What one of them refused is taken from both.
        if (shown.refusal?.name && !this.shown.tool.kind) this.exact.tool.remove();
        if (exact?.refusal?.name && !this.exact.tool.kind) this.shown.tool.remove();
        const error = exact && !exact.halted ? apart(shown.target, exact.target) : null;
        this.worst = Math.max(this.worst, error ?? 0);
        return {
            ...shown,
            refusal: shown.refusal ?? (exact?.halted ? null : (exact?.refusal ?? null)),
            slipped,
            moved: apart(shown.target, this.shown.target),
            exact: error === null ? null : { error, milliseconds: exact.milliseconds },
            worst: this.worst,
            refused: this.refused,
        };
    }
}
