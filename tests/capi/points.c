/* Points that follow and displacement fields: nodes follow themselves, places between them go with their elements, an affine motion
 * is its own field, and whatever numbers come the answers are finite, or refused. */
#include "body.h"

enum { PLACES = 500, SIDE = 24, POINTS = SIDE * SIDE * SIDE };

SUPPLE_MEMORY(scene_memory, SCENE_SIZE);
SUPPLE_MEMORY(state_memory, SUPPLE_STATE_SIZE(NODES, ELEMENT));
SUPPLE_MEMORY(loads_memory, SUPPLE_LOADS_SIZE(FORCES, MOTIONS));
SUPPLE_MEMORY(scratch, 1 << 20);
static supple_scene *scene;
static supple_state *state;
static supple_followed_point located[NODES + PLACES];
static float places[NODES + PLACES][3], now[NODES + PLACES][3], fast[NODES + PLACES][3];
static float nodes_now[NODES][3], nodes_fast[NODES][3], field[POINTS][3];

static uint64_t random_state = 49;
static uint32_t bits(void) {
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(random_state >> 32);
}
static float share(void) { return (float)(bits() >> 8) / 16777216.0f; }

/* Steps in which the end is moved. */
static void move(void) {
    const supple_scene_config config = bar_config();
    supple_loads *loads;
    CHECK(supple_scene_init(scene_memory, sizeof scene_memory, &config, &scene, NULL) == SUPPLE_OK);
    CHECK(supple_state_init(state_memory, sizeof state_memory, scene, &state) == SUPPLE_OK);
    CHECK(supple_loads_init(loads_memory, sizeof loads_memory, scene, FORCES, MOTIONS, &loads) == SUPPLE_OK);
    const supple_step_config step = {SUPPLE_CONFIG(supple_step_config), 1e-4f, 20.0f};
    CHECK(supple_set_step(scene, state, &step, NULL) == SUPPLE_OK);
    move_end(scene, loads, 0.002f, -0.001f, 0.001f);
    CHECK(supple_step(scene, loads, state, 100, NULL, NULL) == SUPPLE_OK);
}

static void follow(void) {
    memcpy(places, points, sizeof points);
    for (int n = 0; n < PLACES; n++) {
        places[NODES + n][0] = 0.01f * X * share();
        places[NODES + n][1] = 0.01f * Y * share();
        places[NODES + n][2] = 0.01f * Z * share();
    }
    CHECK(supple_locate_size(TETS) <= 36 * TETS + 400 && supple_locate_size(TETS) <= sizeof scratch);
    CHECK(supple_locate(points[0], NODES, tets[0], TETS, places[0], NODES + PLACES, scratch, sizeof scratch, located, NULL) == SUPPLE_OK);
    CHECK(supple_follow(state, located, NODES + PLACES, now[0], fast[0], NULL) == SUPPLE_OK);
    CHECK(supple_copy_positions(state, points[0], nodes_now[0], 3 * NODES) == SUPPLE_OK);
    CHECK(supple_copy_velocities(state, nodes_fast[0], 3 * NODES) == SUPPLE_OK);
    for (int n = 0; n < NODES + PLACES; n++) {
        const supple_followed_point at = located[n];
        CHECK(at.distance == 0.0f && at.element < TETS && memcmp(at.nodes, tets[at.element], sizeof at.nodes) == 0);
        for (int axis = 0; axis < 3; axis++) {
            float position = 0.0f, velocity = 0.0f;
            for (int corner = 0; corner < 4; corner++) {
                position += at.weights[corner] * nodes_now[at.nodes[corner]][axis];
                velocity += at.weights[corner] * nodes_fast[at.nodes[corner]][axis];
            }
            CHECK(fabsf(now[n][axis] - position) < 1e-7f && fabsf(fast[n][axis] - velocity) < 1e-5f);
            CHECK(n >= NODES || fabsf(now[n][axis] - nodes_now[n][axis]) < 1e-7f);
        }
    }
}

/* Whatever places and displacements come: finite answers, or a refusal. */
static void hostile(void) {
    static const float odd[] = {0.0f, -0.0f, 1e-40f, 1e-7f, 1e10f, 1e30f, 3e38f, -3e38f, INFINITY, -INFINITY, NAN};
    static float moved[NODES][3];
    const int rounds = PARTS == 1 ? 20 : 300;
    int refused = 0;
    for (int round = 0; round < rounds; round++) {
        const int wild = round % 3;
        for (int n = 0; n < NODES; n++) {
            for (int axis = 0; axis < 3; axis++) {
                moved[n][axis] = 0.02f * (share() - 0.5f);
                if (wild && bits() % 4096 == 0) moved[n][axis] = odd[bits() % (wild == 1 ? 8 : 11)];
                places[n][axis] = bits() % 64 ? share() - 0.5f : odd[bits() % (wild == 2 ? 11 : 8)];
            }
        }
        supple_status status = supple_locate(points[0], NODES, tets[0], TETS, places[0], NODES, scratch, sizeof scratch, located, NULL);
        CHECK(status == SUPPLE_OK || status == SUPPLE_E_NOT_FINITE);
        for (int n = 0; n < NODES && status == SUPPLE_OK; n++) {
            CHECK(isfinite(located[n].distance) && located[n].distance >= 0.0f);
            for (int corner = 0; corner < 4; corner++) CHECK(located[n].weights[corner] >= 0.0f && located[n].weights[corner] <= 1.0f);
        }
        refused += status != SUPPLE_OK;
        const supple_image_grid grid = {{-0.05, -0.05, -0.05}, {0.001 + 0.02 * share(), 0.02 * share() + 1e-4, 0.01},
                                        {{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}}, {1 + bits() % SIDE, 1 + bits() % SIDE, 1 + bits() % SIDE}};
        const float reach = round % 2 ? 0.1f * share() : 0.0f;
        const supple_vectors from = {moved[0], sizeof *moved, NODES};
        size_t bytes, covered;
        CHECK(supple_displacement_field_size(&grid, reach, &bytes, NULL) == SUPPLE_OK && bytes <= sizeof scratch);
        status = supple_displacement_field(points[0], NODES, tets[0], TETS, &from, bits() % 2, &grid, reach, scratch, bytes, field[0],
                                           3 * POINTS, &covered, NULL);
        CHECK(status == SUPPLE_OK || status == SUPPLE_E_NOT_FINITE);
        const size_t count = (size_t)grid.size[0] * grid.size[1] * grid.size[2];
        for (size_t n = 0; n < count && status == SUPPLE_OK; n++) {
            CHECK(isfinite(field[n][0]) && isfinite(field[n][1]) && isfinite(field[n][2]));
        }
        refused += status != SUPPLE_OK;
    }
    CHECK(refused > 0 && refused < rounds);
}

/* Stretched along z by a fifth: at a place now, the material was at five sixths. */
static void stretch(void) {
    static float moved[NODES][3];
    for (int n = 0; n < NODES; n++) moved[n][2] = 0.2f * points[n][2];
    const supple_vectors from = {moved[0], sizeof *moved, NODES};
    const supple_image_grid grid = {{0.001, 0.001, 0.001}, {0.002, 0.002, 0.002}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {4, 4, SIDE}};
    size_t covered;
    CHECK(supple_displacement_field(points[0], NODES, tets[0], TETS, &from, SUPPLE_INVERSE_FIELD, &grid, 0.0f, scratch, sizeof scratch,
                                    field[0], 3 * POINTS, &covered, NULL) == SUPPLE_OK);
    CHECK(covered == 16 * SIDE);
    for (int n = 0; n < 16 * SIDE; n++) {
        const float z = 0.001f + 0.002f * (float)(n / 16);
        CHECK(fabsf(field[n][0]) < 1e-9f && fabsf(field[n][1]) < 1e-9f && fabsf(field[n][2] + z / 6.0f) < 1e-8f);
    }
}

int main(void) {
    move();
    follow();
    stretch();
    hostile();
    printf("points: %d follow their elements, an affine motion is its own field, and nothing makes a number that is none\n", NODES + PLACES);
    return 0;
}
