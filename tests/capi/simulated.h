/* What tests of simulations share: one of the bar, in memory of ROOM bytes, which goes on by frames. A test defines ROOM first,
 * and OF_TISSUE if it looks at what tissue does. */
#ifndef SIMULATED_H
#define SIMULATED_H

#include "body.h"

static const double FRAME = 0.02; /* s */
static supple_scene_config body;

static supple_sim *set_up(unsigned char *memory, const supple_settings *settings) {
    size_t bytes;
    supple_sim *sim;
    supple_error error;
    CHECK(supple_sim_size(&body, settings, &bytes, NULL) == SUPPLE_OK && bytes <= ROOM);
    const supple_status status = supple_sim_setup(memory, bytes, &body, settings, &sim, &error);
    if (status != SUPPLE_OK) fprintf(stderr, "%s\n", supple_status_text(status));
    CHECK(status == SUPPLE_OK);
    return sim;
}

static supple_sim_objects objects_of(supple_sim *sim) {
    supple_sim_objects objects;
    CHECK(supple_sim_describe(sim, &objects) == SUPPLE_OK);
    return objects;
}

static void advance(supple_sim *sim, int frames) {
    for (int frame = 0; frame < frames; frame++) CHECK(supple_sim_advance(sim, FRAME, NULL, NULL) >= SUPPLE_OK);
}

#ifdef OF_TISSUE
static float moved[NODES][3];

static double exponential(double x) {
    double sum = 1.0, term = 1.0;
    for (int n = 1; n < 60; n++) term *= x / n, sum += term;
    return sum;
}

/* Damped steps, exact ones of so many seconds. */
static supple_settings damped(uint32_t steps, float seconds) {
    supple_settings made;
    CHECK(supple_default_settings(&made) == SUPPLE_OK);
    made.steps = steps, made.damping = 20.0f, made.forces = 1, made.motions = MOTIONS;
    if (steps == SUPPLE_STEPS_EXACT) made.seconds = seconds;
    return made;
}

static void pull_along_y(supple_sim *sim, float acceleration) {
    CHECK(supple_set_gravity(objects_of(sim).loads, (const float[3]){0.0f, acceleration, 0.0f}) == SUPPLE_OK);
}

static uint64_t where(supple_sim *sim) {
    CHECK(supple_copy_displacements(objects_of(sim).state, moved[0], 3 * NODES) == SUPPLE_OK);
    return hash(moved, sizeof moved);
}
#endif

#endif
