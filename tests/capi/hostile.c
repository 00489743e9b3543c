/* Random calls with arguments as no sound host makes them, within what the header allows: counts, sizes, versions, choices, nodes,
 * numbers, addresses and objects are wrong as often as right. Memory that no call may touch lies on both sides of everything, and any
 * access to it ends the program. After each call: the status is one of the header's, a refused call has changed nothing and named its
 * status, what was taken or told is finite, objects that were not handed over are as before; and after a refused step the next one is
 * the same, to the bit, as without it.
 *
 *     hostile [CALLS | SECONDSs] [SEED]
 */
#define _GNU_SOURCE
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include "body.h"

/* Random numbers (splitmix64). */
static uint64_t random_state;
static uint64_t bits(void) {
    uint64_t z = random_state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}
static uint32_t below(uint32_t count) { return (uint32_t)(bits() % count); }
/* While it is set nothing is wrong on purpose. */
static int is_calm;
static int one_in(uint32_t count) { return below(count) == 0 && (!is_calm || count < 5); }
static float share(void) { return (float)(bits() >> 40) / 16777216.0f; }

/* Of a usual size mostly, now and then anything. */
static float wild(float usual) {
    static const float odd[] = {0.0f, -0.0f, 1e-40f, 1e-30f, 1e10f, 1e19f, 1e30f, 3e38f, -3e38f, INFINITY, -INFINITY, NAN};
    switch (is_calm ? 3 : below(40)) {
        case 0: return odd[below(sizeof odd / sizeof *odd)];
        case 1: {
            const uint32_t any = (uint32_t)bits();
            float value;
            memcpy(&value, &any, sizeof value);
            return value;
        }
        case 2: return usual * powf(10.0f, (float)below(20) - 10.0f);
        default: return usual * (2.0f * share() - 1.0f);
    }
}

/* A right number, or one of the wrong ones. */
static uint32_t number(uint32_t right) {
    static const uint32_t odd[] = {0, 1, 2, 3, 7, 8, 255, 65535, 65536, 0x7fffffffu, 0x80000000u, UINT32_MAX};
    if (is_calm || !one_in(30)) {
        return right;
    }
    return one_in(3) ? right + below(3) - 1 : odd[below(sizeof odd / sizeof *odd)];
}

/* Memory between two pieces that must not be touched; what is handed out ends at the second. */
typedef struct {
    unsigned char *start;
    size_t room;
} arena;

static arena arena_of(size_t bytes) {
    const size_t page = (size_t)sysconf(_SC_PAGESIZE), room = (bytes + page - 1) / page * page;
    unsigned char *all = mmap(NULL, room + 2 * page, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    CHECK(all != MAP_FAILED && mprotect(all + page, room, PROT_READ | PROT_WRITE) == 0);
    return (arena){all + page, room};
}

/* The last `bytes` of an arena. */
static void *end_of(const arena *in, size_t bytes) {
    CHECK(bytes <= in->room);
    return in->start + (in->room - bytes);
}

/* Objects of all kinds: what a call is told to be at an address may be of any kind. */
enum { SCENE, STATE, LOADS, LEARNED, LARGE, GUARD, REACTION, ADAPTIVE, CONTACT, SIM, PULLS, PRESSURE, KINDS };
enum { EACH = 3, SLOTS = KINDS * EACH, MOST_PULLS = 4, PLACES = 40, SIDE = 8 };
static struct {
    arena in;
    unsigned char *at;
    size_t bytes;
    uint64_t before;
    int written;
} slots[SLOTS];
static arena of_points, of_tets, of_supports, of_tissues, of_regions, of_weights, of_out, of_faces, of_saved, of_rest, of_removed,
    of_places, of_found, of_field, of_scratch, of_prony, of_fibres, of_directions,
    copies[2];
static size_t weights_bytes;
static uint32_t of_bar[4 * TETS][3], bar_triangles;
static const char *doing;
static supple_report report;
static supple_error error;
static unsigned long calls, refused, counted[256];

#define NO_OBJECT ((void *)0)

/* An object of a kind; seldom NULL, misaligned, or of another kind. `is_written`: the call may change it. */
static void *object(int kind, int is_written) {
    if (one_in(60)) {
        return NO_OBJECT;
    }
    const int slot = (one_in(60) ? (int)below(KINDS) : kind) * EACH + (int)(!is_calm && one_in(8) ? below(EACH) : 0);
    slots[slot].written |= is_written;
    return one_in(100) ? slots[slot].at + 8 : slots[slot].at;
}

/* Room for an object that needs `bytes`: mostly so many, seldom fewer. */
static void *room(int kind, size_t needed, size_t *bytes) {
    /* The first of a kind is left as it is, mostly. */
    const int slot = kind * EACH + (int)(is_calm ? 0 : one_in(6) ? 0 : 1 + below(EACH - 1));
    if (needed > slots[slot].in.room) {
        needed = slots[slot].in.room;
    }
    *bytes = needed;
    if (one_in(20)) {
        *bytes = needed < 64 ? 0 : 64 * below((uint32_t)(needed / 64));
    }
    const size_t taken = (*bytes + 63) / 64 * 64;
    unsigned char *at = end_of(&slots[slot].in, taken < 64 ? 64 : taken);
    if (at != slots[slot].at) {
        /* An object elsewhere in this memory would be overwritten in part: it is gone. */
        memset(slots[slot].in.start, 0xa5, slots[slot].in.room);
    }
    slots[slot].at = at;
    slots[slot].bytes = taken < 64 ? 64 : taken;
    slots[slot].written = 1;
    return one_in(100) ? NO_OBJECT : slots[slot].at;
}

static uint64_t slot_hash(int slot) { return hash(slots[slot].at, slots[slot].in.start + slots[slot].in.room - slots[slot].at); }

/* Displacements, time and steps of a state, and whether the first are finite. */
static uint64_t state_hash(const supple_state *state, int *finite) {
    supple_vectors vectors;
    double seconds = 0.0;
    uint64_t steps = 0, sum = 0;
    if (supple_displacements(state, &vectors) != SUPPLE_OK || supple_state_time(state, &seconds, &steps) != SUPPLE_OK) {
        return 0;
    }
    for (uint32_t node = 0; node < vectors.count; node++) {
        const float *u = (const float *)(const void *)((const char *)vectors.first + node * vectors.stride);
        *finite &= isfinite(u[0]) && isfinite(u[1]) && isfinite(u[2]);
        /* The critical step may make a zero of a negative zero. */
        const float same[3] = {u[0] + 0.0f, u[1] + 0.0f, u[2] + 0.0f};
        sum = sum * 31 + hash(same, sizeof same);
    }
    return sum ^ hash(&seconds, sizeof seconds) ^ 3 * steps;
}

static void fail(const char *what, int status) {
    fprintf(stderr, "call %lu, %s: %s (%d, %s)\n", calls, doing, what, status, supple_status_text(status));
    exit(1);
}

/* Parts in any order, some twice, some not at all. */
static void each(void *context, supple_part part, const void *work, uint32_t parts) {
    (void)context;
    for (uint32_t n = below(2 * parts + 1); n > 0; n--) {
        part(work, below(parts));
    }
}

static const supple_threads *threads(supple_threads *room) {
    *room = (supple_threads){NULL, one_in(10) ? (uint32_t)bits() : below(9), one_in(40) ? NULL : each};
    return one_in(2) ? NULL : room;
}

static supple_error *wanted(void) {
    memset(&error, 0, sizeof error);
    return &error;
}

/* The bar in a configuration with a few changes. */
static supple_scene_config changed_bar(void) {
    static const float constants[3][3] = {{500.0f, 25000.0f, 0.0f}, {59.0f, 8.023f, 60000.0f}, {500.0f, 750.0f, 25000.0f}};
    const int is_small = one_in(5);
    const uint32_t nodes = is_small ? 4 : NODES, elements = is_small ? 1 : TETS;
    const uint32_t law = number(below(3)), tissues_there = one_in(4) ? 2 : 1;
    const uint32_t supports_there = is_small ? below(4) : 2 * LAYER;
    float *p = end_of(&of_points, 12 * (size_t)nodes);
    uint32_t *t = end_of(&of_tets, 16 * (size_t)elements);
    supple_support *s = end_of(&of_supports, sizeof(supple_support) * supports_there);
    supple_tissue *c = end_of(&of_tissues, sizeof(supple_tissue) * tissues_there);
    uint16_t *r = end_of(&of_regions, 2 * (size_t)elements);
    memcpy(p, points, 12 * (size_t)nodes);
    memcpy(t, tets, 16 * (size_t)elements);
    if (is_small) {
        static const float corners[12] = {0, 0, 0, 0.01f, 0, 0, 0, 0.01f, 0, 0, 0, 0.01f};
        memcpy(p, corners, sizeof corners);
        for (uint32_t n = 0; n < 4; n++) {
            t[n] = n;
        }
    }
    memcpy(s, supports, sizeof(supple_support) * supports_there);
    for (uint32_t n = 0; n < tissues_there; n++) {
        for (int k = 0; k < 3; k++) {
            c[n].constants[k] = constants[law < 3 ? law : 0][k] * (one_in(40) ? wild(2.0f) : 1.0f);
        }
        c[n].constants[3] = 0.0f, c[n].density = one_in(40) ? wild(1e3f) : 1000.0f;
    }
    for (uint32_t n = 0; n < elements; n++) {
        r[n] = (uint16_t)below(tissues_there);
    }
    for (uint32_t n = below(4); n > 0 && one_in(5); n--) {
        switch (below(5)) {
            case 0: p[below(3 * nodes)] = wild(0.05f); break;
            case 1: t[below(4 * elements)] = one_in(2) ? below(nodes) : number(nodes); break;
            case 2: r[below(elements)] = (uint16_t)bits(); break;
            default:
                if (supports_there > 0) {
                    s[below(supports_there)] = (supple_support){number(below(nodes)), number(below(8)), number(below(2))};
                }
        }
    }
    supple_scene_config config = {SUPPLE_CONFIG(supple_scene_config), law, number(below(2)), nodes, elements, supports_there,
                                  tissues_there, p, t, s, c, tissues_there > 1 || one_in(9) ? r : NULL, number(below(3)), 0, NULL, NULL,
                                  NULL, NULL};
    if (one_in(4)) {
        uint8_t *removed = end_of(&of_removed, elements);
        for (uint32_t n = 0; n < elements; n++) removed[n] = one_in(10);
        if (one_in(20)) removed[below(elements)] = (uint8_t)number(2);
        config.removed = removed;
    }
    if (one_in(3)) {
        supple_prony *series = end_of(&of_prony, sizeof *series * tissues_there);
        for (uint32_t n = 0; n < tissues_there; n++) {
            for (int term = 0; term < 3; term++) {
                series[n].share[term] = one_in(2) ? 0.0f : one_in(40) ? wild(0.2f) : 0.2f;
                series[n].seconds[term] = one_in(20) ? wild(1e-3f) : 1e-3f * (float)(1 + below(50));
            }
        }
        config.prony = series;
    }
    if (one_in(3)) {
        supple_fibres *fibres = end_of(&of_fibres, sizeof *fibres * tissues_there);
        float *directions = end_of(&of_directions, 24 * elements);
        for (uint32_t n = 0; n < tissues_there; n++) {
            float *const terms[3] = {fibres[n].fibres, fibres[n].sheets, fibres[n].coupling};
            for (int term = 0; term < 3; term++) {
                terms[term][0] = one_in(2) ? 0.0f : one_in(60) ? wild(1e3f) : (float)below(20000);
                terms[term][1] = one_in(60) ? wild(10.0f) : 10.0f;
            }
        }
        for (uint32_t n = 0; n < 6 * elements; n++) {
            directions[n] = one_in(2000) ? wild(1.0f) : (float)below(2000) - 1000.0f;
        }
        if (one_in(10) && elements > 0) memset(directions + 6 * below(elements), 0, 24);
        config.fibres = fibres, config.directions = directions;
    }
    config.struct_size = number(config.struct_size), config.abi = number(config.abi), config.reserved = number(0);
    /* Fewer than there are, or none: more would be memory that is not the host's. */
    config.supports = one_in(20) ? below(supports_there + 1) : config.supports;
    config.elements = one_in(20) ? below(elements + 1) : config.elements;
    config.nodes = one_in(20) ? below(nodes + 1) : config.nodes;
    config.tissues = one_in(20) ? below(tissues_there + 1) : config.tissues;
    if (one_in(40)) {
        const void **const pointers[8] = {(const void **)&config.points, (const void **)&config.tetrahedra, (const void **)&config.support,
                                          (const void **)&config.tissue, (const void **)&config.tissue_of_element,
                                          (const void **)&config.prony, (const void **)&config.fibres,
                                          (const void **)&config.directions};
        const void **pointer = pointers[below(8)];
        *pointer = one_in(2) || *pointer == NULL ? NULL : (const void *)((const char *)*pointer - 1);
    }
    return config;
}

static supple_status make_scene(void) {
    const supple_scene_config config = changed_bar();
    size_t needed = supple_scene_size(config.nodes, config.elements, config.tissues), bytes;
    needed += config.element == SUPPLE_NODAL_STRAIN ? supple_patches_size(config.nodes, config.elements, config.tissues) : 0;
    needed += config.prony != NULL ? supple_prony_size(config.tissues) : 0;
    needed += config.fibres != NULL ? supple_fibres_size(config.nodes, config.elements, config.tissues, config.element) : 0;
    supple_scene *made = NULL;
    void *at = room(SCENE, needed, &bytes);
    return supple_scene_init(at, bytes, one_in(60) ? NULL : &config, one_in(60) ? NULL : &made, wanted());
}

static uint32_t nodes_of(const supple_scene *scene) {
    supple_scene_facts facts = {0, 0, 0, 0, 0};
    return supple_scene_describe(scene, &facts) == SUPPLE_OK ? facts.nodes : 0;
}

/* The points of a scene of so many nodes, of which a few may be wild. */
static const float *points_for(uint32_t nodes) {
    if (nodes == 0 || nodes > NODES || one_in(60)) {
        return NULL;
    }
    float *p = end_of(&of_points, 12 * (size_t)nodes);
    memcpy(p, points, 12 * (size_t)nodes);
    if (one_in(20)) {
        p[below(3 * nodes)] = wild(0.05f);
    }
    return p;
}

static supple_status make_state(void) {
    const supple_scene *scene = object(SCENE, 0);
    const uint32_t nodes = nodes_of(scene);
    size_t bytes;
    supple_state *made = NULL;
    const uint32_t element = is_calm ? SUPPLE_NODAL_PRESSURE : below(3), terms = is_calm ? 3 : one_in(2) ? 0 : number(3);
    const size_t remembers = terms > 3 ? 0 : supple_relaxation_size(nodes, nodes == 4 ? 1 : TETS, is_calm ? 2 : 1 + below(2), element, terms);
    void *at = room(STATE, supple_state_size(nodes, element) + remembers, &bytes);
    return supple_state_init(at, bytes, scene, one_in(60) ? NULL : &made);
}

static supple_status make_loads(void) {
    const supple_scene *scene = object(SCENE, 0);
    const uint32_t forces = number(FORCES), motions = number(MOTIONS);
    size_t bytes;
    supple_loads *made = NULL;
    void *at = room(LOADS, supple_loads_size(forces, motions), &bytes);
    return supple_loads_init(at, bytes, scene, forces, motions, one_in(60) ? NULL : &made);
}

static supple_status make_learned(void) {
    const supple_scene *scene = object(SCENE, 0);
    const uint32_t nodes = nodes_of(scene), fallback = number(below(2));
    supple_learned_config config = {number(sizeof config), number(SUPPLE_ABI), fallback, number(0), NULL, 0};
    config.weights = one_in(40) ? NULL : end_of(&of_weights, (weights_bytes + 63) / 64 * 64);
    config.weights_bytes = one_in(20) ? below((uint32_t)weights_bytes) : weights_bytes;
    if (one_in(40) && config.weights != NULL) {
        config.weights = (const char *)config.weights + 4 * below(16), config.weights_bytes -= config.weights_bytes < 64 ? 0 : 64;
    }
    size_t bytes;
    supple_learned *made = NULL;
    void *at = room(LEARNED, supple_learned_size(nodes, fallback != 0), &bytes);
    return supple_learned_init(at, bytes, scene, &config, one_in(60) ? NULL : &made, wanted());
}

static supple_status make_large(void) {
    const supple_scene *scene = object(SCENE, 0);
    supple_state *state = object(STATE, 1);
    supple_large_config config = {number(sizeof config), number(SUPPLE_ABI), one_in(5) ? wild(1e-2f) : 2e-3f,
                                  one_in(5) ? wild(20.0f) : 20.0f, {0, 0, 0}};
    if (one_in(3)) {
        for (int axis = 0; axis < 3; axis++) {
            config.cells[axis] = number(1 + below(3));
        }
    }
    const float *p = points_for(nodes_of(scene));
    size_t needed = 64, bytes;
    const supple_status sized = supple_large_size(scene, p, &config, one_in(60) ? NULL : &needed, wanted());
    if (sized < 0) {
        return sized;
    }
    supple_large *made = NULL;
    void *at = room(LARGE, needed, &bytes);
    return supple_large_init(at, bytes, scene, state, p, &config, one_in(60) ? NULL : &made, wanted());
}

static supple_status make_guard(void) {
    const supple_scene *scene = object(SCENE, 0);
    supple_state *state = object(STATE, 1);
    supple_guard_config config = {number(sizeof config), number(SUPPLE_ABI), one_in(5) ? wild(1e-2f) : 1e-3f, 20.0f, number(3),
                                  one_in(3) ? wild(1e-3f) : 0.0f};
    const float *p = points_for(nodes_of(scene));
    size_t needed = 64, bytes;
    const supple_status sized = supple_guard_size(scene, p, one_in(60) ? NULL : &needed, wanted());
    if (sized < 0) {
        return sized;
    }
    supple_guard *made = NULL;
    void *at = room(GUARD, needed, &bytes);
    return supple_guard_init(at, bytes, scene, state, p, &config, one_in(60) ? NULL : &made, wanted());
}

static supple_status make_adaptive(void) {
    const supple_scene *scene = object(SCENE, 0);
    supple_state *state = object(STATE, 1);
    const supple_large_config config = {number(sizeof config), number(SUPPLE_ABI), one_in(5) ? wild(1e-2f) : 5e-3f, one_in(5) ? wild(20.0f) : 20.0f, {0, 0, 0}};
    const float *p = points_for(nodes_of(scene));
    size_t needed = 64, bytes;
    const supple_status sized = supple_adaptive_size(scene, p, &config, one_in(60) ? NULL : &needed, wanted());
    if (sized < 0) {
        return sized;
    }
    supple_adaptive *made = NULL;
    void *at = room(ADAPTIVE, needed, &bytes);
    return supple_adaptive_init(at, bytes, scene, state, p, &config, one_in(5) ? wild(1e-3f) : 1e-4f, one_in(60) ? NULL : &made, wanted());
}

static supple_status make_reaction(void) {
    const supple_scene *scene = object(SCENE, 0);
    uint32_t *nodes = end_of(&of_saved, 4 * sizeof *nodes);
    for (int n = 0; n < 4; n++) {
        nodes[n] = number((uint32_t)(below(2) ? n : NODES - 1 - n));
    }
    size_t bytes;
    supple_reaction *made = NULL;
    void *at = room(REACTION, supple_reaction_size(NODES), &bytes);
    return supple_reaction_init(at, bytes, scene, one_in(60) ? NULL : nodes, below(5), one_in(5) ? wild(20.0f) : 20.0f,
                                one_in(60) ? NULL : &made, wanted());
}

static supple_status set_loads(void) {
    static supple_force forces[FORCES + 2];
    static supple_motion motions[MOTIONS + 2];
    supple_loads *loads = object(LOADS, 1);
    const int is_wild = one_in(4);
    const float strong = is_wild ? powf(10.0f, (float)below(38)) : 0.05f, far = is_wild ? powf(10.0f, (float)below(20) - 4.0f) : 0.003f;
    switch (below(3)) {
        case 0: {
            float *gravity = end_of(&of_out, 12);
            for (int axis = 0; axis < 3; axis++) {
                gravity[axis] = is_wild ? wild(10.0f) : 10.0f * share();
            }
            return supple_set_gravity(loads, one_in(60) ? NULL : gravity);
        }
        case 1: {
            const uint32_t count = one_in(20) ? below(FORCES + 3) : below(4);
            for (uint32_t n = 0; n < count; n++) {
                forces[n] = (supple_force){number(below(NODES)), {strong * share(), strong * share(), wild(strong)}, one_in(30) ? wild(0.1f) : 0.0f};
            }
            supple_force *f = end_of(&of_out, sizeof *forces * count);
            memcpy(f, forces, sizeof *forces * count);
            return supple_set_forces(loads, one_in(60) ? NULL : f, count, wanted());
        }
        default: {
            const uint32_t count = one_in(20) ? below(MOTIONS + 3) : below(6);
            for (uint32_t n = 0; n < count; n++) {
                motions[n] = (supple_motion){number(NODES - LAYER + below(LAYER)), number(7), {far * share(), wild(far), 0.0f},
                                             one_in(5) ? wild(0.1f) : 0.0f};
            }
            supple_motion *m = end_of(&of_out, sizeof *motions * count);
            memcpy(m, motions, sizeof *motions * count);
            return supple_set_motions(loads, object(SCENE, 0), one_in(60) ? NULL : m, count, wanted());
        }
    }
}

static supple_status read_state(void) {
    const supple_state *state = object(STATE, 0);
    supple_vectors vectors;
    if (supple_displacements(state, &vectors) != SUPPLE_OK) {
        return supple_displacements(state, one_in(2) ? NULL : &vectors);
    }
    const size_t floats = one_in(10) ? below(3 * vectors.count) : 3 * (size_t)vectors.count;
    float *out = end_of(&of_out, 4 * floats);
    if (one_in(40)) {
        out = (float *)(void *)((char *)out - 2);
    } else if (one_in(40)) {
        out = NULL;
    }
    switch (below(4)) {
        case 0: return supple_copy_displacements(state, out, floats);
        case 1: return supple_copy_positions(state, points_for(vectors.count), out, floats);
        case 2: return supple_copy_velocities(state, out, floats);
        default: return supple_copy_forces(state, out, floats);
    }
}

static supple_status set_step(void) {
    const supple_scene *scene = object(SCENE, 0);
    supple_state *state = object(STATE, 1);
    if (one_in(5)) {
        float seconds;
        uint32_t node;
        return supple_critical_step(scene, state, one_in(40) ? NULL : &seconds, one_in(2) ? NULL : &node);
    }
    const supple_step_config config = {number(sizeof config), number(SUPPLE_ABI), one_in(4) ? wild(1e-3f) : 1e-4f,
                                       one_in(4) ? wild(50.0f) : 20.0f};
    return supple_set_step(scene, state, one_in(60) ? NULL : &config, wanted());
}

/* Where a saved state, damaged and its checksum put right, may come from. */
static supple_status save_and_restore(void) {
    supple_state *state = object(STATE, 1);
    supple_vectors vectors;
    if (supple_displacements(state, &vectors) != SUPPLE_OK) {
        return supple_save(state, end_of(&of_saved, 64), 64);
    }
    size_t needed = 0;
    CHECK(supple_state_saved_size(state, &needed) == SUPPLE_OK && needed >= supple_saved_size(vectors.count));
    unsigned char *saved = end_of(&of_saved, needed);
    const supple_status done = supple_save(state, saved, one_in(20) ? below((uint32_t)needed) : needed);
    if (done < 0) {
        return done;
    }
    for (uint32_t n = one_in(2) ? 0 : below(6); n > 0; n--) {
        const size_t at = one_in(2) ? below(96) : below((uint32_t)needed);
        if (one_in(2)) {
            saved[at] ^= (unsigned char)(1 << below(8));
        } else {
            const float value = wild(0.01f);
            memcpy(saved + at / 4 * 4, &value, 4);
        }
    }
    if (!one_in(10)) {
        const uint32_t sum = crc32_of(saved + 16, needed - 16);
        memcpy(saved + 12, &sum, 4);
    }
    return supple_restore(object(STATE, 1), saved, one_in(20) ? below((uint32_t)needed) : needed);
}

/* Whether a step of a state, and of the large or exact kind, leaves the same after a refused one as without. */
static void same_as_without(const supple_scene *scene, supple_state *state, supple_large *large, int state_slot, int large_slot) {
    supple_state *copy = end_of(&copies[0], slots[state_slot].bytes);
    supple_large *large_copy = large == NULL ? NULL : end_of(&copies[1], slots[large_slot].bytes);
    int finite = 1;
    uint64_t sums[2];
    supple_status told[2];
    supple_state *const states[2] = {state, copy};
    supple_large *const larges[2] = {large, large_copy};
    for (int n = 0; n < 2; n++) {
        told[n] = large == NULL ? supple_step(scene, NULL, states[n], 2, NULL, NULL)
                                : supple_large_step(scene, NULL, states[n], larges[n], 2, NULL, NULL);
        sums[n] = state_hash(states[n], &finite);
    }
    if (told[0] != told[1] || sums[0] != sums[1]) {
        fail("a refused step is seen in the next", told[0]);
    }
}

/* Steps change contact and pulls of their loads, and what is grasped moves nothing. */
static void contacts_may_change(void) {
    for (int n = 0; n < EACH; n++) {
        slots[CONTACT * EACH + n].written = slots[PULLS * EACH + n].written = 1;
    }
}

/* What a call wrote is finite; what a refused one was handed is as before. */
static void told_well(supple_status status, const void *out, size_t bytes, uint64_t before) {
    if (status < 0 && hash(out, bytes) != before) {
        fail("a refused call has written", status);
    }
    for (size_t n = 0; status >= 0 && n < bytes / sizeof(float); n++) {
        if (!isfinite(((const float *)out)[n])) {
            fail("a number that is none is told", status);
        }
    }
}

static supple_status make_pulls(void) {
    const uint32_t pulls = number(1 + below(MOST_PULLS)), nodes = number(below(2) ? 24 : NODES);
    size_t bytes;
    supple_pulls *made = NULL;
    void *at = room(PULLS, supple_pulls_size(pulls, nodes), &bytes);
    return supple_pulls_init(at, bytes, object(SCENE, 0), pulls, nodes, one_in(60) ? NULL : &made);
}

static supple_pull some_pull(void) {
    const float *near = points[below(NODES)];
    supple_pull made = {{0, 0, 0}, one_in(5) ? wild(0.05f) : 0.012f, powf(10.0f, (float)below(one_in(5) ? 10 : 7)), 0.0f, {0, 0, 0}};
    for (int axis = 0; axis < 3; axis++) {
        made.at[axis] = near[axis] + wild(0.002f), made.along[axis] = one_in(2) ? 0.0f : wild(1.0f);
    }
    made.stiffness = one_in(20) ? wild(1e6f) : made.stiffness, made.most = one_in(3) ? 0.0f : one_in(3) ? INFINITY : fabsf(wild(0.1f));
    made.most = one_in(60) ? wild(1.0f) : made.most;
    return made;
}

static supple_status add_pull(void) {
    supple_pulls *pulls = object(PULLS, 1);
    const supple_scene *scene = object(SCENE, 0);
    const supple_pull pull = some_pull();
    const supple_pull *given = one_in(60) ? NULL : &pull;
    if (one_in(2)) {
        return supple_add_pull(pulls, scene, points_for(nodes_of(scene)), given, wanted());
    }
    const uint32_t count = is_calm ? 4 : below(9);
    uint32_t *nodes = end_of(&of_faces, 4 * count);
    float *weights = end_of(&of_out, 4 * count);
    for (uint32_t n = 0; n < count; n++) {
        nodes[n] = number(below(NODES)), weights[n] = one_in(5) ? wild(1.0f) : 1.0f / (float)count;
    }
    return supple_add_pull_of_nodes(pulls, scene, one_in(60) ? NULL : nodes, one_in(60) ? NULL : weights, count, given, wanted());
}

/* Only the host knows how many pulls there are: all numbers are tried. */
static supple_status move_pulls(void) {
    supple_pulls *pulls = object(PULLS, 1);
    float *targets = end_of(&of_out, 12 * MOST_PULLS);
    double now = 0.0;
    (void)supple_state_time(object(STATE, 0), &now, NULL);
    const double from = one_in(10) ? (double)wild(1.0f) : now, to = one_in(10) ? (double)wild(1.0f) : now + 0.01 * (double)share();
    const float far = one_in(5) ? powf(10.0f, (float)below(38)) : 0.003f;
    for (int n = 0; n < MOST_PULLS; n++) {
        const float *near = points[below(NODES)];
        for (int axis = 0; axis < 3; axis++) {
            targets[3 * n + axis] = near[axis] + wild(far);
        }
        targets[3 * n] = one_in(8) ? NAN : targets[3 * n];
    }
    supple_status status = SUPPLE_E_MISMATCH;
    for (uint32_t count = 0; count <= MOST_PULLS && status == SUPPLE_E_MISMATCH; count++) {
        status = supple_set_targets(pulls, one_in(60) ? NULL : targets, count, from, to, wanted());
    }
    return status;
}

static supple_status read_pulls(supple_pulls *pulls, supple_state *state) {
    const supple_scene *scene = object(SCENE, 0);
    if (one_in(2)) (void)supple_turn_pulls(pulls, scene, one_in(60) ? NULL : points_for(nodes_of(scene)), state, NULL);
    supple_pulled *out = end_of(&of_out, MOST_PULLS * sizeof *out);
    supple_status status = SUPPLE_E_MISMATCH;
    for (uint32_t count = 0; count <= MOST_PULLS && status == SUPPLE_E_MISMATCH; count++) {
        const uint64_t before = hash(out, count * sizeof *out);
        status = supple_read_pulls(pulls, state, one_in(60) ? NULL : out, count);
        told_well(status, out, count * sizeof *out, before);
    }
    return status;
}

static supple_status pull(void) {
    switch (below(8)) {
        case 0:
        case 1: return add_pull();
        case 2: {
            const supple_pull pull = some_pull();
            return supple_set_pull(object(PULLS, 1), number(below(MOST_PULLS)), one_in(60) ? NULL : &pull, wanted());
        }
        case 3: return read_pulls(object(PULLS, 1), object(STATE, 1));
        case 4:
        case 5: return supple_set_pulls(object(LOADS, 1), one_in(8) ? NULL : object(PULLS, 1));
        default: return move_pulls();
    }
}

/* Surfaces that a host mixes, some of which are not closed. */
static supple_status make_pressure(void) {
    const supple_scene *scene = object(SCENE, 0);
    const uint32_t all = bar_triangles, count = one_in(4) ? below(all + 1) : all, surfaces = number(1 + below(3));
    uint32_t *corners = end_of(&of_faces, 12 * (size_t)count), *surface_of = end_of(&of_found, 4 * (size_t)count);
    memcpy(corners, of_bar, 12 * (size_t)count);
    for (uint32_t n = 0; n < count; n++) {
        surface_of[n] = one_in(400) ? number(0) : n % 3 < surfaces ? n % 3 : 0;
    }
    for (uint32_t n = below(4); n > 0 && count > 0 && one_in(5); n--) {
        corners[below(3 * count)] = number(below(NODES));
    }
    size_t bytes;
    supple_pressure *made = NULL;
    void *at = room(PRESSURE, supple_pressure_size(count, surfaces), &bytes);
    return supple_pressure_init(at, bytes, scene, points_for(nodes_of(scene)), one_in(60) ? NULL : corners, one_in(3) ? NULL : surface_of,
                                count, surfaces, one_in(60) ? NULL : &made, wanted());
}

static supple_status press(void) {
    supple_pressure *pressure = object(PRESSURE, 1);
    const uint32_t surface = number(below(3));
    switch (below(6)) {
        case 0: return supple_pressure_set(pressure, surface, one_in(4) ? wild(1e4f) : 20.0f * share(), one_in(4) ? wild(0.1f) : 0.0f);
        case 1: return supple_pressure_fill(pressure, surface, one_in(8) ? wild(1e-4f) : 6e-5f * share(), one_in(8) ? wild(1e5f) : 1e3f * share());
        case 2:
        case 3: return supple_set_pressure(object(LOADS, 1), one_in(8) ? NULL : pressure);
        default: {
            struct {
                double volume;
                float pascal, nothing;
            } told = {0.0, 0.0f, 0.0f};
            const uint64_t before = hash(&told, sizeof told);
            const supple_status status = supple_pressure_now(pressure, object(STATE, 0), surface, one_in(60) ? NULL : &told.volume,
                                                             one_in(60) ? NULL : &told.pascal);
            /* NaN is that of a surface which is open. */
            if (isinf(told.volume) || (isnan(told.volume) && status < 0)) {
                fail("a volume that is no number is told", status);
            }
            told.volume = status < 0 ? told.volume : 0.0;
            told_well(status, &told, sizeof told, before);
            return status;
        }
    }
}

/* A mesh with a few mistakes, and points that were located in it or damaged since. */
static supple_status points_and_fields(void) {
    static supple_followed_point kept[PLACES];
    const uint32_t elements = one_in(3) ? 1 + below(TETS) : TETS, nodes = one_in(20) ? below(NODES + 1) : NODES, kind = below(3);
    if (kind == 0) {
        const uint32_t count = below(PLACES + 1);
        supple_followed_point *located = end_of(&of_places, count * sizeof *located);
        for (uint32_t n = 0; n < count; n++) {
            if (one_in(40)) {
                ((float *)(void *)&kept[n])[below(sizeof kept[n] / 4)] = wild(1.0f);
            } else if (one_in(40)) {
                kept[n].nodes[below(4)] = number(below(NODES));
            }
            located[n] = kept[n];
        }
        float *positions = end_of(&of_out, 12 * (size_t)count), *fast = end_of(&of_field, 12 * (size_t)count);
        const uint64_t before[2] = {hash(positions, 12 * (size_t)count), hash(fast, 12 * (size_t)count)};
        float *const wanted_fast = one_in(3) ? NULL : fast;
        const supple_status status = supple_follow(object(STATE, 0), one_in(60) ? NULL : located, count, one_in(60) ? NULL : positions,
                                                   wanted_fast, wanted());
        told_well(status, positions, 12 * (size_t)count, before[0]);
        told_well(wanted_fast == NULL ? SUPPLE_E_NULL : status, fast, 12 * (size_t)count, before[1]);
        return status;
    }
    uint32_t *t = end_of(&of_tets, 16 * (size_t)elements);
    float *p = end_of(&of_points, 12 * (size_t)nodes);
    memcpy(t, tets, 16 * (size_t)elements), memcpy(p, points, 12 * (size_t)nodes);
    for (uint32_t n = below(4); n > 0 && nodes > 0 && one_in(4); n--) {
        t[below(4 * elements)] = number(below(NODES)), p[below(3 * nodes)] = wild(0.05f);
    }
    if (kind == 1) {
        const uint32_t count = below(PLACES + 1);
        float *places = end_of(&of_out, 12 * (size_t)count);
        for (uint32_t n = 0; n < 3 * count; n++) {
            places[n] = wild(0.08f);
        }
        const size_t needed = supple_locate_size(elements), bytes = one_in(20) ? below((uint32_t)needed) : needed;
        void *scratch = end_of(&of_scratch, (bytes + 3) / 4 * 4);
        supple_followed_point *located = end_of(&of_places, count * sizeof *located);
        const uint64_t before = hash(located, count * sizeof *located);
        const supple_status status = supple_locate(p, nodes, t, elements, one_in(60) ? NULL : places, count, one_in(60) ? NULL : scratch, bytes,
                                                   one_in(60) ? NULL : located, wanted());
        if (status < 0 && hash(located, count * sizeof *located) != before) {
            fail("a refused call has written", status);
        }
        for (uint32_t n = 0; status >= 0 && n < count; n++) {
            kept[n] = located[n];
            told_well(status, located[n].weights, sizeof located[n].weights + sizeof located[n].distance, 0);
            CHECK(located[n].element < elements && located[n].weights[0] >= 0.0f && located[n].weights[3] <= 1.0f);
        }
        return status;
    }
    supple_image_grid grid = {{-0.01, -0.01, -0.01}, {0.01, 0.01, 0.01}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1 + below(SIDE), 1 + below(SIDE), 1 + below(SIDE)}};
    for (int axis = 0; axis < 3; axis++) {
        grid.spacing[axis] *= one_in(3) ? 0.1 + (double)share() : 1.0;
        grid.size[axis] = one_in(3) ? number(grid.size[axis]) : grid.size[axis];
        if (one_in(12)) {
            grid.spacing[axis] = (double)wild(0.01f) * (one_in(2) ? 1.0 : pow(10.0, (double)below(600) - 300.0));
        } else if (one_in(12)) {
            grid.origin[axis] = (double)wild(0.1f) * (one_in(2) ? 1.0 : pow(10.0, (double)below(600) - 300.0));
        } else if (one_in(20)) {
            grid.direction[axis][below(3)] = (double)wild(1.0f);
        }
    }
    const float reach = one_in(2) ? 0.0f : wild(0.05f);
    size_t needed = 64, covered = 0;
    supple_status status = supple_displacement_field_size(one_in(60) ? NULL : &grid, reach, one_in(60) ? NULL : &needed, wanted());
    if (status < 0 && !one_in(2)) {
        return status;
    }
    error.status = SUPPLE_OK;
    /* With room for fewer: as much as there is. */
    needed = needed < of_scratch.room ? needed : of_scratch.room / 2;
    const double count = (double)grid.size[0] * grid.size[1] * grid.size[2];
    const size_t floats = count < SIDE * SIDE * SIDE ? 3 * (size_t)count : 3 * SIDE * SIDE, bytes = one_in(20) ? below((uint32_t)needed) : needed;
    float *field = end_of(&of_field, 4 * floats), *moved = end_of(&of_rest, 12 * NODES);
    supple_vectors from = {moved, 12, nodes};
    const float far = one_in(5) ? powf(10.0f, (float)below(38)) : 0.003f;
    for (int n = 0; n < 3 * NODES; n++) {
        moved[n] = one_in(200) ? wild(far) : far * share();
    }
    if (one_in(3)) {
        status = supple_displacements(object(STATE, 0), &from);
        if (status < 0) {
            return status;
        }
    }
    const uint64_t before = hash(field, 4 * floats);
    status = supple_displacement_field(p, nodes, t, elements, one_in(60) ? NULL : &from, number(below(2)), one_in(60) ? NULL : &grid, reach,
                                       one_in(60) ? NULL : end_of(&of_scratch, (bytes + 3) / 4 * 4), bytes, one_in(60) ? NULL : field,
                                       one_in(20) ? floats / 2 : floats, one_in(9) ? NULL : &covered, wanted());
    told_well(status, field, 4 * floats, before);
    CHECK((double)covered <= count);
    return status;
}

/* Another scene, or other tissues, under a state that moves; nothing that was prepared for the former one is prepared again. */
static supple_status exchange(void) {
    const supple_tissue others[2] = {{{one_in(3) ? wild(500.0f) : 300.0f, one_in(3) ? wild(1e4f) : 900.0f, 2e4f, 0.0f}, number(1000)}, tissue};
    switch (below(4)) {
        case 0: return supple_set_tissues(object(SCENE, 1), one_in(60) ? NULL : others, number(1) % 3, wanted());
        case 1: return supple_contact_carry_on(object(CONTACT, 1), object(SCENE, 0), object(CONTACT, 1));
        default: return supple_state_carry_on(object(SCENE, 0), object(STATE, 1));
    }
}

static supple_status make_contact(void) {
    static uint32_t numbers[NODES], corners[3 * 8];
    size_t bytes;
    for (uint32_t node = 0; node < NODES; node++) {
        numbers[node] = number(node);
    }
    const int is_list = one_in(2);
    const uint32_t count = number(is_list ? 1 + below(NODES) : NODES), grips = number(8);
    if (is_list && count > NODES) {
        return supple_let_go(object(CONTACT, 1), 0);
    }
    /* Corners among the nodes that there are, but for a few. */
    const uint32_t triangles = count < 3 ? 0 : number(below(9)) % 9;
    for (uint32_t n = 0; n < 3 * triangles; n++) {
        corners[n] = number((n / 3 + n % 3) % (count < NODES ? count : NODES));
    }
    const size_t needed = supple_contact_size(count < 4 * NODES ? count : NODES, triangles, grips < 99 ? grips : 8);
    const supple_surface surface = {is_list ? numbers : NULL, one_in(60) ? NULL : corners, count, triangles};
    void *at = room(CONTACT, needed, &bytes);
    float *scene_points = end_of(&of_points, sizeof points);
    memcpy(scene_points, points, sizeof points);
    supple_contact *made;
    return supple_contact_init(at, bytes, object(SCENE, 0), one_in(60) ? NULL : scene_points, one_in(60) ? NULL : &surface, grips, &made, &error);
}

static supple_pose any_pose(void) {
    supple_pose pose;
    for (int n = 0; n < 3; n++) {
        pose.position[n] = wild(0.03f);
    }
    for (int n = 0; n < 4; n++) {
        pose.rotation[n] = one_in(3) ? 0.0f : wild(1.0f);
    }
    return pose;
}

/* Instruments anywhere, of any kind. */
static supple_status touch(void) {
    supple_contact *contact = object(CONTACT, 1);
    const uint32_t which = number(below(3));
    switch (below(8)) {
        case 0: {
            supple_instrument list[4];
            for (int n = 0; n < 4; n++) {
                list[n] = (supple_instrument){number(below(3)), 0.002f + fabsf(wild(0.01f)), fabsf(wild(0.02f)), fabsf(wild(0.5f)), any_pose(), NULL, 0};
            }
            return supple_set_instruments(contact, one_in(60) ? NULL : list, number(1 + below(4)) % 5, &error);
        }
        case 1: {
            const supple_pose pose = any_pose();
            const double from = fabs((double)wild(0.1f));
            return supple_move_instrument(contact, which, one_in(60) ? NULL : &pose, from, from + fabs((double)wild(0.1f)), &error);
        }
        case 2: return supple_grasp(contact, object(STATE, 1), which, wild(0.004f), NULL);
        case 3: return supple_let_go(contact, which);
        case 4:
        case 5: return supple_set_contact(object(LOADS, 1), one_in(4) ? NULL : contact);
        case 6: {
            supple_touch felt;
            supple_contact_point list[8];
            uint32_t count;
            const supple_status status = supple_contact_points(contact, list, number(below(8)) % 9, &count);
            for (uint32_t n = 0; status == SUPPLE_OK && n < count; n++) {
                CHECK(isfinite(list[n].force[0] + list[n].position[1]));
            }
            return supple_read_touch(contact, which, &felt);
        }
        default: {
            supple_local_force model = {{0}, {0}, {{0}}, 0, 0};
            const float at[3] = {wild(0.01f), wild(0.01f), wild(0.01f)}, newton[3] = {wild(0.1f), wild(0.1f), wild(0.1f)};
            float there[3];
            const supple_status status = supple_local_force_follow(&model, at, newton);
            return status < 0 ? status : supple_local_force_at(&model, at, there);
        }
    }
}

static supple_status step(void) {
    contacts_may_change();
    const supple_scene *scene = object(SCENE, 0);
    supple_loads *loads = one_in(8) ? NULL : object(LOADS, 1);
    supple_state *state = object(STATE, 1);
    const uint32_t count = one_in(20) ? 0 : 1 + below(4);
    supple_threads room;
    const supple_threads *on = threads(&room);
    memset(&report, 0xa5, sizeof report);
    supple_report *told = one_in(8) ? NULL : &report;
    supple_status status;
    const uint32_t kind = below(5);
    if (kind < 3) {
        supple_large *large = kind == 0 ? NULL : object(LARGE, 1);
        int state_slot = -1, large_slot = -1;
        for (int slot = 0; slot < SLOTS; slot++) {
            state_slot = slots[slot].at == (void *)state && slot / EACH == STATE ? slot : state_slot;
            large_slot = large != NULL && slots[slot].at == (void *)large && slot / EACH == LARGE ? slot : large_slot;
        }
        /* Pulls of a refused long step stay in its inertia. */
        const int is_free = large == NULL || loads == NULL || (one_in(3) && supple_set_pulls(loads, NULL) == SUPPLE_OK);
        const int compared = state_slot >= 0 && (large == NULL || large_slot >= 0) && is_free;
        if (compared) {
            memcpy(end_of(&copies[0], slots[state_slot].bytes), state, slots[state_slot].bytes);
            if (large != NULL) {
                memcpy(end_of(&copies[1], slots[large_slot].bytes), large, slots[large_slot].bytes);
            }
        }
        status = kind == 0 ? supple_step(scene, loads, state, count, on, told) : supple_large_step(scene, loads, state, large, count, on, told);
        if (compared && told != NULL && status < 0 && report.steps == 0) {
            same_as_without(scene, state, large, state_slot, large_slot);
        }
    } else {
        supple_learned *learned = object(LEARNED, 1);
        if (one_in(20)) {
            return supple_learned_reset(learned);
        }
        /* A long lead-in takes long: that is no mistake of the library. */
        const float drawn = one_in(10) ? wild(0.001f) : 0.003f;
        const double seconds = drawn > 0.01f && isfinite(drawn) ? 0.01 : (double)drawn;
        status = kind == 3 ? supple_learned_lead(scene, loads, state, learned, seconds, on, told)
                           : supple_learned_step(scene, loads, state, learned, count, on, told);
    }
    if (told != NULL) {
        if (!isfinite(report.time) || report.error.status != (status < 0 ? status : SUPPLE_OK) || report.steps > 1000000) {
            fail("a report that does not fit", status);
        }
        if (status >= 0 && kind < 3 && report.steps != count) {
            fail("steps are missing", status);
        }
    }
    return status;
}

static supple_status follow(void) {
    contacts_may_change();
    supple_estimate estimate;
    memset(&estimate, 0xff, sizeof estimate);
    supple_threads room;
    const supple_status status = supple_guard_follow(object(SCENE, 0), one_in(8) ? NULL : object(LOADS, 1), object(STATE, 1),
                                                     object(GUARD, 1), threads(&room), &estimate);
    if (status == SUPPLE_OK && (estimate.known > 1 || (estimate.known && !(estimate.mean <= estimate.allowed)))) {
        fail("an estimate that is no number, or too large, is called good", status);
    }
    return status;
}

/* Never long: that many exact steps take their time. */
static supple_status advance(void) {
    contacts_may_change();
    const float drawn = one_in(10) ? wild(5e-3f) : 5e-3f;
    supple_adaptive_report taken;
    memset(&taken, 0xff, sizeof taken);
    memset(&report, 0xa5, sizeof report);
    supple_threads room;
    const supple_status status =
        supple_adaptive_advance(object(SCENE, 0), one_in(8) ? NULL : object(LOADS, 1), object(STATE, 1), object(ADAPTIVE, 1),
                                drawn > 0.01f && isfinite(drawn) ? 0.01f : drawn, threads(&room), &report, &taken);
    if (!isfinite(report.time) || report.error.status != (status < 0 ? status : SUPPLE_OK)) {
        fail("a report that does not fit", status);
    }
    if (status == SUPPLE_OK && !(taken.estimate.known == 0 || taken.estimate.mean <= taken.estimate.allowed)) {
        fail("an estimate that is no number, or too large, is called good", status);
    }
    return status;
}

/* Lattices are small, or the bytes of all simulations would take most of the time to compare. */
static supple_settings some_settings(void) {
    supple_settings made;
    CHECK(supple_default_settings(&made) == SUPPLE_OK);
    made.struct_size = number(made.struct_size), made.abi = number(made.abi), made.steps = number(below(4));
    made.seconds = one_in(2) ? 0.0f : one_in(5) ? wild(1e-3f) : 1e-4f, made.damping = one_in(5) ? wild(20.0f) : 20.0f;
    made.tolerance = one_in(2) ? 0.0f : one_in(5) ? wild(1e-3f) : 1e-3f;
    /* Never as many as it takes: stiff tissue, or a length that is drawn, takes millions. */
    made.most_steps = 1 + below(one_in(2) ? 30 : 1000);
    made.guard = number(below(2)), made.fallback = number(below(2)), made.lead_in = (double)(one_in(20) ? wild(0.01f) : 0.0f);
    for (int axis = 0; axis < 3; axis++) made.cells[axis] = number(1 + below(2));
    if (made.cells[0] * made.cells[1] * made.cells[2] > 8) made.cells[below(3)] = 0;
    made.forces = one_in(60) ? 0 : FORCES, made.motions = one_in(60) ? 0 : MOTIONS, made.grips = below(3);
    made.surface.node_count = one_in(2) ? 0 : one_in(20) ? number(NODES) : 4;
    if (one_in(made.steps == SUPPLE_STEPS_LEARNED ? 1 : 20)) {
        made.weights = one_in(40) ? NULL : end_of(&of_weights, (weights_bytes + 63) / 64 * 64), made.weights_bytes = weights_bytes;
    }
    return made;
}

static supple_status make_sim(void) {
    const supple_scene_config config = changed_bar();
    const supple_settings settings = some_settings();
    size_t needed = 64, bytes;
    const supple_status sized = supple_sim_size(&config, &settings, one_in(60) ? NULL : &needed, wanted());
    if (sized < 0) return sized;
    supple_sim *made = NULL;
    void *at = room(SIM, needed, &bytes);
    const supple_status status = supple_sim_setup(at, bytes, &config, &settings, one_in(60) ? NULL : &made, wanted());
    if (status == SUPPLE_E_SHORT && bytes >= needed) fail("a size that is not enough", status);
    return status;
}

/* What a host does with a simulation. */
static supple_status use_sim(void) {
    supple_sim *sim = object(SIM, 1);
    supple_sim_objects objects;
    if (one_in(20) || supple_sim_describe(sim, &objects) != SUPPLE_OK) return supple_sim_describe(sim, one_in(2) ? NULL : &objects);
    /* Long steps that end compute their forces once more. */
    contacts_may_change();
    if (one_in(6)) {
        const supple_settings settings = some_settings();
        return supple_sim_set(sim, one_in(60) ? NULL : &settings, wanted());
    }
    if (one_in(8)) {
        const float gravity[3] = {wild(10.0f), wild(10.0f), wild(10.0f)};
        return supple_set_gravity(objects.loads, gravity);
    }
    if (one_in(12)) return supple_state_reset(objects.state);
    if (one_in(8)) {
        return one_in(2) ? supple_set_pulls(objects.loads, one_in(4) ? NULL : object(PULLS, 1))
                         : supple_set_pressure(objects.loads, one_in(4) ? NULL : object(PRESSURE, 0));
    }
    if (one_in(12)) return read_pulls(object(PULLS, 1), objects.state);
    if (one_in(10)) {
        /* Other tissues, or the state of another simulation. */
        const supple_settings settings = some_settings();
        const supple_tissue others[2] = {{{wild(59.0f), 8.0f, 60000.0f, 0.0f}, 1000.0f}, {{100.0f, 8.0f, 60000.0f, 0.0f}, number(1000)}};
        return one_in(2) ? supple_sim_set_tissues(sim, one_in(60) ? NULL : others, below(3), one_in(3) ? NULL : &settings, wanted())
                         : supple_sim_carry_on(sim, object(SIM, 1), one_in(60) ? NULL : &settings, wanted());
    }
    if (objects.contact != NULL && one_in(4)) {
        const supple_instrument ball = {number(SUPPLE_SPHERE), wild(0.01f), 0.0f, 0.3f, {{wild(0.05f), wild(0.05f), 0.03f}, {0, 0, 0, 1}}, NULL, 0};
        return supple_set_instruments(objects.contact, &ball, below(2), wanted());
    }
    const float drawn = one_in(10) ? wild(5e-3f) : 5e-3f;
    supple_sim_report told;
    memset(&told, 0xa5, sizeof told);
    supple_threads room;
    const supple_status status = supple_sim_advance(sim, drawn > 0.01f && isfinite(drawn) ? 0.01 : (double)drawn, threads(&room), &told);
    if (!isfinite(told.call.time) || told.call.error.status != (status < 0 ? status : SUPPLE_OK)) {
        fail("a report that does not fit", status);
    }
    if (status == SUPPLE_OK && !(told.estimate.known == 0 || told.estimate.mean <= told.estimate.allowed)) {
        fail("an estimate that is no number, or too large, is called good", status);
    }
    return status;
}

/* The state of a simulation, if it is one. */
static uint64_t sim_hash(int slot, int *finite) {
    supple_sim_objects objects;
    return supple_sim_describe((supple_sim *)(void *)slots[slot].at, &objects) == SUPPLE_OK ? state_hash(objects.state, finite) : 0;
}

static supple_status remark(void) {
    const supple_scene *scene = object(SCENE, 0);
    supple_remark *remarks = end_of(&of_out, 4 * sizeof *remarks);
    uint32_t count = 77;
    const supple_status status =
        supple_remarks(scene, points_for(nodes_of(scene)), one_in(8) ? NULL : object(LOADS, 1), one_in(8) ? NULL : object(LEARNED, 0),
                       one_in(60) ? NULL : remarks, below(5), one_in(60) ? NULL : &count);
    for (uint32_t n = 0; status >= 0 && n < count && n < 4; n++) {
        if (supple_remark_text(remarks[n].kind)[0] == '\0') {
            fail("a remark without words", status);
        }
    }
    return status;
}

/* The boundary of a damaged mesh, what may touch it, and a traction on it. */
static supple_status surfaces(void) {
    const uint32_t elements = one_in(3) ? 1 + below(TETS) : TETS, right = 1 + below(FORCES);
    uint32_t *t = end_of(&of_tets, 16 * (size_t)elements), *faces = end_of(&of_faces, 48 * (size_t)elements), count = 0, needed = 2;
    float *p = end_of(&of_points, sizeof points);
    memcpy(t, tets, 16 * (size_t)elements), memcpy(p, points, sizeof points);
    for (uint32_t n = below(4); n > 0; n--) {
        t[below(4 * elements)] = number(below(NODES)), p[below(3 * NODES)] = wild(0.05f);
    }
    const size_t there = one_in(20) ? below(4 * elements) : 4 * (size_t)elements;
    supple_status status = supple_boundary(one_in(60) ? NULL : t, elements, one_in(60) ? NULL : faces, there, one_in(60) ? NULL : &count);
    if (status < 0) {
        return status;
    }
    if (count == 0 || count > 4 * elements) {
        fail("a mesh without a boundary", status);
    }
    const supple_instrument tool = {number(below(4)), wild(0.02f), wild(0.02f), wild(1.0f), any_pose(), NULL, 0};
    status = supple_needs_triangles(p, NODES, faces, count, &tool, one_in(9) ? 0 : 1, one_in(60) ? NULL : &needed, wanted());
    if (status >= 0 && needed > 1) {
        fail("neither needed nor not", status);
    }
    supple_force *forces = end_of(&of_out, 3 * FORCES * sizeof *forces);
    const float pascal[3] = {wild(100.0f), wild(100.0f), wild(100.0f)};
    const size_t room = one_in(20) ? below(3 * FORCES) : 3 * FORCES;
    status = supple_traction(p, NODES, faces, count < right ? count : right, pascal, one_in(9) ? wild(0.1f) : 0.0f, one_in(60) ? NULL : forces, room, wanted());
    for (uint32_t n = 0; status >= 0 && n < 3 * (count < right ? count : right); n++) {
        if (forces[n].node >= NODES || !isfinite(forces[n].newton[0] + forces[n].newton[1] + forces[n].newton[2])) {
            fail("a traction that is no force", status);
        }
    }
    return status;
}

static supple_status feel(void) {
    supple_reaction_force force;
    memset(&force, 0xff, sizeof force);
    const supple_status status = supple_reaction_follow(object(SCENE, 0), object(STATE, 1), object(REACTION, 1), one_in(60) ? NULL : &force);
    if (status == SUPPLE_OK && (force.known > 1 || !isfinite(force.newton[0] + force.newton[1] + force.newton[2]) || !(force.spread >= 0.0f))) {
        fail("a force that is no number is called good", status);
    }
    return status;
}

/* To rest, or from displacements that are drawn. */
static supple_status settle(void) {
    const supple_scene *scene = object(SCENE, 0);
    if (one_in(4)) {
        float *moved = end_of(&of_out, 12 * NODES);
        const float far = one_in(5) ? powf(10.0f, (float)below(20) - 6.0f) : 1e-4f;
        for (int n = 0; n < 3 * NODES; n++) {
            moved[n] = one_in(900) ? wild(far) : far * share();
        }
        return supple_set_displacements(scene, object(STATE, 1), one_in(60) ? NULL : moved, number(NODES), wanted());
    }
    contacts_may_change();
    const size_t needed = (supple_settle_size(NODES) + 63) / 64 * 64;
    unsigned char *at = end_of(&of_rest, needed);
    supple_settled told;
    if (one_in(4)) {
        const supple_status done = supple_sim_settle(object(SIM, 1), 1e-5f, below(30), NULL, at, needed, &told);
        CHECK(told.error.status == (done < 0 ? done : SUPPLE_OK) && !(told.remaining < 0.0f));
        return done;
    }
    const supple_status status = supple_settle(scene, object(LOADS, 1), object(STATE, 1), one_in(5) ? wild(1e-4f) : 1e-5f, below(60), NULL,
                                               one_in(60) ? NULL : at, one_in(20) ? 64 * below((uint32_t)(needed / 64)) : needed, &told);
    CHECK(told.error.status == (status < 0 ? status : SUPPLE_OK) && !(told.remaining < 0.0f) && (told.steps > 0 || status != SUPPLE_OK));
    return status;
}

static supple_status other(void) {
    supple_learned_facts facts;
    supple_scene_facts of_scene;
    switch (below(6)) {
        case 4: return supple_state_stop(object(SCENE, 0), object(STATE, 1));
        case 5: return supple_learned_fall_back(object(LEARNED, 1), object(STATE, 0));
        case 0: return supple_scene_describe(object(SCENE, 0), one_in(20) ? NULL : &of_scene);
        case 1: return supple_learned_describe(object(LEARNED, 0), one_in(20) ? NULL : &facts);
        case 2: return one_in(5) ? supple_state_reset(object(STATE, 1)) : SUPPLE_OK;
        default: return one_in(2) ? SUPPLE_OK : supple_set_level(one_in(2) ? supple_level() : 5 + below(100));
    }
}

/* Sound objects, one of each kind, with a law, an element, a method and a threading of their own. */
static void begin_anew(void) {
    static supple_status (*const makers[])(void) = {make_scene, make_state, set_step, make_loads, make_contact, make_pulls, add_pull, make_pressure,
                                                make_learned, make_large, make_guard, make_adaptive, make_sim};
    is_calm = 1, doing = "sound objects";
    for (size_t n = 0; n < sizeof makers / sizeof *makers; n++) {
        const supple_status status = makers[n]();
        if (status < 0 && makers[n] != add_pull && makers[n] != make_large && makers[n] != make_guard && makers[n] != make_adaptive && makers[n] != make_sim && makers[n] != set_step) {
            fail("refused", status);
        }
    }
    is_calm = 0;
}

static void one_call(void) {
    static const struct {
        const char *name;
        supple_status (*call)(void);
        int often;
    } all[] = {{"a scene", make_scene, 6}, {"a state", make_state, 4}, {"loads", make_loads, 3}, {"a learned step", make_learned, 3},
               {"steps beyond the critical one", make_large, 6}, {"a guard", make_guard, 2}, {"set loads", set_loads, 20}, {"read", read_state, 8},
               {"set a step", set_step, 8}, {"save and restore", save_and_restore, 6}, {"steps", step, 50}, {"follow", follow, 8},
               {"a reaction", make_reaction, 3}, {"feel", feel, 8}, {"other", other, 6}, {"adaptive steps", make_adaptive, 2},
               {"advance", advance, 8}, {"remarks", remark, 4}, {"a contact", make_contact, 4}, {"touch", touch, 20},
               {"a simulation", make_sim, 4}, {"use of a simulation", use_sim, 30}, {"surfaces", surfaces, 6},
               {"settling", settle, 8}, {"pulls", make_pulls, 3}, {"a pull", pull, 40}, {"pressures", make_pressure, 3},
               {"a pressure", press, 24}, {"points and fields", points_and_fields, 20}, {"an exchange", exchange, 6}};
    int at = 0;
    for (int draw = (int)below(323); draw >= all[at].often && at + 1 < (int)(sizeof all / sizeof *all); at++) {
        draw -= all[at].often;
    }
    doing = all[at].name;
    uint64_t states[EACH], sims[EACH];
    int finite = 1;
    for (int slot = 0; slot < SLOTS; slot++) {
        slots[slot].written = 0;
        slots[slot].before = slot_hash(slot);
    }
    for (int n = 0; n < EACH; n++) {
        states[n] = state_hash((supple_state *)(void *)slots[STATE * EACH + n].at, &finite);
        sims[n] = sim_hash(SIM * EACH + n, &finite);
    }
    report.steps = 0, error.status = SUPPLE_OK;
    const supple_status status = all[at].call();
    calls++, refused += status < 0;
    counted[(unsigned char)(status + 128)]++;
    if (supple_status_text(status) == supple_status_text(100)) {
        fail("no status", status);
    }
    if (error.status != SUPPLE_OK && error.status != status) {
        fail("an error with another status", status);
    }
    finite = 1;
    for (int n = 0; n < EACH; n++) {
        const int slot = STATE * EACH + n;
        const uint64_t now = state_hash((supple_state *)(void *)slots[slot].at, &finite);
        /* Steps are taken one after the other, and a report may not have been asked for: those may have moved it. */
        const int may_move = all[at].call == step || all[at].call == advance || all[at].call == settle || all[at].call == make_state || status >= 0;
        if (!(may_move && slots[slot].written) && now != states[n]) {
            fail("a state has moved", status);
        }
        const int is_used = all[at].call == use_sim || all[at].call == make_sim || all[at].call == settle;
        if (sim_hash(SIM * EACH + n, &finite) != sims[n] && !(is_used && slots[SIM * EACH + n].written)) {
            fail("the state of a simulation has moved", status);
        }
    }
    if (!finite) {
        fail("a displacement is not finite", status);
    }
    for (int slot = 0; slot < SLOTS; slot++) {
        if (!slots[slot].written && slot_hash(slot) != slots[slot].before) {
            fail("an object has changed that was not handed over", status);
        }
    }
}

int main(int argc, char **argv) {
    const char *const amount = argc > 1 ? argv[1] : "10000";
    const int is_time = strchr(amount, 's') != NULL;
    const unsigned long most = strtoul(amount, NULL, 10);
    random_state = argc > 2 ? strtoul(argv[2], NULL, 10) : 1;
    (void)bar_config();
    static const size_t sizes_of[KINDS] = {4 << 17, 1 << 17, 1 << 13, 1 << 14, 1 << 20, 1 << 20, 1 << 12, 1 << 20, 1 << 16, 1 << 20, 1 << 13, 1 << 14};
    for (int slot = 0; slot < SLOTS; slot++) {
        slots[slot].in = arena_of(sizes_of[slot / EACH]);
        slots[slot].at = end_of(&slots[slot].in, 64), slots[slot].bytes = 64;
    }
    of_removed = arena_of(TETS), of_points = arena_of(sizeof points), of_tets = arena_of(sizeof tets), of_supports = arena_of(sizeof supports);
    of_tissues = arena_of(2 * sizeof(supple_tissue)), of_regions = arena_of(2 * TETS);
    of_weights = arena_of(1 << 16), of_out = arena_of(1 << 13), of_faces = arena_of(48 * TETS), of_saved = arena_of(1 << 16);
    of_prony = arena_of(2 * sizeof(supple_prony)), of_fibres = arena_of(2 * sizeof(supple_fibres)), of_directions = arena_of(24 * TETS);
    of_rest = arena_of(supple_settle_size(NODES) + 64);
    of_places = arena_of(PLACES * sizeof(supple_followed_point)), of_found = arena_of(16 * TETS);
    of_field = arena_of(12 * SIDE * SIDE * SIDE), of_scratch = arena_of(1 << 16);
    CHECK(supple_boundary(tets[0], TETS, of_bar[0], 12 * TETS, &bar_triangles) == SUPPLE_OK);
    copies[0] = arena_of(sizes_of[STATE]), copies[1] = arena_of(sizes_of[LARGE]);
    file("weights/compact-10.weights", of_weights.start, of_weights.room, &weights_bytes);
    memmove(end_of(&of_weights, (weights_bytes + 63) / 64 * 64), of_weights.start, weights_bytes);
    const time_t start = time(NULL);
    while (is_time ? time(NULL) - start < (time_t)most : calls < most) {
        if (calls % 300 == 0) {
            begin_anew();
        }
        one_call();
    }
    printf("hostile: %lu calls, %lu refused; statuses:", calls, refused);
    for (int status = -128; status < 128; status++) {
        if (counted[(unsigned char)(status + 128)] > 0) {
            printf(" %d: %lu", status, counted[(unsigned char)(status + 128)]);
        }
    }
    printf("\n");
    return 0;
}
