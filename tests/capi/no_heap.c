/* Linked with a program that shall not use the heap, with malloc and its kin wrapped: whoever asks ends the program. */
#include <stdio.h>
#include <stdlib.h>

void *__wrap_malloc(size_t bytes);
void *__wrap_calloc(size_t count, size_t bytes);
void *__wrap_realloc(void *old, size_t bytes);
void *__wrap_aligned_alloc(size_t alignment, size_t bytes);
int __wrap_posix_memalign(void **memory, size_t alignment, size_t bytes);

static void *refuse(size_t bytes) {
    fprintf(stderr, "somebody asks for %zu bytes of heap\n", bytes);
    exit(1);
}

void *__wrap_malloc(size_t bytes) { return refuse(bytes); }
void *__wrap_calloc(size_t count, size_t bytes) { return refuse(count * bytes); }
void *__wrap_realloc(void *old, size_t bytes) { return (void)old, refuse(bytes); }
void *__wrap_aligned_alloc(size_t alignment, size_t bytes) { return (void)alignment, refuse(bytes); }
int __wrap_posix_memalign(void **memory, size_t alignment, size_t bytes) {
    return (void)memory, (void)alignment, (void)refuse(bytes), 1;
}
