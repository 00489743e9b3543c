/* Tissue that changes while it moves: a simulation goes on in another one without some elements, and with other constants. What stays
 * keeps its momentum, the end is that of a body that was so from the start, and what is refused changes nothing. */
#include "body.h"
#ifdef UNDER_VALGRIND
#include <valgrind/memcheck.h>
#endif

/* A coarse bar takes longer to rest. */
enum { ROOM = PARTS == 1 ? 6 << 20 : 32 << 20, FRAMES = PARTS == 1 ? 400 : 150 };
#include "simulated.h"

SUPPLE_MEMORY(first_memory, ROOM);
SUPPLE_MEMORY(second_memory, ROOM);
SUPPLE_MEMORY(third_memory, ROOM);
SUPPLE_MEMORY(contact_memory, 1 << 20);
SUPPLE_MEMORY(pulls_memory, 1 << 13);
static uint8_t removed[TETS];
static float of_one[NODES][3], of_other[NODES][3], frozen[NODES][3];

/* Of all bytes of an object. Those between its fields have no values of their own, but stay what they are. */
static uint64_t hash_of(const unsigned char *memory) {
    uint64_t sum = hash(memory, ROOM);
#ifdef UNDER_VALGRIND
    (void)VALGRIND_MAKE_MEM_DEFINED(&sum, sizeof sum);
#endif
    return sum;
}

static supple_settings settings_of(uint32_t steps) {
    supple_settings made;
    CHECK(supple_default_settings(&made) == SUPPLE_OK);
    made.steps = steps, made.damping = 20.0f, made.forces = FORCES, made.motions = MOTIONS, made.guard = 0;
    made.surface.node_count = NODES, made.grips = NODES;
    return made;
}

static void set_gravity(supple_sim *sim) {
    const float gravity[3] = {0.0f, 1.0f, 0.0f};
    CHECK(supple_set_gravity(objects_of(sim).loads, gravity) == SUPPLE_OK);
}

/* The largest difference of two bodies' displacements along an axis, over the largest displacement along one. */
static double difference(supple_sim *one, supple_sim *other, int with_alone) {
    CHECK(supple_copy_displacements(objects_of(one).state, of_one[0], 3 * NODES) == SUPPLE_OK);
    CHECK(supple_copy_displacements(objects_of(other).state, of_other[0], 3 * NODES) == SUPPLE_OK);
    double most = 0.0, far = 0.0;
    for (int n = 0; n < NODES; n++) {
        double off = 0.0, way = 0.0;
        for (int axis = 0; axis < 3; axis++) {
            const double is = fabs((double)of_one[n][axis] - (double)of_other[n][axis]), at = fabs((double)of_other[n][axis]);
            off = is > off ? is : off, way = at > way ? at : way;
        }
        int is_left = 0;
        for (int e = 0; e < TETS && !is_left; e++) {
            for (int corner = 0; corner < 4; corner++) is_left |= !removed[e] && tets[e][corner] == (uint32_t)n;
        }
        if (is_left || with_alone) most = off > most ? off : most, far = way > far ? way : far;
    }
    return most / far;
}

/* The half of the bar beyond a height, on one side. */
static uint32_t remove_a_part(void) {
    uint32_t count = 0;
    for (int e = 0; e < TETS; e++) {
        float x = 0.0f, z = 0.0f;
        for (int corner = 0; corner < 4; corner++) x += points[tets[e][corner]][0] / 4, z += points[tets[e][corner]][2] / 4;
        removed[e] = x < points[NODES - 1][0] / 2 && z > 0.3f * points[NODES - 1][2] && z < 0.6f * points[NODES - 1][2];
        count += removed[e];
    }
    CHECK(count > 0);
    return count;
}

/* Adaptive steps keep half a millimetre, and long ones take seconds to come to rest. */
static double most_of(uint32_t steps) { return steps == SUPPLE_STEPS_EXACT ? 0.001 : steps == SUPPLE_STEPS_LONG ? 0.06 : 0.1; }

static void elements_go(uint32_t steps, const char *name) {
    const supple_settings settings = settings_of(steps);
    body.removed = NULL;
    supple_sim *first = set_up(first_memory, &settings);
    set_gravity(first);
    advance(first, 10);
    CHECK(supple_copy_displacements(objects_of(first).state, frozen[0], 3 * NODES) == SUPPLE_OK);

    remove_a_part(), body.removed = removed;
    supple_sim *second = set_up(second_memory, &settings), *never = set_up(third_memory, &settings);
    const uint64_t before = hash_of(first_memory);
    supple_error error;
    const supple_status status = supple_sim_carry_on(second, first, &settings, &error);
    CHECK(status == SUPPLE_OK && hash_of(first_memory) == before);
    double time;
    CHECK(supple_state_time(objects_of(second).state, &time, NULL) == SUPPLE_OK && fabs(time - 10 * FRAME) < 1e-6);
    CHECK(supple_copy_displacements(objects_of(second).state, of_one[0], 3 * NODES) == SUPPLE_OK);
    CHECK(memcmp(of_one, frozen, sizeof frozen) == 0);
    supple_scene_facts whole, part;
    CHECK(supple_scene_describe(objects_of(first).scene, &whole) == SUPPLE_OK);
    CHECK(supple_scene_describe(objects_of(second).scene, &part) == SUPPLE_OK);
    CHECK(part.mass < whole.mass && part.elements < whole.elements && part.nodes == whole.nodes);

    set_gravity(never);
    advance(second, FRAMES), advance(never, FRAMES + 10);
    const double off = difference(second, never, 0);
    printf("exchange: %s steps, %u elements less, %.4f of the way off\n", name, whole.elements - part.elements, off);
    CHECK(off < most_of(steps));
    /* The other one may go on. */
    advance(first, 1);
}

static void constants_change(uint32_t steps, const char *name) {
    static uint16_t of_element[TETS];
    static const supple_tissue soft[2] = {{{59.0f, 8.023f, 60000.0f, 0.0f}, 1000.0f}, {{59.0f, 8.023f, 60000.0f, 0.0f}, 1000.0f}};
    supple_tissue now[2] = {soft[0], soft[1]};
    const supple_settings settings = settings_of(steps);
    const uint32_t count = remove_a_part();
    for (int e = 0; e < TETS; e++) of_element[e] = removed[e];
    memset(removed, 0, sizeof removed);
    body.removed = NULL, body.tissues = 2, body.tissue = now, body.tissue_of_element = of_element;
    supple_sim *first = set_up(first_memory, &settings);
    set_gravity(first);
    for (int stage = 0; stage < 20; stage++) {
        now[1].constants[0] = 59.0f + 10.0f * (float)(stage + 1);
        CHECK(supple_sim_set_tissues(first, now, 2, stage < 19 ? NULL : &settings, NULL) == SUPPLE_OK);
        advance(first, 1);
    }
    supple_sim *stiff = set_up(second_memory, &settings);
    set_gravity(stiff);
    advance(first, 150), advance(stiff, 170);
    const double off = difference(first, stiff, 1);
    printf("exchange: %s steps, %u elements stiffer in 20 stages, %.4f of the way off\n", name, count, off);
    CHECK(off < most_of(steps));
    body = bar_config();
}

static void instruments_follow(void) {
    const supple_settings settings = settings_of(SUPPLE_STEPS_EXACT);
    body.removed = NULL;
    supple_sim *first = set_up(first_memory, &settings);
    const float *tip = points[NODES - 1];
    const supple_instrument ball = {SUPPLE_SPHERE, 0.3f * tip[0], 0.0f, 0.0f, {{tip[0] / 2, tip[1] / 2, tip[2]}, {0, 0, 0, 0}}, NULL, 0};
    CHECK(supple_set_instruments(objects_of(first).contact, &ball, 1, NULL) == SUPPLE_OK);
    uint32_t held = 0, after = 0;
    CHECK(supple_grasp(objects_of(first).contact, objects_of(first).state, 0, 0.1f * tip[0], &held) == SUPPLE_OK && held > 0);
    advance(first, 2);
    /* All that is held goes. */
    for (int e = 0; e < TETS; e++) {
        float z = 0.0f;
        for (int corner = 0; corner < 4; corner++) z += points[tets[e][corner]][2] / 4;
        removed[e] = z > 0.6f * tip[2];
    }
    body.removed = removed;
    supple_sim *second = set_up(second_memory, &settings);
    CHECK(supple_sim_carry_on(second, first, &settings, NULL) == SUPPLE_OK);
    advance(second, 5);
    supple_touch touch;
    CHECK(supple_read_touch(objects_of(second).contact, 0, &touch) == SUPPLE_OK && touch.contacts == 0);
    /* Far from all nodes it holds what it held before. */
    const supple_pose far = {{1.0f, 1.0f, 1.0f}, {0, 0, 0, 0}};
    CHECK(supple_move_instrument(objects_of(second).contact, 0, &far, 0.0, 0.0, NULL) == SUPPLE_OK);
    CHECK(supple_grasp(objects_of(second).contact, objects_of(second).state, 0, 0.0f, &after) == SUPPLE_OK && after == 0);
    printf("exchange: %u nodes were held, %u are\n", held, after);
    /* A triangle of what has gone would be touched where there is no tissue. */
    static const uint32_t gone[3] = {NODES - 1 - LAYER, NODES - 2, NODES - 1};
    const supple_surface surface = {NULL, gone, NODES, 1};
    supple_contact *none;
    supple_error error;
    const supple_scene *scene = objects_of(second).scene;
    CHECK(supple_contact_init(contact_memory, sizeof contact_memory, scene, points[0], &surface, 0, &none, &error) == SUPPLE_E_MESH_UNUSED_NODE);
    CHECK(error.index == 0 && error.node == NODES - 1 - LAYER);
}

static void refusals_change_nothing(void) {
    const supple_settings settings = settings_of(SUPPLE_STEPS_EXACT);
    supple_settings fewer = settings;
    fewer.forces = 0;
    body = bar_config();
    supple_sim *first = set_up(first_memory, &settings);
    const supple_force push = {NODES - 1, {0.001f, 0.0f, 0.0f}, 0.0f};
    CHECK(supple_set_forces(objects_of(first).loads, &push, 1, NULL) == SUPPLE_OK);
    advance(first, 2);
    remove_a_part(), body.removed = removed;
    supple_sim *second = set_up(second_memory, &fewer), *none = NULL;
    supple_error error;
    size_t bytes;
    CHECK(supple_sim_size(&body, &settings, &bytes, NULL) == SUPPLE_OK);
    const uint64_t before = hash_of(first_memory), after = hash_of(second_memory);
    CHECK(supple_sim_carry_on(NULL, first, &settings, NULL) == SUPPLE_E_NULL);
    CHECK(supple_sim_carry_on(second, NULL, &settings, NULL) == SUPPLE_E_NULL);
    CHECK(supple_sim_carry_on(second, first, NULL, NULL) == SUPPLE_E_NULL);
    CHECK(supple_sim_carry_on(second, second, &settings, NULL) == SUPPLE_E_OVERLAP);
    CHECK(supple_sim_carry_on(second, first, &fewer, &error) == SUPPLE_E_CAPACITY && error.value == 1.0 && error.limit == 0.0);
    supple_tissue other = tissue;
    CHECK(supple_sim_set_tissues(NULL, &other, 1, &settings, NULL) == SUPPLE_E_NULL);
    CHECK(supple_sim_set_tissues(first, NULL, 1, &settings, NULL) == SUPPLE_E_NULL);
    CHECK(supple_sim_set_tissues(first, &other, 0, &settings, &error) == SUPPLE_E_MISMATCH);
    other.constants[0] = NAN;
    CHECK(supple_sim_set_tissues(first, &other, 1, &settings, &error) == SUPPLE_E_CONSTANT);
    CHECK(error.index == 0 || (PARTS == 1 && error.index < TETS));
    CHECK(supple_set_tissues((supple_scene *)objects_of(first).scene, &other, 1, NULL) == SUPPLE_E_CONSTANT);
    CHECK(supple_set_tissues(NULL, &other, 1, NULL) == SUPPLE_E_NULL);
    other = tissue, other.density = 900.0f;
    CHECK(supple_sim_set_tissues(first, &other, 1, &settings, &error) == SUPPLE_E_MISMATCH);
    CHECK(error.index == 0 && error.value == 900.0 && error.limit == (double)tissue.density);
    CHECK(supple_state_carry_on(NULL, objects_of(first).state) == SUPPLE_E_NULL);
    CHECK(supple_state_carry_on(objects_of(first).scene, NULL) == SUPPLE_E_NULL);
    CHECK(supple_contact_carry_on(objects_of(first).contact, objects_of(first).scene, NULL) == SUPPLE_E_NULL);
    CHECK(supple_contact_carry_on(objects_of(first).contact, objects_of(first).scene, objects_of(first).contact) == SUPPLE_E_OVERLAP);
    CHECK(hash_of(first_memory) == before && hash_of(second_memory) == after);
    /* Pulls whose memory is used for something else by now. */
    supple_pulls *pulls;
    CHECK(supple_pulls_init(pulls_memory, sizeof pulls_memory, objects_of(first).scene, 1, 1, &pulls) == SUPPLE_OK);
    CHECK(supple_set_pulls(objects_of(first).loads, pulls) == SUPPLE_OK);
    memset(pulls_memory, 0, sizeof pulls_memory);
    CHECK(supple_sim_setup(second_memory, bytes, &body, &settings, &second, NULL) == SUPPLE_OK);
    const uint64_t without = hash_of(second_memory);
    CHECK(supple_sim_carry_on(second, first, &settings, NULL) == SUPPLE_E_NOT_INITIALISED && hash_of(second_memory) == without);
    CHECK(supple_set_pulls(objects_of(first).loads, NULL) == SUPPLE_OK);
    CHECK(hash_of(first_memory) == before);
    /* Marks that are none, all of them, and another body. */
    removed[17] = 2;
    CHECK(supple_sim_setup(third_memory, bytes, &body, &settings, &none, &error) == SUPPLE_E_CHOICE && error.index == 17);
    memset(removed, 1, sizeof removed);
    CHECK(supple_sim_setup(third_memory, bytes, &body, &settings, &none, NULL) == SUPPLE_E_MESH_EMPTY);
    body.removed = NULL, points[5][0] += 1e-5f;
    supple_sim *moved = set_up(third_memory, &settings);
    CHECK(supple_sim_carry_on(moved, first, &settings, &error) == SUPPLE_E_MISMATCH && error.node == 5);
    points[5][0] -= 1e-5f;
    CHECK(hash_of(first_memory) == before);
    advance(first, 1);
    /* Steps that choose their length are prepared anew. */
    const supple_settings chosen = settings_of(SUPPLE_STEPS_AUTO);
    supple_sim *adaptive = set_up(third_memory, &chosen);
    CHECK(supple_sim_set_tissues(adaptive, &tissue, 1, NULL, NULL) == SUPPLE_E_NULL);
    CHECK(supple_sim_set_tissues(adaptive, &tissue, 1, &chosen, NULL) == SUPPLE_OK);
}

/* Pressures act on the surface of their scene, pulls let go, and a refused exchange leaves both sides' pulls as they are. */
static void pressures_and_pulls(void) {
    static uint32_t all[4 * TETS][3], pressed[4 * TETS][3], surface_of[4 * TETS];
    uint32_t count = 0, taken = 0;
    supple_error error;
    const supple_settings settings = settings_of(SUPPLE_STEPS_EXACT);
    body = bar_config();
    supple_sim *first = set_up(first_memory, &settings);
    CHECK(supple_boundary(tets[0], TETS, all[0], 4 * TETS, &count) == SUPPLE_OK && count > 0);
    /* All but the end that is held. */
    for (uint32_t t = 0; t < count; t++) {
        const float z = points[all[t][0]][2] + points[all[t][1]][2] + points[all[t][2]][2];
        if (z > 1e-6f) memcpy(pressed[taken++], all[t], sizeof all[t]);
    }
    const size_t bytes = supple_pressure_size(taken, 1);
    supple_pressure *pressure;
    CHECK(bytes <= sizeof contact_memory);
    CHECK(supple_pressure_init(contact_memory, bytes, objects_of(first).scene, points[0], pressed[0], surface_of, taken, 1, &pressure, NULL) == SUPPLE_OK);
    CHECK(supple_pressure_set(pressure, 0, 2.0f, 0.0f) == SUPPLE_OK && supple_set_pressure(objects_of(first).loads, pressure) == SUPPLE_OK);
    supple_pulls *pulls;
    const float *tip = points[NODES - 1];
    const supple_pull pull = {{tip[0] / 4, tip[1] / 2, 0.45f * tip[2]}, 0.3f * tip[0], 10.0f, 0.0f, {0, 0, 0}};
    const float target[3] = {pull.at[0], pull.at[1] + 0.1f * tip[0], pull.at[2]};
    CHECK(supple_pulls_init(pulls_memory, sizeof pulls_memory, objects_of(first).scene, 1, 200, &pulls) == SUPPLE_OK);
    CHECK(supple_add_pull(pulls, objects_of(first).scene, points[0], &pull, &error) == SUPPLE_OK);
    CHECK(supple_set_targets(pulls, target, 1, 0.0, 0.0, NULL) == SUPPLE_OK && supple_set_pulls(objects_of(first).loads, pulls) == SUPPLE_OK);
    advance(first, 10);
    /* Steps that are too long: refused at the end. */
    remove_a_part(), body.removed = removed;
    supple_sim *second = set_up(second_memory, &settings);
    supple_settings long_steps = settings;
    long_steps.seconds = 1.0f;
    const uint64_t before = hash(pulls_memory, sizeof pulls_memory);
    CHECK(supple_sim_carry_on(second, first, &long_steps, &error) < 0 && hash(pulls_memory, sizeof pulls_memory) == before);
    /* The surface is another one: no pressure until there is a new one. */
    second = set_up(second_memory, &settings);
    CHECK(supple_sim_carry_on(second, first, &settings, &error) == SUPPLE_OK);
    /* Of a coarse bar no node of the patch goes. */
    CHECK(PARTS == 1 || hash(pulls_memory, sizeof pulls_memory) != before);
    supple_sim *never = set_up(third_memory, &settings);
    CHECK(supple_set_pulls(objects_of(second).loads, NULL) == SUPPLE_OK);
    advance(second, FRAMES), advance(never, 1);
    double most = 0.0;
    CHECK(supple_copy_displacements(objects_of(second).state, of_one[0], 3 * NODES) == SUPPLE_OK);
    for (int e = 0; e < TETS; e++) {
        for (int at = 0; at < 12 && !removed[e]; at++) {
            const double way = fabs((double)of_one[tets[e][at / 3]][at % 3]);
            most = way > most ? way : most;
        }
    }
    printf("exchange: without pressure and pulls it is within %.4f mm of its shape at rest\n", 1e3 * most);
    CHECK(most < 2e-3 * (double)tip[0]);
}

/* A copy of the bytes in use has no more than these. */
static void a_copy_has_the_memory_in_use(void) {
    body = bar_config();
    const supple_settings exact = settings_of(SUPPLE_STEPS_EXACT), chosen = settings_of(SUPPLE_STEPS_AUTO);
    size_t bytes;
    supple_sim *sim;
    CHECK(supple_sim_size(&body, &chosen, &bytes, NULL) == SUPPLE_OK && bytes <= ROOM);
    CHECK(supple_sim_setup(first_memory, bytes, &body, &exact, &sim, NULL) == SUPPLE_OK);
    memcpy(second_memory, first_memory, objects_of(sim).bytes);
    supple_sim *copy = (supple_sim *)(void *)second_memory;
    advance(copy, 1);
    supple_error error;
    CHECK(supple_sim_set(copy, &chosen, &error) == SUPPLE_E_SHORT && supple_sim_set(copy, &exact, NULL) == SUPPLE_OK);
    CHECK(supple_sim_set(sim, &chosen, NULL) == SUPPLE_OK);
}

/* The force of supports is right from the first frame on, also of a body that goes on in another scene. */
static void supports_bear_the_weight(void) {
    const supple_settings settings = settings_of(SUPPLE_STEPS_EXACT);
    body = bar_config(), body.removed = NULL;
    supple_sim *first = set_up(first_memory, &settings), *second = set_up(second_memory, &settings);
    set_gravity(first);
    supple_settled settled;
    CHECK(supple_settle_size(NODES) <= sizeof third_memory);
    CHECK(supple_sim_settle(first, 1e-6f, 50000, NULL, third_memory, sizeof third_memory, &settled) == SUPPLE_OK);
    CHECK(supple_sim_carry_on(second, first, &settings, NULL) == SUPPLE_OK);
    uint32_t bearing[2 * LAYER];
    for (int n = 0; n < 2 * LAYER; n++) bearing[n] = supports[n].node;
    supple_reaction *reaction;
    CHECK(supple_reaction_size(NODES) <= sizeof third_memory);
    CHECK(supple_reaction_init(third_memory, sizeof third_memory, objects_of(second).scene, bearing, 2 * LAYER, 20.0f, &reaction, NULL) == SUPPLE_OK);
    supple_reaction_force force;
    CHECK(supple_reaction_follow(objects_of(second).scene, objects_of(second).state, reaction, &force) == SUPPLE_OK && !force.known);
    supple_scene_facts facts;
    CHECK(supple_scene_describe(objects_of(second).scene, &facts) == SUPPLE_OK);
    for (int frame = 0; frame < 3; frame++) {
        advance(second, 1);
        CHECK(supple_reaction_follow(objects_of(second).scene, objects_of(second).state, reaction, &force) == SUPPLE_OK && force.known);
        printf("exchange: frame %d: the supports bear %.4f of the weight\n", frame, -(double)force.newton[1] / facts.mass);
        CHECK(fabs(-(double)force.newton[1] / facts.mass - 1.0) < 0.01);
    }
}

/* The objects below a supple_sim: a second scene, and a contact whose surface has changed. */
static void objects_below(void) {
    body = bar_config();
    const supple_settings settings = settings_of(SUPPLE_STEPS_EXACT);
    supple_sim *sim = set_up(first_memory, &settings);
    set_gravity(sim), advance(sim, 3);
    const supple_sim_objects objects = objects_of(sim);
    remove_a_part(), body.removed = removed;
    supple_scene *scene;
    supple_loads *loads;
    CHECK(supple_scene_init(second_memory, ROOM, &body, &scene, NULL) == SUPPLE_OK);
    CHECK(supple_loads_init(third_memory, ROOM, scene, 1, 1, &loads) == SUPPLE_OK);
    supple_contact *contact;
    const supple_surface surface = {NULL, NULL, NODES, 0};
    CHECK(supple_contact_init(contact_memory, sizeof contact_memory, scene, points[0], &surface, NODES, &contact, NULL) == SUPPLE_OK);
    CHECK(supple_contact_carry_on(contact, scene, objects.contact) == SUPPLE_OK);
    CHECK(supple_state_carry_on(scene, objects.state) == SUPPLE_OK);
    CHECK(supple_step(scene, loads, objects.state, 1, NULL, NULL) == SUPPLE_E_NO_STEP);
    supple_step_config step = {SUPPLE_CONFIG(supple_step_config), 0.0f, 20.0f};
    CHECK(supple_critical_step(scene, objects.state, &step.seconds, NULL) == SUPPLE_OK);
    step.seconds *= 0.9f;
    CHECK(supple_set_step(scene, objects.state, &step, NULL) == SUPPLE_OK);
    CHECK(supple_step(scene, loads, objects.state, 200, NULL, NULL) == SUPPLE_OK);
}

int main(void) {
    body = bar_config();
    elements_go(SUPPLE_STEPS_EXACT, "exact");
    elements_go(SUPPLE_STEPS_LONG, "long");
    elements_go(SUPPLE_STEPS_AUTO, "auto");
    constants_change(SUPPLE_STEPS_EXACT, "exact");
    constants_change(SUPPLE_STEPS_LONG, "long");
    instruments_follow();
    refusals_change_nothing();
    pressures_and_pulls();
    a_copy_has_the_memory_in_use();
    supports_bear_the_weight();
    objects_below();
    return 0;
}
