/* What the tests of the C API share: a bar of the paper's exponential tissue in static memory, fixed at one end, whose other end
 * can be moved; a check that names its line; a hash, to see that nothing has changed. */
#ifndef BODY_H
#define BODY_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <supple.h>

#define CHECK(condition)                                                                                               \
    do {                                                                                                               \
        if (!(condition)) {                                                                                            \
            fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition);                                    \
            exit(1);                                                                                                   \
        }                                                                                                              \
    } while (0)

#ifndef ELEMENT
#define ELEMENT SUPPLE_NODAL_PRESSURE
#endif

#ifdef SMALL /* for valgrind, which takes fifty times as long */
enum { X = 3, Y = 3, Z = 6, PARTS = 1 };
#else /* enough elements for four parts */
enum { X = 8, Y = 8, Z = 16, PARTS = 4 };
#endif
enum {
    LAYER = (X + 1) * (Y + 1),
    NODES = LAYER * (Z + 1),
    TETS = 6 * X * Y * Z,
    FORCES = 8,
    MOTIONS = LAYER
};

/* Bytes of the bar's scene. */
#define SCENE_SIZE                                                                                                     \
    (SUPPLE_SCENE_SIZE(NODES, TETS, 1) + (ELEMENT == SUPPLE_NODAL_STRAIN ? SUPPLE_PATCHES_SIZE(NODES, TETS, 1) : 0))

static float points[NODES][3];
static uint32_t tets[TETS][4];
static supple_support supports[2 * LAYER];
static const supple_tissue tissue = {{59.0f, 8.023f, 60000.0f}, 1000.0f};

static inline supple_scene_config bar_config(void) {
    for (uint32_t n = 0; n < NODES; n++) {
        points[n][0] = 0.01f * (float)(n % (X + 1));
        points[n][1] = 0.01f * (float)(n / (X + 1) % (Y + 1));
        points[n][2] = 0.01f * (float)(n / LAYER);
    }
    static const uint32_t step[3] = {1, X + 1, LAYER};
    static const uint32_t walk[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 2}, {2, 1}, {1, 0}};
    for (uint32_t t = 0; t < TETS; t++) {
        const uint32_t cell = t / 6, even = t % 6 < 3;
        const uint32_t a = cell % X + (X + 1) * (cell / X % Y) + LAYER * (cell / X / Y);
        const uint32_t b = a + step[walk[t % 6][0]], c = b + step[walk[t % 6][1]];
        tets[t][0] = a, tets[t][1] = even ? b : c, tets[t][2] = even ? c : b, tets[t][3] = a + 1 + (X + 1) + LAYER;
    }
    for (uint32_t n = 0; n < LAYER; n++) {
        supports[n] = (supple_support){n, 7, 0};
        supports[LAYER + n] = (supple_support){NODES - LAYER + n, 7, 1};
    }
    return (supple_scene_config){SUPPLE_CONFIG(supple_scene_config), SUPPLE_EXPONENTIAL, SUPPLE_WINDING_CHECKED, NODES, TETS,
                                 2 * LAYER, 1, points[0], tets[0], supports, &tissue, NULL, ELEMENT, 0, NULL, NULL, NULL, NULL};
}

#ifdef UNDER_VALGRIND
/* valgrind 3.19 does not know an encoding of vmovq that kernels for AVX2 have. */
__attribute__((constructor)) static void use_portable_kernels(void) { supple_set_level(SUPPLE_LEVEL_PORTABLE); }
#endif

/* All motions of the moved end, to the same displacement, m. */
static inline void move_end(supple_scene *scene, supple_loads *loads, float x, float y, float z) {
    supple_motion motions[MOTIONS];
    for (uint32_t n = 0; n < MOTIONS; n++) {
        motions[n] = (supple_motion){NODES - LAYER + n, 7, {x, y, z}, 0.0f};
    }
    CHECK(supple_set_motions(loads, scene, motions, MOTIONS, NULL) == SUPPLE_OK);
}

/* The checksum of a saved state. */
static inline uint32_t crc32_of(const unsigned char *bytes, size_t count) {
    uint32_t sum = ~0u;
    for (size_t at = 0; at < count; at++) {
        sum ^= bytes[at];
        for (int bit = 0; bit < 8; bit++) {
            sum = sum >> 1 ^ (sum & 1 ? 0xedb88320u : 0u);
        }
    }
    return ~sum;
}

/* A whole file at a multiple of 64 bytes; `bytes` receives its length. */
static inline const void *file(const char *path, void *room, size_t most, size_t *bytes) {
    FILE *from = fopen(path, "rb");
    CHECK(from != NULL);
    *bytes = fread(room, 1, most, from);
    CHECK(*bytes > 0 && *bytes < most);
    fclose(from);
    return room;
}

/* FNV-1a, over words while there are any. */
static inline uint64_t hash(const void *memory, size_t bytes) {
    const unsigned char *at = memory;
    uint64_t sum = 0xcbf29ce484222325u, word;
    for (; bytes >= sizeof word; at += sizeof word, bytes -= sizeof word) {
        memcpy(&word, at, sizeof word);
        sum = (sum ^ word) * 0x100000001b3u;
    }
    for (; bytes > 0; at++, bytes--) {
        sum = (sum ^ *at) * 0x100000001b3u;
    }
    return sum;
}

#endif
