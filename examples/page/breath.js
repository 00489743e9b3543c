// The diaphragm: it leads the nodes at the back of the liver, down while a patient breathes in and up again.

import { FRAME } from "./simulation.js";

const PERIOD = 4; // s

export class Breath {
    /** @param {import("./simulation.js").Simulation} simulation, @param liver which nodes, and how far they go */
    constructor(simulation, { moved, breath }) {
        Object.assign(this, { simulation, nodes: moved, way: breath, goes: false });
    }

    /** Breathed out. */
    reset() {
        this.phase = 0;
        this.#lead();
    }

    /** Whether it goes on. If not it goes back the shorter way to where it is breathed out. */
    let(goes) {
        this.goes = goes;
    }

    /** A frame on. */
    move() {
        if (!this.goes && this.phase === 0) return;
        const on = this.phase + FRAME / PERIOD;
        if (this.goes) this.phase = on % 1;
        else this.phase = this.phase < 0.5 ? Math.max(0, this.phase - FRAME / PERIOD) : on < 1 ? on : 0;
        this.#lead();
    }

    #lead() {
        const share = (1 - Math.cos(2 * Math.PI * this.phase)) / 2;
        const metre = this.way.map((metres) => share * metres);
        this.simulation.setMotions(this.nodes.map((node) => ({ node, metre })));
    }
}
