// Types of the package. SI units: m, kg, s, N, Pa.

import type { Functions, Law, Structures, supple_error, supple_estimate } from "./interface.js";

export type * from "./interface.js";

export type Vector = [number, number, number];
export type Method = "exact" | "long" | "auto";
export declare const METHODS: Method[];

/** What readMesh gives; nodes count from zero. */
export interface Mesh {
    /** x, y, z of each node. */
    points: ArrayLike<number>;
    /** Four nodes each. */
    tetrahedra: ArrayLike<number>;
    /** Three nodes each, of the surface, where instruments shall touch it. */
    triangles?: ArrayLike<number> & Iterable<number>;
    /** The group of each triangle. */
    groups?: ArrayLike<number>;
}

export interface Shape {
    /** "neo-hookean" unless it is given. */
    law?: Law;
    /** "nodal-strain" unless it is given. */
    element?: "linear" | "nodal-pressure" | "nodal-strain";
    /** Nodes that are held. */
    fixed?: number[];
    /** Nodes that are held, and led by `setMotions`. */
    moved?: number[];
}

/** A tissue: constants of the law, at most four, in the order of supple.h, and density. */
export interface Tissue {
    constants: number[];
    density: number;
}

/** Several, and of each tetrahedron which. */
export interface Tissues {
    tissues: Tissue[];
    tissueOfElement: ArrayLike<number>;
}

export interface Settings {
    /** "exact" unless it is given. */
    method?: Method;
    /** Length of the steps, 0 for the kernel's choice. */
    seconds?: number;
    /** 1/s, proportional to mass. */
    damping?: number;
    /** Mean error of the nodes that automatic steps keep to, and that the guard of long ones allows, m. */
    tolerance?: number;
    guard?: boolean;
    /**
     * The most exact steps that a call of `advance` takes, a long one counts four; then its status is SUPPLE_BEHIND. 0:
     * as many as it needs.
     */
    mostSteps?: number;
}

export interface Report {
    /** SUPPLE_OK or what was limited. */
    status: string;
    text: string;
    steps: number;
    estimate: supple_estimate | null;
}

/** The library, with memory of its own: supple.wasm of this package, or what the page has fetched. */
export declare function load(given?: WebAssembly.Module | BufferSource): Promise<Library>;

/** A Gmsh 2.2 text file; `name` is for complaints. */
export declare function readMesh(text: string, name: string): Required<Mesh>;

/** A body in motion. */
export declare class Simulation {
    constructor(library: Library, mesh: Mesh, body: Shape & (Tissue | Tissues), settings?: Settings);
    readonly library: Library;
    /** How many. */
    readonly nodes: number;
    readonly settings: Required<Settings>;
    /** Objects of the C API, for functions of the library. */
    readonly sim: number;
    readonly scene: number;
    readonly state: number;
    readonly loads: number;
    readonly contact: number;
    /** From now on these steps; what is not named stays. */
    set(settings: Settings): void;
    setGravity(gravity: Vector): void;
    /** In place of those before. */
    setForces(forces: { node: number; newton: Vector; ramp?: number }[]): void;
    /**
     * Displacements of nodes that are `moved`, in place of those before; without a ramp (s) reached at the end of the
     * next call that moves the body.
     */
    setMotions(motions: { node: number; metre: Vector; ramp?: number }[]): void;
    /** Brings the body to within so many metres of where it rests under its loads; gives the steps that it took. */
    settle(metres: number, mostSteps?: number): number;
    /** At rest at time zero; loads stay. */
    reset(): void;
    /** Moves on by so many seconds; throws a Refusal where nothing could be moved. */
    advance(seconds: number): Report;
    /** Simulated time, s. */
    time(): number;
    /** The largest exact step that is stable, s. */
    criticalStep(): number;
    /** x, y, z of each node: a view that holds until the next call. */
    positions(): Float32Array;
}

/** Memory, structures and calls of the C API. */
export declare class Library {
    constructor(module: WebAssembly.Module, header: unknown);
    readonly functions: Functions;
    readonly memory: WebAssembly.Memory;
    readonly header: { constants: Record<string, number>; statuses: Record<string, number>; laws: Record<Law, number>; none: number };
    /** The place of so many bytes, for as long as the library is there. */
    room(bytes: number): number;
    copy(array: ArrayBufferView): number;
    floats(place: number, count: number): Float32Array;
    /** Room for structures. */
    space(name: keyof Structures, count?: number): number;
    layout(name: keyof Structures): { size: number; align: number; fields: Record<string, { type: string; offset: number; count: number }> };
    /** Fills a structure; what is not named is zero. */
    write<Name extends keyof Structures>(place: number, name: Name, values: Part<Structures[Name]>): number;
    /** Fills structures that lie one after the other. */
    writeAll<Name extends keyof Structures>(place: number, name: Name, list: Part<Structures[Name]>[]): number;
    read<Name extends keyof Structures>(place: number, name: Name): Structures[Name];
    pointer(place: number): number;
    /** Calls a function that gives a status; throws a Refusal if that is an error. */
    call(name: keyof Functions, ...values: (number | bigint)[]): number;
    name(status: number): string;
    text(status: number): string;
}

/** Fields that are set, also of structures within. */
export type Part<T> = { [Key in keyof T]?: T[Key] extends (infer One)[] ? One[] : T[Key] extends object ? Part<T[Key]> : T[Key] };

/** What the library refused. */
export declare class Refusal extends Error {
    constructor(library: Library, name: string, status: number, error?: Partial<supple_error>);
    readonly code: number;
    /** As SUPPLE_E_UNSTABLE. */
    readonly status: string;
    readonly text: string;
    /** Of `advance`: steps taken before. */
    readonly steps?: number;
}
