/* Exact steps of the lobe, ten a call: microseconds a call, best of the calls of each line that comes in. See overhead.py. */
#include <stdio.h>
#include <time.h>

#include <supple.h>

#include "lobe_mesh.h"

static unsigned char scene_memory[SUPPLE_SCENE_SIZE(LOBE_NODES, LOBE_TETRAHEDRA, 1)] __attribute__((aligned(SUPPLE_ALIGN)));
static unsigned char state_memory[SUPPLE_STATE_SIZE(LOBE_NODES, SUPPLE_NODAL_PRESSURE)] __attribute__((aligned(SUPPLE_ALIGN)));
static unsigned char loads_memory[SUPPLE_LOADS_SIZE(0, 0)] __attribute__((aligned(SUPPLE_ALIGN)));
static supple_support held[LOBE_NODES];

static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return 1e6 * (double)time.tv_sec + 1e-3 * (double)time.tv_nsec;
}

int main(void) {
    supple_scene *scene;
    supple_state *state;
    supple_loads *loads;
    uint32_t count = 0;
    for (uint32_t node = 0; node < LOBE_NODES; node++) {
        if (lobe_points[node][1] > 0.03f) held[count++] = (supple_support){node, 7, 0};
    }
    const supple_tissue liver = {{1500.0f, 8.023f, 40000.0f}, 1060.0f};
    supple_scene_config body = {SUPPLE_CONFIG(supple_scene_config), SUPPLE_EXPONENTIAL, SUPPLE_WINDING_CHECKED, LOBE_NODES, LOBE_TETRAHEDRA,
        count, 1, lobe_points[0], lobe_tetrahedra[0], held, &liver, NULL, SUPPLE_NODAL_PRESSURE, 0};
    const supple_step_config length = {SUPPLE_CONFIG(supple_step_config), 1e-4f, 20.0f};
    const float gravity[3] = {0.0f, 0.0f, -9.81f};
    if (supple_scene_init(scene_memory, sizeof scene_memory, &body, &scene, NULL) < 0 ||
        supple_state_init(state_memory, sizeof state_memory, scene, &state) < 0 ||
        supple_loads_init(loads_memory, sizeof loads_memory, scene, 0, 0, &loads) < 0 || supple_set_gravity(loads, gravity) < 0 ||
        supple_set_step(scene, state, &length, NULL) < 0) {
        return 1;
    }
    for (int key; (key = getchar()) != EOF;) {
        if (key != '\n') continue;
        double sum = 0.0;
        for (int call = 0; call < 50; call++) {
            const double start = now();
            supple_report report;
            if (supple_step(scene, loads, state, 10, NULL, &report) < 0) return 1;
            sum += now() - start;
        }
        printf("%.3f\n", sum / 50.0);
        fflush(stdout);
    }
}
