// The instrument: a ball that presses, or forceps that hold tissue and pull it. It begins outside the body on the line
// from the camera to the point that was touched, goes where the pointer leads it no faster than a hand would, and goes
// away when it is let go. Metres.

import { FRAME } from "./simulation.js";
import { length, plus } from "./vectors.js";

const SPEED = 0.1; // m/s
const REACH = 0.025; // m, how far from where it began the pointer leads it
const DEPTH = 0.008; // m, how far the ball is pressed in
const AWAY = 0.02; // m, how far it withdraws when it is let go
const HOLD = 0.01; // m: forceps hold what is nearer to them
const SLIP = 5; // N: where they hold more they slip
const FORCEPS = 0.004; // m, their radius
const CLEARANCE = { press: 0.001, pull: 0.003 }; // m, between the instrument and the tissue before it touches

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

export class Tool {
    /**
     * @param {import("./simulation.js").Simulation} simulation, @param surface numbers of the nodes that it can touch
     * @param probe radius of the ball that presses, and friction
     */
    constructor(simulation, surface, { radius, friction }) {
        const { library, contact } = simulation;
        Object.assign(this, {
            simulation,
            library,
            contact,
            surface,
            friction,
            radii: { press: radius, pull: FORCEPS },
        });
        this.places = {
            instrument: library.space("supple_instrument"),
            pose: library.space("supple_pose"),
            touch: library.space("supple_touch"),
            held: library.room(4),
        };
        this.remove();
    }

    /** No instrument. */
    remove() {
        this.library.call("supple_set_instruments", this.contact, 0, 0, 0);
        this.kind = null;
        this.held = 0;
    }

    /**
     * An instrument of this kind for the point `hit` of the surface, whose nodes are at `positions`, and which the
     * camera sees along `direction` (of length 1). Gives what the library refused, or null.
     */
    begin(kind, hit, direction, positions) {
        if (!CLEARANCE[kind]) throw new Error(`no instrument ${kind}`);
        const { library, places } = this;
        const { constants } = library.header;
        const [radius, clearance] = [this.radii[kind], CLEARANCE[kind]];
        this.remove();
        const start = plus(hit, direction, -this.#clear(hit, direction, radius + clearance, positions));
        library.write(places.instrument, "supple_instrument", {
            shape: constants.SUPPLE_SPHERE,
            radius,
            friction: this.friction,
            pose: { position: start, rotation: [0, 0, 0, 0] },
        });
        let status = library.functions.supple_set_instruments(
            this.contact,
            places.instrument,
            1,
            this.simulation.places.error,
        );
        if (status >= 0 && kind === "pull") {
            status = library.functions.supple_grasp(this.contact, this.simulation.state, 0, HOLD, places.held);
            this.held = library.pointer(places.held);
        }
        if (status < 0) {
            this.remove();
            return this.simulation.refusal(status);
        }
        this.kind = kind;
        this.phase = "led";
        this.direction = direction;
        this.position = start;
        this.origin = kind === "press" ? plus(start, direction, DEPTH + clearance) : start;
        this.target = this.origin;
        return null;
    }

    /** How far back from `hit` a ball of this radius is clear of all nodes before it. */
    #clear(hit, direction, radius, positions) {
        let back = radius;
        for (const node of this.surface) {
            const way = plus(Array.from(positions.subarray(3 * node, 3 * node + 3)), hit, -1);
            const along = dot(way, direction);
            const rest = along * along - dot(way, way) + radius * radius;
            if (rest > 0) back = Math.max(back, Math.sqrt(rest) - along);
        }
        return back;
    }

    /** The pointer has moved by this vector since it touched. */
    lead(way) {
        if (this.kind === null || this.phase !== "led") return;
        const far = length(way);
        this.target = plus(this.origin, way, far > REACH ? REACH / far : 1);
    }

    /** Lets the tissue go, and withdraws towards the camera. */
    release() {
        if (this.kind === null || this.phase !== "led") return;
        this.library.call("supple_let_go", this.contact, 0);
        this.held = 0;
        this.phase = "away";
        this.target = plus(this.position, this.direction, -(this.kind === "press" ? DEPTH : 0) - AWAY);
    }

    /** Whether forceps hold more than they can. */
    slips() {
        return this.held > 0 && this.describe().force > SLIP;
    }

    /**
     * Tells the library where the instrument will be at the end of the frame that begins at `now` (s). Gives what it
     * refused, or null.
     */
    move(now) {
        if (this.kind === null) return null;
        const { library, places } = this;
        const way = plus(this.target, this.position, -1);
        const [far, most] = [length(way), SPEED * FRAME];
        const position = far > most ? plus(this.position, way, most / far) : this.target;
        library.write(places.pose, "supple_pose", { position, rotation: [0, 0, 0, 0] });
        const status = library.functions.supple_move_instrument(
            this.contact,
            0,
            places.pose,
            now,
            now + FRAME,
            this.simulation.places.error,
        );
        if (status < 0) {
            this.target = this.position;
            return this.simulation.refusal(status);
        }
        this.position = position;
        return null;
    }

    /**
     * What the page shows of it: null without an instrument. Force of the tissue on it, N, the mean of the latest
     * call's steps.
     */
    describe() {
        if (this.kind === null) return null;
        const { library, places } = this;
        library.call("supple_read_touch", this.contact, 0, places.touch);
        const { mean_force: force, contacts, depth } = library.read(places.touch, "supple_touch");
        return {
            kind: this.kind,
            phase: this.phase,
            position: this.position,
            radius: this.radii[this.kind],
            held: this.held,
            force: length(force),
            contacts,
            depth,
        };
    }
}
