// A liver lobe an instrument and pins, as a host of supple's C API: the scene, the methods, a frame. No page and no clock of its own:
// worker.js runs it in the page, the tests run it in node. SI units; a frame has a sixtieth of a second.

import { Pins } from "./pins.js";
import { Tool } from "./tool.js";

export const FRAME = 1 / 60; // s
export const METHODS = ["exact", "long", "auto"];
export const TOLERANCE = { least: 0.05e-3, most: 5e-3, usual: 0.5e-3 }; // m, mean error of the nodes

// Neo-Hookean and liver-like: half the shear modulus and half the bulk modulus (Pa); kg/m^3. It does not stiffen when it is pulled.
const TISSUE = { constants: [750, 40000, 0, 0], density: 1060 };
const DAMPING = 20; // 1/s, proportional to mass
const BACK = 0.03; // nodes behind y = 30 mm hang on the diaphragm
const LONG = 4; // long steps a frame
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
            settings: library.space("supple_settings"),
            report: library.space("supple_sim_report"),
            positions: library.room(12 * this.nodes),
        };
        const surface = Uint32Array.from(new Set(mesh.triangles)).sort();
        this.surface = { nodes: library.copy(surface), node_count: surface.length };
        this.#build(mesh);
        library.call("supple_critical_step", this.scene, this.state, this.places.made, 0);
        this.exact = Math.ceil(FRAME / (MARGIN * library.floats(this.places.made, 1)[0])); // steps a frame
        this.tool = new Tool(this, surface);
        this.pins = new Pins(this, surface);
        this.leading = this.tool;
        this.halted = null;
        this.setMethod("long", TOLERANCE.usual);
    }

    #build(mesh) {
        const { library, nodes, places } = this;
        const { constants } = library.header;
        const held = [];
        for (let node = 0; node < nodes; node++) if (mesh.points[3 * node + 1] > BACK) held.push(node);
        const support = library.space("supple_support", held.length);
        const { size } = library.layout("supple_support");
        held.forEach((node, place) => library.write(support + size * place, "supple_support", { node, axes: 7 }));
        const body = library.write(library.space("supple_scene_config"), "supple_scene_config", {
            law: constants.SUPPLE_NEO_HOOKEAN, winding: constants.SUPPLE_WINDING_CHECKED,
            // Bends nearly right on coarse meshes, and takes the least time.
            element: constants.SUPPLE_NODAL_STRAIN,
            nodes, elements: mesh.tetrahedra.length / 4, supports: held.length, tissues: 1,
            points: this.points, tetrahedra: library.copy(mesh.tetrahedra), support,
            tissue: library.write(library.space("supple_tissue"), "supple_tissue", TISSUE),
        });
        // Memory for the steps that need the most: whatever is chosen is prepared there.
        const bytes = Math.max(...METHODS.map((method) => {
            library.call("supple_sim_size", body, this.#settings(method, TOLERANCE.usual), places.made, places.error);
            return library.pointer(places.made);
        }));
        const settings = this.#settings("exact", TOLERANCE.usual);
        library.call("supple_sim_setup", library.room(bytes), bytes, body, settings, places.made, places.error);
        this.sim = library.pointer(places.made);
        const objects = library.space("supple_sim_objects");
        library.call("supple_sim_describe", this.sim, objects);
        Object.assign(this, library.read(objects, "supple_sim_objects"));
    }

    #settings(method, tolerance) {
        const { library, surface } = this;
        const { SUPPLE_STEPS_EXACT, SUPPLE_STEPS_LONG, SUPPLE_STEPS_AUTO } = library.header.constants;
        const steps = { exact: SUPPLE_STEPS_EXACT, long: SUPPLE_STEPS_LONG, auto: SUPPLE_STEPS_AUTO }[method];
        const seconds = method === "exact" ? (this.exact ? FRAME / this.exact : 0) : FRAME / LONG;
        return library.write(this.places.settings, "supple_settings", {
            steps, seconds, damping: DAMPING, tolerance, guard: 1, surface, grips: surface.node_count });
    }

    /** From now on these steps. `tolerance` (m) is that of automatic steps, and what the guard of long ones allows. */
    setMethod(method, tolerance) {
        if (!METHODS.includes(method)) throw new Error(`no method ${method}`);
        this.method = method;
        this.tolerance = tolerance;
        const { library, places } = this;
        const status = library.functions.supple_sim_set(this.sim, this.#settings(method, tolerance), places.error);
        this.halted = status < 0 ? this.#refusal(status, library.read(places.error, "supple_error")) : null;
    }

    /** The lobe at rest at time zero, without an instrument. */
    reset() {
        this.library.call("supple_state_reset", this.state);
        this.tool.remove();
        this.pins.remove();
        this.setMethod(this.method, this.tolerance);
    }

    /** An instrument or a pin where the pointer touches the tissue. Gives what the library refused, or null. */
    begin(kind, hit, direction) {
        this.leading = kind === "pin" ? this.pins : this.tool;
        return this.leading.begin(...(kind === "pin" ? [hit] : [kind, hit, direction]));
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
        this.pins.move(before);
        const begin = performance.now();
        const status = library.functions.supple_sim_advance(this.sim, FRAME, 0, places.report);
        const milliseconds = performance.now() - begin;
        const { call, estimate } = library.read(places.report, "supple_sim_report");
        let refusal = unplaced;
        if (status < 0) {
            refusal = this.#refusal(status, call.error);
            // Nothing has moved: the body goes on without the instrument. Anything else needs a reset.
            if (refusal.name === "SUPPLE_E_DIVERGED_INSTRUMENT") this.tool.remove();
            else this.halted = refusal;
        }
        return {
            ...this.#standing(),
            name: library.name(status), text: library.text(status),
            steps: call.steps, milliseconds, seconds: this.time() - before,
            // None of exact steps, and before the first comparison.
            estimate: estimate.known ? estimate : null, refusal, halted: this.halted !== null,
        };
    }

    #standing() {
        return { method: this.method, time: this.time(), tool: this.tool.describe(), pins: this.pins.describe(), positions: this.positions().slice() };
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
