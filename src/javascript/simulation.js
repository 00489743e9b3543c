// A body in motion by the C API: scene, state, loads and steps in one supple_sim. SI units. Instruments, pulls and all
// else are set through the library's functions with what `scene`, `state`, `loads` and `contact` lead to.

import { Refusal } from "./library.js";

const ALL = 7; // axes
export const METHODS = ["exact", "long", "auto"];
const SETTINGS = { method: "exact", seconds: 0, damping: 0, tolerance: 0.5e-3, guard: true, mostSteps: 0 };

export class Simulation {
    #forces;
    #motions;
    #surface;

    /**
     * At rest. What is held and how large it is stays; there is memory for steps of all kinds.
     * @param {import("./library.js").Library} library
     * @param mesh points, tetrahedra, and triangles of the surface where instruments shall touch it
     * @param body tissue or tissues, and numbers of the nodes that are held, and of those that `setMotions` leads
     * @param settings of the steps: see `set`
     */
    constructor(library, mesh, body, settings = {}) {
        this.library = library;
        this.nodes = mesh.points.length / 3;
        this.points = library.copy(Float32Array.from(mesh.points));
        this.places = {
            made: library.room(8),
            error: library.space("supple_error"),
            settings: library.space("supple_settings"),
            report: library.space("supple_sim_report"),
            positions: library.room(12 * this.nodes),
        };
        const surface = Uint32Array.from(new Set(mesh.triangles ?? [])).sort();
        this.#surface = surface.length ? { nodes: library.copy(surface), node_count: surface.length } : {};
        this.#forces = { most: this.nodes, place: library.space("supple_force", this.nodes) };
        this.settings = { ...SETTINGS, ...settings };
        this.#build(mesh, body, surface.length);
    }

    #build(mesh, { law = "neo-hookean", element = "nodal-strain", fixed = [], moved = [], ...of }, grips) {
        const { library, nodes, places } = this;
        const { constants: numbers, laws } = library.header;
        const elements = {
            "linear": numbers.SUPPLE_LINEAR,
            "nodal-pressure": numbers.SUPPLE_NODAL_PRESSURE,
            "nodal-strain": numbers.SUPPLE_NODAL_STRAIN,
        };
        if (!Object.hasOwn(laws, law)) throw new Error(`no law ${law}, only ${Object.keys(laws).join(", ")}`);
        if (!Object.hasOwn(elements, element))
            throw new Error(`no element ${element}, only ${Object.keys(elements).join(", ")}`);
        const supports = [fixed, moved].flatMap((nodes, moves) =>
            Array.from(nodes, (node) => ({ node, axes: ALL, moves })),
        );
        const { tissues, tissueOfElement } = of.tissues ? of : { tissues: [of] };
        const elementCount = mesh.tetrahedra.length / 4;
        if (tissues.length > 1 && tissueOfElement?.length !== elementCount) {
            const given = tissueOfElement?.length ?? 0;
            throw new Error(`tissueOfElement has ${given} entries, there are ${elementCount} tetrahedra`);
        }
        const structures = (name, list) => library.writeAll(library.space(name, list.length), name, list);
        this.#motions = { most: moved.length, place: library.space("supple_motion", moved.length) };
        const body = library.write(library.space("supple_scene_config"), "supple_scene_config", {
            law: laws[law],
            winding: numbers.SUPPLE_WINDING_CHECKED,
            element: elements[element],
            nodes,
            elements: elementCount,
            supports: supports.length,
            tissues: tissues.length,
            points: this.points,
            tetrahedra: library.copy(Uint32Array.from(mesh.tetrahedra)),
            support: structures("supple_support", supports),
            tissue: structures(
                "supple_tissue",
                tissues.map(({ constants: given, density }) => ({
                    constants: [...given, 0, 0, 0, 0].slice(0, 4),
                    density,
                })),
            ),
            tissue_of_element: tissues.length > 1 ? library.copy(Uint16Array.from(tissueOfElement)) : 0,
        });
        // Whatever steps are chosen later are prepared there.
        const bytes = Math.max(
            ...METHODS.map((method) => {
                this.#call(
                    "supple_sim_size",
                    body,
                    this.#written({ ...this.settings, method, seconds: 0 }, grips),
                    places.made,
                    places.error,
                );
                return library.pointer(places.made);
            }),
        );
        const settings = this.#written(this.settings, grips);
        this.#call("supple_sim_setup", library.room(bytes), bytes, body, settings, places.made, places.error);
        this.sim = library.pointer(places.made);
        this.grips = grips;
        const objects = library.space("supple_sim_objects");
        library.call("supple_sim_describe", this.sim, objects);
        Object.assign(this, library.read(objects, "supple_sim_objects"));
    }

    #written({ method, seconds, damping, tolerance, guard, mostSteps }, grips) {
        const { library } = this;
        const steps = METHODS.includes(method) && library.header.constants[`SUPPLE_STEPS_${method.toUpperCase()}`];
        if (steps === false) throw new Error(`no method ${method}`);
        return library.write(this.places.settings, "supple_settings", {
            steps,
            seconds,
            damping,
            tolerance,
            guard: Number(guard),
            most_steps: mostSteps,
            forces: this.#forces.most,
            motions: this.#motions.most,
            surface: this.#surface,
            grips,
        });
    }

    /** Calls a function that tells in `places.error` what it refuses. */
    #call(name, ...values) {
        const { library, places } = this;
        const status = library.functions[name](...values);
        if (status < 0) throw new Refusal(library, name, status, library.read(places.error, "supple_error"));
        return status;
    }

    /**
     * From now on these steps; what is not named stays. `method`: "exact", "long" or "auto"; `seconds`: their length, 0
     * for the kernel's choice; `damping`, 1/s; `tolerance` (m): of automatic steps, and what the guard of long ones
     * allows; `guard`: whether there is one; `mostSteps`: that a call of `advance` takes, 0 for as many as it needs.
     */
    set(settings) {
        const wanted = { ...this.settings, ...settings };
        this.#call("supple_sim_set", this.sim, this.#written(wanted, this.grips), this.places.error);
        this.settings = wanted;
    }

    /** m/s². */
    setGravity(gravity) {
        this.library.write(this.#forces.place, "supple_force", { newton: gravity });
        this.library.call(
            "supple_set_gravity",
            this.loads,
            this.#forces.place + this.library.layout("supple_force").fields.newton.offset,
        );
    }

    /**
     * Forces on nodes in place of those before: { node, newton: [x, y, z], ramp: seconds }. At most as many as there
     * are nodes.
     */
    setForces(forces) {
        const { library } = this;
        if (forces.length > this.#forces.most)
            throw new Error(`${forces.length} forces, there are ${this.#forces.most} nodes`);
        library.writeAll(this.#forces.place, "supple_force", forces);
        this.#call("supple_set_forces", this.loads, this.#forces.place, forces.length, this.places.error);
    }

    /**
     * Displacements from rest of nodes that are `moved`, in place of those before: { node, metre: [x, y, z], ramp:
     * seconds }; without a ramp they are reached at the end of the next call that moves the body.
     */
    setMotions(motions) {
        const { library } = this;
        if (motions.length > this.#motions.most)
            throw new Error(`${motions.length} motions, ${this.#motions.most} nodes are moved`);
        library.writeAll(
            this.#motions.place,
            "supple_motion",
            motions.map((motion) => ({ axes: ALL, ...motion })),
        );
        this.#call(
            "supple_set_motions",
            this.loads,
            this.scene,
            this.#motions.place,
            motions.length,
            this.places.error,
        );
    }

    /**
     * Brings the body to within so many metres of where it rests under its loads; time stands still. Gives the steps
     * that it took.
     */
    settle(metres, mostSteps = 100_000) {
        const { library, places } = this;
        const bytes = library.functions.supple_settle_size(this.nodes);
        places.settle ??= { memory: library.room(bytes), report: library.space("supple_settled") };
        const status = library.functions.supple_sim_settle(
            this.sim,
            metres,
            mostSteps,
            0,
            places.settle.memory,
            bytes,
            places.settle.report,
        );
        const { steps, error } = library.read(places.settle.report, "supple_settled");
        if (status < 0 || status === library.header.statuses.SUPPLE_BEHIND)
            throw new Refusal(library, "supple_sim_settle", status, error);
        return steps;
    }

    /** At rest at time zero; loads stay. */
    reset() {
        this.library.call("supple_state_reset", this.state);
    }

    /**
     * Moves on by so many seconds. Tells status, steps and the estimate of the error; throws where nothing could be
     * moved.
     */
    advance(seconds) {
        const { library, places } = this;
        const status = library.functions.supple_sim_advance(this.sim, seconds, 0, places.report);
        const { call, estimate } = library.read(places.report, "supple_sim_report");
        if (status < 0)
            throw Object.assign(new Refusal(library, "supple_sim_advance", status, call.error), { steps: call.steps });
        return {
            status: library.name(status),
            text: library.text(status),
            steps: call.steps,
            // None of exact steps, and before the first comparison.
            estimate: estimate.known ? estimate : null,
        };
    }

    /** Simulated time, s. */
    time() {
        const { made } = this.places;
        this.library.call("supple_state_time", this.state, made, 0);
        return new DataView(this.library.memory.buffer, made).getFloat64(0, true);
    }

    /** Seconds of the largest exact step that is stable. */
    criticalStep() {
        this.library.call("supple_critical_step", this.scene, this.state, this.places.made, 0);
        return this.library.floats(this.places.made, 1)[0];
    }

    /** Where the nodes are, m: a view that holds until the next call. */
    positions() {
        const { positions } = this.places;
        this.library.call("supple_copy_positions", this.state, this.points, positions, 3 * this.nodes);
        return this.library.floats(positions, 3 * this.nodes);
    }
}
