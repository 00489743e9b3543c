// The page's simulation without the page, in node: it agrees with the native kernel, tells the error at the tumour,
// moves and comes back with every method, and goes on after whatever it is handed. Run by tools/page.sh, which sets
// SUPPLE_WASM, SUPPLE_COMMAND, the command built for this machine, and SUPPLE_LIVER, the page's liver by that command.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";

import { readHeader } from "../../src/javascript/header.mjs";
import { Library } from "../../src/javascript/library.js";
import { readMesh } from "../../src/javascript/mesh.js";
import { Compared } from "../../examples/page/compared.js";
import { METHODS, Simulation } from "../../examples/page/simulation.js";

const root = fileURLToPath(new URL("../..", import.meta.url));
const read = (path, ...options) => readFileSync(join(root, path), ...options);
const header = readHeader(read("include/supple.h", "utf8"));
const scene = JSON.parse(readFileSync(process.env.SUPPLE_LIVER, "utf8"));
const liver = {
    ...scene,
    tetrahedra: Uint32Array.from(scene.tetrahedra),
    triangles: Uint32Array.from(scene.triangles),
};
const module = new WebAssembly.Module(readFileSync(process.env.SUPPLE_WASM));
const first = new Simulation(new Library(module, header), liver);
const hanging = first.hanging();
const start = () => new Simulation(new Library(module, header), liver, hanging);
const compared = () => new Compared(module, header, liver);

const TOP = [-0.0101, -0.0032, 0.0469]; // a point of the dome as it hangs, m
const DOWN = [0, 0, -1];

/** Distances of the nodes, m. */
function distances(a, b) {
    return Array.from({ length: a.length / 3 }, (_, n) =>
        Math.hypot(a[3 * n] - b[3 * n], a[3 * n + 1] - b[3 * n + 1], a[3 * n + 2] - b[3 * n + 2]),
    );
}
/** From where it hangs. */
const largest = (positions) => Math.max(...distances(positions, first.start));
/** In millimetres, for people. */
const mm = (metres, digits = 1) => `${(1e3 * metres).toFixed(digits)} mm`;
const mean = (values) => values.reduce((a, b) => a + b) / values.length;

/** A second with the instrument and two without; what was seen. */
function play(simulation, kind, way) {
    const seen = { force: 0, largest: 0, milliseconds: 0, steps: 0 };
    assert.equal(simulation.begin(kind, TOP, DOWN, simulation.positions().slice()), null);
    for (let frame = 0; frame < 180; frame++) {
        if (frame === 20) simulation.leading.lead(way);
        if (frame === 60) simulation.leading.release();
        seen.last = simulation.frame();
        assert.equal(seen.last.refusal, null);
        if (frame === 59) seen.force = seen.last.tool.force;
        seen.largest = Math.max(seen.largest, largest(seen.last.positions));
        seen.milliseconds += seen.last.milliseconds;
        seen.steps += seen.last.steps;
    }
    return seen;
}

function movedAndCameBack(seen) {
    assert.ok(seen.largest > 0.001, `moved by ${seen.largest} m only`);
    assert.ok(seen.force > 0.05 && seen.force < 50, `a force of ${seen.force} N`);
    assert.equal(seen.last.tool.force, 0);
    const left = largest(seen.last.positions);
    assert.ok(left < 0.0005, `${left} m from rest two seconds after it was let go`);
    const each = seen.milliseconds / seen.steps;
    assert.ok(each > 0.005 && each < 50, `${each} ms a step`);
}

test("the header is read as the library has it", () => {
    assert.equal(header.constants.SUPPLE_ALIGN, 64);
    assert.equal(header.structs.supple_report.size, 96);
    assert.equal(header.structs.supple_error.fields.value.offset, 16);
    assert.throws(() => readHeader("int x;"), /SUPPLE_ABI/);
    assert.throws(() => readHeader("typedef struct { long double x; } supple_y;"), /supple_y.*long double x/);
    assert.throws(() => readMesh("$MeshFormat\n4.1 0 8\n$EndMeshFormat", "a.msh"), /a.msh: not Gmsh 2.2/);
    assert.throws(() => start().setMethod("learned", 1e-3), /no method learned/);
    const library = start().library;
    assert.equal(library.functions.supple_level(), header.constants.SUPPLE_LEVEL_SIMD128);
});

for (const method of METHODS) {
    for (const [kind, way] of [
        ["press", [0.008, 0, 0]],
        ["pull", [0, -0.01, 0.02]],
    ]) {
        test(`${method}: ${kind}, and let go`, (context) => {
            const simulation = start();
            simulation.setMethod(method, 0.002);
            const seen = play(simulation, kind, way);
            movedAndCameBack(seen);
            assert.equal(seen.last.estimate === null, method === "exact");
            context.diagnostic(
                `${mm(seen.largest)}, ${seen.force.toFixed(2)} N, ${mm(largest(seen.last.positions), 4)} left, ` +
                    `${(seen.milliseconds / seen.steps).toFixed(3)} ms a step, ` +
                    `${(seen.milliseconds / 180).toFixed(1)} ms a frame`,
            );
        });
    }
}

test("a body that does not move fails", () => {
    const frozen = start();
    const first = frozen.frame();
    frozen.frame = () => ({ ...first, tool: { force: 0 } });
    assert.throws(() => movedAndCameBack(play(frozen, "pull", [0, 0, 0.02])), /moved by .* m only/);
});

test("the same input gives the same bits", () => {
    const [one, other] = [start(), start()].map(
        (simulation) => play(simulation, "pull", [0.01, 0, 0.01]).last.positions,
    );
    assert.deepEqual(one, other);
});

test("methods can be switched while tissue is held, and feel the same force", () => {
    const simulation = start();
    simulation.begin("pull", TOP, DOWN, simulation.positions().slice());
    simulation.leading.lead([0, 0, 0.01]);
    const force = (method) => {
        simulation.setMethod(method, 0.001);
        let frame;
        for (let number = 0; number < 60; number++) frame = simulation.frame();
        assert.equal(frame.refusal, null);
        return frame.tool.force;
    };
    force("long");
    const exact = force("exact");
    assert.ok(exact > 0.1);
    for (const method of METHODS) {
        const share = force(method) / exact;
        assert.ok(Math.abs(share - 1) < 0.03, `${method}: ${share} of the force of exact steps`);
    }
});

/** Of tests/page/press.toml: frames, and steps in them. */
const FRAMES = 15;
const PRESSES = { exact: { steps: 72 * FRAMES, apart: 5e-6 }, long: { steps: 4 * FRAMES, apart: 5e-6 } };

/** The path of the probe and of the diaphragm in tests/page/press.toml. */
function press(simulation) {
    const { library, tool, places } = simulation;
    const { SUPPLE_SPHERE } = header.constants;
    const pose = (position) => ({ position, rotation: [0, 0, 0, 0] });
    const instrument = library.write(library.space("supple_instrument"), "supple_instrument", {
        shape: SUPPLE_SPHERE,
        ...scene.probe,
        pose: pose([-0.0101, -0.0032, 0.075]),
    });
    library.call("supple_set_instruments", tool.contact, instrument, 1, places.error);
    const end = library.write(library.space("supple_pose"), "supple_pose", pose([-0.0061, -0.0032, 0.044]));
    library.call("supple_move_instrument", tool.contact, 0, end, 0, 0.2, places.error);
    simulation.setMotions(scene.moved.map((node) => ({ node, metre: scene.breath, ramp: 0.2 })));
}

const stepsOf = (method) => ({ method, seconds: FRAMES / 60 / PRESSES[method].steps, tolerance: 0.005 });

/** The same by the native command: where nodes and the middle of the tumour end, m, and what a step took, ms. */
const native = Object.fromEntries(
    Object.entries(PRESSES).map(([method, { steps }]) => {
        const folder = mkdtempSync(join(tmpdir(), "supple-press-"));
        try {
            writeFileSync(join(folder, "liver.msh"), gmsh());
            const path = join(folder, "press.toml");
            const values = {
                METHOD: method,
                STEP: FRAMES / 60 / steps,
                MESH: join(folder, "liver.msh"),
                TUMOUR: scene.tumour.centre,
            };
            writeFileSync(
                path,
                read("tests/page/press.toml", "utf8").replace(/"@([A-Z]+)@"/g, (_, name) =>
                    JSON.stringify(values[name]),
                ),
            );
            execFileSync(process.env.SUPPLE_COMMAND, ["simulate", path, "--out", join(folder, "out")]);
            const rows = (name) =>
                readFileSync(join(folder, "out", name), "utf8")
                    .trim()
                    .split("\n")
                    .slice(1)
                    .map((row) => row.split(","));
            const summary = JSON.parse(readFileSync(join(folder, "out/summary.json"), "utf8"));
            assert.equal(summary.steps, steps);
            const nodes = rows("final.csv").map((row) => row.map(Number));
            return [
                method,
                {
                    positions: Float32Array.from(nodes.flatMap(([, x, y, z, ux, uy, uz]) => [x + ux, y + uy, z + uz])),
                    target: rows("points.csv").at(-1).slice(-3).map(Number),
                    each: summary.us_per_step / 1e3,
                },
            ];
        } finally {
            rmSync(folder, { recursive: true });
        }
    }),
);

/** The liver as a mesh file whose regions are its tissues. */
function gmsh() {
    const { points, tetrahedra, tissueOfElement } = scene;
    const rows = (values, each, row) =>
        Array.from({ length: values.length / each }, (_, index) =>
            row(index, values.slice(each * index, each * (index + 1))),
        );
    return [
        "$MeshFormat",
        "2.2 0 8",
        "$EndMeshFormat",
        "$Nodes",
        points.length / 3,
        ...rows(points, 3, (index, point) => `${index + 1} ${point.join(" ")}`),
        "$EndNodes",
        "$Elements",
        tetrahedra.length / 4,
        ...rows(
            tetrahedra,
            4,
            (index, nodes) =>
                `${index + 1} 4 2 ${tissueOfElement[index] + 1} 1 ${nodes.map((node) => node + 1).join(" ")}`,
        ),
        "$EndElements",
        "",
    ].join("\n");
}

for (const [method, { apart: tolerance }] of Object.entries(PRESSES)) {
    test(`${method}: WebAssembly agrees with the native kernel`, (context) => {
        const simulation = start();
        simulation.set(stepsOf(method));
        press(simulation);
        let milliseconds = 0;
        let steps = 0;
        let frame;
        for (let number = 0; number < FRAMES; number++) {
            frame = simulation.frame();
            milliseconds += frame.milliseconds;
            steps += frame.steps;
        }
        assert.equal(steps, PRESSES[method].steps);
        const { positions, target, each } = native[method];
        const apart = distances(frame.positions, positions);
        const moved = largest(positions);
        assert.ok(moved > 0.005, `the native body moved by ${moved} m only`);
        context.diagnostic(
            `largest displacement ${mm(moved, 3)}; apart at most ${mm(Math.max(...apart), 6)}, ` +
                `mean ${mm(mean(apart), 6)}, tumour ${mm(distances(frame.target, target)[0], 6)}; ` +
                `ms a step: WebAssembly ${(milliseconds / steps).toFixed(3)}, native ${each.toFixed(3)}`,
        );
        assert.ok(Math.max(...apart) < tolerance, `${Math.max(...apart)} m apart`);
        assert.ok(distances(frame.target, target)[0] < tolerance);
    });
}

test("the error at the tumour is the distance of two native runs", (context) => {
    const both = compared();
    both.shown.set(stepsOf("long"));
    both.exact.set(stepsOf("exact"));
    press(both.shown);
    press(both.exact);
    let frame;
    for (let number = 0; number < FRAMES; number++) frame = both.frame();
    const [expected] = distances(native.long.target, native.exact.target);
    context.diagnostic(`${mm(frame.exact.error, 4)}, native ${mm(expected, 4)}; moved by ${mm(frame.moved, 2)}`);
    assert.ok(expected > 2e-5, `native runs are ${expected} m apart only`);
    assert.ok(Math.abs(frame.exact.error - expected) < 3e-6, `${frame.exact.error} m, native ${expected} m`);
    assert.ok(frame.worst >= frame.exact.error);
    const [moved] = distances(native.long.target, first.target);
    assert.ok(moved > 0.005 && Math.abs(frame.moved - moved) < 5e-6, `moved by ${frame.moved} m, native ${moved} m`);
});

test("exact steps have no error at the tumour, and begin again where they were left out", () => {
    const both = compared();
    both.setMethod("exact", 0.001);
    both.breathe(true);
    assert.equal(both.begin("press", TOP, DOWN), null);
    let frame;
    for (let number = 0; number < 40; number++) frame = both.frame();
    assert.ok(frame.moved > 0.001);
    assert.equal(frame.worst, 0);
    both.compare(false);
    assert.equal(both.frame().exact, null);
    both.compare(true);
    frame = both.frame();
    assert.ok(frame.time < 0.02 && frame.exact.error === 0);
});

test("forceps slip rather than tear, in both runs", () => {
    const both = compared();
    both.begin("pull", TOP, DOWN);
    both.lead([0, -0.01, 0.02]);
    const frames = Array.from({ length: 60 }, () => both.frame());
    assert.ok(frames.some(({ slipped }) => slipped));
    assert.deepEqual([both.shown.tool.held, both.exact.tool.held], [0, 0]);
    assert.ok(frames.every(({ refusal, exact }) => !refusal && exact));
});

test("an instrument that one of both runs refuses is taken from both", () => {
    const both = compared();
    both.begin("press", TOP, DOWN);
    both.frame();
    // Through the body at 60 m/s in one of them.
    both.exact.tool.target = both.exact.tool.position = [TOP[0], TOP[1], TOP[2] - 1];
    const frame = both.frame();
    assert.equal(frame.refusal.name, "SUPPLE_E_DIVERGED_INSTRUMENT");
    assert.deepEqual([both.shown.tool.kind, both.exact.tool.kind], [null, null]);
    // One was refused in the middle of the frame, and went on to its end: the error is that of one time.
    for (const { exact } of [frame, both.frame()]) {
        assert.ok(Math.abs(both.shown.time() - both.exact.time()) < 1e-7 && exact.error < 0.001);
    }
});

test("it breathes by as much as the demo, and stops breathed out", () => {
    const simulation = start();
    simulation.breath.let(true);
    const frames = Array.from({ length: 120 }, () => simulation.frame());
    const moved = largest(frames.at(-1).positions);
    assert.ok(Math.abs(moved - Math.hypot(...scene.breath)) < 0.003, `${moved} m`);
    simulation.breath.let(false);
    let frame;
    for (let number = 0; number < 180; number++) frame = simulation.frame();
    assert.ok(largest(frame.positions) < 0.0005, `${largest(frame.positions)} m`);
});

/** Sum of the volumes between a surface and the origin, m^3. */
function volume(positions, { first: from, triangles }) {
    const at = (corner) => Array.from(positions.subarray(3 * (from + corner), 3 * (from + corner) + 3));
    let sum = 0;
    for (let corner = 0; corner < triangles.length; corner += 3) {
        const [[a, b, c], [d, e, f], [g, h, i]] = [0, 1, 2].map((place) => at(triangles[corner + place]));
        sum += (a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)) / 6;
    }
    return Math.abs(sum);
}

test("tumour and vessels are drawn where their tissue is", () => {
    const simulation = start();
    const { surfaces } = simulation.inside;
    assert.deepEqual(
        surfaces.map(({ name }) => name),
        ["tumour", "vessel", "vessel"],
    );
    const inside = simulation.frame().inside;
    const ball = (4 / 3) * Math.PI * scene.tumour.radius ** 3;
    assert.ok(
        Math.abs(volume(inside, surfaces[0]) / ball - 1) < 0.1,
        `${volume(inside, surfaces[0])} m^3, at rest ${ball} m^3`,
    );
    // Its middle is the target.
    const points = Array.from({ length: surfaces[0].count }, (_, point) => inside.subarray(3 * point, 3 * point + 3));
    const middle = [0, 1, 2].map((axis) => mean(points.map((point) => point[axis])));
    assert.ok(distances(middle, simulation.target)[0] < 0.001);
    // They go with the tissue.
    simulation.breath.let(true);
    for (let number = 0; number < 119; number++) simulation.frame();
    const { inside: later } = simulation.frame();
    const moved = distances(later, inside);
    assert.ok(
        Math.min(...moved) > 0.008 && Math.max(...moved) < 0.014,
        `${Math.min(...moved)} to ${Math.max(...moved)} m`,
    );
});

test("what the kernel cannot go on with stands still and says so, until it is reset", () => {
    const simulation = start();
    simulation.setMethod("exact", 0.001);
    simulation.setForces([{ node: 517, newton: [0, 0, 1e6] }]);
    let frame;
    for (let number = 0; number < 60 && !frame?.halted; number++) frame = simulation.frame();
    assert.ok(frame.halted);
    assert.match(frame.refusal.name, /^SUPPLE_(BEHIND|E_DIVERGED)/);
    assert.match(frame.refusal.text, /^the (work|step) /);
    const { positions } = simulation.frame();
    assert.deepEqual(positions, simulation.frame().positions);
    simulation.setForces([]);
    simulation.reset();
    assert.ok(largest(simulation.frame().positions) < 1e-5);
    movedAndCameBack(play(simulation, "press", [0, 0, 0]));
});

test("an instrument that cannot be is refused in the library's words", () => {
    const simulation = start();
    const refused = simulation.begin("press", [NaN, 0, 0], DOWN, simulation.positions().slice());
    assert.equal(refused.name, "SUPPLE_E_INSTRUMENT");
    assert.equal(refused.text, library(simulation, "SUPPLE_E_INSTRUMENT"));
    assert.equal(simulation.frame().refusal, null);
    simulation.setMethod("auto", NaN);
    assert.ok(simulation.frame().halted);
    simulation.setMethod("long", 0.001);
    movedAndCameBack(play(simulation, "press", [0, 0, 0]));
});
const library = (simulation, name) => simulation.library.text(header.statuses[name]);

test("no input stops the module: 600 random messages", () => {
    let seed = 20;
    const random = () => (seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0) / 2 ** 32;
    const odd = [NaN, Infinity, -Infinity, 1e30, -1e30, 0, 1e-40];
    const number = (size) => (random() < 0.05 ? odd[Math.floor(random() * odd.length)] : size * (2 * random() - 1));
    const vector = (size) => [number(size), number(size), number(size)];
    const one = (list) => list[Math.floor(random() * list.length)];
    const both = compared();
    const counts = { refused: 0, halted: 0, frames: 0, compared: 0 };
    for (let message = 0; message < 600; message++) {
        const which = random();
        if (which < 0.1) both.begin(one(["press", "pull", "pin"]), vector(0.08), vector(1));
        else if (which < 0.2) both.lead(vector(one([0.03, 1, 1e4])));
        else if (which < 0.23) both.release();
        else if (which < 0.26) both.setMethod(one(METHODS), random() < 0.3 ? one(odd) : 0.001);
        else if (which < 0.28) both.reset();
        else if (which < 0.3) both.breathe(random() < 0.5);
        else if (which < 0.31) both.compare(random() < 0.7);
        else {
            const frame = both.frame();
            assert.ok(frame.positions.every(Number.isFinite), `message ${message}`);
            counts.frames += 1;
            assert.ok(!frame.exact || Number.isFinite(frame.exact.error), `message ${message}`);
            counts.compared += frame.exact ? 1 : 0;
            counts.refused += frame.refusal ? 1 : 0;
            counts.halted += frame.halted ? 1 : 0;
        }
    }
    assert.ok(
        counts.frames > 300 && counts.compared > 50 && counts.refused > 0 && counts.halted < counts.frames / 2,
        JSON.stringify(counts),
    );
});
