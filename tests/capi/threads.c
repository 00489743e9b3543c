/* Two bodies in two threads, which share a scene and nothing else, and a third moved in parts by both: under a race detector
 * nothing is found, and each ends where it ends alone, to the bit. */
#include "body.h"
#include <pthread.h>

SUPPLE_MEMORY(scene_memory, SCENE_SIZE);
SUPPLE_MEMORY(state_memory, 4 * SUPPLE_STATE_SIZE(NODES, ELEMENT));
SUPPLE_MEMORY(loads_memory, 4 * SUPPLE_LOADS_SIZE(0, MOTIONS));
static supple_scene *scene;

struct body {
    supple_state *state;
    supple_loads *loads;
    supple_status status;
};

static struct body body(int number) {
    struct body made = {NULL, NULL, SUPPLE_OK};
    const supple_step_config step = {SUPPLE_CONFIG(supple_step_config), 1e-4f, 20.0f};
    const size_t of_state = SUPPLE_STATE_SIZE(NODES, ELEMENT), of_loads = SUPPLE_LOADS_SIZE(0, MOTIONS);
    CHECK(supple_state_init(state_memory + (size_t)number * of_state, of_state, scene, &made.state) == SUPPLE_OK);
    CHECK(supple_loads_init(loads_memory + (size_t)number * of_loads, of_loads, scene, 0, MOTIONS, &made.loads) == SUPPLE_OK);
    CHECK(supple_set_step(scene, made.state, &step, NULL) == SUPPLE_OK);
    move_end(scene, made.loads, 0.01f, 0.0f, 0.01f);
    return made;
}

static void *swing(void *of) {
    struct body *mine = of;
    mine->status = supple_step(scene, mine->loads, mine->state, 100, NULL, NULL);
    return NULL;
}

struct share {
    supple_part part;
    const void *work;
    uint32_t first, parts;
};

static void *half(void *of) {
    const struct share *mine = of;
    for (uint32_t p = mine->first; p < mine->parts; p += 2) {
        mine->part(mine->work, p);
    }
    return NULL;
}

static void on_two_threads(void *context, supple_part part, const void *work, uint32_t parts) {
    (void)context;
    pthread_t other;
    struct share theirs = {part, work, 1, parts}, ours = {part, work, 0, parts};
    CHECK(pthread_create(&other, NULL, half, &theirs) == 0);
    half(&ours);
    CHECK(pthread_join(other, NULL) == 0);
}

static uint64_t where(const supple_state *state) {
    supple_vectors vectors;
    CHECK(supple_displacements(state, &vectors) == SUPPLE_OK);
    return hash(vectors.first, vectors.stride * vectors.count);
}

int main(void) {
    const supple_scene_config config = bar_config();
    CHECK(supple_scene_init(scene_memory, sizeof scene_memory, &config, &scene, NULL) == SUPPLE_OK);
    struct body bodies[4] = {body(0), body(1), body(2), body(3)};
    pthread_t threads[2];
    for (int number = 0; number < 2; number++) {
        CHECK(pthread_create(&threads[number], NULL, swing, &bodies[number]) == 0);
    }
    for (int number = 0; number < 2; number++) {
        CHECK(pthread_join(threads[number], NULL) == 0);
    }
    const supple_threads two = {NULL, 4, on_two_threads};
    bodies[2].status = supple_step(scene, bodies[2].loads, bodies[2].state, 100, &two, NULL);
    swing(&bodies[3]);
    for (int number = 0; number < 4; number++) {
        CHECK(bodies[number].status == SUPPLE_OK && where(bodies[number].state) == where(bodies[3].state));
    }
    printf("threads: two bodies in two threads, one in parts on both, one alone: the same bits\n");
    return 0;
}
