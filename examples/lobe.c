/* The exact step and the learned one on a liver lobe that leans over under a sixteenth of its weight, in C11, with
 * static memory only: mesh and weights are in the program, nothing comes from a heap. After a lead-in of 0.3 s a
 * network moves one state; the exact step moves another, to compare with.
 *
 *     tools/mesh_to_c.py meshes/lobe.msh lobe_mesh.h
 *     tools/mesh_to_c.py --bytes weights/compact-10.weights compact compact.h
 *     cc -std=c11 -O2 -Iinclude -I. examples/lobe.c -lsupple -lm -o lobe
 */
#include <math.h>
#include <stdio.h>
#include <supple.h>

#include "compact.h"
#include "lobe_mesh.h"

enum {
    NODES = LOBE_NODES,
    EXACT = 3,   /* exact steps in a learned one */
    TICK = 20,   /* learned steps between two looks */
    LEAD_IN = 50, /* ticks of the lead-in: 0.3 s, as in the paper */
    TICKS = 170, /* in all: 1.02 s */
    SHOWN = 15   /* every so many ticks a line */
};
static const float GRAVITY = 0.6f, RAMP = 1.0f; /* m/s^2, s */
static const float HELD = 0.12f; /* the thick end, this share of the length, does not move */
/* Ten times as stiff as the network's own: the lobe is larger than the bar that it learned from. */
static const supple_tissue TISSUE = {{590.0f, 8.023f, 60000.0f}, 1000.0f};

static supple_support held[NODES];
SUPPLE_MEMORY(scene_memory, SUPPLE_SCENE_SIZE(NODES, LOBE_TETRAHEDRA, 1));
SUPPLE_MEMORY(loads_memory, SUPPLE_LOADS_SIZE(0, 0));
SUPPLE_MEMORY(exact_memory, SUPPLE_STATE_SIZE(NODES, SUPPLE_LINEAR));
SUPPLE_MEMORY(moved_memory, SUPPLE_STATE_SIZE(NODES, SUPPLE_LINEAR));
SUPPLE_MEMORY(learned_memory, SUPPLE_LEARNED_SIZE(NODES, 1));

/* Whether a call did what it was asked for; says what not. */
static int done(const char *what, supple_status status) {
    if (status < 0) printf("%s: %s\n", what, supple_status_text(status));
    return status >= 0;
}

/* Displacement of a node, m. */
static const float *at(supple_vectors vectors, uint32_t node) {
    return (const float *)((const char *)vectors.first + vectors.stride * node);
}

static double distance(const float *a, const float *b) {
    return sqrt(pow((double)a[0] - b[0], 2) + pow((double)a[1] - b[1], 2) + pow((double)a[2] - b[2], 2));
}

int main(void) {
    static char line[1024];
    setvbuf(stdout, line, _IOLBF, sizeof line); /* or the C library would take a buffer from the heap */

    uint32_t tip = 0, end = 0, supports = 0;
    for (uint32_t node = 0; node < NODES; node++) {
        tip = lobe_points[node][0] > lobe_points[tip][0] ? node : tip;
        end = lobe_points[node][0] < lobe_points[end][0] ? node : end;
    }
    const float from = lobe_points[end][0], length = lobe_points[tip][0] - from;
    for (uint32_t node = 0; node < NODES; node++)
        if (lobe_points[node][0] <= from + HELD * length) held[supports++] = (supple_support){node, 7, 0};

    const supple_scene_config body = {SUPPLE_CONFIG(supple_scene_config), SUPPLE_EXPONENTIAL,
                                      SUPPLE_WINDING_CHECKED, NODES, LOBE_TETRAHEDRA, supports, 1,
                                      lobe_points[0], lobe_tetrahedra[0], held, &TISSUE, NULL,
                                      SUPPLE_LINEAR /* as in the network's training */, 0, NULL, NULL, NULL, NULL};
    const supple_learned_config network = {SUPPLE_CONFIG(supple_learned_config), 1, 0, compact, sizeof compact};
    supple_scene *scene;
    supple_loads *loads;
    supple_state *exact, *moved;
    supple_learned *learned;
    supple_learned_facts facts;
    if (!done("scene", supple_scene_init(scene_memory, sizeof scene_memory, &body, &scene, NULL)) ||
        !done("loads", supple_loads_init(loads_memory, sizeof loads_memory, scene, 0, 0, &loads)) ||
        !done("state", supple_state_init(exact_memory, sizeof exact_memory, scene, &exact)) ||
        !done("state", supple_state_init(moved_memory, sizeof moved_memory, scene, &moved)) ||
        !done("network",
              supple_learned_init(learned_memory, sizeof learned_memory, scene, &network, &learned, NULL)) ||
        !done("network", supple_learned_describe(learned, &facts)))
        return 1;
    const supple_step_config step = {SUPPLE_CONFIG(supple_step_config), facts.seconds / EXACT, facts.damping};
    if (!done("step", supple_set_step(scene, exact, &step, NULL)) ||
        !done("step", supple_set_step(scene, moved, &step, NULL)))
        return 1;

    printf("bytes: scene %zu, loads %zu, each state %zu, learned %zu, weights %zu\n", sizeof scene_memory,
           sizeof loads_memory, sizeof exact_memory, sizeof learned_memory, sizeof compact);
    printf("time s  exact mm  learned mm  apart mm  mean apart mm  clipped %%  outside %%  learned step\n");
    supple_vectors truth, predicted;
    if (!done("displacements", supple_displacements(exact, &truth)) ||
        !done("displacements", supple_displacements(moved, &predicted)))
        return 1;
    for (int tick = 1; tick <= TICKS; tick++) {
        /* Gravity has no ramp of its own: it is raised here. */
        const float now = (float)(tick - 1) * TICK * facts.seconds;
        const float gravity[3] = {0.0f, -GRAVITY * fminf(1.0f, now / RAMP), 0.0f};
        supple_report report;
        if (!done("gravity", supple_set_gravity(loads, gravity)) ||
            !done("exact", supple_step(scene, loads, exact, TICK * EXACT, NULL, NULL)))
            return 1;
        const supple_status status =
            tick <= LEAD_IN ? supple_learned_lead(scene, loads, moved, learned, TICK * (double)facts.seconds, NULL, &report)
                            : supple_learned_step(scene, loads, moved, learned, TICK, NULL, &report);
        if (!done("learned", status)) return 1;
        if (tick % SHOWN != 0 && tick != LEAD_IN && tick != TICKS) continue;
        const float rest[3] = {0.0f, 0.0f, 0.0f};
        double apart = 0.0;
        for (uint32_t node = 0; node < NODES; node++)
            apart += distance(at(truth, node), at(predicted, node)) / NODES;
        printf("%6.3f  %8.3f  %10.3f  %8.3f  %13.4f  %9.2f  %9.2f  %s\n", report.time,
               1e3 * distance(at(truth, tip), rest), 1e3 * distance(at(predicted, tip), rest),
               1e3 * distance(at(truth, tip), at(predicted, tip)), 1e3 * apart, 100.0 * (double)report.clipped,
               100.0 * (double)report.outside,
               tick <= LEAD_IN ? "lead-in" : supple_status_text(status));
    }
    return 0;
}
