// A liver lobe and one instrument, as a host of supple's C API: the scene, the methods, a frame. No page and no clock of its own:
// worker.js runs it in the page, the tests run it in node. SI units; a frame has a sixtieth of a second.

import { Tool } from "./tool.js";

export const FRAME = 1 / 60; // s
export const METHODS = ["exact", "damped", "adaptive"];
export const TOLERANCE = { least: 0.05e-3, most: 5e-3, usual: 0.5e-3 }; // m, mean error of the nodes

// Neo-Hookean and liver-like: half the shear modulus and half the bulk modulus (Pa); kg/m^3. It does not stiffen when it is pulled.
const TISSUE = { constants: [750, 40000, 0, 0], density: 1060 };
const DAMPING = 20; // 1/s, proportional to mass
const BACK = 0.03; // nodes behind y = 30 mm hang on the diaphragm
const LONG = 4; // damped steps a frame, and at least as many adaptive ones
const MARGIN = 0.7; // exact steps, in critical steps at rest: deformed tissue is stiffer

export class Simulation {
    /** @param {import("./library.js").Library} library, @param mesh of readMesh */
    constructor(library, mesh) {
        this.library = library;
        this.nodes = mesh.points.length / 3;
        this.points = library.copy(mesh.points);
        this.places = {
            made: library.room(8),
            error: library.space("supple_error"),
            report: library.space("supple_report"),
            taken: library.space("supple_adaptive_report"),
            estimate: library.space("supple_estimate"),
            step: library.space("supple_step_config"),
            long: library.space("supple_large_config"),
            guard: library.space("supple_guard_config"),
            positions: library.room(12 * this.nodes),
        };
        this.#build(mesh);
        library.call("supple_critical_step", this.scene, this.state, this.places.made, 0);
        this.critical = library.floats(this.places.made, 1)[0];
        this.exact = Math.ceil(FRAME / (MARGIN * this.critical)); // steps a frame
        this.#reserve();
        this.tool = new Tool(this, mesh);
        this.halted = null;
        this.setMethod("damped", TOLERANCE.usual);
    }

    #build(mesh) {
        const { library, nodes } = this;
        const { functions } = library;
        const { constants } = library.header;
        // Bends nearly right on coarse meshes, and takes the least time.
        const element = constants.SUPPLE_NODAL_STRAIN;
        const elements = mesh.tetrahedra.length / 4;
        const held = [];
        for (let node = 0; node < nodes; node++) if (mesh.points[3 * node + 1] > BACK) held.push(node);
        const support = library.space("supple_support", held.length);
        const { size } = library.layout("supple_support");
        held.forEach((node, place) => library.write(support + size * place, "supple_support", { node, axes: 7 }));
        const body = library.write(library.space("supple_scene_config"), "supple_scene_config", {
            law: constants.SUPPLE_NEO_HOOKEAN, winding: constants.SUPPLE_WINDING_CHECKED, element,
            nodes, elements, supports: held.length, tissues: 1,
            points: this.points, tetrahedra: library.copy(mesh.tetrahedra), support,
            tissue: library.write(library.space("supple_tissue"), "supple_tissue", TISSUE),
        });
        const { made, error } = this.places;
        const bytes = functions.supple_scene_size(nodes, elements, 1) + functions.supple_patches_size(nodes, elements, 1);
        this.scene = this.object("supple_scene_init", bytes, body, made, error);
        this.state = this.object("supple_state_init", functions.supple_state_size(nodes, element), this.scene, made);
        this.loads = this.object("supple_loads_init", functions.supple_loads_size(0, 0), this.scene, 0, 0, made);
    }

    /** Prepares an object in memory of its own; gives the pointer to it. */
    object(name, bytes, ...values) {
        this.library.call(name, this.library.room(bytes), bytes, ...values);
        return this.library.pointer(this.places.made);
    }

    /** Memory for the method that needs the most, and for a guard: whatever is chosen is prepared there. */
    #reserve() {
        const { library, scene, points } = this;
        const { made, error } = this.places;
        const size = (name, ...values) => {
            library.call(name, scene, points, ...values, made, error);
            return library.pointer(made);
        };
        const long = this.#config();
        this.methodBytes = Math.max(size("supple_large_size", long), size("supple_adaptive_size", long));
        this.methodRoom = library.room(this.methodBytes);
        this.guardBytes = size("supple_guard_size");
        this.guardRoom = library.room(this.guardBytes);
    }

    /** Configuration of steps beyond the critical one. */
    #config() {
        const { SUPPLE_DAMPED: method } = this.library.header.constants;
        return this.library.write(this.places.long, "supple_large_config", { method, seconds: FRAME / LONG, damping: DAMPING });
    }

    /** From now on these steps. `tolerance` (m) is that of adaptive steps, and what the guard of long ones allows. */
    setMethod(method, tolerance) {
        if (!METHODS.includes(method)) throw new Error(`no method ${method}`);
        this.method = method;
        this.tolerance = tolerance;
        const { library, places } = this;
        const { functions } = library;
        const prepared = (name, room, bytes, ...values) =>
            functions[name](room, bytes, this.scene, this.state, this.points, ...values, places.made, places.error);
        let status;
        if (method === "exact") {
            library.write(places.step, "supple_step_config", { seconds: FRAME / this.exact, damping: DAMPING });
            status = functions.supple_set_step(this.scene, this.state, places.step, places.error);
        } else if (method === "adaptive") {
            status = prepared("supple_adaptive_init", this.methodRoom, this.methodBytes, this.#config(), tolerance);
        } else {
            status = prepared("supple_large_init", this.methodRoom, this.methodBytes, this.#config());
        }
        this.stepper = library.pointer(places.made);
        if (status >= 0 && this.#isGuarded()) {
            library.write(places.guard, "supple_guard_config", {
                seconds: FRAME / LONG, damping: DAMPING, every: LONG, tolerance });
            status = prepared("supple_guard_init", this.guardRoom, this.guardBytes, places.guard);
            this.guard = library.pointer(places.made);
        }
        this.halted = status < 0 ? this.#refusal(status, library.read(places.error, "supple_error")) : null;
    }

    #isGuarded() {
        return this.method === "damped";
    }

    /** The lobe at rest at time zero, without an instrument. */
    reset() {
        this.library.call("supple_state_reset", this.state);
        this.tool.remove();
        this.setMethod(this.method, this.tolerance);
    }

    /** Simulated time, s. */
    time() {
        const { made } = this.places;
        this.library.call("supple_state_time", this.state, made, 0);
        return new DataView(this.library.memory.buffer, made).getFloat64(0, true);
    }

    /** Where the nodes are, m: a view that holds until the next call. */
    positions() {
        const { positions } = this.places;
        this.library.call("supple_copy_positions", this.state, this.points, positions, 3 * this.nodes);
        return this.library.floats(positions, 3 * this.nodes);
    }

    /** Moves on by a frame; gives what the page shows of it. */
    frame() {
        if (this.halted) return { ...this.#standing(), refusal: this.halted, halted: true };
        const { library, places } = this;
        const before = this.time();
        const unplaced = this.tool.move(before);
        const begin = performance.now();
        const status = this.#steps();
        // Before the guard's second run, which is a call that takes steps as well.
        const tool = this.tool.describe();
        const guarded = status >= 0 && this.#isGuarded()
            ? library.functions.supple_guard_follow(this.scene, this.loads, this.state, this.guard, 0, places.estimate)
            : 0;
        const milliseconds = performance.now() - begin;
        const report = library.read(places.report, "supple_report");
        let refusal = unplaced;
        if (status < 0) {
            refusal = this.#refusal(status, report.error);
            // Nothing has moved: the body goes on without the instrument. Anything else needs a reset.
            if (refusal.name === "SUPPLE_E_DIVERGED_INSTRUMENT") this.tool.remove();
            else this.halted = refusal;
        }
        const worst = status < 0 ? status : Math.max(status, guarded);
        return {
            ...this.#standing(),
            tool: status < 0 ? this.tool.describe() : tool,
            name: library.name(worst), text: library.text(worst),
            steps: report.steps, milliseconds, seconds: this.time() - before,
            estimate: this.#estimate(), refusal, halted: this.halted !== null,
        };
    }

    #steps() {
        const { library, scene, loads, state, places } = this;
        const { functions } = library;
        if (this.method === "exact") return functions.supple_step(scene, loads, state, this.exact, 0, places.report);
        if (this.method === "adaptive") {
            return functions.supple_adaptive_advance(scene, loads, state, this.stepper, FRAME, 0, places.report, places.taken);
        }
        return functions.supple_large_step(scene, loads, state, this.stepper, LONG, 0, places.report);
    }

    /** The error estimate (m) of the guard or of the adaptive steps; null for exact steps, and before the first comparison. */
    #estimate() {
        if (this.method === "exact") return null;
        const { estimate } = this.method === "adaptive"
            ? this.library.read(this.places.taken, "supple_adaptive_report")
            : { estimate: this.library.read(this.places.estimate, "supple_estimate") };
        return estimate.known ? estimate : null;
    }

    #standing() {
        return { method: this.method, time: this.time(), tool: this.tool.describe(), positions: this.positions().slice() };
    }

    /** In the library's own words, with its numbers. */
    #refusal(status, { node, value, limit }) {
        const { library } = this;
        const none = library.header.none;
        const where = node === none ? "" : `, node ${node}`;
        const numbers = value === 0 && limit === 0 ? "" : ` (${value.toPrecision(3)}, limit ${limit.toPrecision(3)}${where})`;
        return { status, name: library.name(status), text: library.text(status) + numbers };
    }
}
