/* Tissue with fibres: against closed forms, in memory of the sizes that are told, saved and restored to the bit, and when another
 * scene takes its place. */
#include "body.h"

enum { ROOM = PARTS == 1 ? 8 << 20 : 48 << 20 };
#define OF_TISSUE
#include "simulated.h"
#define FIBRES_SIZE SUPPLE_FIBRES_SIZE(NODES, TETS, 1, ELEMENT)
/* Of two tissues. */
#define BOTH_SIZE                                                                                                      \
    (SUPPLE_SCENE_SIZE(NODES, TETS, 2) + SUPPLE_FIBRES_SIZE(NODES, TETS, 2, ELEMENT) +                                 \
     (ELEMENT == SUPPLE_NODAL_STRAIN ? SUPPLE_PATCHES_SIZE(NODES, TETS, 2) : 0))

SUPPLE_MEMORY(scene_memory, SCENE_SIZE + FIBRES_SIZE);
SUPPLE_MEMORY(other_scene_memory, SCENE_SIZE + FIBRES_SIZE);
SUPPLE_MEMORY(both_memory, BOTH_SIZE);
SUPPLE_MEMORY(state_memory, SUPPLE_STATE_SIZE(NODES, ELEMENT));
SUPPLE_MEMORY(first_memory, ROOM);
SUPPLE_MEMORY(second_memory, ROOM);
SUPPLE_MEMORY(settle_memory, SUPPLE_SETTLE_SIZE(NODES));
static unsigned char saved[48 * NODES + 256];
static float forces[NODES][3], directions[TETS][2][3];
static uint16_t tissue_of[TETS];
static uint8_t removed[TETS];

/* Constants of Holzapfel & Ogden 2009, table 1: a (Pa), b. */
static const supple_fibres myocardium = {{18472.0f, 16.026f}, {2481.0f, 11.12f}, {216.0f, 11.436f}};
static const supple_fibres one_family = {{18472.0f, 16.026f}, {0.0f, 0.0f}, {0.0f, 0.0f}}, none = {{0.0f, 7.0f}, {0.0f, 0.0f}, {0.0f, 0.0f}};

/* a x exp(b x^2), Pa. */
static double slope(const float term[2], double x) { return (double)term[0] * x * exponential((double)term[1] * x * x); }

/* The same in all elements: vectors that are not of unit length. */
static void point(const float fibre[3], const float sheet[3]) {
    for (int e = 0; e < TETS; e++)
        for (int axis = 0; axis < 3; axis++) directions[e][0][axis] = fibre[axis], directions[e][1][axis] = sheet[axis];
}

static const supple_step_config step = {SUPPLE_CONFIG(supple_step_config), 2e-6f, 0.0f};

/* The stress (Pa) on the last layer, along x and across z, of a shear by `k`: all nodes are held where it brings them. */
static double sheared(unsigned char *memory, size_t bytes, double k) {
    static supple_support all[NODES];
    supple_scene_config held = body;
    for (uint32_t n = 0; n < NODES; n++) all[n] = (supple_support){n, 7, 1};
    held.support = all, held.supports = NODES;
    supple_scene *scene;
    supple_state *state;
    CHECK(supple_scene_init(memory, bytes, &held, &scene, NULL) == SUPPLE_OK);
    CHECK(supple_state_init(state_memory, sizeof state_memory, scene, &state) == SUPPLE_OK);
    for (int n = 0; n < NODES; n++) moved[n][0] = (float)(k * (double)points[n][2]), moved[n][1] = 0.0f, moved[n][2] = 0.0f;
    CHECK(supple_set_displacements(scene, state, moved[0], NODES, NULL) == SUPPLE_OK);
    CHECK(supple_set_step(scene, state, &step, NULL) == SUPPLE_OK);
    CHECK(supple_step(scene, NULL, state, 1, NULL, NULL) >= SUPPLE_OK);
    CHECK(supple_copy_forces(state, forces[0], 3 * NODES) == SUPPLE_OK);
    double force = 0.0;
    for (int node = NODES - LAYER; node < NODES; node++) force += (double)forces[node][0];
    const double area = (double)points[NODES - 1][0] * (double)points[NODES - 1][1];
    return fabs(force) / area;
}

/* Of the law alone, Pa. */
static double of_the_law(double k) { return (double)tissue.constants[0] * k * exponential((double)tissue.constants[1] * k * k); }

static void close_to(const char *name, double found, double expected) {
    printf("fibres: %s, %.2f Pa, %.1e of the closed form off\n", name, found, fabs(found / expected - 1.0));
    CHECK(fabs(found / expected - 1.0) < 1e-4);
}

/* Holzapfel & Ogden 2009, section 5d: fibres across the plane that slides are stretched, such in it and those along the normal of
 * both are not. */
static void stress_is_that_of_the_closed_form(void) {
    const double k = 0.4;
    point((const float[3]){0.0f, 0.0f, 2.0f}, (const float[3]){0.5f, 0.0f, 3.0f});
    close_to("a shear of fibres", sheared(scene_memory, sizeof scene_memory, k),
             of_the_law(k) + 2.0 * k * slope(myocardium.fibres, k * k) + slope(myocardium.coupling, k));
    point((const float[3]){-3.0f, 0.0f, 0.0f}, (const float[3]){0.0f, 0.0f, 0.1f});
    close_to("a shear of sheets", sheared(scene_memory, sizeof scene_memory, k),
             of_the_law(k) + 2.0 * k * slope(myocardium.sheets, k * k) + slope(myocardium.coupling, k));
    point((const float[3]){1.0f, 0.0f, 0.0f}, (const float[3]){1.0f, 1.0f, 0.0f});
    close_to("a shear of neither", sheared(scene_memory, sizeof scene_memory, k), of_the_law(k));
}

/* Of two tissues the one below has sheets, and the one above only fibres, whose elements have no direction of sheets. */
static void each_tissue_has_its_own(void) {
    static supple_tissue tissues[2];
    supple_fibres given[2] = {myocardium, one_family};
    const double k = 0.4;
    tissues[0] = tissues[1] = tissue;
    for (int e = 0; e < TETS; e++) {
        float z = 0.0f;
        for (int corner = 0; corner < 4; corner++) z += points[tets[e][corner]][2] / 4;
        tissue_of[e] = z > 0.5f * points[NODES - 1][2];
    }
    const supple_scene_config kept = body;
    body.tissues = 2, body.tissue = tissues, body.tissue_of_element = tissue_of, body.fibres = given;
    point((const float[3]){0.0f, 0.0f, 1.0f}, (const float[3]){1.0f, 0.0f, 0.0f});
    for (int e = 0; e < TETS; e++)
        if (tissue_of[e] == 1) directions[e][1][0] = 0.0f;
    CHECK(supple_fibres_size(NODES, TETS, 2, ELEMENT) == SUPPLE_FIBRES_SIZE(NODES, TETS, 2, ELEMENT));
    const double expected = of_the_law(k) + 2.0 * k * slope(one_family.fibres, k * k);
    close_to("fibres of one tissue of two", sheared(both_memory, sizeof both_memory, k), expected);
    /* The one without fibres needs no direction at all. */
    given[0] = none;
    for (int e = 0; e < TETS; e++)
        if (tissue_of[e] == 0) memset(directions[e], 0, sizeof directions[e]);
    close_to("fibres of the only tissue that has them", sheared(both_memory, sizeof both_memory, k), expected);
    body = kept;
    point((const float[3]){0.0f, 0.0f, 1.0f}, (const float[3]){1.0f, 0.0f, 0.0f});
}

static supple_settings settings_of(uint32_t steps) { return damped(steps, 5e-5f); }

static void pull(supple_sim *sim) { pull_along_y(sim, 3.0f); }

/* A pull along y, which the middle of the bar follows. */
static supple_sim *hanging(unsigned char *memory, const supple_settings *settings) {
    supple_sim *sim = set_up(memory, settings);
    pull(sim);
    return sim;
}

/* The mean along y of the nodes on a side of the bar, m. */
static double way(supple_sim *sim) {
    double sum = 0.0;
    (void)where(sim);
    for (int n = X; n < NODES; n += X + 1) sum += (double)moved[n][1] * (X + 1) / NODES;
    return sum;
}

/* A copy by memcpy goes on to the bit, and a saved state with exact steps. */
static void goes_on_to_the_bit(uint32_t steps, const char *name) {
    const supple_settings settings = settings_of(steps);
    supple_sim *sim = hanging(first_memory, &settings);
    advance(sim, 3);
    supple_state *state = objects_of(sim).state;
    size_t bytes;
    CHECK(supple_state_saved_size(state, &bytes) == SUPPLE_OK && bytes == supple_saved_size(NODES) && bytes <= sizeof saved);
    CHECK(supple_save(state, saved, bytes) == SUPPLE_OK);
    memcpy(second_memory, first_memory, objects_of(sim).bytes);
    supple_sim *copy = (supple_sim *)(void *)second_memory;
    advance(sim, 3), advance(copy, 3);
    const uint64_t end = where(sim);
    CHECK(where(copy) == end);
    if (steps == SUPPLE_STEPS_EXACT) {
        CHECK(supple_restore(state, saved, bytes) == SUPPLE_OK);
        advance(sim, 3);
        CHECK(where(sim) == end);
    }
    printf("fibres: %s steps go on to the bit, %.3f mm\n", name, 1e3 * way(sim));
}

/* Along the bar fibres hold it. Steps of all kinds bring it to where it settles. */
static void fibres_hold(void) {
    const uint32_t kinds[3] = {SUPPLE_STEPS_EXACT, SUPPLE_STEPS_LONG, SUPPLE_STEPS_AUTO};
    supple_settings settings = settings_of(SUPPLE_STEPS_EXACT);
    const size_t bytes = sizeof settle_memory;
    body.fibres = NULL;
    supple_sim *soft = hanging(first_memory, &settings);
    CHECK(supple_sim_settle(soft, 1e-5f, 100000, NULL, settle_memory, bytes, NULL) == SUPPLE_OK);
    const double without = way(soft);
    body.fibres = &myocardium;
    supple_sim *held = hanging(first_memory, &settings);
    CHECK(supple_sim_settle(held, 1e-5f, 100000, NULL, settle_memory, bytes, NULL) == SUPPLE_OK);
    const double with = way(held);
    printf("fibres: %.3f mm without, %.3f mm with them\n", 1e3 * without, 1e3 * with);
    CHECK(with > 0.0 && with < 0.8 * without);
    for (int kind = 0; kind < 3; kind++) {
        settings = settings_of(kinds[kind]);
        supple_sim *sim = hanging(second_memory, &settings);
        advance(sim, 100);
        printf("fibres: %.3f mm with them after 2 s of steps of kind %u\n", 1e3 * way(sim), kinds[kind]);
        CHECK(fabs(way(sim) - with) < 0.01 * with);
    }
}

static void sizes_are_those_that_are_told(void) {
    supple_scene *scene, *plain, *nothing = NULL;
    supple_error error;
    supple_scene_facts facts, of_plain;
    CHECK(supple_fibres_size(NODES, TETS, 1, ELEMENT) == FIBRES_SIZE && FIBRES_SIZE % SUPPLE_ALIGN == 0);
    CHECK(supple_fibres_size(NODES, TETS, 1, 77) == 0 && supple_fibres_size(UINT32_MAX, UINT32_MAX, 1, ELEMENT) > 0);
    if (ELEMENT != SUPPLE_NODAL_STRAIN) {
        CHECK(supple_scene_init(scene_memory, sizeof scene_memory - 1, &body, &nothing, &error) == SUPPLE_E_SHORT);
    } else {
        CHECK(supple_scene_init(scene_memory, SUPPLE_SCENE_SIZE(NODES, TETS, 1), &body, &nothing, &error) == SUPPLE_E_SHORT);
    }
    CHECK(error.limit == sizeof scene_memory && nothing == NULL);
    CHECK(supple_scene_init(scene_memory, sizeof scene_memory, &body, &scene, NULL) == SUPPLE_OK);
    /* Fibres without a term are none. */
    const supple_settings settings = settings_of(SUPPLE_STEPS_AUTO);
    size_t with, without, elastic;
    CHECK(supple_sim_size(&body, &settings, &with, NULL) == SUPPLE_OK);
    const supple_scene_config kept = body;
    body.fibres = &none, body.directions = NULL;
    CHECK(supple_sim_size(&body, &settings, &without, NULL) == SUPPLE_OK);
    CHECK(supple_scene_init(other_scene_memory, SCENE_SIZE, &body, &plain, NULL) == SUPPLE_OK);
    body.fibres = NULL;
    CHECK(supple_sim_size(&body, &settings, &elastic, NULL) == SUPPLE_OK && elastic == without && with == elastic + FIBRES_SIZE);
    body = kept;
    CHECK(supple_scene_describe(scene, &facts) == SUPPLE_OK && supple_scene_describe(plain, &of_plain) == SUPPLE_OK);
    CHECK(facts.bytes == of_plain.bytes + FIBRES_SIZE);
    printf("fibres: %zu bytes more than %zu\n", (size_t)(facts.bytes - of_plain.bytes), (size_t)of_plain.bytes);
}

/* Fibres stay where constants change, where elements are removed, and where the body goes on in another scene. */
static void another_scene_takes_its_place(void) {
    const supple_settings settings = settings_of(SUPPLE_STEPS_EXACT);
    const size_t bytes = sizeof settle_memory;
    supple_tissue stiffer = tissue;
    stiffer.constants[0] *= 3.0f;
    /* Other constants in the scene that is there, and in one that was built with them. */
    supple_sim *changed = hanging(first_memory, &settings);
    advance(changed, 2);
    const uint64_t before = where(changed);
    CHECK(supple_sim_set_tissues(changed, &stiffer, 1, &settings, NULL) == SUPPLE_OK && where(changed) == before);
    CHECK(supple_sim_settle(changed, 1e-6f, 100000, NULL, settle_memory, bytes, NULL) == SUPPLE_OK);
    body.tissue = &stiffer;
    supple_sim *built = hanging(second_memory, &settings);
    body.tissue = &tissue;
    CHECK(supple_sim_settle(built, 1e-6f, 100000, NULL, settle_memory, bytes, NULL) == SUPPLE_OK);
    CHECK(fabs(way(changed) - way(built)) < 1e-3 * way(built));
    /* The same body to the bit, then without a corner of the middle. */
    supple_sim *first = hanging(first_memory, &settings);
    advance(first, 3);
    supple_sim *second = set_up(second_memory, &settings);
    CHECK(supple_sim_carry_on(second, first, &settings, NULL) == SUPPLE_OK);
    CHECK(supple_save(objects_of(first).state, saved, sizeof saved) == SUPPLE_OK);
    advance(first, 2), advance(second, 2);
    CHECK(where(first) == where(second));
    const double whole = way(first);
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
    CHECK(supple_sim_settle(part, 1e-5f, 100000, NULL, settle_memory, bytes, NULL) == SUPPLE_OK);
    supple_sim *fresh = hanging(first_memory, &settings);
    CHECK(supple_sim_settle(fresh, 1e-5f, 100000, NULL, settle_memory, bytes, NULL) == SUPPLE_OK);
    printf("fibres: without %u of %d elements %.3f mm, so from the start %.3f mm, before %.3f mm\n", count, TETS, 1e3 * way(part),
           1e3 * way(fresh), 1e3 * whole);
    CHECK(fabs(way(part) - way(fresh)) < 1e-3 * way(fresh));
    body.removed = NULL;
    /* A state of tissue without fibres goes on in a scene with them: it keeps nothing of them. */
    supple_scene *scene, *plain;
    supple_state *state;
    const supple_step_config shorter = {SUPPLE_CONFIG(supple_step_config), 5e-5f, 20.0f};
    supple_scene_config without = body;
    without.fibres = NULL, without.directions = NULL;
    CHECK(supple_scene_init(scene_memory, sizeof scene_memory, &body, &scene, NULL) == SUPPLE_OK);
    CHECK(supple_scene_init(other_scene_memory, sizeof other_scene_memory, &without, &plain, NULL) == SUPPLE_OK);
    CHECK(supple_state_init(state_memory, sizeof state_memory, plain, &state) == SUPPLE_OK);
    CHECK(supple_restore(state, saved, supple_saved_size(NODES)) == SUPPLE_OK);
    CHECK(supple_state_carry_on(scene, state) == SUPPLE_OK && supple_set_step(scene, state, &shorter, NULL) == SUPPLE_OK);
    CHECK(supple_step(scene, NULL, state, 100, NULL, NULL) == SUPPLE_OK);
    CHECK(supple_copy_displacements(state, moved[0], 3 * NODES) == SUPPLE_OK);
    const uint64_t end = hash(moved, sizeof moved);
    CHECK(supple_state_init(state_memory, sizeof state_memory, scene, &state) == SUPPLE_OK);
    CHECK(supple_restore(state, saved, supple_saved_size(NODES)) == SUPPLE_OK);
    CHECK(supple_state_carry_on(scene, state) == SUPPLE_OK && supple_set_step(scene, state, &shorter, NULL) == SUPPLE_OK);
    CHECK(supple_step(scene, NULL, state, 100, NULL, NULL) == SUPPLE_OK);
    CHECK(supple_copy_displacements(state, moved[0], 3 * NODES) == SUPPLE_OK && hash(moved, sizeof moved) == end);
}

int main(void) {
    body = bar_config();
    body.fibres = &myocardium, body.directions = directions[0][0];
    stress_is_that_of_the_closed_form();
    each_tissue_has_its_own();
    sizes_are_those_that_are_told();
    goes_on_to_the_bit(SUPPLE_STEPS_EXACT, "exact");
    goes_on_to_the_bit(SUPPLE_STEPS_LONG, "long");
    goes_on_to_the_bit(SUPPLE_STEPS_AUTO, "auto");
    fibres_hold();
    another_scene_takes_its_place();
    return 0;
}
