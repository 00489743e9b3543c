/* The constant expressions for sizes are those that the library computes, over the sizes of scenes people have; for lattices
 * they are never less. */
#include "body.h"

SUPPLE_MEMORY(scene_memory, SCENE_SIZE);

static supple_large_config large_of(uint32_t x, uint32_t y, uint32_t z) {
    return (supple_large_config){SUPPLE_CONFIG(supple_large_config), 1e-3f, 10.0f, {x, y, z}};
}

int main(void) {
    CHECK(sizeof(supple_followed_point) == 52);
    unsigned long checked = 0;
    for (uint32_t nodes = 1; nodes < 3000000; nodes += nodes / 7 + 1) {
        for (uint32_t element = SUPPLE_LINEAR; element <= SUPPLE_NODAL_STRAIN; element++) {
            CHECK(supple_settle_size(nodes) == SUPPLE_SETTLE_SIZE(nodes));
            CHECK(supple_pressure_size(nodes, element) == SUPPLE_PRESSURE_SIZE(nodes, element));
            CHECK(supple_pulls_size(nodes, 24 * element) == SUPPLE_PULLS_SIZE(nodes, 24 * element));
            CHECK(supple_pulls_size(element, nodes) == SUPPLE_PULLS_SIZE(element, nodes));
            CHECK(supple_state_size(nodes, element) == SUPPLE_STATE_SIZE(nodes, element));
        }
        /* As docs/sizes.md says: from 20 to 32 bytes for each element, and a little. */
        CHECK(supple_locate_size(nodes) >= 8 * (size_t)nodes && supple_locate_size(nodes) <= 32 * (size_t)nodes + 256);
        const supple_image_grid grid = {{0, 0, 0}, {1e-3, 1e-3, 1e-3}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {100, 90, nodes % 999 + 8}};
        const size_t at = 9000 * (size_t)grid.size[2];
        size_t alike, near;
        CHECK(supple_displacement_field_size(&grid, 0.0f, &alike, NULL) == SUPPLE_OK && alike <= 2 * at + 512);
        CHECK(supple_displacement_field_size(&grid, 1e-3f, &near, NULL) == SUPPLE_OK && near <= alike + 8 * at + 512);
        for (uint32_t fallback = 0; fallback < 2; fallback++) {
            CHECK(supple_learned_size(nodes, fallback) == SUPPLE_LEARNED_SIZE(nodes, fallback));
        }
        for (uint32_t elements = 1; elements < 12000000; elements += elements / 5 + 1) {
            for (uint32_t tissues = 1; tissues < 65536; tissues += 4 * tissues) {
                CHECK(supple_scene_size(nodes, elements, tissues) == SUPPLE_SCENE_SIZE(nodes, elements, tissues));
                CHECK(supple_patches_size(nodes, elements, tissues) == SUPPLE_PATCHES_SIZE(nodes, elements, tissues));
                CHECK(supple_prony_size(tissues) == SUPPLE_PRONY_SIZE(tissues));
                for (uint32_t element = SUPPLE_LINEAR; element <= SUPPLE_NODAL_STRAIN; element++) {
                    const uint32_t terms = tissues % 4;
                    CHECK(supple_fibres_size(nodes, elements, tissues, element) == SUPPLE_FIBRES_SIZE(nodes, elements, tissues, element));
                    CHECK(supple_relaxation_size(nodes, elements, tissues, element, terms) ==
                          SUPPLE_RELAXATION_SIZE(nodes, elements, tissues, element, terms));
                }
                checked++;
            }
        }
    }
    for (uint32_t forces = 0; forces < 5000; forces += forces / 3 + 1) {
        for (uint32_t motions = 0; motions < 5000; motions += motions / 3 + 1) {
            CHECK(supple_loads_size(forces, motions) == SUPPLE_LOADS_SIZE(forces, motions));
        }
    }

    const supple_scene_config config = bar_config();
    supple_scene *scene;
    CHECK(supple_scene_init(scene_memory, sizeof scene_memory, &config, &scene, NULL) == SUPPLE_OK);
    size_t most = 0;
    for (uint32_t x = 1; x < 5; x++) {
        for (uint32_t z = 1; z < 6; z++) {
            const supple_large_config large = large_of(x, x, z);
            size_t bytes = 0;
            const supple_status status = supple_large_size(scene, points[0], &large, &bytes, NULL);
            const size_t room = SUPPLE_LARGE_SIZE(NODES, TETS, x, x, z);
            if (status == SUPPLE_E_LATTICE) {
                CHECK((x + 1) * (x + 1) * (z + 1) > SUPPLE_LATTICE_FUNCTIONS);
                continue;
            }
            CHECK(status == SUPPLE_OK && bytes <= room && bytes > SUPPLE_LARGE_FRONT);
            most = room - bytes > most ? room - bytes : most;
        }
    }
    printf("sizes: %lu scenes equal; lattices at most %zu bytes more than needed\n", checked, most);
    return 0;
}
