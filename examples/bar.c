/* A soft bar, fixed at one end, bent by a force at the other; all memory is static. */
#include <stdio.h>
#include <supple.h>

enum { X = 2, Y = 2, Z = 10, NODES = (X + 1) * (Y + 1) * (Z + 1), CELLS = X * Y * Z, FIXED = (X + 1) * (Y + 1) };
static float points[NODES][3];
static uint32_t tets[6 * CELLS][4];
static supple_support fixed[FIXED];
SUPPLE_MEMORY(scene_memory, SUPPLE_SCENE_SIZE(NODES, 6 * CELLS, 1));
SUPPLE_MEMORY(state_memory, SUPPLE_STATE_SIZE(NODES));
SUPPLE_MEMORY(loads_memory, SUPPLE_LOADS_SIZE(1, 0));

static void tell(const char *what, supple_status status) { if (status != SUPPLE_OK) printf("%s: %s\n", what, supple_status_text(status)); }

int main(void) {
    for (uint32_t node = 0; node < NODES; node++) {
        const uint32_t at[3] = {node % (X + 1), node / (X + 1) % (Y + 1), node / FIXED};
        points[node][0] = 0.01f * at[0], points[node][1] = 0.01f * at[1], points[node][2] = 0.01f * at[2];
    }
    static const uint32_t along[3] = {1, X + 1, FIXED}, order[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 2}, {2, 1}, {1, 0}};
    for (uint32_t tet = 0; tet < 6 * CELLS; tet++) { /* six around the diagonal of each cell */
        const uint32_t cell = tet / 6, *axes = order[tet % 6], even = tet % 6 < 3;
        const uint32_t a = cell % X + (X + 1) * (cell / X % Y) + FIXED * (cell / X / Y);
        const uint32_t b = a + along[axes[0]], c = b + along[axes[1]], d = a + 1 + (X + 1) + FIXED;
        tets[tet][0] = a, tets[tet][1] = even ? b : c, tets[tet][2] = even ? c : b, tets[tet][3] = d;
    }
    for (uint32_t node = 0; node < FIXED; node++) fixed[node] = (supple_support){node, 7, 0};

    const supple_tissue tissue = {{500.0f, 25000.0f, 0.0f}, 1000.0f};
    const supple_scene_config body = {SUPPLE_CONFIG(supple_scene_config), SUPPLE_NEO_HOOKEAN, SUPPLE_WINDING_CHECKED, NODES, 6 * CELLS, FIXED, 1, points[0], tets[0], fixed, &tissue, NULL};
    const supple_step_config length = {SUPPLE_CONFIG(supple_step_config), 2e-4f, 20.0f};
    const supple_force push = {NODES - 5, {0.01f, 0.0f, 0.0f}, 0.1f};
    supple_scene *scene; supple_state *state; supple_loads *loads; supple_vectors moved;
    tell("scene", supple_scene_init(scene_memory, sizeof scene_memory, &body, &scene, NULL));
    tell("state", supple_state_init(state_memory, sizeof state_memory, scene, &state));
    tell("loads", supple_loads_init(loads_memory, sizeof loads_memory, scene, 1, 0, &loads));
    tell("force", supple_set_forces(loads, &push, 1, NULL));
    tell("length of a step", supple_set_step(scene, state, &length, NULL));
    tell("1000 steps", supple_step(scene, loads, state, 1000, NULL, NULL));
    tell("displacements", supple_displacements(state, &moved));
    const float *tip = (const float *)((const char *)moved.first + moved.stride * (NODES - 5));
    printf("the tip moved by %.9g %.9g %.9g m\n", tip[0], tip[1], tip[2]);
    return 0;
}
