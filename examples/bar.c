/* A soft bar, fixed at one end, bent by a force at the other. All memory is static. */
#include <stdio.h>
#include <supple.h>
enum { X = 2, Y = 2, Z = 10, LAYER = (X + 1) * (Y + 1), NODES = LAYER * (Z + 1), CELLS = X * Y * Z, TIP = NODES - 5 };
static float points[NODES][3]; static uint32_t tets[6 * CELLS][4]; static supple_support held[LAYER];
SUPPLE_MEMORY(memory, 64 << 10); /* supple_sim_size tells how much is enough */
#define TRY(call) if ((status = (call)) < 0) return printf("%s: %s\n", #call, supple_status_text(status)), 1
int main(void) {
    for (uint32_t n = 0; n < NODES; n++) { /* a grid, x fastest, m */
        points[n][0] = 0.02f * (float)(n % (X + 1)) / X;
        points[n][1] = 0.02f * (float)(n / (X + 1) % (Y + 1)) / Y;
        points[n][2] = (float)((double)0.1f * (n / LAYER) / Z);
    }
    const uint32_t step[3] = {1, X + 1, LAYER}, walk[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 2}, {2, 1}, {1, 0}};
    for (uint32_t t = 0; t < 6 * CELLS; t++) { /* six along the edges of each cell, half of them wound the other way */
        const uint32_t cell = t / 6, a = cell % X + (X + 1) * (cell / X % Y) + LAYER * (cell / X / Y);
        const uint32_t b = a + step[walk[t % 6][0]], c = b + step[walk[t % 6][1]], even = t % 6 < 3;
        tets[t][0] = a, tets[t][1] = even ? b : c, tets[t][2] = even ? c : b, tets[t][3] = a + 1 + (X + 1) + LAYER;
    }
    for (uint32_t n = 0; n < LAYER; n++) held[n] = (supple_support){.node = n, .axes = 7};
    const supple_tissue tissue = {.constants = {500.0f, 25000.0f}, .density = 1000.0f}; /* c and d, Pa; kg/m^3 */
    const supple_scene_config body = {SUPPLE_CONFIG(supple_scene_config), .law = SUPPLE_NEO_HOOKEAN, .nodes = NODES,
        .elements = 6 * CELLS, .supports = LAYER, .tissues = 1, .points = points[0], .tetrahedra = tets[0],
        .support = held, .tissue = &tissue, .element = SUPPLE_NODAL_PRESSURE};
    const supple_force push = {.node = TIP, .newton = {0.01f, 0.0f, 0.0f}, .ramp = 0.1f}; /* N, s */
    supple_settings settings; supple_sim *bar; supple_sim_objects of; supple_vectors moved; supple_status status;
    TRY(supple_default_settings(&settings));
    settings.seconds = 2e-4f, settings.damping = 20.0f, settings.forces = 1; /* s, 1/s, room for one force */
    TRY(supple_sim_setup(memory, sizeof memory, &body, &settings, &bar, NULL));
    TRY(supple_sim_describe(bar, &of));
    TRY(supple_set_forces(of.loads, &push, 1, NULL));
    TRY(supple_sim_advance(bar, 0.2, NULL, NULL));
    TRY(supple_displacements(of.state, &moved));
    const float *u = moved.first + moved.stride / sizeof(float) * TIP;
    return printf("the tip moved by %.9g %.9g %.9g m\n", u[0], u[1], u[2]) < 0;
}
