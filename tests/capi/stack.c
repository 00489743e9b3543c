/* How much stack the library's calls need: each runs on a thread of its own whose stack was painted, and what is still painted
 * afterwards was not used. With the best instructions of the processor and with the portable ones. */
#define _POSIX_C_SOURCE 200809L
#include <pthread.h>

#include "body.h"

SUPPLE_MEMORY(scene_memory, SCENE_SIZE);
SUPPLE_MEMORY(state_memory, SUPPLE_STATE_SIZE(NODES, ELEMENT));
SUPPLE_MEMORY(loads_memory, SUPPLE_LOADS_SIZE(FORCES, MOTIONS));
SUPPLE_MEMORY(learned_memory, SUPPLE_LEARNED_SIZE(NODES, 0));
SUPPLE_MEMORY(large_memory, 4 << 20);
SUPPLE_MEMORY(guard_memory, 4 << 20);
SUPPLE_MEMORY(adaptive_memory, 8 << 20);
SUPPLE_MEMORY(sim_memory, 24 << 20);
SUPPLE_MEMORY(weights, 40000);

enum { PAINT = 0xA5 };
static _Alignas(4096) unsigned char stack[1 << 20];

static supple_scene_config scene_config;
static supple_learned_config network;
static supple_large_config beyond;
static supple_guard_config guarded;
static supple_step_config step;
static supple_scene *scene;
static supple_state *state;
static supple_loads *loads;
static supple_learned *learned;
static supple_large *large;
static supple_guard *guard;
static supple_adaptive *adaptive;
static supple_sim *sim;

static void nothing(void) {}
static void init_scene(void) {
    CHECK(supple_scene_init(scene_memory, sizeof scene_memory, &scene_config, &scene, NULL) == SUPPLE_OK);
}
static void init_state(void) {
    CHECK(supple_state_init(state_memory, sizeof state_memory, scene, &state) == SUPPLE_OK);
}
static void init_loads(void) {
    const float gravity[3] = {0.0f, 0.0f, -9.81f};
    CHECK(supple_loads_init(loads_memory, sizeof loads_memory, scene, FORCES, MOTIONS, &loads) == SUPPLE_OK);
    CHECK(supple_set_gravity(loads, gravity) == SUPPLE_OK);
}
static void set_step(void) { CHECK(supple_set_step(scene, state, &step, NULL) == SUPPLE_OK); }
static void exact(void) { CHECK(supple_step(scene, loads, state, 2, NULL, NULL) == SUPPLE_OK); }
static void init_learned(void) {
    CHECK(supple_learned_init(learned_memory, sizeof learned_memory, scene, &network, &learned, NULL) == SUPPLE_OK);
}
static void learn(void) {
    CHECK(supple_learned_lead(scene, loads, state, learned, 0.006, NULL, NULL) >= 0);
    CHECK(supple_learned_step(scene, loads, state, learned, 2, NULL, NULL) >= 0);
}
static void init_large(void) {
    CHECK(supple_large_init(large_memory, sizeof large_memory, scene, state, points[0], &beyond, &large, NULL) == SUPPLE_OK);
}
/* More than a cycle, in which everything is renewed once. */
static void step_large(void) { CHECK(supple_large_step(scene, loads, state, large, 200, NULL, NULL) >= 0); }

static void init_guard(void) {
    CHECK(supple_guard_init(guard_memory, sizeof guard_memory, scene, state, points[0], &guarded, &guard, NULL) == SUPPLE_OK);
}
static void follow(void) {
    for (int n = 0; n < 10; n++) {
        CHECK(supple_large_step(scene, loads, state, large, 4, NULL, NULL) >= 0);
        CHECK(supple_guard_follow(scene, loads, state, guard, NULL, NULL) >= 0);
    }
}

static void init_adaptive(void) {
    CHECK(supple_adaptive_init(adaptive_memory, sizeof adaptive_memory, scene, state, points[0], &beyond, 0.001f, &adaptive, NULL) == SUPPLE_OK);
}
static void advance(void) {
    for (int n = 0; n < 25; n++) {
        CHECK(supple_adaptive_advance(scene, loads, state, adaptive, 0.01f, NULL, NULL, NULL) >= 0);
    }
}

static void sim_setup(void) {
    supple_settings settings;
    CHECK(supple_default_settings(&settings) == SUPPLE_OK);
    settings.steps = SUPPLE_STEPS_LONG, settings.damping = 20.0f, settings.seconds = 1e-3f;
    CHECK(supple_sim_setup(sim_memory, sizeof sim_memory, &scene_config, &settings, &sim, NULL) == SUPPLE_OK);
}
static void sim_advance(void) {
    for (int n = 0; n < 25; n++) {
        CHECK(supple_sim_advance(sim, 0.01, NULL, NULL) >= 0);
    }
}

static void locate_and_follow(void) {
    static unsigned char memory[64 * TETS];
    static float places[2][3] = {{0.01f, 0.02f, 0.01f}, {1.0f, 1.0f, 1.0f}}, now[2][3];
    static supple_followed_point located[2];
    CHECK(supple_locate(points[0], NODES, tets[0], TETS, places[0], 2, memory, sizeof memory, located, NULL) == SUPPLE_OK);
    CHECK(supple_follow(state, located, 2, now[0], NULL, NULL) == SUPPLE_OK);
}
static void field(void) {
    static float scratch[200000], out[3 * 40 * 40 * 40];
    const supple_image_grid grid = {{-0.02, -0.02, -0.02}, {0.004, 0.004, 0.01}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {40, 40, 40}};
    supple_vectors from;
    CHECK(supple_displacements(state, &from) == SUPPLE_OK);
    CHECK(supple_displacement_field(points[0], NODES, tets[0], TETS, &from, SUPPLE_INVERSE_FIELD, &grid, 0.03f, scratch, sizeof scratch,
                                    out, sizeof out / sizeof *out, NULL, NULL) == SUPPLE_OK);
}

static void *run(void *call) {
    (*(void (**)(void))call)();
    return NULL;
}

static size_t used_by(void (*call)(void)) {
    memset(stack, PAINT, sizeof stack);
    pthread_attr_t attributes;
    pthread_t thread;
    CHECK(pthread_attr_init(&attributes) == 0 && pthread_attr_setstack(&attributes, stack, sizeof stack) == 0);
    CHECK(pthread_create(&thread, &attributes, run, &call) == 0 && pthread_join(thread, NULL) == 0);
    CHECK(pthread_attr_destroy(&attributes) == 0);
    size_t untouched = 0;
    while (untouched < sizeof stack && stack[untouched] == PAINT) {
        untouched++;
    }
    return sizeof stack - untouched;
}

int main(void) {
    size_t of_weights;
    file("weights/compact-10.weights", weights, sizeof weights, &of_weights);
    scene_config = bar_config();
    network = (supple_learned_config){SUPPLE_CONFIG(supple_learned_config), 0, 0, weights, of_weights};
    beyond = (supple_large_config){SUPPLE_CONFIG(supple_large_config), 1e-3f, 20.0f, {0, 0, 0}};
    guarded = (supple_guard_config){SUPPLE_CONFIG(supple_guard_config), 1e-3f, 20.0f, 4, 0.0f};
    step = (supple_step_config){SUPPLE_CONFIG(supple_step_config), 3e-5f, 20.0f};
    static const struct {
        const char *name;
        void (*call)(void);
        /* kB; on no processor more. */
        size_t most;
    } calls[] = {
        {"scene_init", init_scene, 16}, {"state_init", init_state, 2},     {"loads_init", init_loads, 2},
        {"set_step", set_step, 21},     {"step", exact, 24},               {"learned_init", init_learned, 12},
        {"learned_step", learn, 140},   {"large_init", init_large, 36},    {"large_step", step_large, 40},
        {"guard_init", init_guard, 40},    {"guard_follow", follow, 40},
        {"adaptive_init", init_adaptive, 44}, {"adaptive_advance", advance, 42},
        {"sim_setup", sim_setup, 47}, {"sim_advance", sim_advance, 42},
        {"locate", locate_and_follow, 3}, {"displacement_field", field, 10},
    };
    const size_t count = sizeof calls / sizeof *calls;
    const uint32_t levels[2] = {supple_level(), SUPPLE_LEVEL_PORTABLE};
    for (int level = 0; level < 2; level++) {
        CHECK(supple_set_level(levels[level]) == SUPPLE_OK);
        const size_t rest = used_by(nothing);
        printf("stack, bytes, %s instructions:", level == 0 ? "best" : "portable");
        for (size_t n = 0; n < count; n++) {
            const size_t used = used_by(calls[n].call) - rest;
            printf(" %s %zu%s", calls[n].name, used, n + 1 < count ? "," : "\n");
            CHECK(used < 1024 * calls[n].most);
        }
    }
    return 0;
}
