/* Memory of a scene with nodal strain: too little is told with what is enough, in exactly what is needed it is built, a copy of what
 * it then takes moves as the original does, and as one with two tissues does that are the same. Steps of a supple_large are refused. */
#include "body.h"

enum { BYTES = SUPPLE_SCENE_SIZE(NODES, TETS, 2) + SUPPLE_PATCHES_SIZE(NODES, TETS, 2), ROW = 320, STEPS = 200 };
SUPPLE_MEMORY(scene_memory, BYTES);
SUPPLE_MEMORY(copy_memory, BYTES);
SUPPLE_MEMORY(other_memory, BYTES);
SUPPLE_MEMORY(state_memory, SUPPLE_STATE_SIZE(NODES, SUPPLE_NODAL_STRAIN));
SUPPLE_MEMORY(loads_memory, SUPPLE_LOADS_SIZE(FORCES, MOTIONS));
SUPPLE_MEMORY(large_memory, 8 << 20);

static supple_loads *loads;
static supple_error error;

static supple_state *fresh(const supple_scene *scene) {
    supple_state *state;
    CHECK(supple_state_init(state_memory, sizeof state_memory, scene, &state) == SUPPLE_OK);
    return state;
}

static uint64_t moved(const supple_scene *scene) {
    supple_state *state = fresh(scene);
    const supple_step_config step = {SUPPLE_CONFIG(supple_step_config), 1e-4f, 20.0f};
    supple_report report;
    supple_vectors vectors;
    CHECK(supple_set_step(scene, state, &step, NULL) == SUPPLE_OK);
    CHECK(supple_step(scene, loads, state, STEPS, NULL, &report) == SUPPLE_OK && report.steps == STEPS && report.kinetic > 0.0);
    CHECK(supple_displacements(state, &vectors) == SUPPLE_OK);
    return hash(vectors.first, vectors.stride * vectors.count);
}

/* Builds it in so many bytes. */
static supple_status built(const supple_scene_config *config, size_t bytes, supple_scene **scene) {
    memset(scene_memory, 0xA5, sizeof scene_memory);
    const supple_status status = supple_scene_init(scene_memory, bytes, config, scene, &error);
    for (size_t at = bytes; at < sizeof scene_memory; at++) {
        CHECK(scene_memory[at] == 0xA5);
    }
    return status;
}

int main(void) {
    supple_scene_config config = bar_config();
    config.element = SUPPLE_NODAL_STRAIN;
    const size_t without = SUPPLE_SCENE_SIZE(NODES, TETS, 1), most = without + SUPPLE_PATCHES_SIZE(NODES, TETS, 1);
    supple_scene *scene = NULL, *other = NULL;
    CHECK(built(&config, without - 1, &scene) == SUPPLE_E_SHORT && error.limit == (double)most);
    CHECK(built(&config, without, &scene) == SUPPLE_E_SHORT && error.limit == (double)most);
    /* With room to count them it tells the bytes exactly. */
    CHECK(built(&config, without + (most - without) / 2, &scene) == SUPPLE_E_SHORT);
    CHECK(error.value == (double)(without + (most - without) / 2));
    const size_t needed = (size_t)error.limit;
    CHECK(needed < most && built(&config, needed - 1, &scene) == SUPPLE_E_SHORT && error.limit == (double)needed);
    CHECK(scene == NULL && built(&config, needed, &scene) == SUPPLE_OK);
    CHECK(supple_loads_init(loads_memory, sizeof loads_memory, scene, FORCES, MOTIONS, &loads) == SUPPLE_OK);
    move_end(scene, loads, 0.005f, -0.002f, 0.005f);
    const uint64_t end = moved(scene);
    CHECK(built(&config, most, &scene) == SUPPLE_OK && moved(scene) == end);

    supple_scene_facts facts;
    CHECK(supple_scene_describe(scene, &facts) == SUPPLE_OK && facts.elements == TETS);
    CHECK(facts.bytes > without && facts.bytes < needed && (facts.bytes - without) % ROW == 0);
    memcpy(copy_memory, scene_memory, facts.bytes);
    memset(scene_memory, 0, sizeof scene_memory);
    CHECK(moved((supple_scene *)(void *)copy_memory) == end);
    printf("strain: %d elements: %zu bytes to build in are enough, %zu are needed, %zu are kept; without patches %zu\n", TETS, most,
           needed, (size_t)facts.bytes, without);

    /* Several tissues have patches of their own, and so other steps, though they are the same. */
    const supple_tissue tissues[2] = {tissue, tissue};
    static uint16_t of_element[TETS];
    config.tissues = 2, config.tissue = tissues, config.tissue_of_element = of_element;
    CHECK(supple_scene_init(other_memory, sizeof other_memory, &config, &other, &error) == SUPPLE_OK);
    CHECK(moved(other) == end);
    for (uint32_t t = 0; t < TETS; t++) {
        of_element[t] = t / 6 % 2;
    }
    CHECK(supple_scene_init(other_memory, sizeof other_memory, &config, &other, &error) == SUPPLE_OK);
    CHECK(moved(other) != end);

    const supple_large_config large_config = {SUPPLE_CONFIG(supple_large_config), 1e-3f, 10.0f, {0, 0, 0}};
    supple_large *large = NULL;
    supple_state *state = fresh(other);
    CHECK(supple_large_init(large_memory, sizeof large_memory, other, state, points[0], &large_config, &large, &error) == SUPPLE_OK);
    CHECK(supple_large_step(other, loads, state, large, 10, NULL, NULL) >= 0);
    /* One for the same mesh in other tetrahedra is for another scene. */
    config = bar_config();
    config.element = SUPPLE_NODAL_PRESSURE;
    CHECK(supple_scene_init(other_memory, sizeof other_memory, &config, &other, &error) == SUPPLE_OK);
    CHECK(supple_large_init(large_memory, sizeof large_memory, other, fresh(other), points[0], &large_config, &large, &error) ==
          SUPPLE_OK);
    scene = (supple_scene *)(void *)copy_memory;
    CHECK(supple_large_step(scene, loads, fresh(scene), large, 1, NULL, NULL) == SUPPLE_E_MISMATCH);
    return 0;
}
