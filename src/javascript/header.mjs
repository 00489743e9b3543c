// The C interface of supple as data, for JavaScript: constants, statuses, and where each field of a structure lies in the memory of
// WebAssembly, by the rules of C with pointers of 32 bits. Read from include/supple.h when the package is built, so that no offset is
// written by hand. Offsets and sizes are in bytes.

const SIZES = { uint32_t: 4, int32_t: 4, supple_status: 4, float: 4, size_t: 4, double: 8, uint64_t: 8 };

/** @param {string} text of include/supple.h */
export function readHeader(text) {
    const plain = text.replace(/\/\*[\s\S]*?\*\//g, "").replace(/\/\/.*/g, "");
    const constants = {};
    for (const [, name, value] of plain.matchAll(/^#define (SUPPLE_\w+) (\d+)\s*$/gm)) constants[name] = Number(value);
    const statuses = {};
    for (const [, name, value] of plain.matchAll(/^\s*(SUPPLE_\w+) = (-?\d+),/gm)) statuses[name] = Number(value);
    const structs = {};
    for (const [, body, name] of plain.matchAll(/typedef struct \{([^}]*)\} (\w+);/g)) structs[name] = layOut(name, body, structs);
    if (constants.SUPPLE_ABI === undefined || statuses.SUPPLE_OK !== 0 || structs.supple_scene_config === undefined) {
        throw new Error("include/supple.h has no SUPPLE_ABI, no SUPPLE_OK or no supple_scene_config");
    }
    const laws = {};
    const named = text.split("/* Laws")[1]?.split("/* Sizes")[0] ?? "";
    for (const [, name, value] of named.matchAll(/^#define SUPPLE_(\w+) (\d+)/gm)) laws[name.toLowerCase().replaceAll("_", "-")] = Number(value);
    return { constants, statuses, structs, laws, none: 0xffffffff };
}

/** The same as types of TypeScript. */
export function typesOf(text) {
    const { structs, laws } = readHeader(text);
    const plain = text.replace(/\/\*[\s\S]*?\*\//g, "");
    const value = ({ type, count }) => {
        const one = structs[type] ? type : type === "uint64_t" ? "bigint" : "number";
        return count > 1 ? `${one}[]` : one;
    };
    const lines = [
        "// Made by build.mjs from include/supple.h. A pointer is a place in the library's memory.",
        `export type Law = ${Object.keys(laws).map((law) => JSON.stringify(law)).join(" | ")};`, "export interface Structures {"];
    const shapes = Object.entries(structs).filter(([, struct]) => struct);
    for (const [name] of shapes) lines.push(`    ${name}: ${name};`);
    lines.push("}");
    for (const [name, { fields }] of shapes) {
        lines.push(`export interface ${name} {`);
        for (const [field, kind] of Object.entries(fields)) lines.push(`    ${field}: ${value(kind)};`);
        lines.push("}");
    }
    lines.push("/** The functions of the C API. */", "export interface Functions {");
    for (const [, result, name, taken] of plain.matchAll(/^([a-z][\w ]*?[\s*]+)(supple_\w+)\(([^)]*)\);/gm)) {
        const names = taken.split(",").map((one) => one.trim()).filter((one) => one && one !== "void");
        const typed = names.map((one) => {
            const found = /(\w+)(\[\d*\])*$/.exec(one)[1];
            return `${found}: ${/^uint64_t \w+$/.test(one) ? "bigint" : "number"}`;
        });
        lines.push(`    ${name}(${typed.join(", ")}): ${/^void\s*$/.test(result) ? "void" : "number"};`);
    }
    return [...lines, "}", ""].join("\n");
}

/** Fields of a structure in the order of the header: type, offset, and how many there are of it. */
function layOut(struct, body, structs) {
    const fields = {};
    let offset = 0;
    let align = 1;
    for (const line of body.split(";").map((part) => part.trim()).filter(Boolean)) {
        const pointer = line.includes("*");
        const found = /^(?:const )?(\w+) (\w+)((?:\[\d+\])*)$/.exec(line.replace("*", " ").replace(/\s+/g, " "));
        const type = pointer ? "uint32_t" : found?.[1];
        const inner = structs[type];
        const size = pointer ? 4 : (SIZES[type] ?? inner?.size);
        // A function of the host's: only in a structure that a page without threads does not use.
        if (/\(\*\w+\)/.test(line)) return null;
        if (!found) {
            throw new Error(`include/supple.h, ${struct}: "${line}" is no field that can be laid out`);
        }
        if (!size) throw new Error(`include/supple.h, ${struct}: the type of "${line}" is not known`);
        const count = [...found[3].matchAll(/\d+/g)].reduce((product, [n]) => product * Number(n), 1);
        const own = inner?.align ?? size;
        offset = Math.ceil(offset / own) * own;
        fields[found[2]] = { type, offset, count };
        offset += size * count;
        align = Math.max(align, own);
    }
    return { size: Math.ceil(offset / align) * align, align, fields };
}
