// The C API of supple from JavaScript: memory, structures and calls. All memory is the host's, as in C: here it is what the module's
// memory has above its own data, handed out once and never taken back. `header` is what header.mjs reads from include/supple.h.

const GETTERS = {
    uint32_t: "getUint32", int32_t: "getInt32", supple_status: "getInt32", float: "getFloat32", size_t: "getUint32",
    double: "getFloat64", uint64_t: "getBigUint64",
};
const PAGE = 65536;

export class Library {
    /** @param {WebAssembly.Module} module the library, @param header its interface */
    constructor(module, header) {
        this.functions = new WebAssembly.Instance(module, {}).exports;
        this.memory = this.functions.memory;
        this.header = header;
        this.top = this.functions.__heap_base.value;
        const abi = this.functions.supple_abi();
        if (abi !== header.constants.SUPPLE_ABI) {
            throw new Error(`the module has version ${abi} of the interface, the package ${header.constants.SUPPLE_ABI}`);
        }
        this.names = Object.fromEntries(Object.entries(header.statuses).map(([name, value]) => [value, name]));
    }

    /** So many bytes of memory for as long as the library is there. */
    room(bytes) {
        const align = this.header.constants.SUPPLE_ALIGN;
        const place = Math.ceil(this.top / align) * align;
        this.top = place + bytes;
        const missing = this.top - this.memory.buffer.byteLength;
        if (missing > 0) this.memory.grow(Math.ceil(missing / PAGE));
        return place;
    }

    /** A copy of numbers or bytes in the library's memory. */
    copy(array) {
        const place = this.room(array.byteLength);
        new Uint8Array(this.memory.buffer, place).set(new Uint8Array(array.buffer, array.byteOffset, array.byteLength));
        return place;
    }

    floats(place, count) {
        return new Float32Array(this.memory.buffer, place, count);
    }

    /** Room for structures of this name. */
    space(name, count = 1) {
        return this.room(this.layout(name).size * count);
    }

    layout(name) {
        const layout = this.header.structs[name];
        if (!layout) throw new Error(`no structure ${name}`);
        return layout;
    }

    /** Fills a structure; what `values` does not name is zero, except how a configuration begins. */
    write(place, name, values) {
        const { size, fields } = this.layout(name);
        new Uint8Array(this.memory.buffer, place, size).fill(0);
        const begin = fields.struct_size ? { struct_size: size, abi: this.header.constants.SUPPLE_ABI } : {};
        for (const [key, value] of Object.entries({ ...begin, ...values })) {
            const field = fields[key];
            if (!field) throw new Error(`${name} has no field ${key}`);
            this.#each(field, (at, index) => {
                const one = field.count > 1 ? value[index] : value;
                if (this.header.structs[field.type]) this.write(place + at, field.type, one);
                else this.#view(place + at)[GETTERS[field.type].replace("get", "set")](0, one, true);
            });
        }
        return place;
    }

    /** Fills structures that lie one after the other. */
    writeAll(place, name, list) {
        const { size } = this.layout(name);
        list.forEach((values, index) => this.write(place + size * index, name, values));
        return place;
    }

    /** A structure as an object. */
    read(place, name) {
        const object = {};
        for (const [key, field] of Object.entries(this.layout(name).fields)) {
            const values = [];
            this.#each(field, (at) => {
                const value = this.header.structs[field.type]
                    ? this.read(place + at, field.type)
                    : this.#view(place + at)[GETTERS[field.type]](0, true);
                values.push(value);
            });
            object[key] = field.count > 1 ? values : values[0];
        }
        return object;
    }

    pointer(place) {
        return this.#view(place).getUint32(0, true);
    }

    /** Calls a function that cannot fail here; throws the library's own words if it does. */
    call(name, ...values) {
        const status = this.functions[name](...values);
        if (status < 0) throw new Refusal(this, name, status);
        return status;
    }

    name(status) {
        return this.names[status] ?? String(status);
    }

    /** The library's sentence for a status. */
    text(status) {
        const bytes = new Uint8Array(this.memory.buffer, this.functions.supple_status_text(status));
        return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
    }

    #view(place) {
        return new DataView(this.memory.buffer, place);
    }

    #each(field, visit) {
        const size = this.header.structs[field.type]?.size ?? { double: 8, uint64_t: 8 }[field.type] ?? 4;
        for (let index = 0; index < field.count; index++) visit(field.offset + size * index, index);
    }
}

/** What the library refused, in its own words, with its numbers where it tells them. */
export class Refusal extends Error {
    constructor(library, name, status, { node, value = 0, limit = 0 } = {}) {
        const where = node === undefined || node === library.header.none ? "" : `, node ${node}`;
        const numbers = value === 0 && limit === 0 ? "" : ` (${value.toPrecision(3)}, limit ${limit.toPrecision(3)}${where})`;
        const text = library.text(status) + numbers;
        super(`${name}: ${text} (${library.name(status)})`);
        this.name = "Refusal";
        this.code = status;
        this.status = library.name(status);
        this.text = text;
    }
}
