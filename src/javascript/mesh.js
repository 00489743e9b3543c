// Points, tetrahedra and boundary triangles of a Gmsh 2.2 text file whose nodes are counted 1, 2, 3, ..., as those in meshes/ are. Metres.

const TRIANGLE = 2;
const TETRAHEDRON = 4;

/** @param {string} text of the file, @param {string} name for complaints */
export function readMesh(text, name) {
    const section = (title) => {
        const found = new RegExp(`\\$${title}\\s+([\\s\\S]*?)\\$End${title}`).exec(text);
        if (!found) throw new Error(`${name}: no section $${title}`);
        return found[1].trim().split(/\r?\n/).map((line) => line.trim().split(/\s+/).map(Number));
    };
    const [[version, binary]] = section("MeshFormat");
    if (version !== 2.2 || binary !== 0) throw new Error(`${name}: not Gmsh 2.2 as text, but ${version}, ${binary}`);
    const [[count], ...nodes] = section("Nodes");
    if (nodes.length !== count || nodes.some((row, index) => row.length !== 4 || row[0] !== index + 1 || row.some(Number.isNaN))) {
        throw new Error(`${name}: not ${count} nodes 1, 2, 3, ... with three coordinates each`);
    }
    const [, ...elements] = section("Elements");
    const corners = (type) => {
        const all = elements.filter((row) => row[1] === type).flatMap((row) => row.slice(3 + row[2]));
        if (all.length === 0 || all.some((node) => !(node >= 1 && node <= count))) {
            throw new Error(`${name}: elements of type ${type} are missing, or name nodes that are not there`);
        }
        return Uint32Array.from(all, (node) => node - 1);
    };
    return {
        points: Float32Array.from(nodes.flatMap((row) => row.slice(1))),
        tetrahedra: corners(TETRAHEDRON),
        triangles: corners(TRIANGLE),
        // The group of each triangle: surfaces that meet at an edge.
        groups: Uint32Array.from(elements.filter((row) => row[1] === TRIANGLE), (row) => row[3]),
    };
}
