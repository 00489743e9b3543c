/* Every way to use the library wrongly has its own status, names the place and the value, and changes nothing; and every status of
 * the header comes up here. */
#include "body.h"

SUPPLE_MEMORY(scene_memory, SUPPLE_SCENE_SIZE(NODES, TETS, 1));
SUPPLE_MEMORY(state_memory, SUPPLE_STATE_SIZE(NODES, ELEMENT));
SUPPLE_MEMORY(loads_memory, SUPPLE_LOADS_SIZE(FORCES, MOTIONS));
SUPPLE_MEMORY(learned_memory, SUPPLE_LEARNED_SIZE(NODES, 1));
SUPPLE_MEMORY(large_memory, 1 << 20);
/* Of another scene, of one element. */
SUPPLE_MEMORY(small_scene_memory, SUPPLE_SCENE_SIZE(4, 1, 1));
SUPPLE_MEMORY(small_state_memory, SUPPLE_STATE_SIZE(4, ELEMENT));
SUPPLE_MEMORY(small_loads_memory, SUPPLE_LOADS_SIZE(1, 1));
/* Where objects are tried that shall not be made. */
SUPPLE_MEMORY(spare, 4 << 20);
SUPPLE_MEMORY(weights, 40000);
SUPPLE_MEMORY(other, 4000);
static unsigned char saved[48 * NODES + 256];
static float out[3 * NODES];

static supple_scene *scene, *small_scene;
static supple_state *state, *small_state;
static supple_loads *loads, *small_loads;
static supple_learned *learned;
static supple_large *large;
static supple_error error;
static unsigned char seen[256];
static unsigned calls;

static const supple_step_config length = {SUPPLE_CONFIG(supple_step_config), 1e-4f, 20.0f};

/* Whether everything is looked at after each call. Not with an argument: under valgrind, which sees bad reads by itself, it would
 * take minutes, and what the compiler leaves between the members of an object counts as never written. */
static int watched;

static uint64_t everything(void) {
    if (!watched) {
        return 0;
    }
    return hash(scene_memory, sizeof scene_memory) ^ 3 * hash(state_memory, sizeof state_memory) ^
           5 * hash(loads_memory, sizeof loads_memory) ^ 7 * hash(learned_memory, sizeof learned_memory) ^
           9 * hash(large_memory, sizeof large_memory) ^ 11 * hash(small_scene_memory, sizeof small_scene_memory) ^
           13 * hash(small_state_memory, sizeof small_state_memory) ^ 15 * hash(saved, sizeof saved) ^ 17 * hash(out, sizeof out);
}

static void note(supple_status status) { seen[(unsigned char)(status + 128)] = 1; }

/* A call that must be refused like this, and change nothing. */
#define REFUSED(expected, call)                                                                                        \
    do {                                                                                                               \
        memset(&error, 0, sizeof error);                                                                               \
        const uint64_t before = everything();                                                                          \
        const supple_status got = (call);                                                                              \
        if (got != (expected) || everything() != before) {                                                             \
            fprintf(stderr, "%s:%d: %s: %d (%s) instead of %s, %s\n", __FILE__, __LINE__, #call, (int)got,             \
                    supple_status_text(got), #expected, everything() == before ? "unchanged" : "changed");             \
            exit(1);                                                                                                   \
        }                                                                                                              \
        CHECK(error.status == 0 || error.status == got);                                                               \
        note(got);                                                                                                     \
        calls++;                                                                                                       \
    } while (0)

#define DONE(call)                                                                                                     \
    do {                                                                                                               \
        const supple_status got = (call);                                                                              \
        note(got);                                                                                                     \
        if (got < 0) {                                                                                                 \
            fprintf(stderr, "%s:%d: %s: %s\n", __FILE__, __LINE__, #call, supple_status_text(got));                    \
            exit(1);                                                                                                   \
        }                                                                                                              \
    } while (0)

/* Where the energy balance and the vectors are in it. */
enum { BALANCE = 48, FRONT = 144 };

/* A saved state with one number changed and the checksum put right. */
static void forge(size_t at, const void *bytes, size_t count) {
    DONE(supple_save(state, saved, sizeof saved));
    memcpy(saved + at, bytes, count);
    const uint32_t sum = crc32_of(saved + 16, supple_saved_size(NODES) - 16);
    memcpy(saved + 12, &sum, 4);
}

static supple_status scene_with(supple_scene_config config) {
    supple_scene *none = NULL;
    memset(spare, 0, SUPPLE_SCENE_FRONT);
    const supple_status status = supple_scene_init(spare, sizeof spare, &config, &none, &error);
    CHECK(status == SUPPLE_OK || none == NULL);
    CHECK(status == SUPPLE_OK || supple_scene_describe((supple_scene *)(void *)spare, NULL) == SUPPLE_E_NOT_INITIALISED);
    return status;
}

/* Of two tissues the second one, that of element 17, has fibres and sheets, the first one only fibres. */
static void fibres(supple_scene_config bad, const uint16_t *of_element) {
    static supple_fibres fibres[2] = {{{1e3f, 10.0f}, {0.0f, 0.0f}, {0.0f, 0.0f}}, {{1e3f, 10.0f}, {1e3f, 10.0f}, {1e2f, 5.0f}}};
    static float directions[TETS][2][3];
    for (int e = 0; e < TETS; e++) directions[e][0][0] = 2.0f, directions[e][1][1] = of_element[e] == 1 ? 0.1f : 0.0f;
    bad.fibres = fibres, bad.directions = directions[0][0];
    DONE(scene_with(bad));
#define FIBRES(field, wrong, at)                                                                                       \
    do {                                                                                                               \
        const float kept = fibres[1].field;                                                                            \
        fibres[1].field = (wrong);                                                                                     \
        REFUSED(SUPPLE_E_FIBRES, scene_with(bad));                                                                     \
        CHECK(error.index == 1 && error.axis == (at));                                                                  \
        CHECK((float)error.value == fibres[1].field || (isnan(error.value) && isnan(fibres[1].field)));                \
        fibres[1].field = kept;                                                                                        \
    } while (0)
    FIBRES(fibres[0], -1.0f, 0);
    FIBRES(fibres[1], 0.0f, 0);
    FIBRES(sheets[0], NAN, 1);
    FIBRES(sheets[1], INFINITY, 1);
    FIBRES(coupling[1], 0.0f, 2);
    FIBRES(coupling[0], -INFINITY, 2);
#define DIRECTION(place, component, wrong)                                                                             \
    do {                                                                                                               \
        const float kept = (place)[component];                                                                         \
        (place)[component] = (wrong);                                                                                  \
        REFUSED(SUPPLE_E_DIRECTION, scene_with(bad));                                                                  \
        CHECK(error.index == 17 && error.value == 0.0 && error.limit == 0.0);                                          \
        (place)[component] = kept;                                                                                     \
    } while (0)
    DIRECTION(directions[17][0], 0, 0.0f);
    DIRECTION(directions[17][0], 2, NAN);
    DIRECTION(directions[17][0], 1, INFINITY);
    DIRECTION(directions[17][1], 1, 0.0f);
    directions[17][1][0] = 1.0f;
    DONE(scene_with(bad));
    DIRECTION(directions[17][1], 1, 0.0f);
    DIRECTION(directions[17][1], 1, NAN);
    bad.directions = NULL;
    REFUSED(SUPPLE_E_DIRECTION, scene_with(bad));
    CHECK(error.index == SUPPLE_NONE && error.value == 0.0 && error.limit == TETS);
    bad.directions = (const float *)(const void *)((const char *)directions + 2);
    REFUSED(SUPPLE_E_MISALIGNED, scene_with(bad));
    bad.fibres = (const supple_fibres *)(const void *)((const char *)fibres + 2);
    REFUSED(SUPPLE_E_MISALIGNED, scene_with(bad));
}

static void scenes(void) {
    const supple_scene_config good = bar_config();
    supple_scene_config bad = good;
    supple_scene *none = NULL;
    REFUSED(SUPPLE_E_NULL, supple_scene_init(NULL, sizeof spare, &good, &none, &error));
    REFUSED(SUPPLE_E_NULL, supple_scene_init(spare, sizeof spare, NULL, &none, &error));
    REFUSED(SUPPLE_E_NULL, supple_scene_init(spare, sizeof spare, &good, NULL, &error));
    REFUSED(SUPPLE_E_MISALIGNED, supple_scene_init(spare + 32, sizeof spare - 32, &good, &none, &error));
    REFUSED(SUPPLE_E_SHORT, supple_scene_init(spare, sizeof scene_memory - 1, &good, &none, &error));
    CHECK(error.value == sizeof scene_memory - 1 && error.limit == sizeof scene_memory);
    REFUSED(SUPPLE_E_SHORT, supple_scene_init(spare, 0, &good, &none, NULL));
#define SCENE(expected, change)                                                                                        \
    bad = good, (change);                                                                                              \
    REFUSED(expected, scene_with(bad))
    SCENE(SUPPLE_E_ABI, bad.struct_size = 4);
    CHECK(error.value == 4 && error.limit == sizeof bad);
    SCENE(SUPPLE_E_ABI, bad.abi = SUPPLE_ABI + 1);
    SCENE(SUPPLE_E_LAW, bad.law = 7);
    CHECK(error.value == 7);
    SCENE(SUPPLE_E_CHOICE, bad.winding = 2);
    SCENE(SUPPLE_E_CHOICE, bad.element = 3);
    CHECK(error.value == 3 && error.limit == SUPPLE_NODAL_STRAIN);
    SCENE(SUPPLE_E_CHOICE, bad.reserved = 1);
    SCENE(SUPPLE_E_MESH_EMPTY, bad.elements = 0);
    SCENE(SUPPLE_E_MESH_EMPTY, bad.nodes = 0);
    SCENE(SUPPLE_E_NULL, bad.points = NULL);
    SCENE(SUPPLE_E_NULL, bad.tetrahedra = NULL);
    SCENE(SUPPLE_E_NULL, bad.support = NULL);
    SCENE(SUPPLE_E_NULL, bad.tissue = NULL);
    SCENE(SUPPLE_E_MISALIGNED, bad.points = (const float *)(const void *)((const char *)points + 2));
    SCENE(SUPPLE_E_TISSUE, bad.tissues = 0);
    SCENE(SUPPLE_E_TISSUE, bad.tissues = 65536);
    SCENE(SUPPLE_E_NULL, bad.tissues = 2);

    supple_tissue tissues[2] = {tissue, tissue};
    static uint16_t of_element[TETS];
    bad.tissue = tissues, bad.tissue_of_element = of_element;
    of_element[17] = 2;
    REFUSED(SUPPLE_E_TISSUE, scene_with(bad));
    CHECK(error.index == 17);
    of_element[17] = 1;
    tissues[1].constants[1] = -1.0f;
    REFUSED(SUPPLE_E_CONSTANT, scene_with(bad));
    CHECK(error.index == 17 && error.value == -1.0);
    tissues[1] = tissue, tissues[1].density = NAN;
    REFUSED(SUPPLE_E_DENSITY, scene_with(bad));
    CHECK(error.index == 17);
    tissues[1] = tissue;
    DONE(scene_with(bad));

    static supple_prony series[2] = {{{0.3f, 0.0f, 0.2f}, {0.1f, 0.0f, 1.0f}}, {{0.3f, 0.0f, 0.2f}, {0.1f, 0.0f, 1.0f}}};
    bad.prony = series;
    DONE(scene_with(bad));
#define RELAXES(expected, field, wrong, at, most)                                                                      \
    do {                                                                                                               \
        const float kept = series[1].field;                                                                            \
        series[1].field = (wrong);                                                                                     \
        REFUSED(expected, scene_with(bad));                                                                            \
        CHECK(error.index == 1 && error.axis == (at) && (float)error.limit == (most));                                 \
        CHECK((error.value == (double)series[1].field) == ((at) != SUPPLE_NONE && !isnan(series[1].field)));           \
        series[1].field = kept;                                                                                        \
    } while (0)
    RELAXES(SUPPLE_E_RELAXATION_SHARE, share[2], -0.1f, 2, 0.99f);
    RELAXES(SUPPLE_E_RELAXATION_SHARE, share[0], NAN, 0, 0.99f);
    RELAXES(SUPPLE_E_RELAXATION_SHARE, share[0], INFINITY, 0, 0.99f);
    RELAXES(SUPPLE_E_RELAXATION_SHARE, share[0], 0.8f, SUPPLE_NONE, 0.99f);
    RELAXES(SUPPLE_E_RELAXATION_TIME, seconds[2], 0.0f, 2, 1e-6f);
    RELAXES(SUPPLE_E_RELAXATION_TIME, seconds[0], 2e6f, 0, 1e6f);
    RELAXES(SUPPLE_E_RELAXATION_TIME, seconds[2], NAN, 2, 1e-6f);
    bad.prony = (const supple_prony *)(const void *)((const char *)series + 2);
    REFUSED(SUPPLE_E_MISALIGNED, scene_with(bad));
    bad.prony = NULL;
    fibres(bad, of_element);

#define MESH(expected, place, value)                                                                                   \
    do {                                                                                                               \
        const __typeof__(place) kept = place;                                                                          \
        place = (value);                                                                                               \
        REFUSED(expected, scene_with(good));                                                                           \
        place = kept;                                                                                                  \
    } while (0)
    MESH(SUPPLE_E_NOT_FINITE, points[9][1], NAN);
    CHECK(error.index == 9 && error.node == 9 && error.axis == 1);
    MESH(SUPPLE_E_NOT_FINITE, points[9][1], 1e30f);
    CHECK(error.index == 9 && error.node == 9 && error.axis == 1 && error.value == (double)1e30f && error.limit == 1e6);
    MESH(SUPPLE_E_INDEX, tets[5][2], NODES);
    CHECK(error.index == 5 && error.node == NODES && error.limit == NODES);
    MESH(SUPPLE_E_MESH_REPEATED_NODE, tets[5][2], tets[5][1]);
    CHECK(error.index == 5 && error.node == tets[5][1]);
    MESH(SUPPLE_E_MESH_DEGENERATE, points[tets[0][3]][0], points[tets[0][0]][0]);
    MESH(SUPPLE_E_MESH_INVERTED, points[tets[0][3]][2], -0.1f);
    CHECK(error.value < 0.0);
    MESH(SUPPLE_E_INDEX, supports[3].node, NODES);
    CHECK(error.index == 3 && error.node == NODES);
    MESH(SUPPLE_E_CHOICE, supports[3].axes, 8);
    CHECK(error.index == 3 && error.value == 8);
    MESH(SUPPLE_E_CHOICE, supports[3].axes, 0);
    CHECK(error.index == 3 && error.value == 0 && error.limit == 7);
    MESH(SUPPLE_E_CHOICE, supports[3].moves, 2);
    /* A mesh without the elements of its last layer. */
    SCENE(SUPPLE_E_MESH_UNUSED_NODE, bad.elements = TETS - 6 * X * Y);
    CHECK(error.node == NODES - LAYER);
    supple_support all[NODES];
    for (uint32_t n = 0; n < NODES; n++) {
        all[n] = (supple_support){n, 7, 0};
    }
    SCENE(SUPPLE_E_NOTHING_MOVES, (bad.support = all, bad.supports = NODES));

    supple_scene_facts facts;
    REFUSED(SUPPLE_E_NULL, supple_scene_describe(NULL, &facts));
    REFUSED(SUPPLE_E_NULL, supple_scene_describe(scene, NULL));
    REFUSED(SUPPLE_E_KIND, supple_scene_describe((supple_scene *)(void *)state, &facts));
    REFUSED(SUPPLE_E_MISALIGNED, supple_scene_describe((supple_scene *)(void *)(scene_memory + 8), &facts));
    DONE(supple_scene_describe(scene, &facts));
    CHECK(facts.nodes == NODES && facts.elements == TETS && facts.bytes == sizeof scene_memory && facts.operations > 100000);
}

static void acting(void) {
    supple_loads *none = NULL;
    REFUSED(SUPPLE_E_NULL, supple_loads_init(spare, sizeof spare, NULL, 1, 1, &none));
    REFUSED(SUPPLE_E_SHORT, supple_loads_init(spare, SUPPLE_LOADS_SIZE(1, 1) - 1, scene, 1, 1, &none));
    REFUSED(SUPPLE_E_SHORT, supple_loads_init(spare, 1000, scene, UINT32_MAX, UINT32_MAX, &none));
    CHECK(none == NULL);
    const float up[3] = {0.0f, 0.0f, -9.81f}, nowhere[3] = {0.0f, INFINITY, 0.0f};
    REFUSED(SUPPLE_E_NULL, supple_set_gravity(NULL, up));
    REFUSED(SUPPLE_E_NULL, supple_set_gravity(loads, NULL));
    REFUSED(SUPPLE_E_NOT_FINITE, supple_set_gravity(loads, nowhere));
    DONE(supple_set_gravity(loads, up));

    supple_force forces[FORCES + 1] = {{0, {0.0f, 0.0f, 0.0f}, 0.0f}};
    REFUSED(SUPPLE_E_CAPACITY, supple_set_forces(loads, forces, FORCES + 1, &error));
    CHECK(error.value == FORCES + 1 && error.limit == FORCES);
    REFUSED(SUPPLE_E_NULL, supple_set_forces(loads, NULL, 1, &error));
    forces[2].node = NODES;
    REFUSED(SUPPLE_E_INDEX, supple_set_forces(loads, forces, 4, &error));
    CHECK(error.index == 2 && error.node == NODES && error.limit == NODES);
    forces[2].node = 0, forces[2].newton[1] = NAN;
    REFUSED(SUPPLE_E_NOT_FINITE, supple_set_forces(loads, forces, 4, &error));
    CHECK(error.index == 2 && isnan(error.value));
    forces[2].newton[1] = 0.0f, forces[2].ramp = -1.0f;
    REFUSED(SUPPLE_E_NEGATIVE, supple_set_forces(loads, forces, 4, &error));
    CHECK(error.index == 2 && error.value == -1.0);
    DONE(supple_set_forces(loads, NULL, 0, &error));

    supple_motion motions[2] = {{NODES - 1, 7, {0.0f, 0.0f, 0.0f}, 0.0f}, {NODES - 2, 7, {0.0f, 0.0f, 0.0f}, 0.0f}};
    motions[1].node = LAYER;
    REFUSED(SUPPLE_E_NOT_HELD, supple_set_motions(loads, scene, motions, 2, &error));
    CHECK(error.index == 1 && error.node == LAYER && error.axis == 0);
    motions[1].node = NODES - 2, motions[1].axes = 15;
    REFUSED(SUPPLE_E_CHOICE, supple_set_motions(loads, scene, motions, 2, &error));
    motions[1].axes = 0;
    REFUSED(SUPPLE_E_CHOICE, supple_set_motions(loads, scene, motions, 2, &error));
    CHECK(error.index == 1 && error.value == 0);
    motions[1].axes = 7, motions[1].metre[2] = NAN;
    REFUSED(SUPPLE_E_NOT_FINITE, supple_set_motions(loads, scene, motions, 2, &error));
    REFUSED(SUPPLE_E_MISMATCH, supple_set_motions(loads, small_scene, motions, 1, &error));
    REFUSED(SUPPLE_E_CAPACITY, supple_set_motions(loads, scene, motions, MOTIONS + 1, &error));
    REFUSED(SUPPLE_E_KIND, supple_set_motions((supple_loads *)(void *)scene, scene, motions, 1, &error));
}

static void states(void) {
    supple_state *none = NULL;
    supple_state *nothing = (supple_state *)(void *)spare;
    float seconds = 0.0f;
    memset(spare, 0, sizeof spare);
    REFUSED(SUPPLE_E_SHORT, supple_state_init(spare, sizeof state_memory - 1, scene, &none));
    REFUSED(SUPPLE_E_NOT_INITIALISED, supple_step(scene, loads, nothing, 1, NULL, NULL));
    REFUSED(SUPPLE_E_NOT_INITIALISED, supple_step((supple_scene *)(void *)spare, loads, state, 1, NULL, NULL));
    REFUSED(SUPPLE_E_NOT_INITIALISED, supple_step(scene, (supple_loads *)(void *)spare, state, 1, NULL, NULL));
    REFUSED(SUPPLE_E_NO_STEP, supple_step(scene, loads, state, 1, NULL, NULL));
    REFUSED(SUPPLE_E_MISMATCH, supple_critical_step(scene, small_state, &seconds, NULL));
    REFUSED(SUPPLE_E_NULL, supple_critical_step(scene, state, NULL, NULL));
    supple_step_config bad = length;
#define STEP(expected, change)                                                                                         \
    bad = length, (change);                                                                                            \
    REFUSED(expected, supple_set_step(scene, state, &bad, &error))
    STEP(SUPPLE_E_ABI, bad.abi = 0);
    STEP(SUPPLE_E_ABI, bad.struct_size = 0);
    STEP(SUPPLE_E_STEP, bad.seconds = 0.0f);
    STEP(SUPPLE_E_STEP, bad.seconds = NAN);
    STEP(SUPPLE_E_NEGATIVE, bad.damping = -1.0f);
    CHECK(error.value == -1.0);
    STEP(SUPPLE_E_UNSTABLE, bad.seconds = 0.1f);
    DONE(supple_critical_step(scene, state, &seconds, NULL));
    CHECK(error.value == (double)0.1f && error.limit == (double)seconds && error.node < NODES);
    REFUSED(SUPPLE_E_MISMATCH, supple_set_step(scene, small_state, &length, &error));
    DONE(supple_set_step(scene, state, &length, &error));
    REFUSED(SUPPLE_E_MISMATCH, supple_step(scene, small_loads, state, 1, NULL, NULL));
    REFUSED(SUPPLE_E_MISMATCH, supple_step(small_scene, NULL, state, 1, NULL, NULL));
    const supple_threads threads = {NULL, 2, NULL};
    REFUSED(SUPPLE_E_NULL, supple_step(scene, loads, state, 1, &threads, NULL));
    REFUSED(SUPPLE_E_MISALIGNED, supple_step(scene, loads, state, 1, NULL, (supple_report *)(void *)(spare + 1)));

    supple_vectors vectors;
    REFUSED(SUPPLE_E_NULL, supple_displacements(state, NULL));
    REFUSED(SUPPLE_E_NULL, supple_displacements(NULL, &vectors));
    REFUSED(SUPPLE_E_SHORT, supple_copy_displacements(state, out, 3 * NODES - 1));
    REFUSED(SUPPLE_E_NULL, supple_copy_velocities(state, NULL, 3 * NODES));
    REFUSED(SUPPLE_E_MISALIGNED, supple_copy_forces(state, (float *)(void *)((char *)out + 1), 3 * NODES - 1));
    REFUSED(SUPPLE_E_OVERLAP, supple_copy_forces(state, (float *)(void *)(state_memory + 256), 3 * NODES));
    REFUSED(SUPPLE_E_OVERLAP, supple_copy_positions(state, out, out, 3 * NODES));
    REFUSED(SUPPLE_E_NULL, supple_copy_positions(state, NULL, out, 3 * NODES));
    REFUSED(SUPPLE_E_NULL, supple_state_time(NULL, NULL, NULL));
    REFUSED(SUPPLE_E_NULL, supple_state_reset(NULL));
    REFUSED(SUPPLE_E_NULL, supple_state_stop(scene, NULL));
}

static void bytes_of_states(void) {
    const size_t bytes = supple_saved_size(NODES);
    REFUSED(SUPPLE_E_SHORT, supple_save(state, saved, bytes - 1));
    REFUSED(SUPPLE_E_NULL, supple_save(state, NULL, bytes));
    REFUSED(SUPPLE_E_OVERLAP, supple_save(state, state_memory, bytes));
    DONE(supple_save(state, saved, sizeof saved));
    REFUSED(SUPPLE_E_SHORT, supple_restore(state, saved, bytes - 1));
    REFUSED(SUPPLE_E_SHORT, supple_restore(state, saved, 3));
    REFUSED(SUPPLE_E_NULL, supple_restore(state, NULL, bytes));
    REFUSED(SUPPLE_E_MISMATCH, supple_restore(small_state, saved, bytes));
    REFUSED(SUPPLE_E_NOT_SAVED, supple_restore(state, points, sizeof points));
    saved[8] ^= 64;
    REFUSED(SUPPLE_E_SAVED_VERSION, supple_restore(state, saved, bytes));
    saved[8] ^= 64, saved[bytes - 1] ^= 1;
    REFUSED(SUPPLE_E_SAVED_CHECKSUM, supple_restore(state, saved, bytes));
}

static void networks(void) {
    size_t bytes, of_other;
    file("weights/compact-10.weights", weights, sizeof weights, &bytes);
    file("tests/data/other-shape.weights", other, sizeof other, &of_other);
    const supple_learned_config good = {SUPPLE_CONFIG(supple_learned_config), 1, 0, weights, bytes};
    supple_learned_config bad = good;
    supple_learned *none = NULL;
#define LEARNED(expected, change)                                                                                      \
    bad = good, (change);                                                                                              \
    REFUSED(expected, supple_learned_init(spare, sizeof spare, scene, &bad, &none, &error))
    LEARNED(SUPPLE_E_ABI, bad.abi = 77);
    LEARNED(SUPPLE_E_CHOICE, bad.fallback = 2);
    LEARNED(SUPPLE_E_CHOICE, bad.reserved = 1);
    LEARNED(SUPPLE_E_NULL, bad.weights = NULL);
    LEARNED(SUPPLE_E_WEIGHTS_MISALIGNED, bad.weights = weights + 1);
    LEARNED(SUPPLE_E_WEIGHTS_SHORT, bad.weights_bytes = 20);
    LEARNED(SUPPLE_E_WEIGHTS_SHORT, bad.weights_bytes = bytes - 1);
    CHECK(error.value == (double)(bytes - 1) && error.limit == (double)bytes);
    LEARNED(SUPPLE_E_NOT_WEIGHTS, bad.weights = points);
    LEARNED(SUPPLE_E_WEIGHTS_SHAPE, (bad.weights = other, bad.weights_bytes = of_other));
    CHECK(error.value == 4);
    weights[8] = 9;
    LEARNED(SUPPLE_E_WEIGHTS_VERSION, bad.abi = SUPPLE_ABI);
    CHECK(error.value == 9);
    weights[8] = 1, weights[bytes / 2] ^= 1;
    LEARNED(SUPPLE_E_WEIGHTS_CHECKSUM, bad.abi = SUPPLE_ABI);
    weights[bytes / 2] ^= 1;
    /* A layer table that begins with no inputs, in a file whose checksum is right. */
    static unsigned char kept[sizeof weights];
    memcpy(kept, weights, sizeof weights);
    weights[24] = 0;
    const uint32_t sum = crc32_of(weights + 20, bytes - 20);
    memcpy(weights + 16, &sum, 4);
    LEARNED(SUPPLE_E_WEIGHTS_CONTENT, bad.abi = SUPPLE_ABI);
    memcpy(weights, kept, sizeof weights);
    REFUSED(SUPPLE_E_SHORT, supple_learned_init(spare, SUPPLE_LEARNED_SIZE(NODES, 0), scene, &good, &none, &error));
    CHECK(none == NULL);

    supple_learned_facts facts;
    DONE(supple_learned_init(learned_memory, sizeof learned_memory, scene, &good, &learned, &error));
    DONE(supple_learned_describe(learned, &facts));
    supple_step_config step = {SUPPLE_CONFIG(supple_step_config), facts.seconds / 2.5f, facts.damping};
    DONE(supple_set_step(scene, state, &step, NULL));
    REFUSED(SUPPLE_E_STEP_RATIO, supple_learned_lead(scene, loads, state, learned, 1, NULL, NULL));
    step.seconds = facts.seconds / 3.0f, step.damping = facts.damping + 1.0f;
    DONE(supple_set_step(scene, state, &step, NULL));
    REFUSED(SUPPLE_E_DAMPING, supple_learned_lead(scene, loads, state, learned, 1, NULL, NULL));
    step.damping = facts.damping;
    DONE(supple_set_step(scene, state, &step, NULL));
    REFUSED(SUPPLE_E_NOT_LED, supple_learned_step(scene, loads, state, learned, 1, NULL, NULL));
    REFUSED(SUPPLE_E_MISMATCH, supple_learned_lead(small_scene, NULL, small_state, learned, 1, NULL, NULL));
    REFUSED(SUPPLE_E_NULL, supple_learned_lead(scene, loads, state, NULL, 1, NULL, NULL));
    const double no_seconds[3] = {-1e-9, INFINITY, NAN};
    for (int n = 0; n < 3; n++) {
        REFUSED(SUPPLE_E_NEGATIVE, supple_learned_lead(scene, loads, state, learned, no_seconds[n], NULL, NULL));
    }
    DONE(supple_learned_lead(scene, loads, state, learned, 0.4 * facts.seconds, NULL, NULL)); /* the nearest number: none */
    REFUSED(SUPPLE_E_NOT_LED, supple_learned_step(scene, loads, state, learned, 1, NULL, NULL));
    DONE(supple_learned_lead(scene, loads, state, learned, 5 * (double)facts.seconds, NULL, NULL));
    DONE(supple_step(scene, loads, state, 1, NULL, NULL));
    REFUSED(SUPPLE_E_NOT_LED, supple_learned_step(scene, loads, state, learned, 1, NULL, NULL));

    const supple_large_config calm = {SUPPLE_CONFIG(supple_large_config), 1e-3f, 20.0f, {1, 1, 3}};
    supple_large_config wrong = calm;
    supple_large *no_large = NULL;
    const supple_threads threads = {NULL, 2, NULL};
    size_t needed = 0;
#define LARGE(expected, change)                                                                                        \
    wrong = calm, (change);                                                                                            \
    REFUSED(expected, supple_large_init(spare, sizeof spare, scene, state, points[0], &wrong, &no_large, &error))
    LARGE(SUPPLE_E_ABI, wrong.struct_size++);
    LARGE(SUPPLE_E_STEP, wrong.seconds = -1.0f);
    LARGE(SUPPLE_E_LATTICE, wrong.cells[0] = 5000);
    LARGE(SUPPLE_E_LATTICE, wrong.cells[0] = 0);
    REFUSED(SUPPLE_E_SHORT, supple_large_init(spare, 5000, scene, state, points[0], &calm, &no_large, &error));
    REFUSED(SUPPLE_E_NULL, supple_large_init(spare, sizeof spare, scene, state, NULL, &calm, &no_large, &error));
    REFUSED(SUPPLE_E_NULL, supple_large_size(scene, points[0], &calm, NULL, &error));
    DONE(supple_large_size(scene, points[0], &calm, &needed, &error));
    DONE(supple_large_init(large_memory, needed, scene, state, points[0], &calm, &large, &error));
    REFUSED(SUPPLE_E_KIND, supple_large_step(scene, loads, state, (supple_large *)(void *)learned, 1, NULL, NULL));
    REFUSED(SUPPLE_E_MISMATCH, supple_large_step(small_scene, NULL, small_state, large, 1, NULL, NULL));
    REFUSED(SUPPLE_E_NULL, supple_large_step(scene, loads, state, large, 1, &threads, NULL));
}

/* Steps that are not to be believed are not taken. */
static void divergence(void) {
    supple_report report;
    DONE(supple_state_reset(state));
    DONE(supple_set_step(scene, state, &length, NULL));
    supple_force force = {NODES / 2, {3e38f, 0.0f, 0.0f}, 0.0f};
    DONE(supple_set_motions(loads, scene, NULL, 0, NULL));
    DONE(supple_set_forces(loads, &force, 1, NULL));
    supple_vectors vectors;
    DONE(supple_displacements(state, &vectors));
    const uint64_t before = hash(vectors.first, vectors.stride * vectors.count);
    const supple_status burst = supple_step(scene, loads, state, 3, NULL, &report);
    note(burst);
    CHECK(burst == SUPPLE_E_DIVERGED_FORCE && report.steps == 0 && report.node == NODES / 2);
    CHECK(report.error.index == 0 && report.error.limit > 1e-4 && report.error.limit < 1e-1);
    CHECK(hash(vectors.first, vectors.stride * vectors.count) == before);
    DONE(supple_set_forces(loads, NULL, 0, NULL));

    /* A state whose energy no load has given. */
    DONE(supple_step(scene, NULL, state, 1, NULL, NULL));
    const float fast[3] = {1e-3f, 0.0f, 0.0f};
    forge(FRONT + 32 * NODES + 16 * (NODES / 2), fast, sizeof fast);
    DONE(supple_restore(state, saved, sizeof saved));
    const supple_status kick = supple_step(scene, NULL, state, 3, NULL, &report);
    note(kick);
    CHECK(kick == SUPPLE_E_DIVERGED_ENERGY && report.node == NODES / 2 && report.steps == 0);
    /* Stopped, the state can go on. */
    DONE(supple_state_stop(scene, state));
    DONE(supple_step(scene, NULL, state, 3, NULL, &report));

    /* Faster than numbers can tell. */
    const float fastest[3] = {1e30f, 0.0f, 0.0f};
    forge(FRONT + 32 * NODES + 16 * (NODES / 2), fastest, sizeof fastest);
    DONE(supple_restore(state, saved, sizeof saved));
    const supple_status flight = supple_step(scene, NULL, state, 3, NULL, &report);
    note(flight);
    CHECK(flight == SUPPLE_E_DIVERGED && report.node == NODES / 2 && report.steps == 0);

    /* An instrument that jumps to and fro. */
    DONE(supple_state_reset(state));
    supple_status jump = SUPPLE_OK;
    for (int n = 0; n < 100 && jump >= SUPPLE_OK; n++) {
        move_end(scene, loads, n % 2 ? -0.3f : 0.3f, 0.0f, 0.0f);
        jump = supple_step(scene, loads, state, 1, NULL, &report);
    }
    note(jump);
    CHECK(jump == SUPPLE_E_DIVERGED_MOTION && report.node >= NODES - LAYER && report.error.value > report.error.limit);

    /* One that is no number. */
    const float nan = NAN;
    const double no_time = INFINITY, too_early = -0.01;
    forge(FRONT + 16 * (NODES / 2), &nan, sizeof nan);
    REFUSED(SUPPLE_E_NOT_FINITE, supple_restore(state, saved, sizeof saved));
    forge(28, &nan, sizeof nan);
    DONE(supple_restore(state, saved, sizeof saved)); /* no step is set */
    forge(20, &nan, sizeof nan);
    REFUSED(SUPPLE_E_NOT_FINITE, supple_restore(state, saved, sizeof saved));
    forge(32, &no_time, sizeof no_time);
    REFUSED(SUPPLE_E_NOT_FINITE, supple_restore(state, saved, sizeof saved));
    /* Or a time before the start, when ramps have not begun. */
    forge(32, &too_early, sizeof too_early);
    REFUSED(SUPPLE_E_NOT_FINITE, supple_restore(state, saved, sizeof saved));

    /* One that is so large that nothing can be bounded. */
    const float far = 3e38f;
    float seconds;
    forge(FRONT + 16 * (NODES / 2), &far, sizeof far);
    DONE(supple_restore(state, saved, sizeof saved));
    CHECK(supple_critical_step(scene, state, &seconds, NULL) == SUPPLE_E_TOO_STIFF);
    CHECK(supple_set_step(scene, state, &length, &error) == SUPPLE_E_TOO_STIFF && error.node == NODES / 2);
    note(SUPPLE_E_TOO_STIFF);

    /* With half of its energy in the balance: the step is taken, and told not to be exact. */
    DONE(supple_state_reset(state));
    DONE(supple_set_step(scene, state, &length, NULL));
    move_end(scene, loads, 0.01f, 0.0f, 0.01f);
    DONE(supple_step(scene, loads, state, 100, NULL, &report));
    const double balance[7] = {0.0, 0.0, 0.0, 0.0, report.kinetic, 0.0, 0.5 * report.kinetic};
    forge(BALANCE, balance, sizeof balance);
    DONE(supple_restore(state, saved, sizeof saved));
    const supple_status limited = supple_step(scene, NULL, state, 1, NULL, &report);
    note(limited);
    CHECK(limited == SUPPLE_LIMITED && report.steps == 1 && report.energy_excess > 0.5f && report.energy_excess < 3.0f);

    /* A network far from its training tells so. With half of its energy in the balance its step is undone, and exact ones
     * take its place and the next. */
    DONE(supple_state_reset(state));
    DONE(supple_learned_reset(learned));
    supple_learned_facts facts;
    DONE(supple_learned_describe(learned, &facts));
    const supple_step_config step = {SUPPLE_CONFIG(supple_step_config), facts.seconds / 3.0f, facts.damping};
    DONE(supple_set_step(scene, state, &step, NULL));
    move_end(scene, loads, 0.02f, 0.0f, 0.02f);
    DONE(supple_learned_lead(scene, loads, state, learned, 100 * (double)facts.seconds, NULL, &report));
    const supple_status outside = supple_learned_step(scene, loads, state, learned, 20, NULL, &report);
    note(outside);
    CHECK(outside == SUPPLE_OUTSIDE && report.steps == 20 && report.outside > 0.01f);

    DONE(supple_state_reset(state));
    DONE(supple_learned_reset(learned));
    move_end(scene, loads, 0.01f, 0.0f, 0.01f);
    DONE(supple_learned_lead(scene, loads, state, learned, 100 * (double)facts.seconds, NULL, &report));
    const double less[7] = {0.0, 0.0, 0.0, 0.0, report.kinetic, 0.0, 0.5 * report.kinetic};
    forge(BALANCE, less, sizeof less);
    DONE(supple_restore(state, saved, sizeof saved));
    const supple_status fell = supple_learned_step(scene, NULL, state, learned, 2, NULL, &report);
    note(fell);
    CHECK(fell == SUPPLE_FELL_BACK && report.steps == 6);
    DONE(supple_learned_describe(learned, &facts));
    CHECK(facts.fell_back == 1);
    CHECK(supple_learned_step(scene, loads, state, learned, 1, NULL, &report) == SUPPLE_FELL_BACK && report.steps == 3);

    /* Without fallback a step that is not to be believed is not taken, and the network cannot go on from what it predicted. */
    const supple_learned_config without = {SUPPLE_CONFIG(supple_learned_config), 0, 0, weights, sizeof weights};
    supple_learned *alone = NULL;
    DONE(supple_learned_init(spare, sizeof spare, scene, &without, &alone, NULL));
    DONE(supple_state_reset(state));
    DONE(supple_learned_lead(scene, loads, state, alone, 100 * (double)facts.seconds, NULL, &report));
    const double least[7] = {0.0, 0.0, 0.0, 0.0, report.kinetic, 0.0, 1e-6 * report.kinetic};
    forge(BALANCE, least, sizeof least);
    DONE(supple_restore(state, saved, sizeof saved));
    CHECK(supple_learned_step(scene, NULL, state, alone, 2, NULL, &report) == SUPPLE_E_DIVERGED_ENERGY && report.steps == 0);
    DONE(supple_restore(state, saved, sizeof saved));
    REFUSED(SUPPLE_E_NOT_LED, supple_learned_step(scene, NULL, state, alone, 1, NULL, NULL));
}

/* A state of one element does not move a scene of another. */
static supple_scene *other_element(supple_scene_config config) {
    supple_scene *other = NULL;
    config.element = SUPPLE_NODAL_PRESSURE - config.element;
    DONE(supple_scene_init(spare, sizeof spare, &config, &other, &error));
    return other;
}

static void elements(supple_scene_config config) {
    supple_scene *other = other_element(config);
    float seconds;
    REFUSED(SUPPLE_E_ELEMENT, supple_critical_step(other, state, &seconds, NULL));
    const supple_step_config length = {SUPPLE_CONFIG(supple_step_config), 1e-5f, 0.0f};
    REFUSED(SUPPLE_E_ELEMENT, supple_set_step(other, state, &length, &error));
    CHECK(error.value != error.limit && error.limit == SUPPLE_NODAL_PRESSURE - config.element);
    CHECK(supple_state_size(NODES, 3) == 0);
}

static void guards(void) {
    static const supple_guard_config good = {SUPPLE_CONFIG(supple_guard_config), 3e-4f, 20.0f, 3, 1e-9f};
    supple_guard *none = NULL, *guard = NULL;
    size_t bytes = 0;
    supple_guard_config bad = good;
    DONE(supple_state_reset(state));
    REFUSED(SUPPLE_E_NULL, supple_guard_size(scene, NULL, &bytes, &error));
    DONE(supple_guard_size(scene, points[0], &bytes, &error));
    CHECK(bytes <= sizeof spare);
    REFUSED(SUPPLE_E_SHORT, supple_guard_init(spare, bytes - 1, scene, state, points[0], &good, &none, &error));
    bad.abi++;
    REFUSED(SUPPLE_E_ABI, supple_guard_init(spare, sizeof spare, scene, state, points[0], &bad, &none, &error));
    bad = good, bad.tolerance = NAN;
    REFUSED(SUPPLE_E_NEGATIVE, supple_guard_init(spare, sizeof spare, scene, state, points[0], &bad, &none, &error));
    bad = good, bad.seconds = 0.0f;
    REFUSED(SUPPLE_E_STEP, supple_guard_init(spare, sizeof spare, scene, state, points[0], &bad, &none, &error));
    DONE(supple_guard_init(spare, sizeof spare, scene, state, points[0], &good, &guard, &error));
    REFUSED(SUPPLE_E_NULL, supple_guard_follow(scene, loads, state, NULL, NULL, NULL));
    REFUSED(SUPPLE_E_MISMATCH, supple_guard_follow(small_scene, small_loads, small_state, guard, NULL, NULL));
    const supple_step_config step = {SUPPLE_CONFIG(supple_step_config), 3e-5f, 20.0f};
    DONE(supple_set_step(scene, state, &step, NULL));
    move_end(scene, loads, 1e-4f, 0.0f, 1e-4f);
    supple_estimate estimate = {0, 0, 0.0f, 0.0f, 0.0f};
    supple_status told = SUPPLE_OK;
    for (int n = 0; n < 30; n++) {
        CHECK(supple_step(scene, loads, state, 10, NULL, NULL) >= 0);
        told = supple_guard_follow(scene, loads, state, guard, NULL, &estimate);
    }
    note(told);
    CHECK(told == SUPPLE_INEXACT && estimate.known == 1 && estimate.mean > estimate.allowed && estimate.allowed == 1e-9f);
}

/* A call of one step for a second, and settings that cannot be, of which the axis of the error tells the number. */
static void settings_and_little_work(const supple_scene_config *config) {
    supple_settings settings, wrong;
    DONE(supple_default_settings(&settings));
    size_t bytes = 0;
#define SETTING(change, quantity)                                                                                      \
    wrong = settings, (change);                                                                                        \
    REFUSED(SUPPLE_E_NEGATIVE, supple_sim_size(config, &wrong, &bytes, &error));                                       \
    CHECK(error.index == SUPPLE_NONE && error.axis == (quantity) && isnan(error.value))
    SETTING(wrong.tolerance = NAN, 0);
    SETTING(wrong.damping = NAN, 1);
    SETTING(wrong.lead_in = NAN, 2);
    settings.most_steps = 1;
    DONE(supple_sim_size(config, &settings, &bytes, &error));
    CHECK(bytes <= sizeof spare);
    supple_sim *sim = NULL;
    DONE(supple_sim_setup(spare, sizeof spare, config, &settings, &sim, &error));
    const supple_status told = supple_sim_advance(sim, 1.0, NULL, NULL);
    note(told);
    CHECK(told == SUPPLE_BEHIND);
}

static void adaptive_steps(void) {
    static const supple_large_config good = {SUPPLE_CONFIG(supple_large_config), 1.0f / 60.0f, 20.0f, {0, 0, 0}};
    supple_adaptive *none = NULL, *adaptive = NULL;
    size_t bytes = 0;
    supple_large_config bad = good;
    DONE(supple_state_reset(state));
    REFUSED(SUPPLE_E_NULL, supple_adaptive_size(scene, NULL, &good, &bytes, &error));
    DONE(supple_adaptive_size(scene, points[0], &good, &bytes, &error));
    CHECK(bytes <= sizeof spare);
    REFUSED(SUPPLE_E_SHORT, supple_adaptive_init(spare, bytes - 1, scene, state, points[0], &good, 1e-4f, &none, &error));
    CHECK(error.limit == (double)bytes);
    bad.abi++;
    REFUSED(SUPPLE_E_ABI, supple_adaptive_init(spare, sizeof spare, scene, state, points[0], &bad, 1e-4f, &none, &error));
    bad = good, bad.seconds = NAN;
    REFUSED(SUPPLE_E_STEP, supple_adaptive_init(spare, sizeof spare, scene, state, points[0], &bad, 1e-4f, &none, &error));
    REFUSED(SUPPLE_E_NEGATIVE, supple_adaptive_init(spare, sizeof spare, scene, state, points[0], &good, 0.0f, &none, &error));
    REFUSED(SUPPLE_E_NEGATIVE, supple_adaptive_init(spare, sizeof spare, scene, state, points[0], &good, NAN, &none, &error));
    DONE(supple_adaptive_init(spare, sizeof spare, scene, state, points[0], &good, 1e-4f, &adaptive, &error));
    supple_report report;
    supple_adaptive_report taken;
    REFUSED(SUPPLE_E_NULL, supple_adaptive_advance(scene, loads, state, NULL, 0.01f, NULL, NULL, NULL));
    REFUSED(SUPPLE_E_STEP, supple_adaptive_advance(scene, loads, state, adaptive, NAN, NULL, &report, &taken));
    REFUSED(SUPPLE_E_STEP, supple_adaptive_advance(scene, loads, state, adaptive, -1.0f, NULL, &report, &taken));
    REFUSED(SUPPLE_E_MISMATCH, supple_adaptive_advance(small_scene, small_loads, small_state, adaptive, 0.01f, NULL, NULL, NULL));
    uint32_t exact = 0, large = 0;
    for (int frame = 0; frame < 60; frame++) {
        move_end(scene, loads, 1e-4f * (float)(frame < 20 ? frame : 20), 0.0f, 0.0f);
        CHECK(supple_adaptive_advance(scene, loads, state, adaptive, 1.0f / 60.0f, NULL, &report, &taken) >= 0);
        CHECK(report.steps == taken.exact + taken.large && taken.next_seconds > 0.0f && taken.estimate.allowed == 1e-4f);
        exact += taken.exact, large += taken.large;
    }
    CHECK(fabs(report.time - 1.0) < 1e-6 && exact > 0 && large > 0);
    supple_vectors moved;
    DONE(supple_displacements(state, &moved));
    const float *last = (const float *)(const void *)((const char *)moved.first + moved.stride * (NODES - 1));
    CHECK(fabsf(last[0] - 2e-3f) < 1e-7f);
    printf("adaptive: %u exact steps and %u longer ones a second, error at most %.4f mm\n", (unsigned)exact, (unsigned)large,
           1e3 * (double)taken.estimate.mean);
}

/* The force of the far end, which an exact step moves. */
static void reactions(void) {
    supple_reaction *none = NULL, *reaction = NULL;
    supple_reaction_force force;
    const uint32_t held[2] = {0, NODES - 1}, beyond = NODES, inside = NODES / 2;
    const size_t bytes = supple_reaction_size(NODES);
    CHECK(bytes > 16 * NODES && bytes <= sizeof spare);
    DONE(supple_state_reset(state));
    REFUSED(SUPPLE_E_SHORT, supple_reaction_init(spare, bytes - 1, scene, held, 2, 20.0f, &none, &error));
    CHECK(error.limit == (double)bytes);
    REFUSED(SUPPLE_E_NULL, supple_reaction_init(spare, sizeof spare, scene, NULL, 2, 20.0f, &none, &error));
    REFUSED(SUPPLE_E_NOT_HELD, supple_reaction_init(spare, sizeof spare, scene, held, 0, 20.0f, &none, &error));
    REFUSED(SUPPLE_E_NOT_HELD, supple_reaction_init(spare, sizeof spare, scene, &inside, 1, 20.0f, &none, &error));
    CHECK(error.index == 0 && error.node == NODES / 2);
    REFUSED(SUPPLE_E_INDEX, supple_reaction_init(spare, sizeof spare, scene, &beyond, 1, 20.0f, &none, &error));
    REFUSED(SUPPLE_E_NEGATIVE, supple_reaction_init(spare, sizeof spare, scene, held, 2, NAN, &none, &error));
    DONE(supple_reaction_init(spare, sizeof spare, scene, held + 1, 1, 20.0f, &reaction, &error));
    REFUSED(SUPPLE_E_NULL, supple_reaction_follow(scene, state, NULL, &force));
    REFUSED(SUPPLE_E_NULL, supple_reaction_follow(scene, state, reaction, NULL));
    REFUSED(SUPPLE_E_MISMATCH, supple_reaction_follow(small_scene, small_state, reaction, &force));
    SUPPLE_MEMORY(memory, sizeof scene_memory);
    supple_scene_config fewer = bar_config();
    supple_scene *other = NULL;
    fewer.elements--;
    DONE(supple_scene_init(memory, sizeof memory, &fewer, &other, &error));
    REFUSED(SUPPLE_E_MISMATCH, supple_reaction_follow(other, state, reaction, &force));
    DONE(supple_reaction_follow(scene, state, reaction, &force));
    CHECK(force.known == 0);
    const supple_step_config step = {SUPPLE_CONFIG(supple_step_config), 3e-5f, 20.0f};
    DONE(supple_set_step(scene, state, &step, NULL));
    move_end(scene, loads, 1e-4f, 0.0f, 0.01f);
    CHECK(supple_step(scene, loads, state, 400, NULL, NULL) >= 0);
    DONE(supple_reaction_follow(scene, state, reaction, &force));
    CHECK(force.known == 1 && force.newton[0] > 0.0f && force.spread >= 0.0f);
    printf("reaction: %.2f mN, spread %.2f mN\n", 1e3 * (double)force.newton[0], 1e3 * (double)force.spread);
}

/* The points of the scene in another unit. */
static const float *in_millimetres(void) {
    static float moved[NODES][3];
    for (uint32_t n = 0; n < 3 * NODES; n++) moved[n / 3][n % 3] = 1e3f * points[n / 3][n % 3];
    return moved[0];
}

/* Scenes that look as if a unit or a number was mistaken. */
static void remarks(supple_scene_config config) {
    SUPPLE_MEMORY(memory, sizeof scene_memory);
    static float millimetres[NODES][3];
    supple_remark told[4] = {{0, 0, 0, 0}};
    uint32_t count = 9;
    supple_scene *odd = NULL;
    DONE(supple_set_motions(loads, scene, NULL, 0, NULL));
    DONE(supple_set_forces(loads, NULL, 0, NULL));
    const float earth[3] = {0.0f, 0.0f, -9.81f}, in_millimetres[3] = {0.0f, 0.0f, -9810.0f}, none[3] = {0.0f, 0.0f, 0.0f};
    DONE(supple_set_gravity(loads, earth));
    DONE(supple_remarks(scene, points[0], loads, NULL, told, 4, &count));
    CHECK(count == 0);
    REFUSED(SUPPLE_E_NULL, supple_remarks(scene, points[0], loads, NULL, NULL, 4, &count));
    REFUSED(SUPPLE_E_NULL, supple_remarks(scene, NULL, loads, NULL, told, 4, &count));
    REFUSED(SUPPLE_E_NULL, supple_remarks(scene, points[0], loads, NULL, told, 4, NULL));

    DONE(supple_set_gravity(loads, in_millimetres));
    const supple_force huge = {NODES / 2, {0.0f, 5e3f, 0.0f}, 1.0f};
    DONE(supple_set_forces(loads, &huge, 1, NULL));
    const supple_motion far[2] = {{NODES - 1, 1, {2.0f, 0, 0}, 0.0f}, {NODES - 2, 1, {0.005f, 0, 0}, 1e-4f}};
    DONE(supple_set_motions(loads, scene, far, 2, NULL));
    DONE(supple_remarks(scene, points[0], loads, NULL, told, 4, &count));
    CHECK(count == 4 && told[0].kind == SUPPLE_REMARK_GRAVITY && told[0].value == 9810.0);
    CHECK(told[1].kind == SUPPLE_REMARK_FORCES && told[1].value == 5e3 && told[1].limit < 5e3);
    CHECK(told[2].kind == SUPPLE_REMARK_WAY && told[2].index == 0 && told[2].value == 2.0);
    CHECK(told[3].kind == SUPPLE_REMARK_SPEED && told[3].index == 1 && fabs(told[3].value - 50.0) < 1e-3 && told[3].limit < 50.0);
    DONE(supple_remarks(scene, points[0], loads, NULL, NULL, 0, &count));
    CHECK(count == 4);
    DONE(supple_set_gravity(loads, none));
    DONE(supple_set_forces(loads, NULL, 0, NULL));
    DONE(supple_set_motions(loads, scene, NULL, 0, NULL));

    /* Millimetres; then g/cm^3 and constants in the wrong order; and a network of another tissue. */
    for (uint32_t n = 0; n < NODES; n++) {
        for (int axis = 0; axis < 3; axis++) {
            millimetres[n][axis] = 1000.0f * points[n][axis];
        }
    }
    supple_scene_config changed = config;
    changed.points = millimetres[0];
    DONE(supple_scene_init(memory, sizeof memory, &changed, &odd, &error));
    DONE(supple_remarks(odd, millimetres[0], NULL, NULL, told, 4, &count));
    CHECK(count == 2 && told[0].kind == SUPPLE_REMARK_SIZE && told[0].value > 10.0 && told[1].kind == SUPPLE_REMARK_MASS);
    REFUSED(SUPPLE_E_POINTS, supple_guard_init(spare, sizeof spare, scene, state, millimetres[0],
            &(supple_guard_config){SUPPLE_CONFIG(supple_guard_config), 1e-3f, 20.0f, 3, 0.0f}, &(supple_guard *){NULL}, &error));
    CHECK(error.index < TETS);

    supple_tissue other = *config.tissue;
    other.density = 1.06f, other.constants[0] = config.tissue->constants[2], other.constants[2] = config.tissue->constants[0];
    changed = config, changed.tissue = &other;
    DONE(supple_scene_init(memory, sizeof memory, &changed, &odd, &error));
    DONE(supple_remarks(odd, points[0], NULL, learned, told, 4, &count));
    CHECK(count == 3 && told[0].kind == SUPPLE_REMARK_DENSITY && told[0].index == 0);
    CHECK(told[1].kind == SUPPLE_REMARK_POISSON_RATIO && told[1].value < 0.0 && told[2].kind == SUPPLE_REMARK_OTHER_TISSUE);
    for (uint32_t kind = SUPPLE_REMARK_SIZE; kind <= SUPPLE_REMARK_FAR_TARGET; kind++) {
        CHECK(strlen(supple_remark_text(kind)) > 10);
    }
    CHECK(strcmp(supple_remark_text(0), "?") == 0);
}

/* The boundary, what may touch it, and what pulls at it. */
static void surfaces(void) {
    static uint32_t faces[4 * TETS][3];
    static supple_force pull[3 * 4 * TETS];
    uint32_t count = 0, needed = 9;
    REFUSED(SUPPLE_E_NULL, supple_boundary(NULL, TETS, faces[0], 4 * TETS, &count));
    REFUSED(SUPPLE_E_NULL, supple_boundary(tets[0], TETS, NULL, 4 * TETS, &count));
    REFUSED(SUPPLE_E_NULL, supple_boundary(tets[0], TETS, faces[0], 4 * TETS, NULL));
    REFUSED(SUPPLE_E_SHORT, supple_boundary(tets[0], TETS, faces[0], 4 * TETS - 1, &count));
    REFUSED(SUPPLE_E_OVERLAP, supple_boundary(tets[0], TETS, tets[TETS - 1], 4 * TETS, &count));
    DONE(supple_boundary(tets[0], TETS, faces[0], 4 * TETS, &count));
    CHECK(count == 4 * (X * Y + Y * Z + Z * X));

    /* Edges of the surface are the diagonals of cells of 10 mm at most, 14.1 mm; those inside are longer. */
    supple_instrument tools[2] = {{SUPPLE_PLANE, 0.0f, 0.0f, 0.0f, {{0, 0, 0}, {0, 0, 0, 0}}, NULL, 0},
                                  {SUPPLE_SPHERE, 0.0143f, 0.0f, 0.0f, {{0, 0, 0}, {0, 0, 0, 0}}, NULL, 0}};
    DONE(supple_needs_triangles(points[0], NODES, faces[0], count, tools, 2, &needed, &error));
    CHECK(needed == 0);
    tools[1].radius = 0.014f;
    DONE(supple_needs_triangles(points[0], NODES, faces[0], count, tools, 2, &needed, &error));
    CHECK(needed == 1);
    tools[1].radius = NAN;
    REFUSED(SUPPLE_E_INSTRUMENT, supple_needs_triangles(points[0], NODES, faces[0], count, tools, 2, &needed, &error));
    CHECK(error.index == 1 && isnan(error.value));
    REFUSED(SUPPLE_E_NULL, supple_needs_triangles(points[0], NODES, faces[0], count, tools, 1, NULL, &error));
    REFUSED(SUPPLE_E_NULL, supple_needs_triangles(NULL, NODES, faces[0], count, tools, 1, &needed, &error));

    /* On a closed surface a traction is pressure times its area. */
    const float pascal[3] = {0.0f, -50.0f, 0.0f}, wrong[3] = {0.0f, NAN, 0.0f};
    REFUSED(SUPPLE_E_SHORT, supple_traction(points[0], NODES, faces[0], count, pascal, 0.0f, pull, 3 * count - 1, &error));
    CHECK(error.limit == 3.0 * count);
    REFUSED(SUPPLE_E_NULL, supple_traction(points[0], NODES, faces[0], count, NULL, 0.0f, pull, 3 * count, &error));
    REFUSED(SUPPLE_E_NULL, supple_traction(points[0], NODES, faces[0], count, pascal, 0.0f, NULL, 3 * count, &error));
    REFUSED(SUPPLE_E_NEGATIVE, supple_traction(points[0], NODES, faces[0], count, pascal, -1.0f, pull, 3 * count, &error));
    REFUSED(SUPPLE_E_NOT_FINITE, supple_traction(points[0], NODES, faces[0], count, wrong, 0.0f, pull, 3 * count, &error));
    CHECK(error.index == 0);
    const uint32_t last = faces[1][2];
    faces[1][2] = NODES;
    REFUSED(SUPPLE_E_INDEX, supple_traction(points[0], NODES, faces[0], count, pascal, 0.0f, pull, 3 * count, &error));
    CHECK(error.index == 1 && error.node == NODES && error.limit == NODES);
    faces[1][2] = last;
    DONE(supple_traction(points[0], NODES, faces[0], count, pascal, 0.5f, pull, 3 * count, &error));
    double sum = 0.0;
    for (uint32_t n = 0; n < 3 * count; n++) {
        sum += (double)pull[n].newton[1];
        CHECK(pull[n].ramp == 0.5f && pull[n].node < NODES);
    }
    CHECK(fabs(sum / (-50.0 * 2e-4 * (X * Y + Y * Z + Z * X)) - 1.0) < 1e-4);
    printf("surfaces: %u triangles, a traction of %.4f N\n", (unsigned)count, sum);
}

/* Pressures that follow the boundary; to rest under one, and from displacements of the host's. */
static void pressures_and_rest(void) {
    enum { MOST = 4 * TETS };
    static _Alignas(SUPPLE_ALIGN) unsigned char memory[SUPPLE_PRESSURE_SIZE(MOST, 2)], room[SUPPLE_SETTLE_SIZE(NODES) + SUPPLE_ALIGN];
    static uint32_t faces[MOST][3], surface_of[MOST];
    static float moved[NODES][3];
    const size_t enough = sizeof room - SUPPLE_ALIGN;
    uint32_t count = 0;
    supple_pressure *none = NULL, *pressure = NULL;
    supple_settled settled;
    double volume = 0.0, before = 0.0;
    DONE(supple_boundary(tets[0], TETS, faces[0], MOST, &count));
    const size_t bytes = supple_pressure_size(count, 2);
#define PRESSED(given, size, corners, of, surfaces) \
    supple_pressure_init(given, size, scene, points[0], corners, of, count, surfaces, &none, &error)
    REFUSED(SUPPLE_E_NULL, PRESSED(NULL, bytes, faces[0], NULL, 1));
    REFUSED(SUPPLE_E_NULL, PRESSED(memory, bytes, NULL, NULL, 1));
    REFUSED(SUPPLE_E_SHORT, PRESSED(memory, bytes - 1, faces[0], surface_of, 2));
    surface_of[3] = 2;
    REFUSED(SUPPLE_E_CAPACITY, PRESSED(memory, bytes, faces[0], surface_of, 2));
    CHECK(error.index == 3 && error.value == 2.0 && error.limit == 2.0);
    surface_of[3] = 0;
    const uint32_t last = faces[1][2];
    faces[1][2] = NODES;
    REFUSED(SUPPLE_E_INDEX, PRESSED(memory, bytes, faces[0], NULL, 1));
    CHECK(error.index == 1 && error.node == NODES && error.limit == NODES);
    faces[1][2] = last;
    /* Surfaces that are mixed, in whichever way, come to the same. */
    static uint32_t mixed[4 * TETS][3], of_mixed[4 * TETS];
    uint64_t sums[2];
    for (uint32_t way = 0; way < 2; way++) {
        for (uint32_t n = 0; n < count; n++) {
            const uint32_t at = way == 0 ? n : count - 1 - n;
            memcpy(mixed[n], faces[at], sizeof mixed[n]), of_mixed[n] = at % 2;
        }
        DONE(supple_pressure_init(memory, bytes, scene, points[0], mixed[0], of_mixed, count, 2, &pressure, &error));
        sums[way] = hash(memory + SUPPLE_PRESSURE_FRONT, 52 * (size_t)count);
    }
    CHECK(sums[0] == sums[1]);
    DONE(supple_pressure_init(memory, bytes, scene, points[0], faces[0], surface_of, count, 2, &pressure, &error));
    REFUSED(SUPPLE_E_NOT_FINITE, supple_pressure_set(pressure, 0, NAN, 0.0f));
    REFUSED(SUPPLE_E_NEGATIVE, supple_pressure_set(pressure, 0, 1.0f, -1.0f));
    REFUSED(SUPPLE_E_CAPACITY, supple_pressure_set(pressure, 2, 1.0f, 0.0f));
    REFUSED(SUPPLE_E_KIND, supple_set_pressure(loads, (supple_pressure *)(void *)state));
    REFUSED(SUPPLE_E_MISMATCH, supple_set_pressure(small_loads, pressure));
    REFUSED(SUPPLE_E_NEGATIVE, supple_pressure_fill(pressure, 0, 0.0f, 1.0f));
    REFUSED(SUPPLE_E_NEGATIVE, supple_pressure_fill(pressure, 0, 1e-3f, -1.0f));
    REFUSED(SUPPLE_E_NOT_FINITE, supple_pressure_fill(pressure, 0, NAN, 1.0f));
    REFUSED(SUPPLE_E_CAPACITY, supple_pressure_fill(pressure, 2, 1e-3f, 1.0f));
    REFUSED(SUPPLE_E_MISMATCH, supple_pressure_now(pressure, small_state, 0, &volume, NULL));
    REFUSED(SUPPLE_E_CAPACITY, supple_pressure_now(pressure, state, 2, &volume, NULL));
    /* Without its first triangle a surface is open, without any it is nothing: neither has a volume, both have a pressure. */
    float now = 0.0f;
    DONE(supple_state_reset(state));
    DONE(supple_pressure_init(memory, bytes, scene, points[0], faces[1], NULL, count - 1, 1, &pressure, &error));
    REFUSED(SUPPLE_E_OPEN_SURFACE, supple_pressure_fill(pressure, 0, 1e-3f, 1.0f));
    DONE(supple_pressure_now(pressure, state, 0, &volume, &now));
    CHECK(isnan(volume) && now == 0.0f);
    DONE(supple_pressure_init(memory, bytes, scene, points[0], faces[0], surface_of, count, 2, &pressure, &error));
    REFUSED(SUPPLE_E_OPEN_SURFACE, supple_pressure_fill(pressure, 1, 1e-3f, 1.0f));
    DONE(supple_pressure_set(pressure, 1, 7.0f, 0.0f));
    DONE(supple_pressure_now(pressure, state, 1, &volume, &now));
    CHECK(isnan(volume) && now == 7.0f);
    DONE(supple_pressure_set(pressure, 1, 0.0f, 0.0f));
    /* Millimetres. */
    REFUSED(SUPPLE_E_POINTS, supple_pressure_init(spare, sizeof spare, scene, in_millimetres(), faces[0], NULL, count, 1, &none, &error));
    CHECK(error.index < TETS && none == NULL);

    DONE(supple_set_motions(loads, scene, NULL, 0, NULL));
    DONE(supple_set_forces(loads, NULL, 0, NULL));
    DONE(supple_set_gravity(loads, (const float[3]){0.0f, 0.0f, 0.0f}));
    DONE(supple_state_reset(state));
    DONE(supple_pressure_now(pressure, state, 0, &before, NULL));
    CHECK(fabs(before / (1e-6 * X * Y * Z) - 1.0) < 1e-4);
    DONE(supple_set_pressure(loads, pressure));
    DONE(supple_pressure_set(pressure, 0, 2000.0f, 0.0f));
    const float wrong[3] = {0.0f, -1e-5f, NAN};
    for (int n = 0; n < 3; n++) {
        REFUSED(SUPPLE_E_NEGATIVE, supple_settle(scene, loads, state, wrong[n], 100, NULL, room, enough, &settled));
        CHECK(settled.error.status == SUPPLE_E_NEGATIVE && settled.steps == 0 && isinf(settled.remaining));
    }
    REFUSED(SUPPLE_E_NULL, supple_settle(scene, loads, state, 1e-5f, 100, NULL, NULL, enough, NULL));
    REFUSED(SUPPLE_E_SHORT, supple_settle(scene, loads, state, 1e-5f, 100, NULL, room, enough - 1, &settled));
    CHECK(settled.error.limit == (double)enough);
    REFUSED(SUPPLE_E_MISALIGNED, supple_settle(scene, loads, state, 1e-5f, 100, NULL, room + 16, enough, NULL));
    REFUSED(SUPPLE_E_NOT_INITIALISED, supple_sim_settle((supple_sim *)(void *)room, 1e-5f, 100, NULL, room, enough, NULL));
    CHECK(supple_settle(scene, loads, state, 1e-5f, 3, NULL, room, enough, &settled) == SUPPLE_BEHIND && settled.steps == 3);
    DONE(supple_settle(scene, loads, state, 1e-5f, 5000, NULL, room, enough, &settled));
    CHECK(settled.remaining < 1e-5f && settled.error.status == SUPPLE_OK);
    DONE(supple_pressure_now(pressure, state, 0, &volume, &now));
    CHECK(now == 2000.0f);
    /* Held at both ends: less than a free body, whose bulk modulus is 120 kPa. */
    CHECK(volume < before * (1.0 - 0.004) && volume > before * (1.0 - 0.02));
    printf("pressure: %.2f %% of the volume in %u steps\n", 100.0 * volume / before, (unsigned)settled.steps);

    /* Back to the volume that it had, by a pressure from within that is not much less than the one from outside. */
    DONE(supple_pressure_fill(pressure, 0, (float)before, 200000.0f));
    DONE(supple_settle(scene, loads, state, 1e-5f, 5000, NULL, room, enough, &settled));
    double filled = 0.0;
    DONE(supple_pressure_now(pressure, state, 0, &filled, &now));
    CHECK(filled > volume && filled < before && now < 1000.0f && now > 0.0f);
    CHECK(fabs(2000.0 - 200000.0 * (1.0 - filled / before) - (double)now) < 1.0);
    DONE(supple_pressure_fill(pressure, 0, 0.0f, 0.0f));

    DONE(supple_copy_displacements(state, moved[0], 3 * NODES));
    moved[NODES / 2][1] = INFINITY;
    REFUSED(SUPPLE_E_NOT_FINITE, supple_set_displacements(scene, state, moved[0], NODES, &error));
    CHECK(error.node == NODES / 2);
    moved[NODES / 2][1] = 1e-3f;
    REFUSED(SUPPLE_E_MISMATCH, supple_set_displacements(scene, state, moved[0], NODES - 1, &error));
    REFUSED(SUPPLE_E_NULL, supple_set_displacements(scene, state, NULL, NODES, &error));
    DONE(supple_set_displacements(scene, state, moved[0], NODES, &error));
    DONE(supple_state_reset(state));

    DONE(supple_pressure_set(pressure, 0, 1e20f, 0.0f));
    supple_report told;
    const supple_status burst = supple_step(scene, loads, state, 1, NULL, &told);
    note(burst);
    CHECK(burst == SUPPLE_E_DIVERGED_PRESSURE && told.error.index == 0 && told.error.value == (double)1e20f && told.error.limit > 0.0);
    DONE(supple_set_pressure(loads, NULL));
    DONE(supple_state_reset(state));
}

/* Instruments that touch, hold and let go; and all that is refused of them. */
static void contacts(void) {
    static _Alignas(SUPPLE_ALIGN) unsigned char memory[1 << 19], acts_memory[SUPPLE_LOADS_SIZE(1, 1)];
    static const float no_number[3] = {0.0f, NAN, 0.0f}, none[3] = {0.0f, 0.0f, 0.0f};
    static uint32_t numbers[NODES], corners[6] = {0, 1, 2, 3, 2, 1};
    supple_surface all = {NULL, NULL, NODES, 0}, listed = {numbers, corners, NODES, 2};
    const size_t bytes = supple_contact_size(NODES, 2, 8);
    supple_contact *contact, *made;
    supple_loads *acts;
    DONE(supple_state_reset(state));
    DONE(supple_set_step(scene, state, &length, &error));
    DONE(supple_loads_init(acts_memory, sizeof acts_memory, scene, 1, 1, &acts));
    for (uint32_t node = 0; node < NODES; node++) {
        numbers[node] = node;
    }
    CHECK(bytes <= sizeof memory && supple_contact_size(UINT32_MAX, UINT32_MAX, UINT32_MAX) >= bytes);
    REFUSED(SUPPLE_E_NULL, supple_contact_init(NULL, bytes, scene, points[0], &all, 8, &made, &error));
    REFUSED(SUPPLE_E_NULL, supple_contact_init(memory, bytes, scene, NULL, &all, 8, &made, &error));
    REFUSED(SUPPLE_E_NULL, supple_contact_init(memory, bytes, scene, points[0], &all, 8, NULL, &error));
    REFUSED(SUPPLE_E_SHORT, supple_contact_init(memory, bytes - 64, scene, points[0], &listed, 8, &made, &error));
    all.node_count = NODES + 1;
    REFUSED(SUPPLE_E_INDEX, supple_contact_init(memory, sizeof memory, scene, points[0], &all, 8, &made, &error));
    CHECK(error.index == NODES && error.limit == NODES);
    numbers[3] = NODES;
    REFUSED(SUPPLE_E_INDEX, supple_contact_init(memory, bytes, scene, points[0], &listed, 8, &made, &error));
    CHECK(error.index == 3 && error.node == NODES);
    numbers[3] = 3;
    corners[4] = NODES;
    REFUSED(SUPPLE_E_INDEX, supple_contact_init(memory, bytes, scene, points[0], &listed, 8, &made, &error));
    CHECK(error.index == 1 && error.node == NODES && error.limit == NODES);
    corners[4] = corners[3];
    REFUSED(SUPPLE_E_INDEX, supple_contact_init(memory, bytes, scene, points[0], &listed, 8, &made, &error));
    CHECK(error.index == 1 && error.node == 3);
    corners[4] = 2;
    listed.triangles = NULL;
    REFUSED(SUPPLE_E_NULL, supple_contact_init(memory, bytes, scene, points[0], &listed, 8, &made, &error));
    listed.triangles = corners;
    REFUSED(SUPPLE_E_NULL, supple_contact_init(memory, bytes, scene, points[0], NULL, 8, &made, &error));
    REFUSED(SUPPLE_E_POINTS, supple_contact_init(memory, bytes, scene, in_millimetres(), &listed, 8, &made, &error));
    CHECK(error.index < TETS);
    DONE(supple_contact_init(memory, bytes, scene, points[0], &listed, 8, &contact, &error));

    const float middle[3] = {-0.0121f, 0.005f * Y, 0.005f * Z};
    const supple_pose start = {{middle[0], middle[1], middle[2]}, {0, 0, 0, 0}};
    const supple_instrument ball = {SUPPLE_SPHERE, 0.012f, 0.0f, 0.3f, start, NULL, 0};
    supple_instrument list[9];
    for (int n = 0; n < 9; n++) {
        list[n] = ball;
    }
    REFUSED(SUPPLE_E_CAPACITY, supple_set_instruments(contact, list, 9, &error));
    REFUSED(SUPPLE_E_NULL, supple_set_instruments(contact, NULL, 1, &error));
    list[1].radius = -1.0f;
    REFUSED(SUPPLE_E_INSTRUMENT, supple_set_instruments(contact, list, 2, &error));
    CHECK(error.index == 1 && error.value == -1.0);
    list[1].shape = 9;
    REFUSED(SUPPLE_E_CHOICE, supple_set_instruments(contact, list, 2, &error));
    list[1].shape = SUPPLE_FIELD;
    REFUSED(SUPPLE_E_FIELD, supple_set_instruments(contact, list, 2, &error));
    CHECK(error.index == 1);
    list[1].field = weights, list[1].field_bytes = sizeof weights;
    REFUSED(SUPPLE_E_FIELD, supple_set_instruments(contact, list, 2, &error));
    CHECK(error.index == 1);
    /* A quaternion may have any length, but must be one. */
    static const float lengths[] = {1e-40f, 1e-25f, 1e-10f, 1e10f, 1e38f};
    for (int n = 0; n < 5; n++) {
        list[0].pose.rotation[0] = 0.6f * lengths[n], list[0].pose.rotation[3] = 0.8f * lengths[n];
        DONE(supple_set_instruments(contact, list, 1, &error));
    }
    list[0].pose.rotation[1] = INFINITY;
    REFUSED(SUPPLE_E_INSTRUMENT, supple_set_instruments(contact, list, 1, &error));
    DONE(supple_set_instruments(contact, &ball, 1, &error));
    supple_pose in = start;
    in.position[0] += 0.002f;
    REFUSED(SUPPLE_E_CAPACITY, supple_move_instrument(contact, 1, &in, 0.0, 0.02, &error));
    REFUSED(SUPPLE_E_NULL, supple_move_instrument(contact, 0, NULL, 0.0, 0.02, &error));
    REFUSED(SUPPLE_E_INSTRUMENT, supple_move_instrument(contact, 0, &in, 0.0, NAN, &error));
    supple_pose nowhere = in;
    nowhere.position[1] = NAN;
    REFUSED(SUPPLE_E_INSTRUMENT, supple_move_instrument(contact, 0, &nowhere, 0.0, 0.02, &error));
    nowhere.position[1] = -INFINITY;
    REFUSED(SUPPLE_E_INSTRUMENT, supple_move_instrument(contact, 0, &nowhere, 0.0, 0.02, &error));
    CHECK(error.index == 0 && error.value == -INFINITY);
    REFUSED(SUPPLE_E_KIND, supple_set_contact(acts, (supple_contact *)(void *)state));
    REFUSED(SUPPLE_E_MISMATCH, supple_set_contact(small_loads, contact));
    REFUSED(SUPPLE_E_NULL, supple_set_contact(NULL, contact));
    DONE(supple_set_contact(acts, contact));

    /* It presses from the side, and the bar is pushed and pushes back; then it leaves. */
    supple_touch touch;
    supple_report report;
    supple_contact_point list_of_points[SUPPLE_MOST_CONTACT_POINTS];
    uint32_t count;
    DONE(supple_move_instrument(contact, 0, &in, 0.0, 0.02, &error));
    DONE(supple_step(scene, acts, state, 200, NULL, &report));
    DONE(supple_read_touch(contact, 0, &touch));
    CHECK(touch.contacts > 0 && touch.force[0] < 0.0f && touch.mean_force[0] < 0.0f);
    /* A guard that follows leaves what it felt. */
    const supple_guard_config watch = {SUPPLE_CONFIG(supple_guard_config), length.seconds, 20.0f, 200, 0.0f};
    supple_guard *guard;
    supple_touch after;
    DONE(supple_guard_init(spare, sizeof spare, scene, state, points[0], &watch, &guard, &error));
    CHECK(supple_guard_follow(scene, acts, state, guard, NULL, NULL) >= 0);
    DONE(supple_read_touch(contact, 0, &after));
    CHECK(memcmp(&after, &touch, sizeof touch) == 0);
    DONE(supple_contact_points(contact, list_of_points, SUPPLE_MOST_CONTACT_POINTS, &count));
    float sum = 0.0f;
    for (uint32_t n = 0; n < count; n++) {
        CHECK(list_of_points[n].instrument == 0 && list_of_points[n].node < NODES && list_of_points[n].normal[0] > 0.5f);
        sum += list_of_points[n].force[0];
    }
    CHECK(count == touch.contacts && fabsf(sum + touch.force[0]) < 1e-5f * fabsf(sum));
    REFUSED(SUPPLE_E_CAPACITY, supple_read_touch(contact, 1, &touch));
    REFUSED(SUPPLE_E_NULL, supple_read_touch(contact, 0, NULL));
    REFUSED(SUPPLE_E_NULL, supple_contact_points(contact, NULL, 4, &count));
    REFUSED(SUPPLE_E_NULL, supple_contact_points(contact, list_of_points, 4, NULL));
    supple_pose away = start;
    away.position[0] -= 0.01f;
    DONE(supple_move_instrument(contact, 0, &away, report.time, report.time + 0.01, &error));
    DONE(supple_step(scene, acts, state, 400, NULL, &report));
    DONE(supple_read_touch(contact, 0, &touch));
    CHECK(touch.contacts == 0 && touch.force[0] == 0.0f);

    /* It is thrown into the bar. */
    supple_pose inside = start;
    inside.position[0] = 0.005f * X;
    DONE(supple_move_instrument(contact, 0, &inside, report.time, report.time + 1e-4, &error));
    CHECK(supple_step(scene, acts, state, 1, NULL, &report) == SUPPLE_E_DIVERGED_INSTRUMENT);
    note(SUPPLE_E_DIVERGED_INSTRUMENT);
    CHECK(report.error.index == 0 && report.error.value > report.error.limit && report.steps == 0);

    /* It holds what is near, and lets go. */
    uint32_t held;
    DONE(supple_set_instruments(contact, &ball, 1, &error));
    REFUSED(SUPPLE_E_CAPACITY, supple_grasp(contact, state, 0, 1.0f, &held));
    REFUSED(SUPPLE_E_CAPACITY, supple_grasp(contact, state, 1, 0.001f, &held));
    REFUSED(SUPPLE_E_NOT_FINITE, supple_grasp(contact, state, 0, NAN, &held));
    REFUSED(SUPPLE_E_NEGATIVE, supple_grasp(contact, state, 0, -0.001f, &held));
    REFUSED(SUPPLE_E_MISMATCH, supple_grasp(contact, small_state, 0, 0.001f, &held));
    REFUSED(SUPPLE_E_CAPACITY, supple_let_go(contact, 1));
    DONE(supple_grasp(contact, state, 0, 0.003f, &held));
    CHECK(held > 0 && held <= 8);
    supple_pose out_there = start;
    out_there.position[0] -= 0.002f;
    double now;
    uint64_t steps;
    DONE(supple_state_time(state, &now, &steps));
    DONE(supple_move_instrument(contact, 0, &out_there, now, now + 0.02, &error));
    DONE(supple_step(scene, acts, state, 200, NULL, &report));
    DONE(supple_read_touch(contact, 0, &touch));
    CHECK(touch.contacts == held && touch.force[0] > 0.0f);
    DONE(supple_let_go(contact, 0));
    DONE(supple_step(scene, acts, state, 1, NULL, &report));
    DONE(supple_read_touch(contact, 0, &touch));
    /* It may still press, but not pull. */
    CHECK(touch.contacts < held || touch.force[0] <= 0.0f);

    supple_local_force model = {{0}, {0}, {{0}}, 0, 0};
    const float here[3] = {0, 0, 0}, there[3] = {0.001f, 0, 0}, weak[3] = {-0.1f, 0, 0}, strong[3] = {-0.2f, 0, 0};
    float between[3];
    REFUSED(SUPPLE_E_NULL, supple_local_force_follow(NULL, here, weak));
    REFUSED(SUPPLE_E_NOT_FINITE, supple_local_force_follow(&model, no_number, weak));
    DONE(supple_local_force_follow(&model, here, weak));
    DONE(supple_local_force_follow(&model, there, strong));
    const float further[3] = {0.0015f, 0, 0};
    DONE(supple_local_force_at(&model, further, between));
    CHECK(fabsf(between[0] + 0.25f) < 1e-5f);
    REFUSED(SUPPLE_E_NULL, supple_local_force_at(&model, none, NULL));

    /* Learned steps cannot meet an instrument. */
    supple_learned_facts facts;
    DONE(supple_state_reset(state));
    DONE(supple_learned_reset(learned));
    DONE(supple_learned_describe(learned, &facts));
    const supple_step_config exact = {SUPPLE_CONFIG(supple_step_config), facts.seconds / 3.0f, facts.damping};
    DONE(supple_set_step(scene, state, &exact, NULL));
    DONE(supple_learned_lead(scene, NULL, state, learned, 5 * (double)facts.seconds, NULL, NULL));
    CHECK(supple_learned_step(scene, acts, state, learned, 1, NULL, &report) == SUPPLE_E_NO_CONTACT);
    note(SUPPLE_E_NO_CONTACT);
    DONE(supple_set_contact(acts, NULL));
    DONE(supple_state_reset(state));
}

static void pulls(void) {
    static _Alignas(64) unsigned char memory[32768], acting[4096];
    enum { MOST = 2, ROOM = 40 };
    const size_t bytes = supple_pulls_size(MOST, ROOM);
    supple_pulls *made;
    supple_loads *acts;
    CHECK(bytes > 0 && bytes <= sizeof memory);
    DONE(supple_loads_init(acting, sizeof acting, scene, 1, 1, &acts));
    REFUSED(SUPPLE_E_NULL, supple_pulls_init(NULL, bytes, scene, MOST, ROOM, &made));
    REFUSED(SUPPLE_E_SHORT, supple_pulls_init(memory, bytes - 1, scene, MOST, ROOM, &made));
    DONE(supple_pulls_init(memory, bytes, scene, MOST, ROOM, &made));

    /* The middle of the held far end with nodes below it, or a corner. */
    supple_pull pull = {{0.005f * X, 0.005f * Y, 0.01f * Z}, 0.013f, 200.0f, INFINITY, {0, 0, 0}};
    supple_pull wrong = pull;
    wrong.radius = 1e-6f, wrong.at[2] += 0.5f;
    REFUSED(SUPPLE_E_NO_NODES, supple_add_pull(made, scene, points[0], &wrong, &error));
    CHECK(error.index == 0 && error.limit > 0.4);
    wrong = pull, wrong.radius = -1.0f;
    REFUSED(SUPPLE_E_PULL, supple_add_pull(made, scene, points[0], &wrong, &error));
    wrong = pull, wrong.stiffness = 2e6f;
    REFUSED(SUPPLE_E_PULL, supple_add_pull(made, scene, points[0], &wrong, &error));
    CHECK(error.value == 2e6);
    wrong = pull, wrong.at[0] = NAN;
    REFUSED(SUPPLE_E_PULL, supple_add_pull(made, scene, points[0], &wrong, &error));
    wrong = pull, wrong.radius = 10.0f;
    REFUSED(SUPPLE_E_CAPACITY, supple_add_pull(made, scene, points[0], &wrong, &error));
    CHECK(error.value == NODES && error.limit == ROOM);
    REFUSED(SUPPLE_E_MISMATCH, supple_add_pull(made, small_scene, points[0], &pull, &error));
    REFUSED(SUPPLE_E_NULL, supple_add_pull(made, scene, NULL, &pull, &error));
    const uint32_t corners[2] = {NODES - 1, NODES};
    const float halves[2] = {0.5f, 0.5f};
    REFUSED(SUPPLE_E_INDEX, supple_add_pull_of_nodes(made, scene, corners, halves, 2, &pull, &error));
    CHECK(error.node == NODES);
    REFUSED(SUPPLE_E_POINTS, supple_add_pull(made, scene, in_millimetres(), &pull, &error));
    CHECK(error.index < TETS);
    DONE(supple_add_pull(made, scene, points[0], &pull, &error));
    /* Weights sum up to one. */
    const uint32_t last[2] = {NODES - 1, NODES - 2};
    static const float sums[5][2] = {{0.25f, 0.25f}, {-1.0f, -1.0f}, {0.0f, 0.0f}, {1.0f, 1.0f}, {0.502f, 0.5f}}, whole = 1.0f;
    for (int n = 0; n < 5; n++) {
        REFUSED(SUPPLE_E_PULL, supple_add_pull_of_nodes(made, scene, last, sums[n], 2, &pull, &error));
        CHECK(error.index == 1 && error.value == (double)(sums[n][0] + sums[n][1]) && error.limit == 1.0);
    }
    DONE(supple_add_pull_of_nodes(made, scene, corners, &whole, 1, &pull, &error));
    REFUSED(SUPPLE_E_CAPACITY, supple_add_pull_of_nodes(made, scene, corners, &whole, 1, &pull, &error));
    wrong = pull, wrong.most = -1.0f;
    REFUSED(SUPPLE_E_PULL, supple_set_pull(made, 1, &wrong, &error));
    REFUSED(SUPPLE_E_CAPACITY, supple_set_pull(made, 2, &pull, &error));
    DONE(supple_set_pull(made, 1, &pull, &error));

    /* One target, 2 mm aside; the other pull is absent. */
    float targets[2][3] = {{pull.at[0] + 0.002f, pull.at[1], pull.at[2]}, {NAN, 0, 0}};
    REFUSED(SUPPLE_E_MISMATCH, supple_set_targets(made, targets[0], 1, 0.0, 0.01, &error));
    REFUSED(SUPPLE_E_PULL, supple_set_targets(made, (const float[6]){0, INFINITY, 0, NAN, 0, 0}, 2, 0.0, 0.01, &error));
    CHECK(error.index == 0);
    REFUSED(SUPPLE_E_PULL, supple_set_targets(made, (const float[6]){0, 3e6f, 0, NAN, 0, 0}, 2, 0.0, 0.01, &error));
    static const double no_times[3][2] = {{NAN, 1.0}, {0.0, NAN}, {0.0, INFINITY}};
    for (int n = 0; n < 3; n++) {
        REFUSED(SUPPLE_E_NEGATIVE, supple_set_targets(made, targets[0], 2, no_times[n][0], no_times[n][1], &error));
        CHECK(error.index == SUPPLE_NONE && error.axis == 2 && !isfinite(error.value));
    }
    DONE(supple_set_targets(made, targets[0], 2, 0.0, 0.01, &error));
    REFUSED(SUPPLE_E_MISMATCH, supple_set_targets_from(made, 1, targets[0], 2, 0.0, 0.01, &error));
    REFUSED(SUPPLE_E_MISMATCH, supple_set_targets_from(made, UINT32_MAX, targets[0], 1, 0.0, 0.01, &error));
    REFUSED(SUPPLE_E_PULL, supple_set_targets_from(made, 1, (const float[3]){0, INFINITY, 0}, 1, 0.0, 0.01, &error));
    CHECK(error.index == 1);
    DONE(supple_set_targets_from(made, 1, targets[1], 1, 0.0, 0.01, &error));
    REFUSED(SUPPLE_E_MISMATCH, supple_set_pulls(small_loads, made));
    REFUSED(SUPPLE_E_KIND, supple_set_pulls(acts, (supple_pulls *)(void *)state));
    DONE(supple_set_pulls(acts, made));
    /* The corner is held. */
    supple_remark told[2];
    uint32_t count = 0;
    DONE(supple_remarks(scene, points[0], acts, NULL, told, 2, &count));
    CHECK(count == 1 && told[0].kind == SUPPLE_REMARK_HELD_PULL && told[0].index == 1);
    supple_report report;
    supple_pulled read[2];
    DONE(supple_state_reset(state));
    DONE(supple_step(scene, acts, state, 2000, NULL, &report));
    REFUSED(SUPPLE_E_MISMATCH, supple_read_pulls(made, state, read, 1));
    REFUSED(SUPPLE_E_NULL, supple_read_pulls(made, state, NULL, 2));
    REFUSED(SUPPLE_E_MISMATCH, supple_read_pulls(made, small_state, read, 2));
    DONE(supple_read_pulls(made, state, read, 2));
    CHECK(read[0].gap[0] < 0.002f && read[0].point[0] > pull.at[0] && read[0].force[0] > 0.0f);
    /* The force is that within the step, the gap that at its end. */
    CHECK(fabsf(read[0].force[0] - pull.stiffness * read[0].gap[0]) < 1e-2f * read[0].force[0]);
    CHECK(read[1].force[0] == 0.0f && read[1].gap[0] == 0.0f);

    /* A step that is refused leaves no force. */
    const float strong = 1e9f;
    DONE(supple_set_forces(acts, &(const supple_force){NODES / 2, {strong, 0, 0}, 0}, 1, &error));
    CHECK(supple_step(scene, acts, state, 1, NULL, &report) == SUPPLE_E_DIVERGED_FORCE);
    DONE(supple_set_forces(acts, NULL, 0, &error));
    DONE(supple_read_pulls(made, state, read, 2));
    CHECK(read[0].force[0] == 0.0f && read[0].gap[0] > 0.0f);

    /* The body has hardly turned. */
    float turned = -1.0f;
    REFUSED(SUPPLE_E_NULL, supple_turn_pulls(made, scene, NULL, state, &turned));
    REFUSED(SUPPLE_E_MISMATCH, supple_turn_pulls(made, scene, points[0], small_state, &turned));
    REFUSED(SUPPLE_E_POINTS, supple_turn_pulls(made, scene, in_millimetres(), state, &turned));
    REFUSED(SUPPLE_E_NULL, supple_turn_pulls(NULL, scene, points[0], state, &turned));
    REFUSED(SUPPLE_E_NULL, supple_turn_pulls(made, NULL, points[0], state, &turned));
    DONE(supple_turn_pulls(made, scene, points[0], state, NULL));
    DONE(supple_turn_pulls(made, scene, points[0], state, &turned));
    CHECK(turned >= 0.0f && turned < 1e-3f);

    /* Learned steps do not know pulls. */
    supple_learned_facts facts;
    DONE(supple_state_reset(state));
    DONE(supple_learned_reset(learned));
    DONE(supple_learned_describe(learned, &facts));
    const supple_step_config exact = {SUPPLE_CONFIG(supple_step_config), facts.seconds / 3.0f, facts.damping};
    DONE(supple_set_step(scene, state, &exact, NULL));
    DONE(supple_learned_lead(scene, NULL, state, learned, 5 * (double)facts.seconds, NULL, NULL));
    CHECK(supple_learned_step(scene, acts, state, learned, 1, NULL, &report) == SUPPLE_E_NO_PULLS);
    note(SUPPLE_E_NO_PULLS);
    DONE(supple_set_pulls(acts, NULL));

    /* Nodes as far away as numbers go. */
    static float far[NODES][3];
    const float apart[2] = {2.0f, -1.0f};
    far[NODES - 1][1] = 3e38f;
    DONE(supple_pulls_init(memory, bytes, scene, MOST, ROOM, &made));
    DONE(supple_add_pull_of_nodes(made, scene, last, apart, 2, &pull, &error));
    DONE(supple_set_displacements(scene, state, far[0], NODES, &error));
    REFUSED(SUPPLE_E_NOT_FINITE, supple_read_pulls(made, state, read, 1));
    DONE(supple_state_reset(state));
}

/* Learned steps do not know tissue that relaxes: without fallback they are refused, and with it exact ones take their place. */
static void relaxing_tissue(supple_scene_config config) {
    const supple_prony series = {{0.5f, 0.0f, 0.0f}, {0.1f, 0.0f, 0.0f}};
    config.prony = &series;
    const size_t of_scene = SUPPLE_SCENE_SIZE(NODES, TETS, 1) + SUPPLE_PRONY_SIZE(1), of_learned = SUPPLE_LEARNED_SIZE(NODES, 1);
    const size_t of_state = SUPPLE_STATE_SIZE(NODES, ELEMENT) + SUPPLE_RELAXATION_SIZE(NODES, TETS, 1, ELEMENT, 1);
    CHECK(of_scene + of_state + of_learned <= sizeof spare);
    supple_scene *relaxing;
    supple_state *remembering;
    supple_learned *network;
    supple_learned_facts facts;
    supple_report report;
    DONE(supple_scene_init(spare, of_scene, &config, &relaxing, NULL));
    REFUSED(SUPPLE_E_SHORT, supple_state_init(spare + of_scene, of_state - 1, relaxing, &remembering));
    DONE(supple_state_init(spare + of_scene, of_state, relaxing, &remembering));
    REFUSED(SUPPLE_E_NO_RELAXATION, supple_state_stop(relaxing, state));
    REFUSED(SUPPLE_E_NO_RELAXATION, supple_state_stop(scene, remembering));
    REFUSED(SUPPLE_E_NO_RELAXATION, supple_state_carry_on(relaxing, state));
    REFUSED(SUPPLE_E_NO_RELAXATION, supple_set_step(relaxing, state, &length, &error));
    CHECK(error.value == 0.0 && error.limit > 0.0);
    for (uint32_t fallback = 0; fallback < 2; fallback++) {
        const supple_learned_config given = {SUPPLE_CONFIG(supple_learned_config), fallback, 0, weights, sizeof weights};
        DONE(supple_learned_init(spare + of_scene + of_state, of_learned, relaxing, &given, &network, NULL));
        DONE(supple_learned_describe(network, &facts));
        const supple_step_config exact = {SUPPLE_CONFIG(supple_step_config), facts.seconds / 10.0f, facts.damping};
        DONE(supple_set_step(relaxing, remembering, &exact, NULL));
        DONE(supple_state_reset(remembering));
        DONE(supple_learned_lead(relaxing, NULL, remembering, network, 5 * (double)facts.seconds, NULL, NULL));
        const supple_status told = supple_learned_step(relaxing, NULL, remembering, network, 1, NULL, &report);
        note(told);
        CHECK(told == (fallback ? SUPPLE_FELL_BACK : SUPPLE_E_NO_RELAXATION));
    }
    REFUSED(SUPPLE_E_NULL, supple_state_saved_size(NULL, &(size_t){0}));
    REFUSED(SUPPLE_E_NULL, supple_state_saved_size(remembering, NULL));
}

/* Nor do they know fibres. */
static void fibrous_tissue(supple_scene_config config) {
    const supple_fibres fibres = {{1e3f, 10.0f}, {0.0f, 0.0f}, {0.0f, 0.0f}};
    static float directions[TETS][6];
    for (int e = 0; e < TETS; e++) directions[e][2] = 1.0f;
    config.fibres = &fibres, config.directions = directions[0];
    const size_t of_scene = SUPPLE_SCENE_SIZE(NODES, TETS, 1) + SUPPLE_FIBRES_SIZE(NODES, TETS, 1, ELEMENT);
    const size_t of_learned = SUPPLE_LEARNED_SIZE(NODES, 1), of_state = SUPPLE_STATE_SIZE(NODES, ELEMENT);
    CHECK(of_scene + of_state + of_learned <= sizeof spare);
    supple_scene *fibrous;
    supple_state *its_state;
    supple_learned *network;
    supple_learned_facts facts;
    DONE(supple_scene_init(spare, of_scene, &config, &fibrous, NULL));
    DONE(supple_state_init(spare + of_scene, of_state, fibrous, &its_state));
    for (uint32_t fallback = 0; fallback < 2; fallback++) {
        const supple_learned_config given = {SUPPLE_CONFIG(supple_learned_config), fallback, 0, weights, sizeof weights};
        DONE(supple_learned_init(spare + of_scene + of_state, of_learned, fibrous, &given, &network, NULL));
        DONE(supple_learned_describe(network, &facts));
        const supple_step_config exact = {SUPPLE_CONFIG(supple_step_config), facts.seconds / 10.0f, facts.damping};
        DONE(supple_set_step(fibrous, its_state, &exact, NULL));
        DONE(supple_state_reset(its_state));
        DONE(supple_learned_lead(fibrous, NULL, its_state, network, 5 * (double)facts.seconds, NULL, NULL));
        const supple_status told = supple_learned_step(fibrous, NULL, its_state, network, 1, NULL, NULL);
        note(told);
        CHECK(told == (fallback ? SUPPLE_FELL_BACK : SUPPLE_E_NO_RELAXATION));
    }
}

static void images(void) {
    static supple_followed_point located[2];
    static float places[2][3] = {{0.01f, 0.01f, 0.01f}, {0.01f, 0.01f, -0.01f}}, moved[2][3], field[3 * 27];
    const size_t room = supple_locate_size(TETS);
    size_t bytes = 0, covered = 0;
#define LOCATE(count, memory, bytes, to)                                                                               \
    supple_locate(points[0], NODES, tets[0], TETS, places[0], count, memory, bytes, to, &error)
    REFUSED(SUPPLE_E_NULL, LOCATE(2, NULL, room, located));
    REFUSED(SUPPLE_E_NULL, LOCATE(2, spare, room, NULL));
    REFUSED(SUPPLE_E_MISALIGNED, LOCATE(2, spare + 1, room, located));
    REFUSED(SUPPLE_E_SHORT, LOCATE(2, spare, room - 1, located));
    CHECK(error.value == (double)(room - 1) && error.limit == (double)room);
    REFUSED(SUPPLE_E_OVERLAP, LOCATE(2, spare, room, (supple_followed_point *)(void *)spare));
    REFUSED(SUPPLE_E_MESH_EMPTY, supple_locate(points[0], NODES, tets[0], 0, places[0], 2, spare, room, located, &error));
    places[1][2] = NAN;
    REFUSED(SUPPLE_E_NOT_FINITE, LOCATE(2, spare, room, located));
    CHECK(error.index == 1 && error.axis == 2 && located[0].weights[0] == 0.0f);
    places[1][2] = -0.01f;
    DONE(LOCATE(2, spare, room, located));
    DONE(LOCATE(0, spare, room, NULL));
#define FOLLOW(to, velocities) supple_follow(state, located, 2, to, velocities, &error)
    REFUSED(SUPPLE_E_NULL, FOLLOW(NULL, moved[0]));
    REFUSED(SUPPLE_E_OVERLAP, FOLLOW(moved[0], moved[0]));
    REFUSED(SUPPLE_E_OVERLAP, FOLLOW((float *)(void *)located, NULL));
    REFUSED(SUPPLE_E_NOT_INITIALISED, supple_follow((supple_state *)(void *)spare, located, 2, moved[0], NULL, &error));
    located[1].nodes[3] = NODES;
    REFUSED(SUPPLE_E_INDEX, FOLLOW(moved[0], NULL));
    CHECK(error.index == 1 && error.node == NODES && error.limit == NODES);
    located[1].nodes[3] = 0, located[1].weights[0] = INFINITY;
    REFUSED(SUPPLE_E_NOT_FINITE, FOLLOW(moved[0], NULL));
    located[1].weights[0] = 1e30f;
    REFUSED(SUPPLE_E_NOT_FINITE, FOLLOW(moved[0], NULL));
    CHECK(error.index == 1 && error.value == (double)1e30f);

    const supple_image_grid good = {{0, 0, 0}, {0.01, 0.01, 0.01}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {3, 3, 3}};
    supple_image_grid bad = good;
    supple_vectors from;
    DONE(supple_displacements(state, &from));
    supple_vectors wrong = from;
    DONE(supple_displacement_field_size(&good, 0.0f, &bytes, &error));
#define FIELD(grid, vectors, kind, bytes, floats)                                                                      \
    supple_displacement_field(points[0], NODES, tets[0], TETS, vectors, kind, grid, 0.0f, spare, bytes, field, floats, \
                              &covered, &error)
#define GRID(change)                                                                                                   \
    bad = good, (change);                                                                                              \
    REFUSED(SUPPLE_E_GRID, supple_displacement_field_size(&bad, 0.0f, &bytes, &error));                                \
    REFUSED(SUPPLE_E_GRID, FIELD(&bad, &from, SUPPLE_INVERSE_FIELD, sizeof spare, 81))
    GRID(bad.origin[1] = INFINITY);
    CHECK(error.axis == 1);
    GRID(bad.spacing[2] = 0.0);
    CHECK(error.axis == 2);
    GRID(bad.size[0] = 0);
    GRID(bad.size[0] = bad.size[1] = UINT32_MAX);
    GRID(bad.direction[0][1] = 0.5);
    REFUSED(SUPPLE_E_NEGATIVE, supple_displacement_field_size(&good, -1.0f, &bytes, &error));
    REFUSED(SUPPLE_E_NULL, supple_displacement_field_size(NULL, 0.0f, &bytes, &error));
    REFUSED(SUPPLE_E_CHOICE, FIELD(&good, &from, 2, sizeof spare, 81));
    REFUSED(SUPPLE_E_SHORT, FIELD(&good, &from, SUPPLE_FORWARD_FIELD, bytes - 1, 81));
    REFUSED(SUPPLE_E_SHORT, FIELD(&good, &from, SUPPLE_FORWARD_FIELD, bytes, 80));
    wrong = from, wrong.count--;
    REFUSED(SUPPLE_E_MISMATCH, FIELD(&good, &wrong, SUPPLE_FORWARD_FIELD, bytes, 81));
    wrong = from, wrong.first = NULL;
    REFUSED(SUPPLE_E_NULL, FIELD(&good, &wrong, SUPPLE_FORWARD_FIELD, bytes, 81));
    wrong = from, wrong.stride = 8;
    REFUSED(SUPPLE_E_SHORT, FIELD(&good, &wrong, SUPPLE_FORWARD_FIELD, bytes, 81));
    wrong = from, wrong.stride = 13;
    REFUSED(SUPPLE_E_MISALIGNED, FIELD(&good, &wrong, SUPPLE_FORWARD_FIELD, bytes, 81));
    static float nan[NODES][3];
    nan[5][1] = NAN;
    wrong = (supple_vectors){nan[0], sizeof *nan, NODES};
    REFUSED(SUPPLE_E_NOT_FINITE, FIELD(&good, &wrong, SUPPLE_INVERSE_FIELD, bytes, 81));
    CHECK(error.node == 5 && error.axis == 1 && field[0] == 0.0f);
    DONE(FIELD(&good, &from, SUPPLE_INVERSE_FIELD, bytes, 81));
    CHECK(covered > 0);
}

int main(int argc, char **argv) {
    (void)argv;
    watched = argc == 1;
    CHECK(supple_abi() == SUPPLE_ABI && strlen(supple_version()) > 4);
    const supple_scene_config config = bar_config();
    static const float corner[4][3] = {{0, 0, 0}, {0.01f, 0, 0}, {0, 0.01f, 0}, {0, 0, 0.01f}};
    static const uint32_t one[4] = {0, 1, 2, 3};
    supple_scene_config small = config;
    small.nodes = 4, small.elements = 1, small.supports = 1, small.points = corner[0], small.tetrahedra = one;
    DONE(supple_scene_init(scene_memory, sizeof scene_memory, &config, &scene, &error));
    DONE(supple_scene_init(small_scene_memory, sizeof small_scene_memory, &small, &small_scene, &error));
    DONE(supple_state_init(state_memory, sizeof state_memory, scene, &state));
    DONE(supple_state_init(small_state_memory, sizeof small_state_memory, small_scene, &small_state));
    DONE(supple_loads_init(loads_memory, sizeof loads_memory, scene, FORCES, MOTIONS, &loads));
    DONE(supple_loads_init(small_loads_memory, sizeof small_loads_memory, small_scene, 1, 1, &small_loads));
    CHECK((void *)scene == (void *)scene_memory && (void *)state == (void *)state_memory);

    REFUSED(SUPPLE_E_CHOICE, supple_set_level(99));
    REFUSED(SUPPLE_E_LEVEL, supple_set_level(supple_level() == SUPPLE_LEVEL_NEON ? SUPPLE_LEVEL_AVX2 : SUPPLE_LEVEL_NEON));
    DONE(supple_set_level(supple_level()));
    scenes();
    elements(config);
    acting();
    states();
    bytes_of_states();
    networks();
    divergence();
    guards();
    adaptive_steps();
    reactions();
    surfaces();
    images();
    pressures_and_rest();
    contacts();
    pulls();
    relaxing_tissue(config);
    fibrous_tissue(config);
    remarks(config);
    settings_and_little_work(&config);
    DONE(supple_state_reset(state));
    REFUSED(SUPPLE_E_ELEMENT, supple_step(other_element(config), NULL, state, 1, NULL, NULL));

    unsigned statuses = 0;
    const char *const none = supple_status_text(100);
    for (int status = -128; status < 128; status++) {
        if (supple_status_text(status) != none) {
            statuses++;
            if (!seen[(unsigned char)(status + 128)]) {
                fprintf(stderr, "status %d (%s) never came up\n", status, supple_status_text(status));
                return 1;
            }
        }
    }
    printf("misuse: %u calls refused%s; all %u statuses came up\n", calls, watched ? ", nothing changed" : "", statuses);
    return 0;
}
