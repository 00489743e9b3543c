#ifndef SUPPLE_H
#define SUPPLE_H

/* Made by tools/header.sh from src/capi and the list of laws: do not change it here. */

#include <stddef.h>
#include <stdint.h>

/*
 * supple moves soft tissue in real time. All objects live in memory of the host, at any address that is a
 * multiple of SUPPLE_ALIGN: ask for the size (a function, or a constant expression for static memory), hand
 * the memory to the function that prepares the object, use the pointer it gives back. Nothing is allocated,
 * nothing needs to be released. Units are SI: m, kg, s, N, Pa, J. Nodes and elements count from zero.
 *
 * Most hosts need a supple_sim: supple_default_settings, supple_sim_setup, then supple_sim_advance once a frame. Loads,
 * instruments and displacements are set and read through the objects that supple_sim_describe tells. A host that wants
 * each step in its own hand, or memory of a constant size, prepares these objects by itself.
 *
 * Every function checks its pointers and values before it changes anything and tells by its status. A
 * pointer to an object must be NULL or lead to memory that belongs to the host; what it finds there tells
 * whether it is such an object.
 *
 * Threads: a supple_scene may be used by any number of threads at once; every other object by one at a
 * time. Different objects share nothing.
 */

/* Static memory for an object: SUPPLE_MEMORY(name, bytes); */
#ifdef __cplusplus
#define SUPPLE_MEMORY(name, bytes) alignas(SUPPLE_ALIGN) static unsigned char name[bytes]
#else
#define SUPPLE_MEMORY(name, bytes) static _Alignas(SUPPLE_ALIGN) unsigned char name[bytes]
#endif

/* What every configuration begins with: supple_step_config step = {SUPPLE_CONFIG(supple_step_config), 1e-4f, 0.0f}; */
#define SUPPLE_CONFIG(type) (uint32_t)sizeof(type), SUPPLE_ABI

/* Laws, for all elements of a scene. Each with its constants in the order of supple_tissue. */
#define SUPPLE_NEO_HOOKEAN 0 /* c (Pa), d (Pa) */
#define SUPPLE_EXPONENTIAL 1 /* a (Pa), b, d (Pa) */
#define SUPPLE_POLYNOMIAL 2 /* c (Pa), e (Pa), d (Pa) */

/* Sizes as constant expressions: what the functions give; with SUPPLE_NODAL_STRAIN a scene needs SUPPLE_SCENE_SIZE and
 * SUPPLE_PATCHES_SIZE together, with tissue that relaxes and SUPPLE_PRONY_SIZE, with fibres and SUPPLE_FIBRES_SIZE; the state of
 * tissue that relaxes needs SUPPLE_STATE_SIZE and SUPPLE_RELAXATION_SIZE; of a supple_large, with x * y * z cells that you give,
 * never less. */
#define SUPPLE_SCENE_SIZE(nodes, elements, tissues) (SUPPLE_SCENE_FRONT + SUPPLE_ARRAY_(nodes, 16) +                           \
    1024 * SUPPLE_TILES_(elements) + SUPPLE_ARRAY_(tissues, 20) + SUPPLE_ARRAY_((tissues) > 1 ? (elements) : 0, 2))
#define SUPPLE_PATCHES_SIZE(nodes, elements, tissues) ((size_t)320 * (9 + SUPPLE_GROUPS_(elements) *                             \
    (1 + SUPPLE_LEAST_((size_t)(nodes), 48)) + SUPPLE_PATCHES_(nodes, elements, tissues) / 16 +                                \
    (4 * (size_t)(elements) + 2 * SUPPLE_PATCHES_(nodes, elements, tissues) + 15) / 16 + (((size_t)(nodes) + 1) / 2 + 39) / 40 + \
    (2 * (size_t)(elements) + 39) / 40 + (SUPPLE_PATCHES_(nodes, elements, tissues) + 39) / 40))
#define SUPPLE_PRONY_SIZE(tissues) SUPPLE_ARRAY_(tissues, 24)
#define SUPPLE_FIBRES_SIZE(nodes, elements, tissues, element) (SUPPLE_ARRAY_(tissues, 24) + (size_t)384 *                      \
    ((element) == SUPPLE_NODAL_STRAIN ? SUPPLE_PATCHES_(nodes, elements, tissues) / 16 + SUPPLE_GROUPS_(elements)              \
                                      : SUPPLE_TILES_(elements)))
#define SUPPLE_RELAXATION_SIZE(nodes, elements, tissues, element, terms) ((size_t)768 * (terms) *                              \
    ((element) == SUPPLE_NODAL_STRAIN ? SUPPLE_PATCHES_(nodes, elements, tissues) / 16 + SUPPLE_GROUPS_(elements)              \
                                      : SUPPLE_TILES_(elements)))
#define SUPPLE_STATE_SIZE(nodes, element) \
    (SUPPLE_STATE_FRONT + ((element) == SUPPLE_LINEAR ? 4 : 5) * SUPPLE_ARRAY_(nodes, 16))
#define SUPPLE_LOADS_SIZE(forces, motions) (SUPPLE_LOADS_FRONT + SUPPLE_ARRAY_(forces, 20) + 2 * SUPPLE_ARRAY_(motions, 24))
#define SUPPLE_PRESSURE_SIZE(triangles, surfaces) \
    (SUPPLE_PRESSURE_FRONT + SUPPLE_ARRAY_(triangles, 52) + SUPPLE_ARRAY_(surfaces, 16))
#define SUPPLE_PULLS_SIZE(pulls, nodes) \
    (SUPPLE_PULLS_FRONT + SUPPLE_ARRAY_(nodes, 8) + SUPPLE_ARRAY_(pulls, 96) + SUPPLE_ARRAY_(pulls, 16))
#define SUPPLE_SETTLE_SIZE(nodes) ((size_t)16 * (3 * (size_t)(nodes) + ((size_t)(nodes) + 3) / 4))
#define SUPPLE_LEARNED_SIZE(nodes, fallback) (SUPPLE_LEARNED_FRONT + SUPPLE_ARRAY_(nodes, (fallback) ? 96 : 48))
#define SUPPLE_LARGE_SIZE(nodes, elements, x, y, z) (SUPPLE_LARGE_FRONT + SUPPLE_ARRAY_(1, 104 * (size_t)(nodes) +             \
    (size_t)(elements) / 4 + 36700 + 19188 * SUPPLE_CELLS_(x, y, z) + 1092 * SUPPLE_LEAST_(2 * SUPPLE_CELLS_(x, y, z) + 32,    \
    (size_t)(elements) / 16 + (size_t)(nodes) / 8 + 50) + 64 * SUPPLE_WHOLE_(3 * SUPPLE_FUNCTIONS_(x, y, z)) +                 \
    196 * SUPPLE_FUNCTIONS_(x, y, z) + 4 * SUPPLE_BAND_(3 * SUPPLE_FUNCTIONS_(x, y, z), 12 * SUPPLE_LAYER_(x, y, z)) +         \
    16 * SUPPLE_BAND_(SUPPLE_FUNCTIONS_(x, y, z), 4 * SUPPLE_LAYER_(x, y, z))))
#define SUPPLE_ARRAY_(count, bytes) (((size_t)(count) * (bytes) + SUPPLE_ALIGN - 1) / SUPPLE_ALIGN * SUPPLE_ALIGN)
#define SUPPLE_LEAST_(a, b) ((a) < (b) ? (a) : (b))
#define SUPPLE_GROUPS_(elements) (2 * SUPPLE_LEAST_((size_t)(elements) / 1536 - ((elements) > 1535), 23) + 1)
#define SUPPLE_TILES_(elements) (((size_t)(elements) + 15) / 16 + SUPPLE_GROUPS_(elements) - 1)
#define SUPPLE_PATCHES_(nodes, elements, tissues) SUPPLE_LEAST_((size_t)(nodes) * (tissues), 4 * (size_t)(elements))
#define SUPPLE_FUNCTIONS_(x, y, z) SUPPLE_LEAST_(((size_t)(x) + 1) * ((y) + 1) * ((z) + 1), SUPPLE_LATTICE_FUNCTIONS)
#define SUPPLE_CELLS_(x, y, z) ((size_t)(x) * (y) * (z))
#define SUPPLE_LAYER_(x, y, z) SUPPLE_LEAST_(((size_t)(x) + 1) * ((y) + 1),                                                    \
    SUPPLE_LEAST_(((size_t)(y) + 1) * ((z) + 1), ((size_t)(x) + 1) * ((z) + 1)))
#define SUPPLE_WHOLE_(count) (((count) + 15) / 16 * 16)
#define SUPPLE_BAND_(unknowns, width) (SUPPLE_WHOLE_(unknowns) *                                                               \
    SUPPLE_LEAST_(SUPPLE_WHOLE_(unknowns), SUPPLE_WHOLE_(width) + 16))


/**
 * Version of the interface: of structures, of functions' arguments, of what statuses mean. Put it into
 * the field `abi` of every configuration; a library of another version refuses it.
 */
#define SUPPLE_ABI 7

/**
 * No node, element or axis.
 */
#define SUPPLE_NONE UINT32_MAX

/**
 * What the library was compiled for, without more.
 */
#define SUPPLE_LEVEL_PORTABLE 0

/**
 * x86-64 with AVX2 and FMA.
 */
#define SUPPLE_LEVEL_AVX2 1

/**
 * x86-64 with AVX-512 (F, BW, DQ, VL, VNNI).
 */
#define SUPPLE_LEVEL_AVX512 2

/**
 * 64-bit Arm.
 */
#define SUPPLE_LEVEL_NEON 3

/**
 * WebAssembly with simd128.
 */
#define SUPPLE_LEVEL_SIMD128 4

/**
 * The memory of every object begins at a multiple of so many bytes.
 */
#define SUPPLE_ALIGN 64

/**
 * Elements must have positive volumes: (x1 - x0) . ((x2 - x0) x (x3 - x0)) > 0.
 */
#define SUPPLE_WINDING_CHECKED 0

/**
 * Elements are turned where needed.
 */
#define SUPPLE_WINDING_NORMALISED 1

/**
 * Linear tetrahedra. They lock, that is bend too little, where tissue hardly changes its volume (Poisson's ratio above
 * 0.45).
 */
#define SUPPLE_LINEAR 0

/**
 * Tetrahedra with average nodal pressure, which do not lock. Take these unless you compare with others' linear ones.
 */
#define SUPPLE_NODAL_PRESSURE 1

/**
 * Tetrahedra with stabilised nodal strain, which bend well on coarse meshes and take less time than linear ones, but
 * more memory: supple_patches_size. Elements that are crushed to less than half of their volume resist. Under strains
 * above a half laws that stiffen much are too soft. Only in a library with all laws.
 */
#define SUPPLE_NODAL_STRAIN 2

/**
 * Bytes before the arrays of a scene.
 */
#define SUPPLE_SCENE_FRONT 768

/**
 * Bytes before the arrays of loads.
 */
#define SUPPLE_LOADS_FRONT 128

/**
 * Bytes before the arrays of a state.
 */
#define SUPPLE_STATE_FRONT 192

/**
 * Bytes before the arrays of pressures.
 */
#define SUPPLE_PRESSURE_FRONT 64

/**
 * Most parts of a step.
 */
#define SUPPLE_MOST_PARTS 8

/**
 * Bytes before the arrays of pulls.
 */
#define SUPPLE_PULLS_FRONT 64

/**
 * At a place of the shape at rest: where its material is now, less where it was.
 */
#define SUPPLE_FORWARD_FIELD 0

/**
 * At a place now: where its material was at rest, less where it is.
 */
#define SUPPLE_INVERSE_FIELD 1

/**
 * Shapes of an instrument: all below the plane z = 0 of its axes; a ball around its centre; a cylinder along z with
 * round ends; the signed distances in a field's file, which `supple field` makes of a mesh.
 */
#define SUPPLE_PLANE 0

#define SUPPLE_SPHERE 1

#define SUPPLE_CAPSULE 2

#define SUPPLE_FIELD 3

/**
 * Most instruments of a supple_contact.
 */
#define SUPPLE_MOST_INSTRUMENTS 8

/**
 * Most contact points that are kept of a step.
 */
#define SUPPLE_MOST_CONTACT_POINTS 64

/**
 * Bytes before the arrays of a learned step.
 */
#define SUPPLE_LEARNED_FRONT 2048

/**
 * Points that a lattice may have.
 */
#define SUPPLE_LATTICE_POINTS 1024

/**
 * Functions that a lattice may have.
 */
#define SUPPLE_LATTICE_FUNCTIONS 240

/**
 * Bytes before the arrays of a supple_large.
 */
#define SUPPLE_LARGE_FRONT 10240

/**
 * Exact steps of nine tenths of the critical step, which is looked at again while tissue stiffens.
 */
#define SUPPLE_STEPS_EXACT 0

/**
 * Equal steps beyond the critical one, and a guard that estimates their error.
 */
#define SUPPLE_STEPS_LONG 1

/**
 * Exact and long steps whose length keeps the error below a tolerance.
 */
#define SUPPLE_STEPS_AUTO 2

/**
 * A lead-in of exact steps, then those of a network, with exact ones wherever energy or the guard does not believe it.
 */
#define SUPPLE_STEPS_LEARNED 3

/**
 * The body's box has a diagonal of `value` m: are its points in metres?
 */
#define SUPPLE_REMARK_SIZE 1

/**
 * The body has a mass of `value` kg.
 */
#define SUPPLE_REMARK_MASS 2

/**
 * Tissue `index` has a density of `value` kg/m^3, not about 1000.
 */
#define SUPPLE_REMARK_DENSITY 3

/**
 * Tissue `index` has a Young's modulus of `value` Pa at rest, not 1e3 to 1e5.
 */
#define SUPPLE_REMARK_STIFFNESS 4

/**
 * Tissue `index` has a Poisson's ratio of `value` at rest, not 0.3 to 0.4999: are its constants in the right order?
 */
#define SUPPLE_REMARK_POISSON_RATIO 5

/**
 * Gravity is `value` m/s^2, not 9.81.
 */
#define SUPPLE_REMARK_GRAVITY 6

/**
 * Forces add up to `value` N, the body would be crushed by `limit` N.
 */
#define SUPPLE_REMARK_FORCES 7

/**
 * Motion `index` goes `value` m, farther than the body is large (`limit`, m).
 */
#define SUPPLE_REMARK_WAY 8

/**
 * Motion `index` has a speed of `value` m/s along its ramp, above that of shear waves in the softest tissue (`limit`,
 * m/s).
 */
#define SUPPLE_REMARK_SPEED 9

/**
 * Supports are of nodes far from each other: are they counted from one? The first node is 0.
 */
#define SUPPLE_REMARK_COUNTED_FROM_ONE 10

/**
 * The network learned from another law, other constants or density, or other elements: its error here is not known.
 */
#define SUPPLE_REMARK_OTHER_TISSUE 11

/**
 * Instrument `index` is `value` m thick, and edges of the surface are longer: it passes between the nodes, or feels
 * too little. Give supple_surface its triangles.
 */
#define SUPPLE_REMARK_THIN 12

/**
 * All nodes of pull `index` are held: it moves nothing.
 */
#define SUPPLE_REMARK_HELD_PULL 13

/**
 * Instrument `index` starts within the body, where it touches nothing and pushes the surface from within: let its path
 * begin outside.
 */
#define SUPPLE_REMARK_INSIDE 14

/**
 * Instrument `index` stays `value` m away from the body, which is `limit` m across: is its pose in metres?
 */
#define SUPPLE_REMARK_FAR 15

/**
 * The target of pull `index` is `value` m away from its point, the body `limit` m across: is it in metres?
 */
#define SUPPLE_REMARK_FAR_TARGET 16

/**
 * What became of a call. Zero: done. Positive: done, with a remark, the largest if there are several. Negative: not
 * done, and nothing has changed, except that memory handed to a function that prepares an object may hold none
 * afterwards, that forces are those of the step that was refused, or zero after a critical step, that a supple_large
 * keeps the inertia that a refused step had computed for other pulls, and what supple_learned_step says of a refused
 * one. Numbers are never given another meaning.
 */
enum supple_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Done.
     */
    SUPPLE_OK = 0,
    /**
     * Steps were taken, but are not exact: elements are beyond the range of their law, there is more kinetic energy
     * than loads and supports explain, or a step of a supple_large held much of the motion back. The report tells the
     * first two, also where a larger remark hides them.
     */
    SUPPLE_LIMITED = 1,
    /**
     * Learned steps were taken, with more than one percent of the vertices outside what training has seen.
     */
    SUPPLE_OUTSIDE = 2,
    /**
     * Exact steps have taken the place of learned ones that were not to be believed. The network is tried again in
     * later steps.
     */
    SUPPLE_FELL_BACK = 3,
    /**
     * A guard, automatic steps or supple_sim_advance estimate that the error is more than is allowed.
     */
    SUPPLE_INEXACT = 4,
    /**
     * The work that supple_sim_advance may take (`most_steps`) is spent before the end of the call; the report tells
     * how much time is missing, and its estimate whether the steps were exact enough. Of supple_settle: the body is not
     * at rest yet, and the report tells how far it is from it.
     */
    SUPPLE_BEHIND = 5,
    /**
     * A pointer that must not be NULL is.
     */
    SUPPLE_E_NULL = -1,
    /**
     * A pointer is not aligned: memory of objects to SUPPLE_ALIGN bytes, arrays to their elements.
     */
    SUPPLE_E_MISALIGNED = -2,
    /**
     * Fewer bytes or floats (value) than needed (limit).
     */
    SUPPLE_E_SHORT = -3,
    /**
     * struct_size or abi of a configuration (value) is not this library's (limit).
     */
    SUPPLE_E_ABI = -4,
    /**
     * The memory holds no object: it was never prepared, or the preparation failed.
     */
    SUPPLE_E_NOT_INITIALISED = -5,
    /**
     * The memory holds an object of another type.
     */
    SUPPLE_E_KIND = -6,
    /**
     * A number that stands for a choice (value) is none of the choices.
     */
    SUPPLE_E_CHOICE = -7,
    /**
     * Objects for scenes with other numbers of nodes, or lists of another length (value, limit); or a saved state of tissue that
     * remembers other bytes (value) than that of the state (limit); or tissue `index` is to have another density (value,
     * kg/m^3) than it has (limit).
     */
    SUPPLE_E_MISMATCH = -8,
    /**
     * More (value) than there is room for (limit).
     */
    SUPPLE_E_CAPACITY = -9,
    /**
     * Entry `index` of a list (elements, supports, forces, motions) names a node that is not there (node; limit:
     * nodes).
     */
    SUPPLE_E_INDEX = -10,
    /**
     * Entry or node `index` has a number (value) that is NaN or infinite, or a coordinate of the mesh beyond 1e6 m.
     */
    SUPPLE_E_NOT_FINITE = -11,
    /**
     * Entry `index` has a ramp (value, s) that is negative or not finite; or a span of supple_sim_advance (s), which must be
     * above zero; or as axis tells a tolerance (0; m), a damping (1; 1/s), a lead-in or a time of targets (2; s).
     */
    SUPPLE_E_NEGATIVE = -12,
    /**
     * An array that is written overlaps the object that is read.
     */
    SUPPLE_E_OVERLAP = -13,
    /**
     * The state was prepared for a scene of other elements (value: its own, limit: the scene's).
     */
    SUPPLE_E_ELEMENT = -14,
    /**
     * The points are not those that element `index` of the scene was built from.
     */
    SUPPLE_E_POINTS = -15,
#if defined(SUPPLE_IO)
    /**
     * There is no mesh in the file, for the reason that the words tell.
     */
    SUPPLE_E_FILE = -16,
#endif
    /**
     * The mesh has no nodes or no elements.
     */
    SUPPLE_E_MESH_EMPTY = -20,
    /**
     * Element `index` names `node` twice.
     */
    SUPPLE_E_MESH_REPEATED_NODE = -21,
    /**
     * Element `index` is flat (value: volume, m^3).
     */
    SUPPLE_E_MESH_DEGENERATE = -22,
    /**
     * Element `index` has a negative volume (value, m^3) and winding is SUPPLE_WINDING_CHECKED.
     */
    SUPPLE_E_MESH_INVERTED = -23,
    /**
     * `node` belongs to no element; with index: it is a corner of that triangle of a contact.
     */
    SUPPLE_E_MESH_UNUSED_NODE = -24,
    /**
     * A constant of the law of element `index` (value) is not a finite positive number.
     */
    SUPPLE_E_CONSTANT = -25,
    /**
     * The density of element `index` (value, kg/m^3) is not a finite positive number.
     */
    SUPPLE_E_DENSITY = -26,
    /**
     * Element `index` is of a tissue that is not there.
     */
    SUPPLE_E_TISSUE = -27,
    /**
     * Every element has four fixed nodes.
     */
    SUPPLE_E_NOTHING_MOVES = -28,
    /**
     * The law (value) is not in this library.
     */
    SUPPLE_E_LAW = -29,
    /**
     * Motion `index` moves `node` along an axis on which no support that moves holds it.
     */
    SUPPLE_E_NOT_HELD = -30,
    /**
     * No step has been set: supple_set_step comes first; of a supple_sim: supple_sim_set was refused, call it again.
     */
    SUPPLE_E_NO_STEP = -31,
    /**
     * The step (value, s) is not a finite positive number.
     */
    SUPPLE_E_STEP = -32,
    /**
     * The step (value, s) is above the critical step (limit, s), which `node` sets.
     */
    SUPPLE_E_UNSTABLE = -33,
    /**
     * Instrument `index` has a size, friction or time (value), or a pose, that cannot be.
     */
    SUPPLE_E_INSTRUMENT = -34,
    /**
     * The field of instrument `index` is none, damaged, or reaches the rim of its grid.
     */
    SUPPLE_E_FIELD = -35,
    /**
     * Pull `index` has a point, radius, direction, target, stiffness or most force (value) that cannot be, no nodes, or weights
     * whose sum (value) is not one (limit).
     */
    SUPPLE_E_PULL = -36,
    /**
     * No node is nearer to the point of pull `index` than its radius (value, m); the nearest is at the limit (m).
     */
    SUPPLE_E_NO_NODES = -37,
    /**
     * Tissue `index` relaxes by a share (value; axis: which term) that is no positive number, or without an axis by more
     * in sum than may relax (limit).
     */
    SUPPLE_E_RELAXATION_SHARE = -38,
    /**
     * Tissue `index` relaxes with a time (value, s; axis: which term) that is not from 1e-6 to 1e6 s (limit: which of them).
     */
    SUPPLE_E_RELAXATION_TIME = -39,
    /**
     * Weights do not begin at a multiple of four bytes.
     */
    SUPPLE_E_WEIGHTS_MISALIGNED = -40,
    /**
     * Fewer bytes (value) than the weight file has (limit).
     */
    SUPPLE_E_WEIGHTS_SHORT = -41,
    /**
     * Not a weight file.
     */
    SUPPLE_E_NOT_WEIGHTS = -42,
    /**
     * A version of the weight format (value) that this library does not read.
     */
    SUPPLE_E_WEIGHTS_VERSION = -43,
    /**
     * The weights are damaged.
     */
    SUPPLE_E_WEIGHTS_CHECKSUM = -44,
    /**
     * A number in the weights (value; index: layer) is not one it can be.
     */
    SUPPLE_E_WEIGHTS_CONTENT = -45,
    /**
     * A network with other inputs (value) or outputs than are needed here.
     */
    SUPPLE_E_WEIGHTS_SHAPE = -46,
    /**
     * No lead-in and no learned step has brought the state to this moment: supple_learned_lead comes first.
     */
    SUPPLE_E_NOT_LED = -50,
    /**
     * The network's step (value, s) is no whole number of the exact one (limit, s), or of more than 65536.
     */
    SUPPLE_E_STEP_RATIO = -51,
    /**
     * The damping (value, 1/s) is not that of the training (limit, 1/s).
     */
    SUPPLE_E_DAMPING = -52,
    /**
     * A lattice of impossible cells: each count at least 1, SUPPLE_LATTICE_POINTS points and SUPPLE_LATTICE_FUNCTIONS
     * functions at most. Or a mesh that is too small for a lattice of one cell: take exact steps.
     */
    SUPPLE_E_LATTICE = -60,
    /**
     * The state is not finite, or so stiff at `node` that no step can be bounded.
     */
    SUPPLE_E_TOO_STIFF = -61,
    /**
     * A constant of the fibres of tissue `index` (value; axis: its term, 0 for fibres, 1 for sheets, 2 for coupling) is not a
     * finite positive number.
     */
    SUPPLE_E_FIBRES = -65,
    /**
     * The directions of the fibres in element `index` are zero, not finite, or parallel where there are two. Or without an
     * index: there are none (value) where so many (limit) are needed.
     */
    SUPPLE_E_DIRECTION = -66,
    /**
     * Not a saved state.
     */
    SUPPLE_E_NOT_SAVED = -70,
    /**
     * A saved state of a version (value) that this library does not read.
     */
    SUPPLE_E_SAVED_VERSION = -71,
    /**
     * The saved state is damaged.
     */
    SUPPLE_E_SAVED_CHECKSUM = -72,
    /**
     * This processor does not have these instructions.
     */
    SUPPLE_E_LEVEL = -80,
    /**
     * The grid of an image that cannot be: along `axis` an origin or a spacing (value, m); without an axis directions that
     * are not orthonormal (value: by how much), or no points or too many (value).
     */
    SUPPLE_E_GRID = -85,
    /**
     * The step was not taken: a displacement, first of `node`, would not be a finite number.
     */
    SUPPLE_E_DIVERGED = -90,
    /**
     * The step was not taken: the kinetic energy (value, J), most of it at `node`, is several times what loads and
     * supports ever gave (limit, J).
     */
    SUPPLE_E_DIVERGED_ENERGY = -91,
    /**
     * The step was not taken: force `index` (value, N) would move `node` in it through the tissue around it (limit:
     * its size, m).
     */
    SUPPLE_E_DIVERGED_FORCE = -92,
    /**
     * The step was not taken: supports moved `node` by too much in the step before (value, m) for the tissue around it
     * (limit: its size, m).
     */
    SUPPLE_E_DIVERGED_MOTION = -93,
    /**
     * The step was not taken: instrument `index` would move farther in it, or is farther inside the body at a node,
     * (value, m) than it may (limit): start outside, move slower.
     */
    SUPPLE_E_DIVERGED_INSTRUMENT = -94,
    /**
     * The step was not taken: learned steps cannot meet instruments.
     */
    SUPPLE_E_NO_CONTACT = -95,
    /**
     * The step was not taken: learned steps do not know pulls.
     */
    SUPPLE_E_NO_PULLS = -96,
    /**
     * The step was not taken: learned steps do not know tissue that relaxes or has fibres. Or a state remembers more or
     * fewer bytes (value) than the tissue of the scene needs (limit): supple_state_carry_on, or another state.
     */
    SUPPLE_E_NO_RELAXATION = -97,
    /**
     * The step was not taken: the pressure on surface `index` (value, Pa) would move `node` in it through the tissue
     * around it (limit: its size, m).
     */
    SUPPLE_E_DIVERGED_PRESSURE = -98,
    /**
     * Surface `index` is to be filled, but is open or has no triangles: it has no volume.
     */
    SUPPLE_E_OPEN_SURFACE = -99,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum supple_status supple_status;
#else
typedef int32_t supple_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Steps that choose their length. One thread at a time. It may be copied with memcpy together with its state.
 */
typedef struct supple_adaptive supple_adaptive;

/**
 * Instruments, the nodes that they can touch, and what a state keeps of them. It belongs to one state: save and
 * restore both, or prepare it again. One thread at a time; a call that takes steps changes it.
 */
typedef struct supple_contact supple_contact;

/**
 * A second run of a state. One thread at a time. It may be copied with memcpy together with its state.
 */
typedef struct supple_guard supple_guard;

/**
 * Inertia for steps of one length, whose stiff part is computed anew where tissue deforms. One thread at a time. It may be copied with
 * memcpy together with its state.
 */
typedef struct supple_large supple_large;

/**
 * A network, and what it keeps for each node of one state. One thread at a time. It may be copied with memcpy; copies
 * use the same weights.
 */
typedef struct supple_learned supple_learned;

/**
 * What acts on a scene. One thread at a time; a call that takes steps changes it as well.
 */
typedef struct supple_loads supple_loads;

/**
 * Pressures on surfaces of a body, which follow them as they move. One thread at a time. It may be copied with memcpy.
 */
typedef struct supple_pressure supple_pressure;

/**
 * Pulls of a scene, with their targets. They belong to one state. One thread at a time; a call that takes steps changes
 * them.
 */
typedef struct supple_pulls supple_pulls;

/**
 * The reaction of some supports. It may be copied with memcpy together with its state.
 */
typedef struct supple_reaction supple_reaction;

/**
 * What is simulated: element tables, masses, supports. After supple_scene_init nothing but supple_set_tissues changes
 * it: any number of threads may use one scene at the same time.
 */
typedef struct supple_scene supple_scene;

/**
 * A scene in motion with all that it needs. One thread at a time. A copy by memcpy, to memory that is aligned to
 * SUPPLE_ALIGN, goes on as the original would, to the bit; it has the memory that is in use, and supple_sim_set refuses
 * steps that need more (SUPPLE_E_SHORT).
 */
typedef struct supple_sim supple_sim;

/**
 * What moves. One thread at a time. It may be copied with memcpy, to any memory aligned to SUPPLE_ALIGN, and the copy
 * goes on as the original would, to the bit.
 */
typedef struct supple_state supple_state;

/**
 * A node that does not move freely: along held axes it stands still, or follows motions.
 */
typedef struct {
    /**
     * From zero.
     */
    uint32_t node;
    /**
     * Held axes, at least one: 1 for x, 2 for y, 4 for z, or their sum; 7 for all.
     */
    uint32_t axes;
    /**
     * 0: stands still. 1: motions may be prescribed.
     */
    uint32_t moves;
} supple_support;

/**
 * The constants of a law, and a density.
 */
typedef struct {
    /**
     * In the order that stands with the law (SUPPLE_NEO_HOOKEAN and so on), finite and positive; the rest is ignored.
     */
    float constants[4];
    /**
     * At rest, kg/m^3; finite and positive.
     */
    float density;
} supple_tissue;

/**
 * How a tissue relaxes: a Prony series of at most three terms. Of the stress that changes the shape, term `i` relaxes the
 * share `share[i]` with the time `seconds[i]`; pressure does not relax. The constants of the law are those of a motion
 * that is over before anything relaxes.
 */
typedef struct {
    /**
     * Positive, at most 0.99 in sum; 0: no such term.
     */
    float share[3];
    /**
     * From 1e-6 to 1e6 s; ignored where the share is 0.
     */
    float seconds[3];
} supple_prony;

/**
 * The fibres of a tissue: an energy of their stretch that is added to that of the law, with up to three terms. Each has the
 * constants `a` (Pa) and `b` (no unit), in this order, both finite and positive; `a` = 0: no such term, and `b` is ignored.
 * Families of fibres resist where they are longer than at rest, not where they are shorter.
 */
typedef struct {
    /**
     * Of the stretch along the first direction of each element: fibres.
     */
    float fibres[2];
    /**
     * Of the stretch along the second one: sheets, or a second family.
     */
    float sheets[2];
    /**
     * Of the shear between both.
     */
    float coupling[2];
} supple_fibres;

/**
 * What a scene is built from. Everything is copied; nothing needs to stay.
 */
typedef struct {
    /**
     * sizeof(supple_scene_config).
     */
    uint32_t struct_size;
    /**
     * SUPPLE_ABI.
     */
    uint32_t abi;
    /**
     * The law of all elements: SUPPLE_NEO_HOOKEAN and so on.
     */
    uint32_t law;
    /**
     * SUPPLE_WINDING_CHECKED or SUPPLE_WINDING_NORMALISED.
     */
    uint32_t winding;
    /**
     * Nodes, at least 4.
     */
    uint32_t nodes;
    /**
     * Elements, at least 1.
     */
    uint32_t elements;
    /**
     * Entries of `support`; a node may have several.
     */
    uint32_t supports;
    /**
     * Entries of `tissue`, 1 to 65535.
     */
    uint32_t tissues;
    /**
     * Three coordinates of each node, m. Keep the origin near the body: they are float32.
     */
    const float *points;
    /**
     * Four nodes of each element, from zero.
     */
    const uint32_t *tetrahedra;
    /**
     * The supports; may be NULL if there are none.
     */
    const supple_support *support;
    /**
     * The tissues.
     */
    const supple_tissue *tissue;
    /**
     * With more than one tissue: of which each element is. With one: NULL.
     */
    const uint16_t *tissue_of_element;
    /**
     * SUPPLE_LINEAR, SUPPLE_NODAL_PRESSURE or SUPPLE_NODAL_STRAIN.
     */
    uint32_t element;
    /**
     * 0.
     */
    uint32_t reserved;
    /**
     * For each element 1 if it is removed, as after a resection, else 0; NULL: none is. Nodes and elements keep their
     * numbers; nodes without an element left are held where they are and weigh nothing.
     */
    const uint8_t *removed;
    /**
     * How each of the `tissues` relaxes; NULL: none does. Needs more memory: supple_prony_size, supple_relaxation_size.
     * Only in a library with all laws.
     */
    const supple_prony *prony;
    /**
     * The fibres of each of the `tissues`; NULL: none has any. Needs more memory: supple_fibres_size. Only in a library with
     * all laws.
     */
    const supple_fibres *fibres;
    /**
     * With fibres: six numbers for each element, a vector along its fibres and one along its sheets, at rest, of any length but
     * zero. The part of the second one along the first is taken off; where the element's tissue has neither sheets nor coupling
     * it is not read, and where it has no fibres neither is. Without fibres: NULL.
     */
    const float *directions;
} supple_scene_config;

/**
 * Where and with which value something went wrong. What does not apply is SUPPLE_NONE or zero.
 */
typedef struct {
    /**
     * What the function returned.
     */
    supple_status status;
    /**
     * Position in a list, or number of an element, from zero.
     */
    uint32_t index;
    /**
     * Number of a node, from zero.
     */
    uint32_t node;
    /**
     * 0, 1, 2 for x, y, z; or of a tissue that relaxes or has fibres for the terms of these; or as the status says.
     */
    uint32_t axis;
    /**
     * The offending value; its unit stands with the status.
     */
    double value;
    /**
     * What it may be at most, or should be.
     */
    double limit;
} supple_error;

/**
 * Sizes and costs of a scene.
 */
typedef struct {
    /**
     * Nodes.
     */
    uint32_t nodes;
    /**
     * Elements that take part; those with four fixed nodes, and removed ones, were left out.
     */
    uint32_t elements;
    /**
     * Memory that the scene takes, bytes: what a copy of it needs. With nodal strain less than it was built in.
     */
    uint64_t bytes;
    /**
     * Floating-point operations of one exact step without loads, the same for every step.
     */
    uint64_t operations;
    /**
     * Mass of the body, kg.
     */
    double mass;
} supple_scene_facts;

/**
 * A force on one node. Forces on the same node add up.
 */
typedef struct {
    /**
     * From zero.
     */
    uint32_t node;
    /**
     * Full force, N.
     */
    float newton[3];
    /**
     * Seconds from the start of the simulation over which it grows to that, zero or more.
     */
    float ramp;
} supple_force;

/**
 * A displacement that one node follows along axes on which a support that moves holds it. Of several for
 * the same axis the last one holds.
 */
typedef struct {
    /**
     * From zero.
     */
    uint32_t node;
    /**
     * Axes that follow, at least one: 1 for x, 2 for y, 4 for z, or their sum.
     */
    uint32_t axes;
    /**
     * Full displacement from rest, m.
     */
    float metre[3];
    /**
     * Seconds from the start of the simulation over which it grows to that. Zero: it is reached at the end of the next
     * call that takes steps, evenly from where the node is, which is what a host that follows an instrument wants.
     */
    float ramp;
} supple_motion;

/**
 * The step, and how motion is damped.
 */
typedef struct {
    /**
     * sizeof(supple_step_config).
     */
    uint32_t struct_size;
    /**
     * SUPPLE_ABI.
     */
    uint32_t abi;
    /**
     * Length of a step, s: at most the critical step.
     */
    float seconds;
    /**
     * Damping proportional to mass, 1/s, zero or more. Learned steps use it as well; a supple_large has its own, in
     * supple_large_config.
     */
    float damping;
} supple_step_config;

/**
 * Computes part `part` of what `work` stands for. It may be called from any thread, once for each part; a second call
 * for the same part does nothing.
 */
typedef void (*supple_part)(const void *work, uint32_t part);

/**
 * Threads of the host. A step calls `each` two to four times: it shall call `part(work, p)` for every `p` below
 * `parts`, on whichever threads, at the same time or not, and return when all those calls have. Parts share nothing,
 * and the result does not depend on where they run, to the bit. What `each` leaves out is computed when it has
 * returned. It must return: no exception and no longjmp may leave it.
 */
typedef struct {
    /**
     * Handed to `each`.
     */
    void *context;
    /**
     * Parts that a step shall be cut into; there will be SUPPLE_MOST_PARTS at most, and fewer if the scene is small.
     */
    uint32_t parts;
    /**
     * See above.
     */
    void (*each)(void *context, supple_part part, const void *work, uint32_t parts);
} supple_threads;

/**
 * What became of the steps of a call, and what stopped it. Every call that takes steps writes all of it.
 */
typedef struct {
    /**
     * Simulated time at the end, s; of a step that was not taken, at its start; zero, and all else as if there had
     * been no step, if the call was refused before its first.
     */
    double time;
    /**
     * Kinetic energy at the latest step, J.
     */
    double kinetic;
    /**
     * The most energy that loads and supports ever gave, J.
     */
    double available;
    /**
     * Steps taken by this call.
     */
    uint32_t steps;
    /**
     * The node at which a step diverged, else SUPPLE_NONE.
     */
    uint32_t node;
    /**
     * Smallest volume of an element over its volume at rest, at the start of any of the steps: below 0.1 the law went
     * on along its tangent.
     */
    float least_volume_ratio;
    /**
     * Largest exponent over its cap, of the exponential law: above 1 the law went on along its tangent.
     */
    float saturation;
    /**
     * Kinetic energy beyond the energy balance, as a share of the most that was ever in it; above 0 it is remarked
     * upon.
     */
    float energy_excess;
    /**
     * Learned steps: the largest share of the free vertices whose prediction was clipped.
     */
    float clipped;
    /**
     * Learned steps: the largest share with an input outside what training has seen.
     */
    float outside;
    /**
     * Long steps: mean over the nodes of the inertia added, in masses of the node.
     */
    float added_mass;
    /**
     * Long steps: most nodes that were held back in a step. Exact steps: pulls that are held back at the end of the call, or have been in
     * the 128 steps before, if it was for more than five steps in a row.
     */
    uint32_t held_back;
    /**
     * Long steps: the least share of the lattice's motion that was used in a step; below 0.5 it is
     * remarked upon.
     */
    float lattice_share;
    /**
     * What stopped the call, with place and value; status SUPPLE_OK if nothing did.
     */
    supple_error error;
} supple_report;

/**
 * How a point is pulled.
 */
typedef struct {
    /**
     * The point at rest, m.
     */
    float at[3];
    /**
     * Nodes no farther than that are pulled, m; not used by supple_add_pull_of_nodes.
     */
    float radius;
    /**
     * N/m, from 0, absent, to 1e6.
     */
    float stiffness;
    /**
     * The most force, N, infinite for no limit; zero: a quarter of the shear modulus on the area in which its nodes hang together with other
     * tissue, half of that for fewer than eight nodes. More tears the tissue.
     */
    float most;
    /**
     * The direction along which it pulls, of any length, as the normal of a surface on which the point slides; zeros: along all.
     */
    float along[3];
} supple_pull;

/**
 * Where a pulled point is.
 */
typedef struct {
    /**
     * m.
     */
    float point[3];
    /**
     * From the point to the target, m; along the direction of a pull that has one; zero for one without a target.
     */
    float gap[3];
    /**
     * On the tissue in the latest step, N.
     */
    float force[3];
} supple_pulled;

/**
 * Vectors where they are, without a copy: three floats each, `stride` bytes apart.
 */
typedef struct {
    /**
     * The first component of the first vector.
     */
    const float *first;
    /**
     * Bytes from one vector to the next.
     */
    size_t stride;
    /**
     * Vectors, one for each node.
     */
    uint32_t count;
} supple_vectors;

/**
 * Where an instrument is.
 */
typedef struct {
    /**
     * Its centre, m.
     */
    float position[3];
    /**
     * Quaternion x, y, z, w that turns its axes into those of the scene, of any length; all zero: not turned.
     */
    float rotation[4];
} supple_pose;

/**
 * A rigid instrument.
 */
typedef struct {
    /**
     * SUPPLE_PLANE, SUPPLE_SPHERE, SUPPLE_CAPSULE or SUPPLE_FIELD.
     */
    uint32_t shape;
    /**
     * Of a sphere or capsule, m. Below the length of the surface's edges the surface needs triangles: else it passes
     * between nodes.
     */
    float radius;
    /**
     * Of a capsule, between the centres of its ends, m.
     */
    float length;
    /**
     * Coulomb's coefficient of friction, zero or more.
     */
    float friction;
    /**
     * Where it is.
     */
    supple_pose pose;
    /**
     * Of a field: the bytes of its file, aligned to four, used where they are as long as the contact; else NULL.
     */
    const void *field;
    /**
     * How many.
     */
    size_t field_bytes;
} supple_instrument;

/**
 * A point that follows the tissue. It may be copied and kept as bytes; it belongs to the mesh that it was located in.
 */
typedef struct {
    /**
     * Where it is at rest, m.
     */
    float rest[3];
    /**
     * The tetrahedron that holds it, or the nearest one.
     */
    uint32_t element;
    /**
     * The nodes of the element.
     */
    uint32_t nodes[4];
    /**
     * How much of each node's displacement is the point's: from 0 to 1, 1 in sum. Of a point outside those of the
     * nearest point of the element.
     */
    float weights[4];
    /**
     * From the element at rest, m; 0 inside.
     */
    float distance;
} supple_followed_point;

/**
 * The grid of an image, as ITK has it but in metres and in the axes of the mesh: place = origin + direction * (spacing *
 * index).
 */
typedef struct {
    /**
     * Of the first point, m.
     */
    double origin[3];
    /**
     * Between points along each axis of the grid, m.
     */
    double spacing[3];
    /**
     * Direction cosines, row by row: column `a` is the direction of axis `a` of the grid. Orthonormal to a thousandth.
     */
    double direction[3][3];
    /**
     * Points along each axis of the grid, at most 2^31 together.
     */
    uint32_t size[3];
} supple_image_grid;

/**
 * What instruments can touch.
 */
typedef struct {
    /**
     * Numbers of the nodes, those of the boundary; NULL: the first `node_count` nodes, all of them with the scene's
     * number.
     */
    const uint32_t *nodes;
    /**
     * Numbers of the three nodes of each triangle between these nodes, where an instrument is thinner than edges are
     * long (supple_needs_triangles); else NULL.
     */
    const uint32_t *triangles;
    /**
     * How many.
     */
    uint32_t node_count;
    /**
     * How many.
     */
    uint32_t triangle_count;
} supple_surface;

/**
 * What an instrument feels.
 */
typedef struct {
    /**
     * Force of the tissue on the instrument in the latest step, N.
     */
    float force[3];
    /**
     * Moment of the same about its position, N m.
     */
    float moment[3];
    /**
     * Mean of the force over the steps of the latest call that took steps, N; of steps that choose their length
     * (supple_adaptive_advance, SUPPLE_STEPS_AUTO) that of the latest step.
     */
    float mean_force[3];
    /**
     * Nodes that it pushes or holds, and triangles.
     */
    uint32_t contacts;
    /**
     * How far the deepest one would have been inside without the instrument, m.
     */
    float depth;
    /**
     * Work that it did on the tissue in the latest step, J.
     */
    float work;
    /**
     * What friction took of the work of the instrument, J.
     */
    float friction_loss;
} supple_touch;

/**
 * Where an instrument pushes a node or a triangle.
 */
typedef struct {
    /**
     * m.
     */
    float position[3];
    /**
     * Outward normal of the instrument; zero where it holds the node.
     */
    float normal[3];
    /**
     * Force of the instrument on the tissue, N.
     */
    float force[3];
    /**
     * How far the point would have been inside without the instrument, m.
     */
    float depth;
    /**
     * From zero; of a triangle the corner with most of the force.
     */
    uint32_t node;
    /**
     * From zero.
     */
    uint32_t instrument;
} supple_contact_point;

/**
 * The force on an instrument between two frames, for a haptic loop: supple_local_force_follow after each frame,
 * supple_local_force_at as often as you like, on any thread, on a copy. Begin with all zero.
 */
typedef struct {
    /**
     * Of the instrument in the latest frame, m.
     */
    float position[3];
    /**
     * Force of the tissue on it there, N.
     */
    float force[3];
    /**
     * Change of the force with the position, N/m, symmetric: force = force + stiffness (position - position in the
     * frame).
     */
    float stiffness[3][3];
    /**
     * How far the force that was predicted for the latest frame was off, N.
     */
    float error;
    /**
     * How far off it would have been to hold the force of the frame before, N.
     */
    float hold_error;
} supple_local_force;

/**
 * What a learned step needs.
 */
typedef struct {
    /**
     * sizeof(supple_learned_config).
     */
    uint32_t struct_size;
    /**
     * SUPPLE_ABI.
     */
    uint32_t abi;
    /**
     * 1: a learned step that diverges, or has more kinetic energy than loads and supports explain, is undone and exact
     * steps take its place and that of some more, before the network is tried again. 0: the caller decides by status
     * and report. 1 needs memory for two vectors a node more.
     */
    uint32_t fallback;
    /**
     * 0.
     */
    uint32_t reserved;
    /**
     * A weight file, at a multiple of 4 bytes, better of 64. It is used where it is, without a copy: it must stay,
     * unchanged, as long as the object is used.
     */
    const void *weights;
    /**
     * Its bytes; what lies behind the file is ignored.
     */
    size_t weights_bytes;
} supple_learned_config;

/**
 * What a network was trained for, and what a prediction costs.
 */
typedef struct {
    /**
     * Length of a learned step, s.
     */
    float seconds;
    /**
     * Damping of the training, 1/s; the state's step must have the same.
     */
    float damping;
    /**
     * Law of the training, SUPPLE_NEO_HOOKEAN and so on; in another tissue the network's error is not known.
     */
    uint32_t law;
    /**
     * Its constants and density, as in a scene.
     */
    supple_tissue tissue;
    /**
     * Length of the exact step that it learned from, s.
     */
    float exact_seconds;
    /**
     * Multiplications with additions of one node's prediction.
     */
    uint64_t multiply_adds;
    /**
     * How often exact steps have taken the place of learned ones since the object was prepared or reset.
     */
    uint32_t fell_back;
    /**
     * Elements of the training, SUPPLE_LINEAR and so on; in a scene of others the network's error is not known.
     */
    uint32_t element;
} supple_learned_facts;

/**
 * What steps beyond the critical one need. Inertia is raised where they would be unstable, smooth motion keeps its true
 * inertia through a coarse lattice, and what the lattice does not carry is damped.
 */
typedef struct {
    /**
     * sizeof(supple_large_config).
     */
    uint32_t struct_size;
    /**
     * SUPPLE_ABI.
     */
    uint32_t abi;
    /**
     * Length of a step, s.
     */
    float seconds;
    /**
     * Damping proportional to mass, 1/s, zero or more. That of supple_step_config is not used here: give the same
     * value twice if both kinds of steps move a state.
     */
    float damping;
    /**
     * Cells of the lattice along x, y, z; zeros: chosen for the scene.
     */
    uint32_t cells[3];
} supple_large_config;

/**
 * What a guard needs.
 */
typedef struct {
    /**
     * sizeof(supple_guard_config).
     */
    uint32_t struct_size;
    /**
     * SUPPLE_ABI.
     */
    uint32_t abi;
    /**
     * Length of the steps that are guarded, s, and their damping, 1/s.
     */
    float seconds;
    float damping;
    /**
     * How many times as long the second run's steps are, at least 1 and at least the number of steps between two calls
     * of supple_guard_follow. More costs less time, about a long step in so many, and calls more right steps
     * inexact. 3 is a good choice, the steps of a frame another; 1 for learned steps.
     */
    uint32_t every;
    /**
     * Mean error of the nodes that is allowed, m; 0: a fifth of the mean motion so far, where that is more than a
     * millimetre and a hundredth of the size of the body, of a body that has moved by less than its error more than a
     * tenth of that.
     */
    float tolerance;
} supple_guard_config;

/**
 * What a guard estimates, m.
 */
typedef struct {
    /**
     * 1 if there is an estimate: after the first comparison. 0: the other fields mean nothing.
     */
    uint32_t known;
    /**
     * The node with the largest error.
     */
    uint32_t node;
    /**
     * Mean error of the nodes.
     */
    float mean;
    /**
     * The largest.
     */
    float largest;
    /**
     * What is allowed for the mean.
     */
    float allowed;
} supple_estimate;

/**
 * What a call of supple_adaptive_advance took.
 */
typedef struct {
    /**
     * Exact steps, those included that were undone.
     */
    uint32_t exact;
    /**
     * Steps beyond the critical one.
     */
    uint32_t large;
    /**
     * Changes of the length of the steps; each costs about a cycle of steps.
     */
    uint32_t changes;
    /**
     * Length of the next steps, s.
     */
    float next_seconds;
    /**
     * Estimate of the error at the end.
     */
    supple_estimate estimate;
} supple_adaptive_report;

/**
 * The force by which supports act on the tissue, the mean since the last call of supple_reaction_follow, N.
 */
typedef struct {
    /**
     * 1 if there is a force; 0 at the first call, after a reset or a restore, and where it is no finite number: the
     * other fields mean nothing.
     */
    uint32_t known;
    /**
     * 1 if the steps resolve it: `spread` is at most a quarter of it. 0: do not use it.
     */
    uint32_t resolved;
    float newton[3];
    /**
     * How far the force at the supports alone is from it.
     */
    float spread;
} supple_reaction_force;

/**
 * How a scene is moved, and what there shall be room for. supple_default_settings fills it.
 */
typedef struct {
    /**
     * sizeof(supple_settings).
     */
    uint32_t struct_size;
    /**
     * SUPPLE_ABI.
     */
    uint32_t abi;
    /**
     * SUPPLE_STEPS_EXACT and so on.
     */
    uint32_t steps;
    /**
     * Length of the steps, s; 0: chosen. Of long steps at most so much, 20 critical steps unless given; of exact
     * ones, a network's included, at most so much, nine tenths of the critical step unless given, and shorter where
     * the critical step falls while they are taken: above the critical step of the state as it is they are refused
     * (SUPPLE_E_UNSTABLE); of SUPPLE_STEPS_AUTO the longest, 100 critical steps unless given.
     */
    float seconds;
    /**
     * Damping proportional to mass, 1/s, zero or more. A network has that of its training.
     */
    float damping;
    /**
     * Mean error of the nodes that you accept, m; 0: chosen. What SUPPLE_STEPS_AUTO keeps, half a millimetre or less in
     * bodies below 10 cm unless given, and what a guard calls inexact, a fifth of the motion unless given.
     */
    float tolerance;
    /**
     * 1: a guard estimates the error of long and of learned steps. 0: nothing does.
     */
    uint32_t guard;
    /**
     * 1: exact steps take the place of learned ones that are not to be believed. 0: the call stops there.
     */
    uint32_t fallback;
    /**
     * Seconds of exact steps before a network takes over.
     */
    double lead_in;
    /**
     * Cells of the lattice of long steps along x, y, z; zeros: chosen for the scene.
     */
    uint32_t cells[3];
    /**
     * The most work that a call of supple_sim_advance takes, in exact steps; a long or a learned one counts four, and
     * is taken while any is left. 0: as much as it takes. When it is spent the call ends with SUPPLE_BEHIND, and the next goes on
     * from there.
     */
    uint32_t most_steps;
    /**
     * Most forces on nodes that the loads will have.
     */
    uint32_t forces;
    /**
     * Most motions.
     */
    uint32_t motions;
    /**
     * Most nodes that instruments hold at once.
     */
    uint32_t grips;
    /**
     * What instruments can touch; no nodes: there are none. Copied.
     */
    supple_surface surface;
    /**
     * Of learned steps the weight file, at a multiple of 4 bytes, better of 64. It is used where it is and must stay.
     * Others do not read it.
     */
    const void *weights;
    /**
     * Its bytes; 0 with NULL.
     */
    size_t weights_bytes;
} supple_settings;

/**
 * The objects of a simulation, for all functions that take them.
 */
typedef struct {
    /**
     * What is simulated.
     */
    const supple_scene *scene;
    /**
     * What moves: to be read, saved, reset, restored.
     */
    supple_state *state;
    /**
     * What acts: gravity, forces and motions are set there, between two calls as you like.
     */
    supple_loads *loads;
    /**
     * The instruments; NULL without a surface.
     */
    supple_contact *contact;
    /**
     * The network of SUPPLE_STEPS_LEARNED, to be described or remarked upon; else NULL.
     */
    const supple_learned *learned;
    /**
     * Of the memory that was handed to supple_sim_setup so many bytes are in use: fewer than supple_sim_size.
     */
    size_t bytes;
} supple_sim_objects;

/**
 * What a call of supple_sim_advance came to.
 */
typedef struct {
    /**
     * As of all calls that take steps; its steps are those taken, of all kinds.
     */
    supple_report call;
    /**
     * Exact steps taken.
     */
    uint32_t exact;
    /**
     * Steps beyond the critical one.
     */
    uint32_t long_steps;
    /**
     * Those of a network.
     */
    uint32_t learned;
    /**
     * Steps that were computed and not taken, or taken back.
     */
    uint32_t undone;
    /**
     * What is missing to the end of the call where the work was spent before it, s; else 0.
     */
    double missing;
    /**
     * The shortest and the longest step taken, s.
     */
    float shortest;
    float longest;
    /**
     * The estimate of the error at the end, by the guard or by SUPPLE_STEPS_AUTO.
     */
    supple_estimate estimate;
} supple_sim_report;

/**
 * What supple_settle came to.
 */
typedef struct {
    /**
     * The estimate of the largest distance of a node from where it rests, m; infinite before the body has swung once.
     */
    float remaining;
    /**
     * Steps that were computed.
     */
    uint32_t steps;
    /**
     * What stopped the call; status SUPPLE_OK if nothing did.
     */
    supple_error error;
} supple_settled;

/**
 * What does not look right. Numbers that have no meaning are 0, an index SUPPLE_NONE.
 */
typedef struct {
    /**
     * SUPPLE_REMARK_SIZE and so on.
     */
    uint32_t kind;
    /**
     * Entry of the list that it is about.
     */
    uint32_t index;
    double value;
    double limit;
} supple_remark;

#if defined(SUPPLE_IO)
/**
 * How large the mesh of a file is. A host defines SUPPLE_IO, and has a library with the feature io, to use this and
 * the two functions that take it.
 */
typedef struct {
    /**
     * Nodes, also those of no element.
     */
    uint32_t nodes;
    /**
     * Tetrahedra.
     */
    uint32_t elements;
    /**
     * 1 if the file tells of what region each tetrahedron is; else 0.
     */
    uint32_t has_regions;
} supple_mesh_size;
#endif

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * The instructions that steps use: the best of this processor, or those chosen.
 */
uint32_t supple_level(void);

/**
 * Makes all later steps of this process use these instructions. Call it before threads take steps.
 */
supple_status supple_set_level(uint32_t level);

/**
 * Version of the interface that the library has. SUPPLE_ABI is the one of the header.
 */
uint32_t supple_abi(void);

/**
 * Version of the library, such as "0.1.0". There for as long as the library is.
 */
const char *supple_version(void);

/**
 * The sentence for a status, in English and without its numbers; for a number that is no status, that it is none.
 * Never NULL, and there for as long as the library is.
 */
const char *supple_status_text(int32_t status);

/**
 * Bytes of memory that a scene with tissue that relaxes needs more than supple_scene_size. SUPPLE_PRONY_SIZE is the same
 * as a constant.
 */
size_t supple_prony_size(uint32_t tissues);

/**
 * Bytes of memory that the state of a scene with tissue that relaxes needs more than supple_state_size, for what the
 * tissue remembers. SUPPLE_RELAXATION_SIZE is the same as a constant.
 *
 * @param element SUPPLE_LINEAR, SUPPLE_NODAL_PRESSURE or SUPPLE_NODAL_STRAIN.
 * @param terms of the tissue that has most: 1 to 3.
 */
size_t supple_relaxation_size(uint32_t nodes,
                              uint32_t elements,
                              uint32_t tissues,
                              uint32_t element,
                              uint32_t terms);

/**
 * Bytes of memory that a scene with fibres needs more than supple_scene_size; zero if there can be no such scene.
 * SUPPLE_FIBRES_SIZE is the same as a constant.
 *
 * @param element SUPPLE_LINEAR, SUPPLE_NODAL_PRESSURE or SUPPLE_NODAL_STRAIN.
 */
size_t supple_fibres_size(uint32_t nodes,
                          uint32_t elements,
                          uint32_t tissues,
                          uint32_t element);

/**
 * Bytes of memory that a scene needs; zero if there can be no such scene. SUPPLE_SCENE_SIZE is the same as a constant.
 * With SUPPLE_NODAL_STRAIN it needs supple_patches_size bytes more, with tissue that relaxes supple_prony_size, with fibres
 * supple_fibres_size.
 */
size_t supple_scene_size(uint32_t nodes,
                         uint32_t elements,
                         uint32_t tissues);

/**
 * Bytes of memory that a scene with SUPPLE_NODAL_STRAIN needs more than supple_scene_size: enough to build it from any
 * mesh whose elements of a tissue around a node are joined by faces, with at most 48 neighbours of a node. For others
 * supple_scene_init returns SUPPLE_E_SHORT, and the error's limit is enough. The scene takes about half of these
 * bytes: supple_scene_describe tells. SUPPLE_PATCHES_SIZE is the same as a constant.
 */
size_t supple_patches_size(uint32_t nodes,
                           uint32_t elements,
                           uint32_t tissues);

/**
 * Builds a scene in `memory` of at least supple_scene_size bytes, with SUPPLE_NODAL_STRAIN and supple_patches_size, with
 * tissue that relaxes and supple_prony_size, with fibres and supple_fibres_size, aligned to SUPPLE_ALIGN. On success
 * `*scene` is the scene, at the beginning of that memory. What it takes of it is told by supple_scene_describe; the rest is
 * free for other use.
 *
 * @param error may be NULL; index is that of an element, a support, a node or a tissue as the status says.
 */
supple_status supple_scene_init(void *memory,
                                size_t bytes,
                                const supple_scene_config *config,
                                supple_scene **scene,
                                supple_error *error);

/**
 * Writes sizes and costs of a scene.
 */
supple_status supple_scene_describe(const supple_scene *scene, supple_scene_facts *facts);

/**
 * Bytes of memory that loads need with room for so many forces and motions. SUPPLE_LOADS_SIZE is the same as a
 * constant.
 */
size_t supple_loads_size(uint32_t forces,
                         uint32_t motions);

/**
 * Prepares loads for a scene in `memory` of at least supple_loads_size bytes, aligned to SUPPLE_ALIGN: none yet,
 * with room for so many forces and motions.
 */
supple_status supple_loads_init(void *memory,
                                size_t bytes,
                                const supple_scene *scene,
                                uint32_t forces,
                                uint32_t motions,
                                supple_loads **loads);

/**
 * Sets gravity, three components, m/s^2.
 */
supple_status supple_set_gravity(supple_loads *loads, const float *gravity);

/**
 * Replaces all forces by `count` others, which are copied; none with a count of zero.
 *
 * @param error may be NULL; index is that of a force.
 */
supple_status supple_set_forces(supple_loads *loads,
                                const supple_force *forces,
                                uint32_t count,
                                supple_error *error);

/**
 * Replaces all motions by `count` others, which are copied; none with a count of zero: moved nodes then stay where
 * they are.
 *
 * @param error may be NULL; index is that of a motion.
 */
supple_status supple_set_motions(supple_loads *loads,
                                 const supple_scene *scene,
                                 const supple_motion *motions,
                                 uint32_t count,
                                 supple_error *error);

/**
 * Lets the instruments of a contact touch what these loads act on, as long as both are there; NULL: none do. Learned
 * steps refuse loads with instruments, and a library without the feature `contact` refuses them here.
 */
supple_status supple_set_contact(supple_loads *loads,
                                 supple_contact *contact);

/**
 * Writes the forces of a uniform traction on triangles of the boundary at rest, three for each, for supple_set_forces
 * among others: a third of traction times area to each corner. Their direction stays while the body moves. Where elements are
 * removed they go on to act on the nodes that are left: make them again, of the triangles that are left.
 *
 * @param points of all `nodes` of the scene at rest, m, three coordinates each.
 * @param triangles three nodes of each of `count` triangles, as of supple_boundary.
 * @param pascal three components, Pa.
 * @param ramp seconds from the start of the simulation over which the forces grow to their full size, zero or more.
 * @param forces room for `room` of them, three times `count` at least.
 * @param error may be NULL; index is that of a triangle.
 */
supple_status supple_traction(const float *points,
                              uint32_t nodes,
                              const uint32_t *triangles,
                              uint32_t count,
                              const float *pascal,
                              float ramp,
                              supple_force *forces,
                              size_t room,
                              supple_error *error);

/**
 * Bytes of memory that the state of so many nodes needs; zero for an element that there is not. SUPPLE_STATE_SIZE is
 * the same as a constant. With tissue that relaxes it needs supple_relaxation_size bytes more.
 *
 * @param element of the scene: SUPPLE_LINEAR, SUPPLE_NODAL_PRESSURE or SUPPLE_NODAL_STRAIN.
 */
size_t supple_state_size(uint32_t nodes,
                         uint32_t element);

/**
 * Prepares the state of a scene, at rest, in `memory` of at least supple_state_size bytes, with tissue that relaxes and
 * supple_relaxation_size, aligned to SUPPLE_ALIGN.
 */
supple_status supple_state_init(void *memory,
                                size_t bytes,
                                const supple_scene *scene,
                                supple_state **state);

/**
 * Puts a state back to rest at time zero; tissue that relaxes remembers nothing. Its step stays. The first step of a supple_large computes its inertia anew;
 * a supple_learned needs supple_learned_reset and a new lead-in.
 */
supple_status supple_state_reset(supple_state *state);

/**
 * Stops all motion: nodes, time and what tissue remembers stay as they are, velocities are zero, and the energy balance
 * begins with the strain energy. To go on after SUPPLE_E_DIVERGED_ENERGY from a state that was not saved before. A supple_learned
 * needs a new lead-in.
 */
supple_status supple_state_stop(const supple_scene *scene,
                                supple_state *state);

/**
 * Writes a bound on the stable step at the state's displacements, s: never above the exact limit. It takes as long as
 * some six steps, with nodal pressure some twenty, with nodal strain some thirty; tissue that is deformed is stiffer,
 * so ask again from time to time.
 *
 * @param seconds receives the step, s.
 * @param node may be NULL; receives the node that sets it.
 */
supple_status supple_critical_step(const supple_scene *scene,
                                   supple_state *state,
                                   float *seconds,
                                   uint32_t *node);

/**
 * Sets the exact step of a state, for all calls that follow. Refused above the critical step at the state's
 * displacements, which it computes. It may be changed at any time.
 *
 * @param error may be NULL.
 */
supple_status supple_set_step(const supple_scene *scene,
                              supple_state *state,
                              const supple_step_config *config,
                              supple_error *error);

/**
 * Writes the simulated time, s, and how many steps have been taken; either may be NULL.
 */
supple_status supple_state_time(const supple_state *state, double *seconds, uint64_t *steps);

/**
 * Bytes of memory that pressures on so many triangles and surfaces need. SUPPLE_PRESSURE_SIZE is the same as a
 * constant.
 */
size_t supple_pressure_size(uint32_t triangles,
                            uint32_t surfaces);

/**
 * Prepares pressures, zero yet, in `memory` of at least supple_pressure_size bytes, aligned to SUPPLE_ALIGN.
 *
 * @param points the points that the scene was built from, three coordinates each (SUPPLE_E_POINTS).
 * @param triangles three nodes of each of `count` triangles, as of supple_boundary: seen from outside of the tissue
 * counter-clockwise.
 * @param surface_of the surface of each triangle, from zero; NULL: all are of surface 0.
 * @param surfaces how many there are, each with a pressure of its own.
 * @param error may be NULL; index is that of a triangle, of SUPPLE_E_POINTS that of an element.
 */
supple_status supple_pressure_init(void *memory,
                                   size_t bytes,
                                   const supple_scene *scene,
                                   const float *points,
                                   const uint32_t *triangles,
                                   const uint32_t *surface_of,
                                   uint32_t count,
                                   uint32_t surfaces,
                                   supple_pressure **pressure,
                                   supple_error *error);

/**
 * Sets the pressure on a surface, between two calls as you like.
 *
 * @param pascal Pa: positive where it presses the tissue, from outside or from within a cavity.
 * @param ramp seconds from the start of the simulation over which it grows to that, zero or more.
 */
supple_status supple_pressure_set(supple_pressure *pressure,
                                  uint32_t surface,
                                  float pascal,
                                  float ramp);

/**
 * Asks for the volume within a closed surface, of a body or of a cavity: in addition to its pressure there is one from
 * within, `bulk` times the share of the volume that is missing. At rest the volume is short of that by the pressure that
 * the tissue needs over `bulk`. A bulk of up to five times Young's modulus is within the margin of exact steps. A surface that
 * is open or has no triangles is refused (SUPPLE_E_OPEN_SURFACE).
 *
 * @param cubic_metres m^3, above zero.
 * @param bulk Pa; 0: the volume is not asked for.
 */
supple_status supple_pressure_fill(supple_pressure *pressure,
                                   uint32_t surface,
                                   float cubic_metres,
                                   float bulk);

/**
 * Lets pressures act where these loads do, as long as both are there; NULL: none do. A copy of the loads has the same
 * pressures.
 */
supple_status supple_set_pressure(supple_loads *loads,
                                  const supple_pressure *pressure);

/**
 * Writes the volume within a closed surface at the displacements of a state, of a body or of a cavity, and the pressure
 * on it at its time, with what fills it. SUPPLE_E_NOT_FINITE where nodes are so far away that this is no number.
 * SUPPLE_E_CAPACITY: there is no such surface.
 *
 * @param cubic_metres may be NULL; receives the volume, m^3; NaN of a surface that is open or has no triangles.
 * @param pascal may be NULL; receives the pressure, Pa, positive where it presses the tissue.
 */
supple_status supple_pressure_now(const supple_pressure *pressure,
                                  const supple_state *state,
                                  uint32_t surface,
                                  double *cubic_metres,
                                  float *pascal);

/**
 * Takes `count` exact steps. Stops at the first that is not to be believed: that one is not taken, the state is as
 * before it, and the status tells.
 *
 * @param loads what acts; NULL: nothing, supports stand still.
 * @param threads NULL: the calling thread alone.
 * @param report may be NULL; is written whatever the status.
 */
supple_status supple_step(const supple_scene *scene,
                          supple_loads *loads,
                          supple_state *state,
                          uint32_t count,
                          const supple_threads *threads,
                          supple_report *report);

#if defined(SUPPLE_PARALLEL)
/**
 * Writes threads for all functions that take them: those of a pool, one for each processor and SUPPLE_MOST_PARTS at
 * most, which the library starts at the first step that needs them, and which stay as long as the process does. A
 * process that is forked has none of them: fork before. A host defines SUPPLE_PARALLEL, and has a library with the
 * feature parallel, to use it.
 *
 * @param parts that a step shall be cut into, 1 to SUPPLE_MOST_PARTS.
 */
supple_status supple_own_threads(uint32_t parts,
                                 supple_threads *threads);
#endif

/**
 * Bytes of memory that so many pulls need, of so many nodes in sum. SUPPLE_PULLS_SIZE is the same as a constant.
 */
size_t supple_pulls_size(uint32_t pulls,
                         uint32_t nodes);

/**
 * Prepares room for pulls in `memory` of at least supple_pulls_size bytes, aligned to SUPPLE_ALIGN: none yet.
 */
supple_status supple_pulls_init(void *memory,
                                size_t bytes,
                                const supple_scene *scene,
                                uint32_t pulls,
                                uint32_t nodes,
                                supple_pulls **made);

/**
 * Adds a pull on the nodes that are no farther from its point than its radius at rest: their mean displacement moves it. A patch of
 * some 24 nodes is a good one. It has no target yet: it is absent until supple_set_targets.
 *
 * @param points the points that the scene was built from, three coordinates each (SUPPLE_E_POINTS).
 * @param error may be NULL; index is that of the pull, of SUPPLE_E_POINTS that of an element.
 */
supple_status supple_add_pull(supple_pulls *pulls,
                              const supple_scene *scene,
                              const float *points,
                              const supple_pull *pull,
                              supple_error *error);

/**
 * Adds a pull on `count` nodes with weights, which sum up to one, as supple_locate gives them for a point in an element. Other sums
 * are refused (SUPPLE_E_PULL): the point would move by more or less than its nodes.
 *
 * @param error may be NULL; node is one that does not exist.
 */
supple_status supple_add_pull_of_nodes(supple_pulls *pulls,
                                       const supple_scene *scene,
                                       const uint32_t *nodes,
                                       const float *weights,
                                       uint32_t count,
                                       const supple_pull *pull,
                                       supple_error *error);

/**
 * Replaces stiffness, most force (zero: as it is) and direction of a pull; its point and nodes stay.
 *
 * @param error may be NULL.
 */
supple_status supple_set_pull(supple_pulls *pulls,
                              uint32_t index,
                              const supple_pull *pull,
                              supple_error *error);

/**
 * Sets the targets of all pulls, m, three coordinates each; of a pull whose first coordinate is NaN there is none: it is absent
 * until it has one again. A target moves evenly from where it is at the time `from` (s) to there at the time `to`, usually
 * the times of the state now and at the end of the frame; one that was absent is there at once, and with `to` before `from` all are.
 *
 * @param error may be NULL; index is that of a pull; of a time that is not finite (SUPPLE_E_NEGATIVE) there is none.
 */
supple_status supple_set_targets(supple_pulls *pulls,
                                 const float *targets,
                                 uint32_t count,
                                 double from,
                                 double to,
                                 supple_error *error);

/**
 * The same of `count` pulls from the one at `first` on; the targets of the others go on as they do.
 *
 * @param error may be NULL; index is that of a pull.
 */
supple_status supple_set_targets_from(supple_pulls *pulls,
                                      uint32_t first,
                                      const float *targets,
                                      uint32_t count,
                                      double from,
                                      double to,
                                      supple_error *error);

/**
 * Turns the points of pulls with the body, as it is in a state: a host calls it between frames, and before it settles. The
 * nodes of a pull move its point by their mean. Near a surface, where they are all on one side of the point, its tissue
 * moves by more than that where the body turns: by 2 mm at 40 degrees with patches of 24 nodes 5 mm apart. A
 * pull that is turned for the first time is turned in full. Later a turn is entered bit by bit, as points that turn draw
 * the body on: while it moves in the longer a time, the less it is damped and the nearer the patches of all pulls are to each other (0.01 s for an
 * organ with pulls all around, at 20 1/s; without damping never), at rest by the part that converges where a host settles and
 * turns in turn, until `most` is small.
 *
 * @param points the points that the scene was built from, three coordinates each. They are looked at in some elements only
 * (SUPPLE_E_POINTS).
 * @param most the largest change of a point that was entered, m; may be NULL.
 */
supple_status supple_turn_pulls(supple_pulls *pulls,
                                const supple_scene *scene,
                                const float *points,
                                supple_state *state,
                                float *most);

/**
 * Writes where the points of all pulls are in a state, how far from their targets, and the forces of the latest step.
 * SUPPLE_E_NOT_FINITE where nodes are so far away that one of these is no number.
 */
supple_status supple_read_pulls(supple_pulls *pulls,
                                supple_state *state,
                                supple_pulled *pulled,
                                uint32_t count);

/**
 * Lets pulls act together with these loads, as long as both are there; NULL: none. Learned steps refuse loads with pulls,
 * and a library without the feature `contact` refuses them here.
 */
supple_status supple_set_pulls(supple_loads *loads,
                               supple_pulls *pulls);

/**
 * Tells where the displacements of a state are, m. They stay there for as long as the state does; read them between
 * calls that change it.
 */
supple_status supple_displacements(const supple_state *state,
                                   supple_vectors *vectors);

/**
 * Copies the displacement of each node, m, to three floats each.
 *
 * @param floats room in `out`: three times the nodes at least.
 */
supple_status supple_copy_displacements(const supple_state *state, float *out, size_t floats);

/**
 * Copies where each node is, m: the point at rest with its displacement.
 *
 * @param points the points that the scene was built from, three coordinates each.
 * @param floats room in `out`: three times the nodes at least. `out` may not be `points`.
 */
supple_status supple_copy_positions(const supple_state *state,
                                    const float *points,
                                    float *out,
                                    size_t floats);

/**
 * Copies the velocity of each node over the latest step, m/s.
 *
 * @param floats room in `out`: three times the nodes at least.
 */
supple_status supple_copy_velocities(const supple_state *state, float *out, size_t floats);

/**
 * Copies the total force on each node at the start of the latest step, also of one that was refused, N: that of the
 * loads with that of the tissue. At held nodes it is what presses on the support, and so what a hand that holds the
 * instrument feels, apart from the inertia of a moved one; the support presses back with the opposite. Not so after
 * steps of a supple_large: raised inertia delays the tissue, and the force is that of a shape that lags behind. Zero
 * after supple_critical_step or supple_set_step, also where these refuse what they computed, until the next step.
 *
 * @param floats room in `out`: three times the nodes at least.
 */
supple_status supple_copy_forces(const supple_state *state,
                                 float *out,
                                 size_t floats);

/**
 * Writes the triangles of the boundary of a mesh, which belong to one element only, seen from outside: three nodes
 * each.
 *
 * @param tetrahedra four nodes of each element, from zero. Of an element with a negative volume the triangles are seen from
 * within, and a pressure on them pulls: turn such elements before, also where the scene is built with
 * SUPPLE_WINDING_NORMALISED, which does not change this array. Leave out those that are removed: the cut is part of the
 * boundary of the others.
 * @param triangles room for `room` of them; four for each element are needed while they are found.
 * @param count receives how many at the beginning are of the boundary.
 */
supple_status supple_boundary(const uint32_t *tetrahedra,
                              uint32_t elements,
                              uint32_t *triangles,
                              size_t room,
                              uint32_t *count);

/**
 * Writes whether one of these instruments passes between the nodes of a surface, since it is not as thick as the
 * longest edge of its triangles is long: `*needed` is 1 if supple_surface has to have these triangles, else 0. A
 * sphere and a capsule are as thick as their radius, a field as its deepest point is deep.
 *
 * @param points of all `nodes` of the scene at rest, m, three coordinates each.
 * @param triangles `count` triangles of the boundary, as of supple_boundary.
 * @param error may be NULL; index is that of an instrument.
 */
supple_status supple_needs_triangles(const float *points,
                                     uint32_t nodes,
                                     const uint32_t *triangles,
                                     uint32_t count,
                                     const supple_instrument *instruments,
                                     uint32_t instrument_count,
                                     uint32_t *needed,
                                     supple_error *error);

/**
 * Bytes of memory that supple_locate needs for a mesh of so many elements: some 20 to 32 for each; 0 if there is no such
 * size.
 */
size_t supple_locate_size(uint32_t elements);

/**
 * Locates places in the mesh at rest, for supple_follow: the element that holds each, or the nearest one with the
 * distance, which tells you whether you meant that place. 100,000 elements and thousands of places take some tens of
 * milliseconds, those inside less.
 *
 * @param points of all `nodes` of the scene at rest, m, three coordinates each.
 * @param tetrahedra four nodes of each of `elements`, of either winding.
 * @param places three coordinates of each of `count` places, m.
 * @param memory of `bytes`, supple_locate_size at least, aligned to 4; free again afterwards.
 * @param located receives `count` points.
 * @param error may be NULL; of SUPPLE_E_NOT_FINITE index is that of a place, or with node that of a point of the mesh.
 */
supple_status supple_locate(const float *points,
                            uint32_t nodes,
                            const uint32_t *tetrahedra,
                            uint32_t elements,
                            const float *places,
                            uint32_t count,
                            void *memory,
                            size_t bytes,
                            supple_followed_point *located,
                            supple_error *error);

/**
 * Writes where points are (m), and how fast over the latest step (m/s), in a state of the mesh that they were located
 * in: some nanoseconds for each.
 *
 * @param located `count` points, as of supple_locate.
 * @param positions room for three floats of each.
 * @param velocities the same; NULL if they are not wanted.
 * @param error may be NULL; index is that of a point: it follows a node that the state does not have (SUPPLE_E_INDEX), or
 * is no number.
 */
supple_status supple_follow(const supple_state *state,
                            const supple_followed_point *located,
                            uint32_t count,
                            float *positions,
                            float *velocities,
                            supple_error *error);

/**
 * Writes how many bytes of scratch supple_displacement_field needs: 2 for each point of the grid where spacings are alike,
 * some 12 at most, and 8 more for each where the reach is below sixteen spacings.
 *
 * @param reach as there, m.
 * @param error may be NULL; SUPPLE_E_GRID: axis and value tell what is wrong with it.
 */
supple_status supple_displacement_field_size(const supple_image_grid *grid,
                                             float reach,
                                             size_t *bytes,
                                             supple_error *error);

/**
 * Writes the displacement field of a body at the points of a grid: three floats for each, m, in the axes of the mesh, x
 * fastest. Within the tissue it is that of the linear elements, to rounding. Elsewhere it goes on smoothly, near the
 * surface as there, far away as the mean of the body, never beyond what is within; with a reach it falls off to zero. An
 * element that is turned inside out is left out, and where several overlap the last one counts.
 *
 * An image is warped with the inverse field: the new image at a point has what the old one has at the point plus the
 * field. Points and surfaces are moved with the forward field.
 *
 * @param points of all `nodes` of the scene at rest, m, three coordinates each.
 * @param tetrahedra four nodes of each of `elements`, of either winding.
 * @param displacements of all nodes, m, as supple_displacements tells where those of a state are; or your own.
 * @param kind SUPPLE_FORWARD_FIELD or SUPPLE_INVERSE_FIELD.
 * @param reach how far from the tissue the field ends, m, to within a quarter of it or two spacings of the grid; 0: it goes on.
 * @param scratch of `bytes`, supple_displacement_field_size at least, aligned to 4; free again afterwards.
 * @param field room for `floats`, three for each point of the grid at least.
 * @param covered may be NULL; receives how many points are within the tissue. With none the field is zero: the grid is
 * elsewhere (in mm? in other axes?) or coarser than the body.
 * @param error may be NULL.
 */
supple_status supple_displacement_field(const float *points,
                                        uint32_t nodes,
                                        const uint32_t *tetrahedra,
                                        uint32_t elements,
                                        const supple_vectors *displacements,
                                        uint32_t kind,
                                        const supple_image_grid *grid,
                                        float reach,
                                        void *scratch,
                                        size_t bytes,
                                        float *field,
                                        size_t floats,
                                        size_t *covered,
                                        supple_error *error);

/**
 * Bytes of memory that a supple_contact needs for a surface of so many nodes and triangles, of which so many nodes can
 * be held at once.
 */
size_t supple_contact_size(uint32_t nodes,
                           uint32_t triangles,
                           uint32_t grips);

/**
 * Prepares a contact in `memory` of at least supple_contact_size bytes, aligned to SUPPLE_ALIGN: no instruments yet.
 *
 * @param points the points that the scene was built from, three coordinates each (SUPPLE_E_POINTS).
 * @param surface what can be touched; it is copied. A triangle with a corner that belongs to no element, as those of tissue
 * that is removed, is refused (SUPPLE_E_MESH_UNUSED_NODE).
 * @param grips most nodes that instruments hold at once.
 * @param error may be NULL; index is the place in the nodes of `surface`, or that of a triangle with a corner that is
 * not among these nodes, twice the same, or of no element; of SUPPLE_E_POINTS that of an element.
 */
supple_status supple_contact_init(void *memory,
                                  size_t bytes,
                                  const supple_scene *scene,
                                  const float *points,
                                  const supple_surface *surface,
                                  uint32_t grips,
                                  supple_contact **contact,
                                  supple_error *error);

/**
 * Replaces all instruments by `count` others, which stand still where they are; none with a count of zero. What was
 * held is let go.
 *
 * @param error may be NULL; index is that of an instrument.
 */
supple_status supple_set_instruments(supple_contact *contact,
                                     const supple_instrument *instruments,
                                     uint32_t count,
                                     supple_error *error);

/**
 * Lets an instrument move on a line, and turn evenly, from where it is at the time `from` (s) to `pose` at the time
 * `to`, usually the times of the state now and at the end of the frame. Before and after it stands still; with `to` before
 * `from` it is there at once.
 *
 * @param error may be NULL.
 */
supple_status supple_move_instrument(supple_contact *contact,
                                     uint32_t instrument,
                                     const supple_pose *pose,
                                     double from,
                                     double to,
                                     supple_error *error);

/**
 * Lets an instrument hold the nodes of the surface that are nearer to it than `within` (m) now, where they are, as
 * forceps do; those that it or another one holds already it leaves as they are. They move with it, whatever force that
 * takes, until supple_let_go.
 *
 * @param within zero or more (SUPPLE_E_NEGATIVE).
 * @param held may be NULL; receives how many nodes it holds.
 */
supple_status supple_grasp(supple_contact *contact,
                           supple_state *state,
                           uint32_t instrument,
                           float within,
                           uint32_t *held);

/**
 * Lets a contact go on where another one is, of a scene of the same nodes: with its instruments where they are, and the
 * nodes that these hold, as far as they are in the new surface and the scene has elements around them. Nothing touches
 * yet. For a surface that has changed, as after a resection.
 *
 * @param scene of the new contact.
 */
supple_status supple_contact_carry_on(supple_contact *contact,
                                      const supple_scene *scene,
                                      supple_contact *from);

/**
 * Lets go what an instrument holds.
 */
supple_status supple_let_go(supple_contact *contact, uint32_t instrument);

/**
 * What an instrument felt in the latest steps.
 */
supple_status supple_read_touch(const supple_contact *contact,
                                uint32_t instrument,
                                supple_touch *touch);

/**
 * Writes where instruments push in the latest step: at most `room` points, and SUPPLE_MOST_CONTACT_POINTS.
 *
 * @param count receives how many were written.
 */
supple_status supple_contact_points(const supple_contact *contact,
                                    supple_contact_point *points,
                                    uint32_t room,
                                    uint32_t *count);

/**
 * Takes the position (m) and the force (N) of a new frame, as of supple_read_touch.
 */
supple_status supple_local_force_follow(supple_local_force *model,
                                        const float *position,
                                        const float *force);

/**
 * Writes the force (N) at a position (m) before the next frame.
 */
supple_status supple_local_force_at(const supple_local_force *model,
                                    const float *position,
                                    float *force);

/**
 * Bytes that a saved state of so many nodes has. With tissue that relaxes it has more: supple_state_saved_size.
 */
size_t supple_saved_size(uint32_t nodes);

/**
 * Writes how many bytes a state has when it is saved.
 */
supple_status supple_state_saved_size(const supple_state *state, size_t *bytes);

/**
 * Saves a state with its step to `to`, at any address.
 *
 * @param bytes room there: supple_state_saved_size at least, which is supple_saved_size where no tissue relaxes.
 */
supple_status supple_save(const supple_state *state,
                          void *to,
                          size_t bytes);

/**
 * Restores a saved state, from any address, into one prepared for the same scene: with exact steps it goes on as the
 * saved one would have, to the bit; with nodal strain unless an element was crushed within the last 16 steps, which
 * the restored state may see some steps sooner. Forces are zero until the next step. A saved state with a time, a
 * displacement or an increment that is not finite, or with a time before the start, is refused: SUPPLE_E_NOT_FINITE. So
 * is one of a scene whose tissue remembers more or less: SUPPLE_E_MISMATCH.
 * The first step of a supple_large computes its inertia anew, and a supple_learned needs a new lead-in; for the same
 * bits with these, copy their objects with memcpy as well.
 */
supple_status supple_restore(supple_state *state,
                             const void *from,
                             size_t bytes);

/**
 * Bytes of memory that learned steps of so many nodes need, with fallback (1) or without (0). SUPPLE_LEARNED_SIZE is
 * the same as a constant.
 */
size_t supple_learned_size(uint32_t nodes,
                           uint32_t fallback);

/**
 * Prepares learned steps of a scene in `memory` of at least supple_learned_size bytes, aligned to SUPPLE_ALIGN.
 *
 * @param error may be NULL; index is that of a layer.
 */
supple_status supple_learned_init(void *memory,
                                  size_t bytes,
                                  const supple_scene *scene,
                                  const supple_learned_config *config,
                                  supple_learned **learned,
                                  supple_error *error);

/**
 * For a motion from rest: frames as at the start, no lead-in yet, nothing has been undone.
 */
supple_status supple_learned_reset(supple_learned *learned);

/**
 * Writes what a network was trained for.
 */
supple_status supple_learned_describe(const supple_learned *learned, supple_learned_facts *facts);

/**
 * The lead-in: exact steps for `seconds` while the frames of the nodes follow, in the nearest whole number of the
 * network's steps (seconds of supple_learned_facts), which may be none. The network can take over at the end of it. In
 * the paper it lasts 0.3 s from rest. Motions go evenly over all of it. Seconds that are negative or not finite:
 * SUPPLE_E_NEGATIVE.
 *
 * @param loads what acts; NULL: nothing, supports stand still.
 * @param threads NULL: the calling thread alone.
 * @param report may be NULL; is written whatever the status; its steps are exact ones.
 */
supple_status supple_learned_lead(const supple_scene *scene,
                                  supple_loads *loads,
                                  supple_state *state,
                                  supple_learned *learned,
                                  double seconds,
                                  const supple_threads *threads,
                                  supple_report *report);

/**
 * Takes `count` learned steps after supple_learned_lead, or after other learned steps, of the same state. With
 * fallback a step that is not to be believed is undone, and exact steps take its place and that of the next seven,
 * where it happens again of more, before the network is tried again: SUPPLE_FELL_BACK. Without fallback the call stops
 * at the first such step: it is not taken, displacements and time are as before it, velocities may be those of the
 * network's own step, and a new lead-in is needed.
 *
 * @param loads what acts; NULL: nothing, supports stand still.
 * @param threads NULL: the calling thread alone.
 * @param report may be NULL; is written whatever the status.
 */
supple_status supple_learned_step(const supple_scene *scene,
                                  supple_loads *loads,
                                  supple_state *state,
                                  supple_learned *learned,
                                  uint32_t count,
                                  const supple_threads *threads,
                                  supple_report *report);

/**
 * To be called whenever a supple_guard calls learned steps inexact (SUPPLE_INEXACT): with fallback exact steps take
 * the place of the next eight, where it happens again of more, before the network is tried again. Without fallback
 * nothing changes.
 */
supple_status supple_learned_fall_back(supple_learned *learned,
                                       const supple_state *state);

/**
 * Writes how many bytes of memory a supple_large needs for a scene; it depends on the lattice. For cells that you give
 * SUPPLE_LARGE_SIZE is never less.
 *
 * @param points the points that the scene was built from, three coordinates each.
 * @param error may be NULL.
 */
supple_status supple_large_size(const supple_scene *scene,
                                const float *points,
                                const supple_large_config *config,
                                size_t *bytes,
                                supple_error *error);

/**
 * Prepares steps beyond the critical one, from the state as it is, in `memory` of at least supple_large_size bytes,
 * aligned to SUPPLE_ALIGN. It takes as long as some steps.
 *
 * @param points the points that the scene was built from, three coordinates each.
 * @param error may be NULL.
 */
supple_status supple_large_init(void *memory,
                                size_t bytes,
                                const supple_scene *scene,
                                supple_state *state,
                                const float *points,
                                const supple_large_config *config,
                                supple_large **large,
                                supple_error *error);

/**
 * Takes `count` steps of the prepared length. Stops at the first that is not to be believed: that one is
 * not taken, the state is as before it, and the status tells. They need no supple_set_step.
 *
 * @param loads what acts; NULL: nothing, supports stand still.
 * @param threads NULL: the calling thread alone. The lattice's factorisation runs on that one in any case.
 * @param report may be NULL; is written whatever the status.
 */
supple_status supple_large_step(const supple_scene *scene,
                                supple_loads *loads,
                                supple_state *state,
                                supple_large *large,
                                uint32_t count,
                                const supple_threads *threads,
                                supple_report *report);

/**
 * Writes how many bytes of memory a supple_guard needs for a scene.
 *
 * @param points the points that the scene was built from, three coordinates each.
 * @param error may be NULL.
 */
supple_status supple_guard_size(const supple_scene *scene,
                                const float *points,
                                size_t *bytes,
                                supple_error *error);

/**
 * Prepares a guard, from the state as it is, in `memory` of at least supple_guard_size bytes, aligned to SUPPLE_ALIGN.
 * It takes as long as some steps.
 *
 * @param points the points that the scene was built from, three coordinates each.
 * @param error may be NULL.
 */
supple_status supple_guard_init(void *memory,
                                size_t bytes,
                                const supple_scene *scene,
                                supple_state *state,
                                const float *points,
                                const supple_guard_config *config,
                                supple_guard **guard,
                                supple_error *error);

/**
 * To be called after each call that moves the state, with the same loads, at the latest after `every` steps of the
 * configuration. Now and then it moves the second run and compares. SUPPLE_INEXACT if the estimate exceeds what is
 * allowed. A state that has not come by steps from where this guard has seen it last (reset, restored, stopped,
 * another copy) begins a new second run from where it is. So a state has one supple_guard at a time.
 *
 * @param loads as of the steps; NULL: nothing, supports stand still.
 * @param threads NULL: the calling thread alone.
 * @param estimate may be NULL.
 */
supple_status supple_guard_follow(const supple_scene *scene,
                                  supple_loads *loads,
                                  supple_state *state,
                                  supple_guard *guard,
                                  const supple_threads *threads,
                                  supple_estimate *estimate);

/**
 * Writes how many bytes of memory a supple_adaptive needs for a scene; it depends on the lattice.
 *
 * @param points the points that the scene was built from, three coordinates each.
 * @param config of the steps beyond the critical one.
 * @param error may be NULL.
 */
supple_status supple_adaptive_size(const supple_scene *scene,
                                   const float *points,
                                   const supple_large_config *config,
                                   size_t *bytes,
                                   supple_error *error);

/**
 * Prepares adaptive steps, from the state as it is, in `memory` of at least supple_adaptive_size bytes, aligned to
 * SUPPLE_ALIGN. It takes as long as some steps. They begin as exact steps.
 *
 * @param points the points that the scene was built from, three coordinates each.
 * @param config of the steps beyond the critical one; its `seconds` are those of the longest step, usually a frame.
 * @param tolerance the mean error of the nodes that you accept, m.
 * @param error may be NULL.
 */
supple_status supple_adaptive_init(void *memory,
                                   size_t bytes,
                                   const supple_scene *scene,
                                   supple_state *state,
                                   const float *points,
                                   const supple_large_config *config,
                                   float tolerance,
                                   supple_adaptive **adaptive,
                                   supple_error *error);

/**
 * Moves on by `seconds`, usually a frame, and ends there exactly. SUPPLE_INEXACT if the estimate of the error exceeded
 * the tolerance at any step: steps become shorter at once, down to exact ones, but an error that is there stays until
 * the body has forgotten it. A step that is not to be believed is taken again with shorter ones; where exact ones are
 * not either, the state is that before it, and the status tells.
 *
 * @param loads what acts; NULL: nothing, supports stand still. Motions without a ramp go evenly over the call.
 * @param threads NULL: the calling thread alone.
 * @param report may be NULL; is written whatever the status.
 * @param taken may be NULL.
 */
supple_status supple_adaptive_advance(const supple_scene *scene,
                                      supple_loads *loads,
                                      supple_state *state,
                                      supple_adaptive *adaptive,
                                      float seconds,
                                      const supple_threads *threads,
                                      supple_report *report,
                                      supple_adaptive_report *taken);

/**
 * Bytes of memory that a supple_reaction needs for a scene of so many nodes; 0 if there is no such size.
 */
size_t supple_reaction_size(uint32_t nodes);

/**
 * Prepares the reaction of some supports in `memory` of at least supple_reaction_size bytes, aligned to SUPPLE_ALIGN.
 * It takes as long as some hundred steps.
 *
 * @param supports numbers of nodes that the scene holds, an instrument's for example.
 * @param count how many, at least 1.
 * @param damping of the steps, 1/s.
 * @param error may be NULL.
 */
supple_status supple_reaction_init(void *memory,
                                   size_t bytes,
                                   const supple_scene *scene,
                                   const uint32_t *supports,
                                   size_t count,
                                   float damping,
                                   supple_reaction **reaction,
                                   supple_error *error);

/**
 * Writes the mean force by which the supports have acted since the last call. To be called before the first step and
 * after each frame's steps, of any kind.
 */
supple_status supple_reaction_follow(const supple_scene *scene,
                                     supple_state *state,
                                     supple_reaction *reaction,
                                     supple_reaction_force *force);

/**
 * Writes settings for exact steps without damping, a guard and a fallback for other steps that are chosen, and no room
 * for forces, motions and instruments.
 */
supple_status supple_default_settings(supple_settings *settings);

/**
 * Writes how many bytes of memory are enough for a simulation. supple_sim_describe tells how many it takes.
 *
 * @param body what it will be built from; of it the numbers of nodes, elements and tissues, the element and how tissues
 * relax are looked at.
 * @param error may be NULL.
 */
supple_status supple_sim_size(const supple_scene_config *body,
                              const supple_settings *settings,
                              size_t *bytes,
                              supple_error *error);

/**
 * Builds a scene, at rest, with loads, instruments and steps, in `memory` of at least supple_sim_size bytes, aligned to
 * SUPPLE_ALIGN. It takes as long as some steps. What is given is copied, but for the weights.
 *
 * @param error may be NULL.
 */
supple_status supple_sim_setup(void *memory,
                               size_t bytes,
                               const supple_scene_config *body,
                               const supple_settings *settings,
                               supple_sim **sim,
                               supple_error *error);

/**
 * Other steps from now on, in the same memory; the motion goes on as it is. After long steps their forces are computed once
 * more, under the loads and instruments as they are, which pulls and contact then tell. To be called as well where lengths are
 * chosen, so that they fit a state that was reset, restored, or moved by other functions. What there is room for stays
 * as it was at supple_sim_setup. Where the scene itself refuses the steps (SUPPLE_E_LATTICE, SUPPLE_E_TOO_STIFF) there
 * are none until the next call.
 *
 * @param error may be NULL; SUPPLE_E_SHORT: the memory is enough for the former steps only.
 */
supple_status supple_sim_set(supple_sim *sim,
                             const supple_settings *settings,
                             supple_error *error);

/**
 * Writes where the objects of a simulation are. They stay there as long as it does.
 */
supple_status supple_sim_describe(supple_sim *sim, supple_sim_objects *objects);

/**
 * Moves on by `seconds`, usually a frame, under the loads and instruments, and ends there to a millionth of it; learned
 * steps end at the nearest of the network's. A span shorter than a sixteenth of the last step is left to the next call.
 * Motions without a ramp go evenly over the call. Where a step is refused the status says why, and the state is that
 * before it; the next call begins there and is no longer for it.
 *
 * @param threads NULL: the calling thread alone.
 * @param report may be NULL; is written whatever the status.
 */
supple_status supple_sim_advance(supple_sim *sim,
                                 double seconds,
                                 const supple_threads *threads,
                                 supple_sim_report *report);

/**
 * Bytes of memory that supple_settle needs for a scene of so many nodes. SUPPLE_SETTLE_SIZE is the same as a constant.
 */
size_t supple_settle_size(uint32_t nodes);

/**
 * Brings a body to rest: every node to within about `metre` of where it rests under these loads.
 * Loads and instruments act as at the time of the state, which stands still: ramps do not go on, motions without a ramp
 * go to where they are asked for, and tissue that relaxes has had the time. Velocities are zero afterwards, and the energy balance begins with the strain energy.
 * Steps of every kind go on from there; a guard begins anew.
 *
 * SUPPLE_BEHIND: the body is not at rest after `most_steps`, or never can be, because no support holds it. The report
 * tells how much is missing, and another call goes on from there. Where a step is refused the status says why, and the
 * body stands where the steps before have brought it.
 *
 * @param metre m, above zero.
 * @param most_steps at least one is taken; each takes about as long as an exact one.
 * @param threads NULL: the calling thread alone.
 * @param memory at least supple_settle_size bytes, aligned to SUPPLE_ALIGN, for the call alone.
 * @param settled may be NULL; is written whatever the status.
 */
supple_status supple_settle(const supple_scene *scene,
                            supple_loads *loads,
                            supple_state *state,
                            float metre,
                            uint32_t most_steps,
                            const supple_threads *threads,
                            void *memory,
                            size_t bytes,
                            supple_settled *settled);

/**
 * The same of a simulation, under its loads and instruments: see supple_settle.
 *
 * @param metre m, above zero.
 * @param most_steps at least one is taken; each takes about as long as an exact one.
 * @param threads NULL: the calling thread alone.
 * @param memory at least supple_settle_size bytes, aligned to SUPPLE_ALIGN, for the call alone.
 * @param settled may be NULL; is written whatever the status.
 */
supple_status supple_sim_settle(supple_sim *sim,
                                float metre,
                                uint32_t most_steps,
                                const supple_threads *threads,
                                void *memory,
                                size_t bytes,
                                supple_settled *settled);

/**
 * Puts the nodes at displacements of yours, at a stop: velocities are zero, time stays, and the energy balance begins
 * with the strain energy. It counts as a step. What tissue that relaxes remembers stays. Fixed nodes keep what is given,
 * moved ones until a motion moves them. Of a simulation call supple_sim_set afterwards, so that the lengths of steps fit.
 *
 * @param displacements three components of each of `nodes` nodes, m, from rest.
 * @param nodes must be that of the scene.
 * @param error may be NULL; index and node are those of a displacement that is not finite. Nothing has changed then.
 */
supple_status supple_set_displacements(const supple_scene *scene,
                                       supple_state *state,
                                       const float *displacements,
                                       uint32_t nodes,
                                       supple_error *error);

/**
 * Lets a state go on in a scene that has taken the place of another one of the same nodes and kind of element: without
 * some elements, with other tissues. Displacements, velocities and time stay, so what stays of the tissue keeps its
 * momentum; the energy balance begins anew. All that was prepared for the former scene, apart from loads and contact,
 * must be prepared again, and the step be set. It takes as long as an exact step or two. Tissue that relaxes goes on where
 * all elements and patches are as before, in scenes with other constants, densities or supports; elsewhere it begins as if
 * nothing had been deformed so far (supple_sim_carry_on does not). SUPPLE_E_NO_RELAXATION: the state has too little memory
 * for what it must remember, as the former scene had fewer terms or tissues.
 */
supple_status supple_state_carry_on(const supple_scene *scene,
                                    supple_state *state);

/**
 * Gives the tissues of a scene other constants, without building it anew: it takes a pass over its elements, and all or
 * nothing is changed. Nobody may use the scene meanwhile. Call supple_state_carry_on for each of its states.
 *
 * @param tissues as many as the scene has, of the same densities, which are checked (SUPPLE_E_MISMATCH).
 * @param error may be NULL; index is that of an element.
 */
supple_status supple_set_tissues(supple_scene *scene,
                                 const supple_tissue *tissues,
                                 uint32_t count,
                                 supple_error *error);

/**
 * The same for a simulation, which goes on with them: for an ablation call it in some twenty stages. Prepare the scene
 * with a tissue of its own for each region that will change. The motion goes on as it is, and the energy balance begins
 * anew.
 *
 * @param settings NULL: the steps stay as they are, but for what follows from the constants, which takes as long as some
 * exact steps; not with SUPPLE_STEPS_AUTO (SUPPLE_E_NULL). Else as at supple_sim_set, to prepare them anew, which takes
 * some hundred exact steps where they are longer, and is best at the end of an ablation. Where the scene with the new
 * tissues refuses its steps (SUPPLE_E_LATTICE, SUPPLE_E_TOO_STIFF) there are none until the next call.
 * @param error may be NULL.
 */
supple_status supple_sim_set_tissues(supple_sim *sim,
                                     const supple_tissue *tissues,
                                     uint32_t count,
                                     const supple_settings *settings,
                                     supple_error *error);

/**
 * Lets a simulation that has just been set up go on where another one is, of a body of the same points: without some
 * elements (supple_scene_config.removed), with other tissues, another kind of element or other supports. It takes over
 * displacements, velocities, time, gravity, forces, motions, pulls, and where it has a surface the instruments with what
 * they hold; what stays of the tissue keeps its momentum and what it remembers, and the energy balance begins anew. It takes over pressures
 * where no element goes. Where some do there is none: the triangles would go on to press the surface that is gone, so set
 * one up on what is left of it, with or without the cut (supple_pressure_init, supple_set_pressure). Forces stay as they are, those
 * that supple_traction has made of triangles that are gone as well: make them again. Nodes that belong to no
 * element any more stay in all arrays, held where they are; pulls and instruments let go of them. The other simulation
 * is only read, may go on, and its memory be used for the next exchange; but the pulls are an object of both, so where it goes
 * on these have let go in it as well. What is refused changes none of this. supple_sim_setup, which takes longest, may run on another thread
 * while the other simulation goes on. This takes as long as supple_sim_set.
 *
 * @param from points and kind of contact are checked (SUPPLE_E_MISMATCH); room for its forces, motions and held nodes
 * must be there (SUPPLE_E_CAPACITY).
 * @param settings those that `sim` was set up with.
 * @param error may be NULL.
 */
supple_status supple_sim_carry_on(supple_sim *sim,
                                  supple_sim *from,
                                  const supple_settings *settings,
                                  supple_error *error);

/**
 * Writes what in a scene looks as if a unit or a number was mistaken; it can be simulated all the same. To be called
 * once, before the first step. It takes as long as some steps.
 *
 * @param points the points that the scene was built from, three coordinates each.
 * @param loads NULL: nothing is said of loads, and of instruments that touch what they act on.
 * @param learned NULL: nothing is said of a network.
 * @param remarks receives the first of them; may be NULL if `room` is 0.
 * @param room in `remarks`.
 * @param count how many there are, which may be more than there is room for.
 */
supple_status supple_remarks(const supple_scene *scene,
                             const float *points,
                             supple_loads *loads,
                             const supple_learned *learned,
                             supple_remark *remarks,
                             uint32_t room,
                             uint32_t *count);

/**
 * What a remark means, a few English words for people; "?" for a number that is none.
 */
const char *supple_remark_text(uint32_t kind);

#if defined(SUPPLE_IO)
/**
 * Writes how large the mesh of a file is. The extension tells the format: .vtk, .vtu, .msh (Gmsh 1, 2.x and 4.1),
 * .node or .ele (TetGen). It reads the whole file, on the heap, and releases what it took. What is wrong with the
 * file, SUPPLE_E_FILE, stands in `words`: a sentence with the file, the place in it and the value.
 *
 * @param path in UTF-8.
 * @param words receives the sentence, cut to `room` bytes, or nothing; NULL if `room` is 0.
 */
supple_status supple_measure_mesh(const char *path,
                                  supple_mesh_size *size,
                                  char *words,
                                  size_t room);
#endif

#if defined(SUPPLE_IO)
/**
 * Writes the mesh of a file of a known size. Nothing is scaled, renumbered or turned.
 *
 * @param size as of supple_measure_mesh. A file that has changed since is refused.
 * @param points receives three coordinates of each node, in the unit of the file.
 * @param tetrahedra receives four nodes of each element, from zero.
 * @param regions receives the region of each element, if the file has regions; else it may be NULL.
 * @param words as of supple_measure_mesh.
 */
supple_status supple_read_mesh(const char *path,
                               const supple_mesh_size *size,
                               double *points,
                               uint32_t *tetrahedra,
                               int32_t *regions,
                               char *words,
                               size_t room);
#endif

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* SUPPLE_H */
