/* A supple_sim is the objects below it, to the bit: for every kind of steps it is held against the calls that a host would make itself.
 * A copy goes on as the original, with instruments of its own; what is refused changes nothing. */
#include "body.h"

enum { FRAMES = 12, ROOM = 24 << 20 };
static const double FRAME = 0.012; /* s */
static const float EXACT = 1e-4f, LONG = 1e-3f, DAMPING = 20.0f, TOLERANCE = 5e-4f;

SUPPLE_MEMORY(sim_memory, ROOM);
SUPPLE_MEMORY(copy_memory, ROOM);
SUPPLE_MEMORY(scene_memory, SCENE_SIZE);
SUPPLE_MEMORY(state_memory, SUPPLE_STATE_SIZE(NODES, ELEMENT));
SUPPLE_MEMORY(loads_memory, SUPPLE_LOADS_SIZE(FORCES, MOTIONS));
SUPPLE_MEMORY(steps_memory, ROOM);
SUPPLE_MEMORY(guard_memory, ROOM);
SUPPLE_MEMORY(weights_memory, 1 << 20);
static size_t weights_bytes;
static float from_sim[NODES][3], by_hand[NODES][3];

static supple_scene_config body;

/* Settings of these steps, with room for what moves the end. */
static supple_settings settings_of(uint32_t steps, float seconds) {
    supple_settings made;
    CHECK(supple_default_settings(&made) == SUPPLE_OK);
    made.steps = steps, made.seconds = seconds, made.damping = DAMPING;
    made.forces = FORCES, made.motions = MOTIONS;
    if (steps == SUPPLE_STEPS_AUTO) made.tolerance = TOLERANCE;
    if (steps == SUPPLE_STEPS_LEARNED) made.weights = weights_memory, made.weights_bytes = weights_bytes, made.lead_in = 0.03;
    return made;
}

static supple_sim *set_up(const supple_settings *settings, supple_sim_objects *objects) {
    size_t bytes;
    supple_sim *sim;
    CHECK(supple_sim_size(&body, settings, &bytes, NULL) == SUPPLE_OK);
    CHECK(bytes <= ROOM);
    CHECK(supple_sim_setup(sim_memory, bytes, &body, settings, &sim, NULL) == SUPPLE_OK);
    CHECK(supple_sim_describe(sim, objects) == SUPPLE_OK);
    CHECK(objects->bytes <= bytes && objects->bytes > bytes / 50);
    CHECK((objects->contact != NULL) == (settings->surface.node_count > 0));
    return sim;
}

/* Where the end has to be after a frame. */
static void pull(const supple_scene *scene, supple_loads *loads, int frame) {
    const float along = 4e-4f * (float)(frame + 1);
    move_end((supple_scene *)scene, loads, along, 0.0f, -along);
}

static double mean_motion(float moved[NODES][3]) {
    double sum = 0.0;
    for (int n = 0; n < NODES; n++) sum += fabs((double)moved[n][0]) + fabs((double)moved[n][2]);
    return sum / NODES;
}

/* The calls of a host without a supple_sim: a frame. */
static supple_status frame_by_hand(uint32_t steps, supple_scene *scene, supple_loads *loads, supple_state *state, void *stepper,
                                   supple_guard *guard, int frame, supple_estimate *estimate) {
    supple_status worst = SUPPLE_OK;
    if (steps == SUPPLE_STEPS_EXACT) return supple_step(scene, loads, state, 120, NULL, NULL);
    if (steps == SUPPLE_STEPS_AUTO) {
        supple_adaptive_report taken;
        worst = supple_adaptive_advance(scene, loads, state, stepper, (float)FRAME, NULL, NULL, &taken);
        *estimate = taken.estimate;
        return worst;
    }
    /* The end goes on evenly over the frame: step by step, as guard and network are asked after each. */
    const int count = steps == SUPPLE_STEPS_LONG ? 12 : 40;
    for (int done = 0; done < count; done++) {
        const float along = 4e-4f * ((float)frame + (float)(done + 1) / (float)count);
        move_end(scene, loads, along, 0.0f, -along);
        supple_status status = steps == SUPPLE_STEPS_LONG ? supple_large_step(scene, loads, state, stepper, 1, NULL, NULL)
                               : frame * count + done < 100     ? supple_learned_lead(scene, loads, state, stepper, 3e-4, NULL, NULL)
                                                            : supple_learned_step(scene, loads, state, stepper, 1, NULL, NULL);
        CHECK(status >= 0);
        worst = status > worst ? status : worst;
        status = supple_guard_follow(scene, loads, state, guard, NULL, estimate);
        CHECK(status >= 0);
        worst = status > worst ? status : worst;
        if (status == SUPPLE_INEXACT && steps == SUPPLE_STEPS_LEARNED) CHECK(supple_learned_fall_back(stepper, state) == SUPPLE_OK);
    }
    return worst;
}

static void is_what_a_host_would_do(uint32_t steps, const char *name) {
    const int learned = steps == SUPPLE_STEPS_LEARNED;
    const float longest = steps == SUPPLE_STEPS_AUTO ? (float)FRAME : LONG, seconds = steps == SUPPLE_STEPS_EXACT || learned ? EXACT : longest;
    const supple_settings settings = settings_of(steps, seconds);
    supple_sim_objects objects;
    supple_sim *sim = set_up(&settings, &objects);

    supple_scene *scene;
    supple_state *state;
    supple_loads *loads;
    void *stepper = NULL;
    supple_guard *guard = NULL;
    CHECK(supple_scene_init(scene_memory, sizeof scene_memory, &body, &scene, NULL) == SUPPLE_OK);
    CHECK(supple_state_init(state_memory, sizeof state_memory, scene, &state) == SUPPLE_OK);
    CHECK(supple_loads_init(loads_memory, sizeof loads_memory, scene, FORCES, MOTIONS, &loads) == SUPPLE_OK);
    supple_step_config exact = {SUPPLE_CONFIG(supple_step_config), EXACT, DAMPING};
    const supple_large_config large = {SUPPLE_CONFIG(supple_large_config), longest, DAMPING, {0, 0, 0}};
    supple_guard_config guarded = {SUPPLE_CONFIG(supple_guard_config), LONG, DAMPING, 3, 0.0f};
    if (steps == SUPPLE_STEPS_LONG)
        CHECK(supple_large_init(steps_memory, ROOM, scene, state, points[0], &large, (supple_large **)&stepper, NULL) == SUPPLE_OK);
    if (steps == SUPPLE_STEPS_AUTO)
        CHECK(supple_adaptive_init(steps_memory, ROOM, scene, state, points[0], &large, TOLERANCE, (supple_adaptive **)&stepper, NULL) ==
              SUPPLE_OK);
    if (learned) {
        const supple_learned_config network = {SUPPLE_CONFIG(supple_learned_config), 1, 0, weights_memory, weights_bytes};
        supple_learned_facts facts;
        CHECK(supple_learned_init(steps_memory, ROOM, scene, &network, (supple_learned **)&stepper, NULL) == SUPPLE_OK);
        CHECK(supple_learned_describe(stepper, &facts) == SUPPLE_OK);
        exact.damping = guarded.damping = facts.damping, guarded.seconds = facts.seconds, guarded.every = 1;
    }
    if (steps == SUPPLE_STEPS_LONG || learned)
        CHECK(supple_guard_init(guard_memory, ROOM, scene, state, points[0], &guarded, &guard, NULL) == SUPPLE_OK);
    CHECK(supple_set_step(scene, state, &exact, NULL) == SUPPLE_OK);

    /* Motions are rounded where the host sets them step by step. */
    const int by_step = learned || steps == SUPPLE_STEPS_LONG;
    supple_sim_report report;
    uint32_t taken = 0, all_kinds = 0;
    for (int frame = 0; frame < FRAMES; frame++) {
        supple_estimate estimate = {0, 0, 0.0f, 0.0f, 0.0f};
        pull(objects.scene, objects.loads, frame);
        pull(scene, loads, frame);
        const supple_status status = supple_sim_advance(sim, FRAME, NULL, &report);
        CHECK(status >= 0);
        CHECK(status == frame_by_hand(steps, scene, loads, state, stepper, guard, frame, &estimate));
        CHECK(fabs(report.call.time - FRAME * (frame + 1)) < 1e-6 * FRAME * (frame + 1));
        CHECK(report.estimate.known == estimate.known);
        CHECK(fabsf(report.estimate.mean - estimate.mean) <= (by_step ? 5e-3f * estimate.mean + 5e-8f : 0.0f));
        CHECK(report.call.steps == report.exact + report.long_steps + report.learned);
        taken += report.call.steps;
        all_kinds |= (report.exact > 0) | (report.long_steps > 0) << 1 | (report.learned > 0) << 2;
        CHECK(supple_copy_displacements(objects.state, from_sim[0], 3 * NODES) == SUPPLE_OK);
        CHECK(supple_copy_displacements(state, by_hand[0], 3 * NODES) == SUPPLE_OK);
        for (int n = 0; n < NODES; n++) {
            for (int axis = 0; axis < 3; axis++) {
                CHECK(fabsf(from_sim[n][axis] - by_hand[n][axis]) <= (by_step ? 1e-5f : 0.0f));
            }
        }
    }
    /* Those that choose may choose exact ones alone. */
    const uint32_t kinds[] = {1, 2, all_kinds & 3, 5};
    CHECK(all_kinds == kinds[steps]);
    const double motion = mean_motion(from_sim);
    CHECK(motion > 5e-4);
    printf("simulation: %s, %u steps for %.0f ms, moved %.2f mm on average, as by hand; %zu bytes\n", name, taken, 1e3 * FRAME * FRAMES,
           1e3 * motion, objects.bytes);

    /* After a reset exact steps lead a network again. */
    if (learned) {
        CHECK(supple_state_reset(objects.state) == SUPPLE_OK);
        pull(objects.scene, objects.loads, 0);
        CHECK(supple_sim_advance(sim, FRAME, NULL, &report) >= 0);
        CHECK(report.learned == 0 && report.exact > 0);
    }
}

/* Frames in which the ball goes into the side of the bar. */
static supple_status press(supple_sim *sim, const supple_sim_objects *objects, int from, int frames, float depth) {
    supple_status status = SUPPLE_OK;
    for (int frame = from; frame < from + frames && status >= 0; frame++) {
        const supple_pose to = {{depth * (float)(frame + 1) - 0.012f, 0.01f * (Y / 2), 0.01f * (Z / 2)}, {0.0f, 0.0f, 0.0f, 1.0f}};
        CHECK(supple_move_instrument(objects->contact, 0, &to, FRAME * frame, FRAME * (frame + 1), NULL) == SUPPLE_OK);
        status = supple_sim_advance(sim, FRAME, NULL, NULL);
    }
    return status;
}

static void copies_go_on(uint32_t steps) {
    supple_settings settings = settings_of(steps, 0.0f);
    settings.surface.node_count = NODES;
    supple_sim_objects objects, copied;
    supple_sim *sim = set_up(&settings, &objects);
    const supple_instrument ball = {SUPPLE_SPHERE, 0.012f, 0.0f, 0.2f, {{-0.012f, 0.01f * (Y / 2), 0.01f * (Z / 2)}, {0.0f, 0.0f, 0.0f, 1.0f}}, NULL, 0};
    CHECK(supple_set_instruments(objects.contact, &ball, 1, NULL) == SUPPLE_OK);
    CHECK(press(sim, &objects, 0, 6, 5e-4f) >= 0);

    memcpy(copy_memory, sim_memory, objects.bytes);
    supple_sim *copy = (supple_sim *)copy_memory;
    CHECK(supple_sim_describe(copy, &copied) == SUPPLE_OK);
    CHECK((const unsigned char *)copied.contact - copy_memory == (const unsigned char *)objects.contact - sim_memory);
    CHECK(press(sim, &objects, 6, 4, 5e-4f) >= 0);
    supple_touch felt, of_copy;
    CHECK(supple_read_touch(objects.contact, 0, &felt) == SUPPLE_OK);
    /* The copy's instrument has not moved, and the original does not feel it. */
    CHECK(supple_read_touch(copied.contact, 0, &of_copy) == SUPPLE_OK);
    CHECK(memcmp(&felt, &of_copy, sizeof felt) != 0);
    CHECK(press(copy, &copied, 6, 4, 5e-4f) >= 0);
    CHECK(supple_read_touch(copied.contact, 0, &of_copy) == SUPPLE_OK);
    CHECK(memcmp(&felt, &of_copy, sizeof felt) == 0);
    CHECK(supple_copy_displacements(objects.state, from_sim[0], 3 * NODES) == SUPPLE_OK);
    CHECK(supple_copy_displacements(copied.state, by_hand[0], 3 * NODES) == SUPPLE_OK);
    CHECK(memcmp(from_sim, by_hand, sizeof from_sim) == 0);
    CHECK(felt.contacts > 0 && felt.mean_force[0] < 0.0f);
    printf("simulation: a copy feels %.4f N as the original does\n", -(double)felt.mean_force[0]);
}

/* Displacements and velocities; the forces are zero after calls that look at the critical step. */
static uint64_t motion_of(const supple_state *state) {
    CHECK(supple_copy_displacements(state, from_sim[0], 3 * NODES) == SUPPLE_OK);
    CHECK(supple_copy_velocities(state, by_hand[0], 3 * NODES) == SUPPLE_OK);
    CHECK(mean_motion(from_sim) > 0.0 && mean_motion(by_hand) > 0.0);
    return hash(from_sim, sizeof from_sim) ^ 3 * hash(by_hand, sizeof by_hand);
}

static void refusals_change_nothing(void) {
    supple_settings settings = settings_of(SUPPLE_STEPS_EXACT, 0.0f), wrong;
    supple_sim_objects objects;
    supple_error error;
    supple_sim *sim;
    size_t bytes, more;
    CHECK(supple_sim_size(&body, &settings, &bytes, NULL) == SUPPLE_OK);
    /* What is too short says what is enough. */
    CHECK(supple_sim_setup(sim_memory, bytes / 2, &body, &settings, &sim, &error) == SUPPLE_E_SHORT);
    CHECK(error.value == (double)(bytes / 2) && error.limit == (double)bytes);
    CHECK(supple_sim_setup(NULL, bytes, &body, &settings, &sim, NULL) == SUPPLE_E_NULL);
    CHECK(supple_sim_setup(sim_memory + 4, bytes, &body, &settings, &sim, NULL) == SUPPLE_E_MISALIGNED);
    CHECK(supple_sim_advance((supple_sim *)sim_memory, FRAME, NULL, NULL) == SUPPLE_E_NOT_INITIALISED);
    wrong = settings, wrong.steps = 4;
    CHECK(supple_sim_setup(sim_memory, bytes, &body, &wrong, &sim, &error) == SUPPLE_E_CHOICE && error.value == 4.0);
    wrong = settings, wrong.abi++;
    CHECK(supple_sim_setup(sim_memory, bytes, &body, &wrong, &sim, NULL) == SUPPLE_E_ABI);
    wrong = settings, wrong.seconds = 1.0f;
    CHECK(supple_sim_setup(sim_memory, bytes, &body, &wrong, &sim, &error) == SUPPLE_E_UNSTABLE && error.limit > 0.0);
    CHECK(supple_sim_advance((supple_sim *)sim_memory, FRAME, NULL, NULL) == SUPPLE_E_NOT_INITIALISED);
    wrong = settings, wrong.surface.node_count = NODES + 1;
    CHECK(supple_sim_setup(sim_memory, ROOM, &body, &wrong, &sim, NULL) == SUPPLE_E_INDEX);

    CHECK(supple_sim_setup(sim_memory, bytes, &body, &settings, &sim, NULL) == SUPPLE_OK);
    CHECK(supple_sim_describe(sim, &objects) == SUPPLE_OK);
    pull(objects.scene, objects.loads, 0);
    CHECK(supple_sim_advance(sim, FRAME, NULL, NULL) == SUPPLE_OK);
    const uint64_t moved = motion_of(objects.state);
    CHECK(supple_sim_advance(sim, -FRAME, NULL, NULL) == SUPPLE_E_NEGATIVE);
    CHECK(supple_sim_advance(sim, NAN, NULL, NULL) == SUPPLE_E_NEGATIVE);
    wrong = settings_of(SUPPLE_STEPS_LEARNED, 0.0f), wrong.weights = NULL;
    CHECK(supple_sim_set(sim, &wrong, NULL) == SUPPLE_E_NULL);
    wrong = settings_of(SUPPLE_STEPS_AUTO, 0.0f), wrong.tolerance = -1.0f;
    CHECK(supple_sim_set(sim, &wrong, &error) == SUPPLE_E_NEGATIVE && error.value == -1.0);
    /* Long steps need more memory than exact ones. */
    wrong = settings_of(SUPPLE_STEPS_LONG, 0.0f);
    CHECK(supple_sim_set(sim, &wrong, &error) == SUPPLE_E_SHORT && error.limit > (double)bytes);
    CHECK(motion_of(objects.state) == moved);
    CHECK(supple_sim_advance(sim, FRAME, NULL, NULL) == SUPPLE_OK);

    /* With as much as all of them need they take turns. */
    for (uint32_t steps = SUPPLE_STEPS_EXACT; steps <= SUPPLE_STEPS_LEARNED; steps++) {
        wrong = settings_of(steps, 0.0f);
        CHECK(supple_sim_size(&body, &wrong, &more, NULL) == SUPPLE_OK);
        bytes = more > bytes ? more : bytes;
    }
    CHECK(supple_sim_setup(sim_memory, bytes, &body, &settings, &sim, NULL) == SUPPLE_OK);
    CHECK(supple_sim_describe(sim, &objects) == SUPPLE_OK);
    supple_sim_report report;
    for (int frame = 0; frame < FRAMES; frame++) {
        const float longest[] = {0.0f, 1e-3f, 4e-3f};
        settings = settings_of((uint32_t)frame % 3, longest[frame % 3]);
        CHECK(supple_sim_set(sim, &settings, NULL) == SUPPLE_OK);
        pull(objects.scene, objects.loads, frame);
        CHECK(supple_sim_advance(sim, FRAME, NULL, &report) >= 0);
        CHECK(fabs(report.call.time - FRAME * (frame + 1)) < 1e-6 * FRAME * (frame + 1));
    }
    CHECK(supple_copy_displacements(objects.state, from_sim[0], 3 * NODES) == SUPPLE_OK);
    CHECK(mean_motion(from_sim) > 5e-4);
    printf("simulation: three kinds of steps in turn, %.2f mm on average\n", 1e3 * mean_motion(from_sim));
}

/* With little work a call ends early and says so; the next one goes on from there. */
static void a_call_ends_when_its_work_is_spent(uint32_t steps) {
    supple_settings settings = settings_of(steps, 0.0f);
    settings.most_steps = 20;
    supple_sim_objects objects;
    supple_sim *sim = set_up(&settings, &objects);
    pull(objects.scene, objects.loads, 1);
    double time = 0.0;
    for (int call = 0; call < 5; call++) {
        supple_sim_report report;
        CHECK(supple_sim_advance(sim, 0.5, NULL, &report) == SUPPLE_BEHIND);
        CHECK(report.missing > 0.1 && fabs(report.call.time + report.missing - time - 0.5) < 1e-6 && report.call.time > time);
        const uint32_t work = report.exact + report.undone + 4 * report.long_steps;
        CHECK(work >= 20 && work < 24);
        time = report.call.time;
    }
    settings.most_steps = 0;
    CHECK(supple_sim_set(sim, &settings, NULL) == SUPPLE_OK);
    supple_sim_report report;
    const supple_status told = supple_sim_advance(sim, 0.1, NULL, &report);
    printf("simulation: work of 20 steps a call, then %s, missing %g s\n", supple_status_text(told), report.missing);
    CHECK(told >= SUPPLE_OK);
    CHECK(report.missing == 0.0 && fabs(report.call.time - time - 0.1) < 1e-6);
}

int main(void) {
    body = bar_config();
    file("weights/compact-10.weights", weights_memory, sizeof weights_memory, &weights_bytes);
    is_what_a_host_would_do(SUPPLE_STEPS_EXACT, "exact");
    is_what_a_host_would_do(SUPPLE_STEPS_LONG, "long");
    is_what_a_host_would_do(SUPPLE_STEPS_AUTO, "auto");
    is_what_a_host_would_do(SUPPLE_STEPS_LEARNED, "learned");
    copies_go_on(SUPPLE_STEPS_EXACT);
    copies_go_on(SUPPLE_STEPS_AUTO);
    refusals_change_nothing();
    a_call_ends_when_its_work_is_spent(SUPPLE_STEPS_EXACT);
    a_call_ends_when_its_work_is_spent(SUPPLE_STEPS_LONG);
    a_call_ends_when_its_work_is_spent(SUPPLE_STEPS_AUTO);
    return 0;
}
