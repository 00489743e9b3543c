/* The library never touches the heap: every function of the C library that could hand out memory is wrapped by the linker
 * (-Wl,--wrap=malloc and so on) and counted, while scenes are built and all kinds of steps are taken. */
#include "body.h"

SUPPLE_MEMORY(scene_memory, SCENE_SIZE);
SUPPLE_MEMORY(state_memory, SUPPLE_STATE_SIZE(NODES, ELEMENT));
SUPPLE_MEMORY(loads_memory, SUPPLE_LOADS_SIZE(FORCES, MOTIONS));
SUPPLE_MEMORY(learned_memory, SUPPLE_LEARNED_SIZE(NODES, 1));
SUPPLE_MEMORY(large_memory, 4 << 20);
SUPPLE_MEMORY(guard_memory, 4 << 20);
SUPPLE_MEMORY(adaptive_memory, 8 << 20);
SUPPLE_MEMORY(weights, 40000);
static unsigned char saved[48 * NODES + 256];

static unsigned long asked;
void *__real_malloc(size_t bytes);
void *__real_calloc(size_t count, size_t bytes);
void *__real_realloc(void *old, size_t bytes);
void *__real_aligned_alloc(size_t alignment, size_t bytes);
int __real_posix_memalign(void **memory, size_t alignment, size_t bytes);
void *__wrap_malloc(size_t bytes);
void *__wrap_calloc(size_t count, size_t bytes);
void *__wrap_realloc(void *old, size_t bytes);
void *__wrap_aligned_alloc(size_t alignment, size_t bytes);
int __wrap_posix_memalign(void **memory, size_t alignment, size_t bytes);

void *__wrap_malloc(size_t bytes) { return asked++, __real_malloc(bytes); }
void *__wrap_calloc(size_t count, size_t bytes) { return asked++, __real_calloc(count, bytes); }
void *__wrap_realloc(void *old, size_t bytes) { return asked++, __real_realloc(old, bytes); }
void *__wrap_aligned_alloc(size_t alignment, size_t bytes) { return asked++, __real_aligned_alloc(alignment, bytes); }
int __wrap_posix_memalign(void **memory, size_t alignment, size_t bytes) {
    return asked++, __real_posix_memalign(memory, alignment, bytes);
}

int main(void) {
    size_t of_weights;
    file("weights/compact-10-i8.weights", weights, sizeof weights, &of_weights);
    void *volatile counted = malloc(1);
    free(counted);
    CHECK(asked > 0);
    asked = 0;

    const supple_scene_config config = bar_config();
    const supple_learned_config network = {SUPPLE_CONFIG(supple_learned_config), 1, 0, weights, of_weights};
    const supple_large_config beyond = {SUPPLE_CONFIG(supple_large_config), 1e-3f, 20.0f, {0, 0, 0}};
    const supple_force force = {NODES / 2, {0.01f, 0.0f, 0.0f}, 0.0f};
    const float gravity[3] = {0.0f, 0.0f, -9.81f};
    supple_scene *scene;
    supple_state *state;
    supple_loads *loads;
    supple_learned *learned;
    supple_large *large;
    supple_learned_facts facts;
    CHECK(supple_scene_init(scene_memory, sizeof scene_memory, &config, &scene, NULL) == SUPPLE_OK);
    CHECK(supple_state_init(state_memory, sizeof state_memory, scene, &state) == SUPPLE_OK);
    CHECK(supple_loads_init(loads_memory, sizeof loads_memory, scene, FORCES, MOTIONS, &loads) == SUPPLE_OK);
    CHECK(supple_set_gravity(loads, gravity) == SUPPLE_OK && supple_set_forces(loads, &force, 1, NULL) == SUPPLE_OK);
    move_end(scene, loads, 0.001f, 0.0f, 0.001f);
    CHECK(supple_learned_init(learned_memory, sizeof learned_memory, scene, &network, &learned, NULL) == SUPPLE_OK);
    CHECK(supple_learned_describe(learned, &facts) == SUPPLE_OK);
    const supple_step_config step = {SUPPLE_CONFIG(supple_step_config), facts.seconds / 3.0f, facts.damping};
    CHECK(supple_set_step(scene, state, &step, NULL) == SUPPLE_OK);
    CHECK(supple_step(scene, loads, state, 50, NULL, NULL) >= 0);
    CHECK(supple_learned_lead(scene, loads, state, learned, 50 * (double)facts.seconds, NULL, NULL) >= 0);
    CHECK(supple_learned_step(scene, loads, state, learned, 20, NULL, NULL) >= 0);
    CHECK(supple_save(state, saved, sizeof saved) == SUPPLE_OK);
    CHECK(supple_restore(state, saved, sizeof saved) == SUPPLE_OK);
    CHECK(supple_state_reset(state) == SUPPLE_OK);
    CHECK(supple_large_init(large_memory, sizeof large_memory, scene, state, points[0], &beyond, &large, NULL) == SUPPLE_OK);
    const supple_guard_config guarded = {SUPPLE_CONFIG(supple_guard_config), 1e-3f, 20.0f, 4, 0.001f};
    supple_guard *guard;
    CHECK(supple_guard_init(guard_memory, sizeof guard_memory, scene, state, points[0], &guarded, &guard, NULL) == SUPPLE_OK);
    for (int frame = 0; frame < 25; frame++) {
        CHECK(supple_large_step(scene, loads, state, large, 4, NULL, NULL) >= 0);
        CHECK(supple_guard_follow(scene, loads, state, guard, NULL, NULL) >= 0);
    }
    supple_adaptive *adaptive;
    CHECK(supple_adaptive_init(adaptive_memory, sizeof adaptive_memory, scene, state, points[0], &beyond, 0.001f, &adaptive, NULL) == SUPPLE_OK);
    for (int frame = 0; frame < 25; frame++) {
        CHECK(supple_adaptive_advance(scene, loads, state, adaptive, 0.01f, NULL, NULL, NULL) >= 0);
    }
    const uint32_t end = NODES - 1;
    supple_reaction *reaction;
    supple_reaction_force felt;
    CHECK(supple_reaction_init(guard_memory, sizeof guard_memory, scene, &end, 1, 20.0f, &reaction, NULL) == SUPPLE_OK);
    CHECK(supple_reaction_follow(scene, state, reaction, &felt) == SUPPLE_OK);
    CHECK(asked == 0);
    printf("heap: a scene, exact, learned, long and adaptive steps, a guard, a reaction: never asked\n");
    return 0;
}
