/* What tests of simulations share: one of the bar, in memory of ROOM bytes, which goes on by frames. A test defines ROOM first. */
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

#endif
