// The page's simulation without the page, in node: it agrees with the native kernel, moves and comes back with every method, and goes on
// after whatever it is handed. Run by tools/page.sh, which sets SUPPLE_WASM, and SUPPLE_COMMAND, the command built for this machine.

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
import { METHODS, Simulation } from "../../examples/page/simulation.js";

const root = fileURLToPath(new URL("../..", import.meta.url));
const read = (path, ...options) => readFileSync(join(root, path), ...options);
const header = readHeader(read("include/supple.h", "utf8"));
const mesh = readMesh(read("meshes/lobe.msh", "utf8"), "meshes/lobe.msh");
const module = new WebAssembly.Module(readFileSync(process.env.SUPPLE_WASM));
const start = () => new Simulation(new Library(module, header), mesh);

const TOP = [-0.01, 0.004, 0.0605]; // a point of the dome, m
const DOWN = [0, 0, -1];

/** Distances of the nodes, m. */
function distances(a, b) {
    return Array.from({ length: a.length / 3 }, (_, n) =>
        Math.hypot(a[3 * n] - b[3 * n], a[3 * n + 1] - b[3 * n + 1], a[3 * n + 2] - b[3 * n + 2]));
}
const largest = (positions) => Math.max(...distances(positions, mesh.points));
const mean = (values) => values.reduce((a, b) => a + b) / values.length;

/** A second with the instrument and two without; what was seen. */
function play(simulation, kind, way) {
    const seen = { force: 0, largest: 0, milliseconds: 0, steps: 0 };
    assert.equal(simulation.tool.begin(kind, TOP, DOWN), null);
    for (let frame = 0; frame < 180; frame++) {
        if (frame === 20) simulation.tool.lead(way);
        if (frame === 60) simulation.tool.release();
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
    for (const [kind, way] of [["press", [0.008, 0, 0]], ["pull", [0, -0.01, 0.02]]]) {
        test(`${method}: ${kind}, and let go`, (context) => {
            const simulation = start();
            simulation.setMethod(method, 0.002);
            const seen = play(simulation, kind, way);
            movedAndCameBack(seen);
            assert.equal(seen.last.estimate === null, method === "exact");
            const millimetres = (1e3 * seen.largest).toFixed(1);
            context.diagnostic(`${millimetres} mm, ${seen.force.toFixed(2)} N, ${(seen.milliseconds / seen.steps).toFixed(3)} ms a step, `
                + `${(seen.milliseconds / 180).toFixed(1)} ms a frame, ${(1e3 * largest(seen.last.positions)).toFixed(4)} mm left`);
        });
    }
}

test("a body that does not move fails", () => {
    const frozen = start();
    const first = frozen.frame();
    frozen.frame = () => ({ ...first, tool: { force: 0 } });
    assert.throws(() => movedAndCameBack(play(frozen, "pull", [0, 0, 0.02])), /moved by 0 m only/);
});

test("the same input gives the same bits", () => {
    const [one, other] = [start(), start()].map((simulation) => play(simulation, "pull", [0.01, 0, 0.01]).last.positions);
    assert.deepEqual(one, other);
});

test("methods can be switched while tissue is held, and feel the same force", () => {
    const simulation = start();
    simulation.tool.begin("pull", TOP, DOWN);
    simulation.tool.lead([0, 0, 0.01]);
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

/** The path of tests/page/press.toml in WebAssembly, to its end. */
function press(method) {
    const simulation = start();
    const { library, tool, places } = simulation;
    simulation.setMethod(method, 0.005);
    const { SUPPLE_SPHERE } = header.constants;
    const pose = (position) => ({ position, rotation: [0, 0, 0, 0] });
    const instrument = library.write(library.space("supple_instrument"), "supple_instrument", {
        shape: SUPPLE_SPHERE, radius: 0.01, friction: 0.3, pose: pose([-0.01, 0.004, 0.0725]) });
    library.call("supple_set_instruments", tool.contact, instrument, 1, places.error);
    const end = library.write(library.space("supple_pose"), "supple_pose", pose([-0.006, 0.004, 0.0635]));
    library.call("supple_move_instrument", tool.contact, 0, end, 0, 0.2, places.error);
    let milliseconds = 0;
    let steps = 0;
    let frame;
    for (let number = 0; number < 15; number++) {
        frame = simulation.frame();
        milliseconds += frame.milliseconds;
        steps += frame.steps;
    }
    return { positions: frame.positions, steps, each: milliseconds / steps, simulation };
}

for (const [method, name, steps, tolerance] of [["exact", "tled", 15 * 72, 1e-6], ["long", "long", 60, 1e-5]]) {
    test(`${method}: WebAssembly agrees with the native kernel`, (context) => {
        const folder = mkdtempSync(join(tmpdir(), "supple-press-"));
        context.after(() => rmSync(folder, { recursive: true }));
        const scene = join(folder, "press.toml");
        writeFileSync(scene, read("tests/page/press.toml", "utf8")
            .replace("@METHOD@", name).replace("\"@STEP@\"", String(0.25 / steps)).replace("@MESH@", join(root, "meshes/lobe.msh")));
        execFileSync(process.env.SUPPLE_COMMAND, ["simulate", scene, "--out", join(folder, "out")]);
        const summary = JSON.parse(readFileSync(join(folder, "out/summary.json")));
        const rows = readFileSync(join(folder, "out/final.csv"), "utf8").trim().split("\n").slice(1).map((row) => row.split(",").map(Number));
        const ours = press(method);
        assert.deepEqual([ours.steps, summary.steps], [steps, steps]);
        const native = Float32Array.from(rows.flatMap(([, x, y, z, ux, uy, uz]) => [x + ux, y + uy, z + uz]));
        const apart = distances(ours.positions, native);
        const moved = largest(native);
        assert.ok(moved > 0.005, `the native body moved by ${moved} m only`);
        context.diagnostic(`largest displacement ${(1e3 * moved).toFixed(3)} mm; apart at most ${(1e3 * Math.max(...apart)).toExponential(2)} mm, `
            + `mean ${(1e3 * mean(apart)).toExponential(2)} mm; ms a step: WebAssembly ${ours.each.toFixed(3)}, native ${(summary.us_per_step / 1e3).toFixed(3)}`);
        assert.ok(Math.max(...apart) < tolerance, `${Math.max(...apart)} m apart`);
    });
}

test("what diverges stands still and says so, until it is reset", () => {
    const simulation = start();
    simulation.setMethod("exact", 0.001);
    const { library } = simulation;
    const gravity = library.copy(Float32Array.from([0, 0, -3e8]));
    library.call("supple_set_gravity", simulation.loads, gravity);
    let frame;
    for (let number = 0; number < 60 && !frame?.halted; number++) frame = simulation.frame();
    assert.ok(frame.halted);
    assert.match(frame.refusal.name, /^SUPPLE_E_DIVERGED/);
    assert.match(frame.refusal.text, /limit/);
    const { positions } = simulation.frame();
    assert.deepEqual(positions, simulation.frame().positions);
    library.call("supple_set_gravity", simulation.loads, library.copy(new Float32Array(3)));
    simulation.reset();
    assert.equal(largest(simulation.frame().positions), 0);
    movedAndCameBack(play(simulation, "press", [0, 0, 0]), "exact");
});

test("an instrument that cannot be is refused in the library's words", () => {
    const simulation = start();
    const refused = simulation.tool.begin("press", [NaN, 0, 0], DOWN);
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
    const simulation = start();
    const counts = { refused: 0, halted: 0, frames: 0 };
    for (let message = 0; message < 600; message++) {
        const which = random();
        if (which < 0.1) simulation.begin(one(["press", "pull", "pin"]), vector(0.08), vector(1));
        else if (which < 0.2) simulation.leading.lead(vector(one([0.03, 1, 1e4])));
        else if (which < 0.23) simulation.leading.release();
        else if (which < 0.26) simulation.setMethod(one(METHODS), random() < 0.3 ? one(odd) : 0.001);
        else if (which < 0.28) simulation.reset();
        else {
            const frame = simulation.frame();
            assert.ok(frame.positions.every(Number.isFinite), `message ${message}`);
            counts.frames += 1;
            counts.refused += frame.refusal ? 1 : 0;
            counts.halted += frame.halted ? 1 : 0;
        }
    }
    assert.ok(counts.frames > 300 && counts.refused > 0 && counts.halted < counts.frames / 2, JSON.stringify(counts));
});
