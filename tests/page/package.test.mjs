// The npm package as others get it: installed from its file into an empty folder, it moves a lobe in node, and a program in TypeScript agrees
// with its types. Run by tools/page.sh, which sets SUPPLE_PACKAGE, the file.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { copyFileSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { fileURLToPath } from "node:url";

const root = fileURLToPath(new URL("../..", import.meta.url));
const folder = mkdtempSync(join(tmpdir(), "supple-package-"));
after(() => rmSync(folder, { recursive: true }));
const start = performance.now();
writeFileSync(join(folder, "package.json"), JSON.stringify({ private: true, type: "module" }));
execFileSync("npm", ["install", "--silent", "--no-audit", "--no-fund", "--offline", process.env.SUPPLE_PACKAGE], { cwd: folder });
copyFileSync(join(root, "meshes/lobe.msh"), join(folder, "lobe.msh"));
const manifest = JSON.parse(readFileSync(join(folder, "node_modules/supple-kernel/package.json"), "utf8"));

/** What a program in the folder prints, as JSON. */
const run = (text) => {
    writeFileSync(join(folder, "program.js"), text);
    return JSON.parse(execFileSync("node", ["program.js"], { cwd: folder, encoding: "utf8" }));
};
const readme = /```js\n([\s\S]*?)```/.exec(readFileSync(join(root, "src/javascript/README.md"), "utf8"))[1];
const body = readme.replace(/console\.log.*\n/, "");

test("the package has the version of the crate, and all that it names", () => {
    assert.equal(manifest.version, /^version = "(.*)"/m.exec(readFileSync(join(root, "Cargo.toml"), "utf8"))[1]);
    for (const name of ["LICENSE-MIT", "LICENSE-APACHE", "README.md", "supple.wasm", "index.d.ts", "interface.d.ts"]) {
        assert.ok(readFileSync(join(folder, "node_modules/supple-kernel", name)).length > 500, name);
    }
});

test("a lobe sags in node, by the lines of its README", (context) => {
    const seen = run(`${body}
        const rows = [];
        for (const method of ["exact", "long", "auto"]) {
            lobe.reset();
            lobe.set({ method, seconds: method === "long" ? 1 / 240 : 0 });
            const begin = performance.now();
            const { status, steps } = lobe.advance(1);
            const moved = Math.max(...lobe.positions().map((metre, place) => Math.abs(metre - mesh.points[place])));
            rows.push({ method, status, steps, moved, milliseconds: performance.now() - begin });
        }
        console.log(JSON.stringify(rows));`);
    for (const { method, status, steps, moved, milliseconds } of seen) {
        assert.ok(moved > 0.005 && moved < 0.1 && Math.abs(moved / seen[0].moved - 1) < 0.05, `${method}: moved by ${moved} m`);
        context.diagnostic(`${method}: ${status}, ${(1e3 * moved).toFixed(1)} mm, ${steps} steps in ${(milliseconds / 1e3).toFixed(2)} s`);
    }
    context.diagnostic(`from the file to here: ${((performance.now() - start) / 1e3).toFixed(1)} s`);
});

test("tissue of two kinds hangs from nodes that move", () => {
    const seen = run(`${body}
        const middle = (nodes) => nodes.reduce((sum, node) => sum + mesh.points[3 * node] / 4, 0);
        const corners = Array.from({ length: mesh.tetrahedra.length / 4 }, (_, tet) =>
            Array.from(mesh.tetrahedra.subarray(4 * tet, 4 * tet + 4)));
        const sag = (stiffer) => {
            const tissues = [1, stiffer].map((times) => ({ constants: [750 * times, 40_000], density: 1060 }));
            const tissueOfElement = corners.map((nodes) => Number(middle(nodes) > 0));
            const settings = { damping: 20, mostSteps: 2000 };
            const hangs = new Simulation(lobe.library, mesh, { tissues, tissueOfElement, moved: fixed }, settings);
            hangs.setGravity([0, 0, -9.81]);
            const steps = hangs.settle(1e-5);
            const hung = hangs.positions().slice();
            hangs.setMotions(fixed.map((node) => ({ node, metre: [0, 0, 0.002] })));
            const { status } = hangs.advance(0.1);
            const led = hangs.positions()[3 * fixed[0] + 2] - mesh.points[3 * fixed[0] + 2];
            return { steps, status, led, most: Math.max(...hung.map((metre, at) => Math.abs(metre - mesh.points[at]))) };
        };
        console.log(JSON.stringify([1, 20].map(sag)));`);
    for (const { steps, status, led } of seen) {
        assert.ok(steps > 100 && status === "SUPPLE_OK" && Math.abs(led - 0.002) < 1e-6, JSON.stringify(seen));
    }
    assert.ok(seen[1].most < 0.95 * seen[0].most && seen[1].most > 0.002, JSON.stringify(seen));
});

test("what cannot be is refused in words", () => {
    const said = run(`import { Refusal } from "supple-kernel";\n${body}
        const said = [];
        const attempt = (what) => {
            try { what(); said.push("nothing"); } catch (error) { said.push(error.message, error instanceof Refusal); }
        };
        const other = (given) => new Simulation(lobe.library, mesh, { constants: [750, 40_000], density: 1060, fixed, ...given });
        attempt(() => lobe.set({ method: "fast" }));
        attempt(() => other({ law: "rubber" }));
        attempt(() => other({ density: -1 }));
        attempt(() => lobe.setForces([{ node: 1e6, newton: [1, 0, 0] }]));
        attempt(() => lobe.advance(-1));
        attempt(() => other({ tissues: [{ constants: [750, 40_000], density: 1060 }, { constants: [1, 1], density: 1 }] }));
        attempt(() => lobe.setMotions([{ node: 0, metre: [0, 0, 0] }]));
        console.log(JSON.stringify(said));`);
    assert.match(said[0], /no method fast/);
    assert.match(said[2], /no law rubber, only neo-hookean/);
    assert.match(said[4], /supple_sim_(size|setup): .*SUPPLE_E_/);
    assert.match(said[6], /supple_set_forces: .*SUPPLE_E_/);
    assert.match(said[8], /supple_sim_advance: .*SUPPLE_E_NEGATIVE/);
    assert.match(said[10], /tissueOfElement has 0 entries, there are 8201 tetrahedra/);
    assert.match(said[12], /1 motions, 0 nodes are moved/);
    assert.deepEqual([said[1], said[3], said[5], said[7], said[9]], [false, false, true, true, true]);
});

test("its types are those of a program in TypeScript", () => {
    writeFileSync(join(folder, "program.ts"), `${body}
        const report = lobe.advance(0.1);
        const mean: number | undefined = report.estimate?.mean;
        lobe.setMotions([{ node: fixed[0], metre: [0, 0, 0.001], ramp: 0.1 }]);
        const two = { tissues: [{ constants: [750, 40_000], density: 1060 }], tissueOfElement: [0], moved: [1] };
        const steps: number = new Simulation(lobe.library, mesh, two).settle(1e-5);
        const place = lobe.library.write(lobe.library.space("supple_force"), "supple_force", { node: 3, newton: [0, 0, 1] });
        const status: number = lobe.library.functions.supple_set_forces(lobe.loads, place, 1, 0);
        // @ts-expect-error
        lobe.library.write(place, "supple_force", { nodes: 3 });
        // @ts-expect-error
        lobe.set({ method: "fast" });
        // @ts-expect-error
        new Simulation(lobe.library, mesh, { fixed });
        console.log(mean, status, steps);`);
    const tools = join(root, "src/javascript/node_modules");
    const options = ["--noEmit", "--strict", "--target", "es2022", "--module", "nodenext", "--typeRoots", join(tools, "@types"), "--types", "node"];
    try {
        execFileSync("node", [join(tools, "typescript/bin/tsc"), ...options, "program.ts"], { cwd: folder, encoding: "utf8" });
    } catch (error) {
        assert.fail(error.stdout);
    }
});
