// Pins: points of the tissue that are pulled to where they were put, as many as eight. A pin is put where the pointer
// touches the tissue and goes where it leads; it stays there when it is let go. Touched again without being led
// anywhere it is taken away. Metres.

import { FRAME } from "./simulation.js";
import { apart, length, plus } from "./vectors.js";

const MOST = 8;
const NODES = 64; // of a pin
const RADIUS = 0.012; // m: the nodes that it pulls
const STIFFNESS = 300; // N/m
const NEAR = 0.008; // m: a pin that is touched
const SPEED = 0.1; // m/s
const STILL = 0.001; // m: led less than that it was not led

export class Pins {
    /**
     * @param {import("./simulation.js").Simulation} simulation, @param surface numbers of the nodes that can be pinned
     */
    constructor(simulation, surface) {
        const { library } = simulation;
        Object.assign(this, { simulation, library, surface });
        const bytes = library.functions.supple_pulls_size(MOST, MOST * NODES);
        this.places = {
            memory: library.room(bytes),
            bytes,
            pull: library.space("supple_pull"),
            targets: library.room(12 * MOST),
            pulled: library.space("supple_pulled", MOST),
        };
        this.remove();
    }

    /** No pins. */
    remove() {
        this.pins = [];
        this.led = null;
        this.#make();
    }

    /** The pins that there are, in the library's memory. Gives what it refused, or null. */
    #make() {
        const { library, simulation, places } = this;
        const { scene, loads } = simulation;
        library.call(
            "supple_pulls_init",
            places.memory,
            places.bytes,
            scene,
            MOST,
            MOST * NODES,
            simulation.places.made,
        );
        this.pulls = library.pointer(simulation.places.made);
        for (const { at } of this.pins) {
            library.write(places.pull, "supple_pull", {
                at,
                radius: RADIUS,
                stiffness: STIFFNESS,
                most: 0,
                along: [0, 0, 0],
            });
            const status = library.functions.supple_add_pull(
                this.pulls,
                scene,
                simulation.points,
                places.pull,
                simulation.places.error,
            );
            if (status < 0) return simulation.refusal(status);
        }
        library.call("supple_set_pulls", loads, this.pins.length > 0 ? this.pulls : 0);
        return this.#aim(
            this.pins.map(({ position }) => position),
            0,
            0,
        );
    }

    /** Gives what the library refused, or null. */
    #aim(positions, from, to) {
        const { library, places, simulation } = this;
        library.floats(places.targets, 3 * MOST).set(positions.flat());
        const status = library.functions.supple_set_targets(
            this.pulls,
            places.targets,
            positions.length,
            from,
            to,
            simulation.places.error,
        );
        return status < 0 ? simulation.refusal(status) : null;
    }

    /**
     * A pin at the point `hit` of the surface, whose nodes are at `positions`, or the one that is there. Gives what the
     * library refused, or null.
     */
    begin(hit, positions) {
        const at = this.pins.findIndex(({ position }) => apart(position, hit) < NEAR);
        if (at >= 0) {
            this.led = { pin: this.pins[at], origin: this.pins[at].position, is_new: false, way: 0 };
            return null;
        }
        if (this.pins.length === MOST)
            return { name: "", text: `${MOST} pins are the most; touch one to take it away` };
        const node = this.#nearest(hit, positions);
        const rest = Array.from(
            this.library.floats(this.simulation.points, 3 * this.simulation.nodes).subarray(3 * node, 3 * node + 3),
        );
        this.pins.push({ at: rest, position: hit, target: hit });
        this.led = { pin: this.pins.at(-1), origin: hit, is_new: true, way: 0 };
        const refused = this.#make();
        if (refused) {
            this.pins.pop();
            this.led = null;
            this.#make();
        }
        return refused;
    }

    #nearest(hit, positions) {
        const far = (node) => apart(Array.from(positions.subarray(3 * node, 3 * node + 3)), hit);
        return this.surface.reduce((best, node) => (far(node) < far(best) ? node : best), this.surface[0]);
    }

    /** The pointer has moved by this vector since it touched. */
    lead(way) {
        if (!this.led) return;
        this.led.pin.target = plus(this.led.origin, way);
        this.led.way = Math.max(this.led.way, length(way));
    }

    /** The pin stays, or goes if it was only touched. */
    release() {
        const { led } = this;
        this.led = null;
        if (!led || led.is_new || led.way > STILL) return;
        this.pins = this.pins.filter((pin) => pin !== led.pin);
        this.#make();
    }

    /**
     * Tells the library where targets will be at the end of the frame that begins at `now` (s). Gives what it refused,
     * or null.
     */
    move(now) {
        if (this.pins.length === 0) return null;
        const positions = this.pins.map(({ position, target }) => {
            const way = plus(target, position, -1);
            const most = SPEED * FRAME;
            return length(way) > most ? plus(position, way, most / length(way)) : target;
        });
        const refused = this.#aim(positions, now, now + FRAME);
        this.pins.forEach((pin, index) => {
            if (refused) pin.target = pin.position;
            else pin.position = positions[index];
        });
        return refused;
    }

    /** What the page shows of them: where they are, m, and with which force each pulls, N. */
    describe() {
        if (this.pins.length === 0) return [];
        const { library, places, simulation } = this;
        library.call("supple_read_pulls", this.pulls, simulation.state, places.pulled, this.pins.length);
        const { size } = library.layout("supple_pulled");
        return this.pins.map(({ position }, index) => {
            const { force, gap } = library.read(places.pulled + size * index, "supple_pulled");
            return { position, force: length(force), gap: length(gap) };
        });
    }
}
