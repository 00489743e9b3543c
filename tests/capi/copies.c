/* A state goes on to the bit where it stops: copied by memcpy to other memory, saved to bytes and restored, cut into any number of
 * parts in any order of threads; by every step: exact, learned, long. */
#include "body.h"

enum { ROOM = 4 << 20 };
SUPPLE_MEMORY(scene_memory, SCENE_SIZE);
SUPPLE_MEMORY(loads_memory, SUPPLE_LOADS_SIZE(FORCES, MOTIONS));
SUPPLE_MEMORY(weights, 40000);
/* Twice each: the original and its copy. */
SUPPLE_MEMORY(state_memory, 2 * SUPPLE_STATE_SIZE(NODES, ELEMENT));
SUPPLE_MEMORY(learned_memory, 2 * SUPPLE_LEARNED_SIZE(NODES, 1));
SUPPLE_MEMORY(large_memory, 2 * ROOM);
SUPPLE_MEMORY(guard_memory, 2 * ROOM);
static unsigned char saved[1 + 48 * NODES + 256];

static supple_scene *scene;
static supple_loads *loads;

static supple_state *fresh(void) {
    supple_state *state;
    const supple_step_config step = {SUPPLE_CONFIG(supple_step_config), 1e-4f, 20.0f};
    CHECK(supple_state_init(state_memory, SUPPLE_STATE_SIZE(NODES, ELEMENT), scene, &state) == SUPPLE_OK);
    CHECK(supple_set_step(scene, state, &step, NULL) == SUPPLE_OK);
    return state;
}

/* Displacements and time. */
static uint64_t where(const supple_state *state) {
    supple_vectors vectors;
    double time;
    CHECK(supple_displacements(state, &vectors) == SUPPLE_OK && vectors.count == NODES);
    CHECK(supple_state_time(state, &time, NULL) == SUPPLE_OK);
    return hash(vectors.first, vectors.stride * vectors.count) ^ hash(&time, sizeof time);
}

/* Whose threads run parts: here one, which takes them in a strange order, and forgets some. */
static void backwards(void *context, supple_part part, const void *work, uint32_t parts) {
    unsigned *most = context;
    *most = parts > *most ? parts : *most;
    for (uint32_t p = parts; p-- > 1;) {
        part(work, p);
        part(work, p);
        part(work, parts + p);
    }
}

static void exact_in_parts(void) {
    uint64_t alone = 0;
    for (uint32_t parts = 0; parts <= 12; parts++) {
        unsigned most = 0;
        const supple_threads threads = {&most, parts, backwards};
        supple_state *state = fresh();
        move_end(scene, loads, 0.01f, -0.005f, 0.01f);
        CHECK(supple_step(scene, loads, state, 200, parts ? &threads : NULL, NULL) == SUPPLE_OK);
        CHECK(most == (parts < PARTS ? parts : PARTS));
        alone = parts ? alone : where(state);
        CHECK(where(state) == alone);
    }
    printf("copies: 200 steps alone and in 1 to %d parts: the same bits\n", PARTS);
}

static void exact_copied(void) {
    supple_state *state = fresh();
    supple_report report;
    /* With nodal strain elements at the moved end would be turned inside out. */
    const float share = ELEMENT == SUPPLE_NODAL_STRAIN ? 0.3f : 1.0f;
    move_end(scene, loads, share * 0.01f, share * -0.005f, share * 0.01f);
    CHECK(supple_step(scene, loads, state, 100, NULL, NULL) == SUPPLE_OK);
    /* Copied by memcpy. */
    unsigned char *other = state_memory + SUPPLE_STATE_SIZE(NODES, ELEMENT);
    memcpy(other, state_memory, SUPPLE_STATE_SIZE(NODES, ELEMENT));
    supple_state *copy = (supple_state *)(void *)other;
    /* Saved to an odd address. */
    CHECK(supple_saved_size(NODES) <= sizeof saved - 1);
    CHECK(supple_save(state, saved + 1, sizeof saved - 1) == SUPPLE_OK);
    CHECK(supple_step(scene, loads, state, 300, NULL, &report) == SUPPLE_OK && report.steps == 300);
    CHECK(report.least_volume_ratio > 0.2f && report.least_volume_ratio < 1.0f && report.saturation > 0.0f);
    const uint64_t end = where(state);
    CHECK(supple_step(scene, loads, copy, 300, NULL, NULL) == SUPPLE_OK);
    CHECK(where(copy) == end);
    CHECK(supple_state_reset(copy) == SUPPLE_OK && where(copy) != end);
    CHECK(supple_restore(copy, saved + 1, sizeof saved - 1) == SUPPLE_OK);
    CHECK(supple_step(scene, loads, copy, 300, NULL, NULL) == SUPPLE_OK);
    CHECK(where(copy) == end);
    /* Moved nodes are where they were sent, and what is copied out is what is there. */
    static float out[3 * NODES], positions[3 * NODES];
    CHECK(supple_copy_displacements(state, out, 3 * NODES) == SUPPLE_OK);
    CHECK(supple_copy_positions(state, points[0], positions, 3 * NODES) == SUPPLE_OK);
    CHECK(out[3 * (NODES - 1)] == share * 0.01f && out[3 * (NODES - 1) + 1] == share * -0.005f);
    for (int at = 0; at < 3 * NODES; at++) {
        CHECK(positions[at] == points[at / 3][at % 3] + out[at]);
    }
    printf("copies: memcpy and save at step 100: the same bits at step 400\n");
}

static void learned_copied(void) {
    size_t bytes;
    const void *file_of_weights = file("weights/compact-10-i8.weights", weights, sizeof weights, &bytes);
    const supple_learned_config config = {SUPPLE_CONFIG(supple_learned_config), 1, 0, file_of_weights, bytes};
    supple_state *state = fresh();
    supple_learned *learned;
    supple_learned_facts facts;
    CHECK(supple_learned_init(learned_memory, SUPPLE_LEARNED_SIZE(NODES, 1), scene, &config, &learned, NULL) == SUPPLE_OK);
    CHECK(supple_learned_describe(learned, &facts) == SUPPLE_OK && facts.multiply_adds > 0);
    const supple_step_config step = {SUPPLE_CONFIG(supple_step_config), facts.seconds / 3.0f, facts.damping};
    CHECK(supple_set_step(scene, state, &step, NULL) == SUPPLE_OK);
    move_end(scene, loads, 0.01f, -0.005f, 0.01f);
    supple_report report;
    CHECK(supple_learned_lead(scene, loads, state, learned, 300 * (double)facts.seconds, NULL, &report) >= 0 && report.steps == 900);
    CHECK(supple_learned_step(scene, loads, state, learned, 10, NULL, &report) >= 0);
    CHECK(report.outside > 0.0f || report.clipped >= 0.0f);
    memcpy(state_memory + SUPPLE_STATE_SIZE(NODES, ELEMENT), state_memory, SUPPLE_STATE_SIZE(NODES, ELEMENT));
    memcpy(learned_memory + SUPPLE_LEARNED_SIZE(NODES, 1), learned_memory, SUPPLE_LEARNED_SIZE(NODES, 1));
    supple_state *state_copy = (supple_state *)(void *)(state_memory + SUPPLE_STATE_SIZE(NODES, ELEMENT));
    supple_learned *copy = (supple_learned *)(void *)(learned_memory + SUPPLE_LEARNED_SIZE(NODES, 1));
    const supple_status first = supple_learned_step(scene, loads, state, learned, 300, NULL, &report);
    CHECK(first >= 0);
    CHECK(supple_learned_step(scene, loads, state_copy, copy, 300, NULL, NULL) == first);
    CHECK(where(state) == where(state_copy));
    printf("copies: learned steps: the same bits after 300 more (%s; outside %.1f %% at most)\n",
           supple_status_text(first), 100.0 * report.outside);
}

static void large_copied(void) {
    size_t needed = 0;
    const supple_large_config config = {SUPPLE_CONFIG(supple_large_config), 2e-3f, 20.0f, {0, 0, 0}};
    supple_state *state = fresh();
    supple_large *large;
    supple_report report;
    move_end(scene, loads, 0.01f, -0.005f, 0.01f);
    CHECK(supple_large_size(scene, points[0], &config, &needed, NULL) == SUPPLE_OK && needed <= ROOM);
    CHECK(supple_large_init(large_memory, ROOM, scene, state, points[0], &config, &large, NULL) == SUPPLE_OK);
    /* A second run that takes one step in five. */
    const supple_guard_config guarded = {SUPPLE_CONFIG(supple_guard_config), config.seconds, config.damping, 5, 0.0f};
    supple_guard *guard;
    supple_estimate estimate, of_copy;
    size_t for_guard = 0;
    CHECK(supple_guard_size(scene, points[0], &for_guard, NULL) == SUPPLE_OK && for_guard <= ROOM);
    CHECK(supple_guard_init(guard_memory, ROOM, scene, state, points[0], &guarded, &guard, NULL) == SUPPLE_OK);
    supple_status told = SUPPLE_OK;
    for (int frame = 0; frame < 10; frame++) {
        CHECK(supple_large_step(scene, loads, state, large, 5, NULL, NULL) >= 0);
        told = supple_guard_follow(scene, loads, state, guard, NULL, &estimate);
        CHECK(told >= 0 && estimate.known == 1 && estimate.largest >= estimate.mean && estimate.node < NODES);
    }
    memcpy(guard_memory + ROOM, guard_memory, for_guard);
    memcpy(state_memory + SUPPLE_STATE_SIZE(NODES, ELEMENT), state_memory, SUPPLE_STATE_SIZE(NODES, ELEMENT));
    memcpy(large_memory + ROOM, large_memory, needed);
    supple_state *state_copy = (supple_state *)(void *)(state_memory + SUPPLE_STATE_SIZE(NODES, ELEMENT));
    CHECK(supple_large_step(scene, loads, state, large, 200, NULL, &report) >= 0 && report.steps == 200);
    CHECK(supple_large_step(scene, loads, state_copy, (supple_large *)(void *)(large_memory + ROOM), 200, NULL, NULL) >= 0);
    CHECK(where(state) == where(state_copy));
    CHECK(report.added_mass > 0.0f);
    /* Two hundred steps that a guard has not seen are a new state for it. */
    CHECK(supple_guard_follow(scene, loads, state, guard, NULL, &of_copy) == SUPPLE_OK && of_copy.known == 0);
    printf("copies: long: the same bits after 200 more; %zu bytes, %.1f masses added; error at most %.3f mm (%s), guard of %zu bytes\n",
           needed, (double)report.added_mass, 1e3 * (double)estimate.mean, supple_status_text(told), for_guard);
}

/* Back to a copy, or to what was saved, and on in steps that are shorter than those that the guard has seen. */
static void guard_restored(void) {
    const supple_large_config config = {SUPPLE_CONFIG(supple_large_config), 2e-3f, 20.0f, {0, 0, 0}};
    const supple_guard_config guarded = {SUPPLE_CONFIG(supple_guard_config), config.seconds, config.damping, 5, 0.0f};
    for (int copied = 0; copied < 2; copied++) {
        supple_state *state = fresh();
        supple_large *large;
        supple_guard *guard;
        supple_estimate estimate;
        move_end(scene, loads, 3e-4f, -1e-4f, 3e-4f);
        CHECK(supple_large_init(large_memory, ROOM, scene, state, points[0], &config, &large, NULL) == SUPPLE_OK);
        CHECK(supple_guard_init(guard_memory, ROOM, scene, state, points[0], &guarded, &guard, NULL) == SUPPLE_OK);
        unsigned char *copy = state_memory + SUPPLE_STATE_SIZE(NODES, ELEMENT);
        memcpy(copy, state_memory, SUPPLE_STATE_SIZE(NODES, ELEMENT));
        CHECK(supple_save(state, saved, sizeof saved) == SUPPLE_OK);
        for (int frame = 0; frame < 3; frame++) {
            CHECK(supple_large_step(scene, loads, state, large, 1, NULL, NULL) >= 0);
            CHECK(supple_guard_follow(scene, loads, state, guard, NULL, &estimate) >= 0 && estimate.known == 1);
        }
        if (copied) {
            memcpy(state_memory, copy, SUPPLE_STATE_SIZE(NODES, ELEMENT));
        } else {
            CHECK(supple_restore(state, saved, sizeof saved) == SUPPLE_OK);
        }
        for (int frame = 0; frame < 20; frame++) {
            CHECK(supple_step(scene, loads, state, 6, NULL, NULL) >= 0);
            CHECK(supple_guard_follow(scene, loads, state, guard, NULL, &estimate) >= 0);
            CHECK(estimate.known == (frame > 0) && (!estimate.known || estimate.mean >= 0.0f));
        }
    }
    printf("copies: a guard begins anew after a copy and a restore, whatever steps follow\n");
}

int main(void) {
    const supple_scene_config config = bar_config();
    CHECK(supple_scene_init(scene_memory, sizeof scene_memory, &config, &scene, NULL) == SUPPLE_OK);
    CHECK(supple_loads_init(loads_memory, sizeof loads_memory, scene, FORCES, MOTIONS, &loads) == SUPPLE_OK);
    exact_in_parts();
    exact_copied();
    learned_copied();
    large_copied();
    guard_restored();
    return 0;
}
