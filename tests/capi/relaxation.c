/* Tissue that relaxes: against closed forms, saved and restored to the bit, in memory of the sizes that are told, at rest, and when
 * another scene takes its place. */
#include "body.h"

enum { ROOM = PARTS == 1 ? 8 << 20 : 48 << 20, TERMS = 2 };
#define OF_TISSUE
#include "simulated.h"
#define STATE_SIZE (SUPPLE_STATE_SIZE(NODES, ELEMENT) + SUPPLE_RELAXATION_SIZE(NODES, TETS, 1, ELEMENT, TERMS))

SUPPLE_MEMORY(scene_memory, SCENE_SIZE + SUPPLE_PRONY_SIZE(1));
SUPPLE_MEMORY(other_scene_memory, SCENE_SIZE + SUPPLE_PRONY_SIZE(1));
SUPPLE_MEMORY(state_memory, STATE_SIZE);
SUPPLE_MEMORY(loads_memory, SUPPLE_LOADS_SIZE(1, NODES));
SUPPLE_MEMORY(first_memory, ROOM);
SUPPLE_MEMORY(second_memory, ROOM);
SUPPLE_MEMORY(third_memory, ROOM);
SUPPLE_MEMORY(settle_memory, SUPPLE_SETTLE_SIZE(NODES));
static unsigned char saved[1 + 144 + 48 * NODES + 16 + STATE_SIZE / 2], again[sizeof saved];
static float forces[NODES][3];
static uint8_t removed[TETS];

/* Shares and times (s) of the terms. The second one stands behind a place without one. */
static const supple_prony series = {{0.5f, 0.0f, 0.2f}, {0.01f, 0.0f, 0.1f}}, none = {{0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}};

/* The force along an axis on the last layer, all of whose nodes are held where a shear or a dilation brings them, after each of
 * some steps: of what relaxes it is that of the law times 1 - sum g (1 - e^(-t / tau)), of pressure that of the law. */
static void relaxes_as_the_closed_form(int shears) {
    static supple_support all[NODES];
    supple_scene_config held = body;
    for (uint32_t n = 0; n < NODES; n++) all[n] = (supple_support){n, 7, 1};
    held.support = all, held.supports = NODES;
    supple_scene *scene;
    supple_state *state;
    supple_loads *loads;
    const supple_step_config step = {SUPPLE_CONFIG(supple_step_config), 2e-4f, 0.0f};
    CHECK(supple_scene_init(scene_memory, sizeof scene_memory, &held, &scene, NULL) == SUPPLE_OK);
    CHECK(supple_state_init(state_memory, sizeof state_memory, scene, &state) == SUPPLE_OK);
    CHECK(supple_loads_init(loads_memory, sizeof loads_memory, scene, 1, NODES, &loads) == SUPPLE_OK);
    for (int n = 0; n < NODES; n++) {
        const float x = points[n][0], y = points[n][1], z = points[n][2];
        moved[n][0] = shears ? 0.2f * z : 0.01f * x, moved[n][1] = shears ? 0.0f : 0.01f * y, moved[n][2] = shears ? 0.0f : 0.01f * z;
    }
    CHECK(supple_set_displacements(scene, state, moved[0], NODES, NULL) == SUPPLE_OK);
    CHECK(supple_set_step(scene, state, &step, NULL) == SUPPLE_OK);
    double first = 0.0, worst = 0.0;
    for (int n = 0; n < 200; n++) {
        CHECK(supple_step(scene, loads, state, 1, NULL, NULL) >= SUPPLE_OK);
        CHECK(supple_copy_forces(state, forces[0], 3 * NODES) == SUPPLE_OK);
        double force = 0.0, factor = 1.0;
        for (int node = NODES - LAYER; node < NODES; node++) force += (double)forces[node][shears ? 0 : 2];
        if (n == 0) first = force;
        const double time = n * (double)step.seconds;
        for (int term = 0; term < 3 && shears; term++) {
            const double share = (double)series.share[term];
            if (share > 0.0) factor -= share * (1.0 - exponential(-time / (double)series.seconds[term]));
        }
        const double off = fabs(force / (factor * first) - 1.0);
        worst = off > worst ? off : worst;
    }
    printf("relaxation: %s, %.1e of the closed form off\n", shears ? "a shear" : "a dilation", worst);
    CHECK(fabs(first) > 0.01 && worst < 1e-5);
}

static supple_settings settings_of(uint32_t steps) { return damped(steps, 1e-4f); }

/* A pull along y, which the middle of the bar follows. */
static supple_sim *hanging(unsigned char *memory, const supple_settings *settings) {
    supple_sim *sim = set_up(memory, settings);
    pull_along_y(sim, 0.5f);
    return sim;
}

/* The mean of all nodes along y, m. */
static double way(supple_sim *sim) {
    double sum = 0.0;
    (void)where(sim);
    for (int n = 0; n < NODES; n++) sum += (double)moved[n][1] / NODES;
    return sum;
}

/* Saved and restored it goes on to the bit with exact steps; a copy by memcpy does with all. */
static void goes_on_to_the_bit(uint32_t steps, const char *name) {
    const supple_settings settings = settings_of(steps);
    supple_sim *sim = hanging(first_memory, &settings);
    /* An odd number of steps: the current memory is the second of two. */
    advance(sim, 3);
    if (steps == SUPPLE_STEPS_EXACT) CHECK(supple_sim_advance(sim, 1e-4, NULL, NULL) == SUPPLE_OK);
    supple_state *state = objects_of(sim).state;
    size_t bytes;
    CHECK(supple_state_saved_size(state, &bytes) == SUPPLE_OK && bytes > supple_saved_size(NODES) && bytes < sizeof saved);
    CHECK(supple_save(state, saved + 1, bytes - 1) == SUPPLE_E_SHORT);
    CHECK(supple_save(state, saved + 1, bytes) == SUPPLE_OK);
    memcpy(second_memory, first_memory, objects_of(sim).bytes);
    supple_sim *copy = (supple_sim *)(void *)second_memory;
    advance(sim, 3), advance(copy, 3);
    const uint64_t end = where(sim);
    CHECK(where(copy) == end);
    advance(sim, 4);
    CHECK(supple_restore(state, saved + 1, bytes - 1) == SUPPLE_E_SHORT);
    CHECK(supple_restore(state, saved + 1, bytes) == SUPPLE_OK);
    CHECK(supple_save(state, again + 1, bytes) == SUPPLE_OK && memcmp(saved + 1, again + 1, bytes) == 0);
    if (steps == SUPPLE_STEPS_EXACT) {
        advance(sim, 3);
        CHECK(where(sim) == end);
    }
    /* A reset one begins as a fresh one. */
    CHECK(supple_state_reset(state) == SUPPLE_OK && supple_sim_set(sim, &settings, NULL) == SUPPLE_OK);
    supple_sim *fresh = hanging(second_memory, &settings);
    advance(sim, 2), advance(fresh, 2);
    CHECK(where(sim) == where(fresh));
    printf("relaxation: %s steps go on to the bit, %zu of %zu bytes saved are of what tissue remembers\n", name,
           bytes - supple_saved_size(NODES), bytes);
}

/* An instantaneous shape, and the one that it creeps to, which settling reaches at once. */
static void settles_where_it_creeps_to(void) {
    supple_settings settings = settings_of(SUPPLE_STEPS_EXACT);
    settings.damping = 8.0f;
    supple_sim *elastic, *settled = hanging(second_memory, &settings), *creeps = hanging(third_memory, &settings);
    body.prony = NULL, elastic = hanging(first_memory, &settings), body.prony = &series;
    const size_t bytes = sizeof settle_memory;
    CHECK(supple_sim_settle(elastic, 1e-5f, 100000, NULL, settle_memory, bytes, NULL) == SUPPLE_OK);
    CHECK(supple_sim_settle(settled, 1e-5f, 100000, NULL, settle_memory, bytes, NULL) == SUPPLE_OK);
    const double stiff = way(elastic), soft = way(settled);
    advance(settled, 5), advance(creeps, 60);
    printf("relaxation: %.3f mm at once, %.3f mm in the end, %.3f mm off after it has settled, %.3f mm after 1.2 s of creep\n",
           1e3 * stiff, 1e3 * soft, 1e3 * (way(settled) - soft), 1e3 * (way(creeps) - soft));
    /* 0.3 of the stress that changes the shape is left. */
    CHECK(soft > 1.5 * stiff && soft < 3.4 * stiff);
    CHECK(fabs(way(settled) - soft) < 1e-3 * soft && fabs(way(creeps) - soft) < 0.02 * soft);
}

static void sizes_are_those_that_are_told(void) {
    supple_scene *scene, *nothing = NULL;
    supple_state *state, *no_state = NULL;
    supple_error error;
    CHECK(supple_prony_size(1) == SUPPLE_PRONY_SIZE(1));
    const size_t room = supple_relaxation_size(NODES, TETS, 1, ELEMENT, TERMS);
    CHECK(room == SUPPLE_RELAXATION_SIZE(NODES, TETS, 1, ELEMENT, TERMS) && room > 0);
    CHECK(supple_relaxation_size(NODES, TETS, 1, ELEMENT, 0) == 0 && supple_relaxation_size(NODES, TETS, 1, 77, 2) == 0);
    if (ELEMENT != SUPPLE_NODAL_STRAIN) {
        CHECK(supple_scene_init(scene_memory, sizeof scene_memory - 1, &body, &nothing, &error) == SUPPLE_E_SHORT);
        CHECK(error.limit == sizeof scene_memory && nothing == NULL);
    }
    CHECK(supple_scene_init(scene_memory, sizeof scene_memory, &body, &scene, NULL) == SUPPLE_OK);
    CHECK(supple_state_init(state_memory, sizeof state_memory - 1, scene, &no_state) == SUPPLE_E_SHORT && no_state == NULL);
    CHECK(supple_state_init(state_memory, sizeof state_memory, scene, &state) == SUPPLE_OK);
    /* A series without a term is none. */
    const supple_settings settings = settings_of(SUPPLE_STEPS_AUTO);
    size_t relaxing, without, elastic;
    supple_scene *plain;
    CHECK(supple_sim_size(&body, &settings, &relaxing, NULL) == SUPPLE_OK);
    body.prony = &none;
    CHECK(supple_sim_size(&body, &settings, &without, NULL) == SUPPLE_OK);
    CHECK(supple_scene_init(other_scene_memory, SCENE_SIZE, &body, &plain, NULL) == SUPPLE_OK);
    body.prony = NULL;
    CHECK(supple_sim_size(&body, &settings, &elastic, NULL) == SUPPLE_OK && elastic == without && relaxing > elastic);
    body.prony = &series;
    /* States, also saved ones, of tissue that does not relax are told apart. */
    CHECK(supple_step(plain, NULL, state, 1, NULL, NULL) == SUPPLE_E_NO_STEP);
    CHECK(supple_state_stop(plain, state) == SUPPLE_E_NO_RELAXATION);
    const supple_step_config step = {SUPPLE_CONFIG(supple_step_config), 1e-5f, 0.0f};
    CHECK(supple_set_step(plain, state, &step, &error) == SUPPLE_E_NO_RELAXATION && error.value > 0.0 && error.limit == 0.0);
    size_t bytes;
    CHECK(supple_state_saved_size(state, &bytes) == SUPPLE_OK && supple_save(state, saved, bytes) == SUPPLE_OK);
    CHECK(supple_state_init(state_memory, SUPPLE_STATE_SIZE(NODES, ELEMENT), plain, &state) == SUPPLE_OK);
    CHECK(supple_restore(state, saved, bytes) == SUPPLE_E_MISMATCH);
    CHECK(supple_set_step(scene, state, &step, &error) == SUPPLE_E_NO_RELAXATION && error.value == 0.0 && error.limit <= (double)room);
    CHECK(supple_state_saved_size(state, &bytes) == SUPPLE_OK && bytes == supple_saved_size(NODES));
    CHECK(supple_state_saved_size(NULL, &bytes) == SUPPLE_E_NULL && supple_state_saved_size(state, NULL) == SUPPLE_E_NULL);
    /* And there is no room for it. */
    CHECK(supple_state_carry_on(scene, state) == SUPPLE_E_NO_RELAXATION);
    printf("relaxation: %zu bytes for what tissue remembers, %zu in a simulation\n", room, relaxing - elastic);
}

/* A body that has crept goes on as it was where its constants change, and where a part of it is removed. */
static void another_scene_takes_its_place(void) {
    const supple_settings settings = settings_of(SUPPLE_STEPS_EXACT);
    supple_sim *first = hanging(first_memory, &settings);
    CHECK(supple_sim_settle(first, 1e-5f, 100000, NULL, settle_memory, sizeof settle_memory, NULL) == SUPPLE_OK);
    const double before = way(first);
    /* The same body to the bit. */
    supple_sim *second = set_up(second_memory, &settings);
    CHECK(supple_sim_carry_on(second, first, &settings, NULL) == SUPPLE_OK);
    advance(first, 2), advance(second, 2);
    CHECK(where(first) == where(second));
    /* Without a corner of the end, or of the middle. */
    uint32_t count = 0;
    for (int e = 0; e < TETS; e++) {
        float x = 0.0f, z = 0.0f;
        for (int corner = 0; corner < 4; corner++) x += points[tets[e][corner]][0] / 4, z += points[tets[e][corner]][2] / 4;
        removed[e] = x < 0.01f && z > 0.45f * points[NODES - 1][2] && z < 0.55f * points[NODES - 1][2];
        count += removed[e];
    }
    body.removed = removed;
    supple_sim *part = set_up(second_memory, &settings);
    CHECK(count > 0 && supple_sim_carry_on(part, first, &settings, NULL) == SUPPLE_OK);
    advance(part, 5);
    const double after = way(part);
    /* Had the tissue forgotten, it would be pulled back as if by more than three times the force. */
    supple_state *state = objects_of(first).state;
    supple_scene *scene;
    CHECK(supple_scene_init(other_scene_memory, sizeof other_scene_memory, &body, &scene, NULL) == SUPPLE_OK);
    size_t bytes, of_part;
    CHECK(supple_state_saved_size(state, &bytes) == SUPPLE_OK && supple_save(state, saved, bytes) == SUPPLE_OK);
    CHECK(supple_state_carry_on(scene, state) == SUPPLE_OK);
    CHECK(supple_state_saved_size(state, &of_part) == SUPPLE_OK && of_part <= bytes && supple_save(state, again, of_part) == SUPPLE_OK);
    for (size_t at = supple_saved_size(NODES) + 16; at < of_part; at++) CHECK(again[at] == 0);
    /* In the scene of before, which has the same tables, it would not have: other constants keep what is remembered. */
    body.removed = NULL;
    supple_tissue stiffer = tissue;
    stiffer.constants[0] *= 1.01f;
    supple_sim *changed = hanging(third_memory, &settings);
    CHECK(supple_restore(objects_of(changed).state, saved, bytes) == SUPPLE_OK);
    CHECK(supple_sim_set_tissues(changed, &stiffer, 1, NULL, NULL) == SUPPLE_OK);
    CHECK(supple_save(objects_of(changed).state, again, bytes) == SUPPLE_OK);
    CHECK(memcmp(saved + supple_saved_size(NODES), again + supple_saved_size(NODES), bytes - supple_saved_size(NODES)) == 0);
    body.tissue = &stiffer;
    CHECK(supple_scene_init(other_scene_memory, sizeof other_scene_memory, &body, &scene, NULL) == SUPPLE_OK);
    body.tissue = &tissue;
    CHECK(supple_state_carry_on(scene, objects_of(changed).state) == SUPPLE_OK);
    CHECK(supple_save(objects_of(changed).state, again, bytes) == SUPPLE_OK);
    CHECK(memcmp(saved + supple_saved_size(NODES), again + supple_saved_size(NODES), bytes - supple_saved_size(NODES)) == 0);
    printf("relaxation: without %u of %d elements %.3f mm after %.3f\n", count, TETS, 1e3 * after, 1e3 * before);
    CHECK(after > 0.97 * before && after < 1.3 * before);
}

int main(void) {
    body = bar_config();
    body.prony = &series;
    relaxes_as_the_closed_form(1);
    relaxes_as_the_closed_form(0);
    goes_on_to_the_bit(SUPPLE_STEPS_EXACT, "exact");
    goes_on_to_the_bit(SUPPLE_STEPS_LONG, "long");
    goes_on_to_the_bit(SUPPLE_STEPS_AUTO, "auto");
    settles_where_it_creeps_to();
    sizes_are_those_that_are_told();
    another_scene_takes_its_place();
    return 0;
}
