// Tumour and vessels in the liver: points of their surfaces, and the middle of the tumour, which is the target. All
// follow the tissue: located once in the mesh at rest, then moved with its nodes by supple_follow. Metres.

import { length, plus } from "./vectors.js";

const AROUND = 16; // points of a ring
const APART = 0.003; // m, between rings of a vessel
const RINGS = 11; // of the tumour, without its ends

export class Inside {
    /** @param {import("./simulation.js").Simulation} simulation, @param liver its mesh, tumour and vessels */
    constructor(simulation, liver) {
        const { library } = simulation;
        Object.assign(this, { simulation, library });
        const { tetrahedra, tumour, vessels } = liver;
        const bytes = library.functions.supple_locate_size(tetrahedra.length / 4);
        this.mesh = {
            tetrahedra: library.copy(tetrahedra),
            elements: tetrahedra.length / 4,
            memory: library.room(bytes),
            bytes,
        };
        this.centre = this.#followed([tumour.centre]);
        const bodies = [ball(tumour), ...vessels.map((vessel) => tube(this.#within(vessel), vessel.radius))];
        let first = 0;
        /** For the picture: where the points of each surface begin among all, and its triangles. */
        this.surfaces = bodies.map(({ points, triangles }, index) => {
            first += points.length;
            return {
                name: index === 0 ? "tumour" : "vessel",
                first: first - points.length,
                count: points.length,
                triangles,
            };
        });
        this.points = this.#followed(bodies.flatMap(({ points }) => points));
    }

    #followed(points) {
        const { library, simulation, mesh } = this;
        const count = points.length;
        const located = library.space("supple_followed_point", count);
        library.call(
            "supple_locate",
            simulation.points,
            simulation.nodes,
            mesh.tetrahedra,
            mesh.elements,
            library.copy(Float32Array.from(points.flat())),
            count,
            mesh.memory,
            mesh.bytes,
            located,
            0,
        );
        return { located, count, positions: library.room(12 * count) };
    }

    /** Points along a vessel, as far as it is in the liver. */
    #within({ from, to }) {
        const way = plus(to, from, -1);
        const parts = Math.ceil(length(way) / APART);
        const line = Array.from({ length: parts + 1 }, (_, part) => plus(from, way, part / parts));
        const { located } = this.#followed(line);
        const { size } = this.library.layout("supple_followed_point");
        return line.filter(
            (_, index) => this.library.read(located + size * index, "supple_followed_point").distance === 0,
        );
    }

    #positions({ located, count, positions }) {
        this.library.call("supple_follow", this.simulation.state, located, count, positions, 0, 0);
        return this.library.floats(positions, 3 * count).slice();
    }

    /** Where the middle of the tumour is. */
    target() {
        return Array.from(this.#positions(this.centre));
    }

    /** Where the points of the surfaces are. */
    positions() {
        return this.#positions(this.points);
    }
}

function ball({ centre, radius }) {
    const angles = Array.from({ length: RINGS + 2 }, (_, ring) => (Math.PI * ring) / (RINGS + 1));
    const middles = angles.map((angle) => plus(centre, [0, 0, -radius * Math.cos(angle)]));
    return rings(
        middles,
        angles.map((angle) => radius * Math.sin(angle)),
    );
}

const tube = (middles, radius) =>
    rings(
        middles,
        middles.map(() => radius),
    );

/** Rings of points about a straight line, with triangles between them. */
function rings(middles, radii) {
    const along = plus(middles.at(-1), middles[0], -1);
    const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    const unit = (a) => a.map((value) => value / length(a));
    const side = unit(cross(along, Math.abs(along[0]) < Math.abs(along[1]) ? [1, 0, 0] : [0, 1, 0]));
    const other = unit(cross(along, side));
    const points = middles.flatMap((middle, ring) =>
        Array.from({ length: AROUND }, (_, place) => {
            const angle = (2 * Math.PI * place) / AROUND;
            return plus(plus(middle, side, radii[ring] * Math.cos(angle)), other, radii[ring] * Math.sin(angle));
        }),
    );
    const triangles = middles.slice(1).flatMap((_, ring) =>
        Array.from({ length: AROUND }, (_, place) => {
            const [a, b] = [place, (place + 1) % AROUND].map((at) => ring * AROUND + at);
            return [a, b, b + AROUND, a, b + AROUND, a + AROUND];
        }).flat(),
    );
    return { points, triangles };
}
