/* Exact steps and those of a supple_large in turn, also from a restored state: nothing is refused, and the motion is that of exact
 * steps alone. A supple_large of another scene with as many nodes is refused. */
#include "body.h"

enum { PHASES = 5, FRAMES = 10, ROOM = 4 << 20 };
SUPPLE_MEMORY(scene_memory, SCENE_SIZE);
SUPPLE_MEMORY(other_scene_memory, SCENE_SIZE);
SUPPLE_MEMORY(state_memory, SUPPLE_STATE_SIZE(NODES, ELEMENT));
SUPPLE_MEMORY(exact_memory, SUPPLE_STATE_SIZE(NODES, ELEMENT));
SUPPLE_MEMORY(loads_memory, SUPPLE_LOADS_SIZE(FORCES, MOTIONS));
SUPPLE_MEMORY(large_memory, ROOM);
static unsigned char saved[48 * NODES + 256];
static float before[NODES][3], truth[NODES][3], moved[NODES][3];

/* A frame of 10 ms in steps of both kinds. */
static const uint32_t exact_steps = 100, large_steps = 10;
static const supple_step_config exact_step = {SUPPLE_CONFIG(supple_step_config), 1e-4f, 20.0f};

static supple_scene *scene, *other_scene;
static supple_loads *loads;

static supple_state *fresh(void *memory) {
    supple_state *state;
    CHECK(supple_state_init(memory, SUPPLE_STATE_SIZE(NODES, ELEMENT), scene, &state) == SUPPLE_OK);
    CHECK(supple_set_step(scene, state, &exact_step, NULL) == SUPPLE_OK);
    return state;
}

static supple_large *prepared(supple_state *state) {
    const supple_large_config config = {SUPPLE_CONFIG(supple_large_config), 1e-3f, 20.0f, {0, 0, 0}};
    supple_large *large;
    CHECK(supple_large_init(large_memory, ROOM, scene, state, points[0], &config, &large, NULL) == SUPPLE_OK);
    return large;
}

static void copied(const supple_state *state, float to[NODES][3]) {
    CHECK(supple_copy_displacements(state, to[0], 3 * NODES) == SUPPLE_OK);
}

/* Mean distance, the sum of those along the axes, m. */
static double mean_distance(float a[NODES][3], float b[NODES][3]) {
    double sum = 0.0;
    for (int n = 0; n < NODES; n++) {
        for (int axis = 0; axis < 3; axis++) {
            sum += fabs((double)a[n][axis] - b[n][axis]);
        }
    }
    return sum / NODES;
}

/* Frames of exact steps, or of large ones. */
static void take(supple_state *state, supple_large *large, int phase) {
    for (int frame = 0; frame < FRAMES; frame++) {
        const float along = 2e-4f * (float)(FRAMES * phase + frame + 1);
        move_end(scene, loads, along, 0.0f, -along);
        supple_report report;
        if (large) {
            CHECK(supple_large_step(scene, loads, state, large, large_steps, NULL, &report) == SUPPLE_OK);
            CHECK(report.steps == large_steps);
        } else {
            CHECK(supple_step(scene, loads, state, exact_steps, NULL, &report) == SUPPLE_OK);
            CHECK(report.steps == exact_steps);
        }
    }
}

static void in_turn(void) {
    supple_state *state = fresh(state_memory), *exact = fresh(exact_memory);
    supple_large *large = prepared(state);
    printf("switching");
    for (int phase = 0; phase < PHASES; phase++) {
        copied(exact, before);
        take(exact, NULL, phase);
        take(state, phase % 2 ? large : NULL, phase);
        if (phase == 2) {
            /* The next phase begins here, but is taken once before. */
            CHECK(supple_save(state, saved, sizeof saved) == SUPPLE_OK);
            take(state, large, phase + 1);
            CHECK(supple_restore(state, saved, sizeof saved) == SUPPLE_OK);
            large = prepared(state);
        }
        copied(exact, truth);
        copied(state, moved);
        const double way = mean_distance(before, truth), off = mean_distance(truth, moved) / way;
        printf("%s %s: %.2f mm, off by %.3f of that", phase ? "," : ";", phase % 2 ? "large" : "exact", 1e3 * way, off);
        double times[2];
        CHECK(supple_state_time(state, &times[0], NULL) == SUPPLE_OK && supple_state_time(exact, &times[1], NULL) == SUPPLE_OK);
        CHECK(fabs(times[0] - times[1]) < 1e-5);
        /* A body that stood still for a phase would be off by all of it. */
        CHECK(way > 2e-3 && off < 0.1);
    }
    printf("\n");
    /* Of another scene, which fits the state: nothing is changed. */
    const uint64_t was = hash(state_memory, sizeof state_memory);
    CHECK(supple_large_step(other_scene, loads, state, large, 1, NULL, NULL) == SUPPLE_E_MISMATCH);
    CHECK(hash(state_memory, sizeof state_memory) == was);
    CHECK(supple_large_step(scene, loads, state, large, 1, NULL, NULL) == SUPPLE_OK);
}

int main(void) {
    supple_scene_config config = bar_config();
    CHECK(supple_scene_init(scene_memory, sizeof scene_memory, &config, &scene, NULL) == SUPPLE_OK);
    const supple_tissue heavier = {{59.0f, 8.023f, 60000.0f}, 1100.0f};
    config.tissue = &heavier;
    CHECK(supple_scene_init(other_scene_memory, sizeof other_scene_memory, &config, &other_scene, NULL) == SUPPLE_OK);
    const float gravity[3] = {0.0f, -3.0f, 0.0f};
    CHECK(supple_loads_init(loads_memory, sizeof loads_memory, scene, FORCES, MOTIONS, &loads) == SUPPLE_OK);
    CHECK(supple_set_gravity(loads, gravity) == SUPPLE_OK);
    in_turn();
    return 0;
}
