/* Resizable memory for the Python bindings: the core's `Resize` function. */

#pragma once

#include <stdlib.h>
#include <string.h>
#if defined(__linux__)
#include <sys/mman.h>
#endif

/* Enlarge memory as `realloc` does, and keep its first `used` bytes. Size 0 frees the memory.

   If the memory of recorded rows had small pages, page faults would double the time of recording, and `realloc` never
   moves memory to large pages. So memory of 4 megabytes to a gigabyte is allocated in large pages, and the rows are
   copied there. Larger sizes are excluded, because memory may not suffice for two copies. */
static void *carom_enlarge(void *memory, size_t used, size_t size) {
#if defined(__linux__)
    void *fresh;
    if (size >= (size_t)4 << 20 && size <= (size_t)1 << 30 && posix_memalign(&fresh, (size_t)2 << 20, size) == 0) {
        madvise(fresh, size, MADV_HUGEPAGE);
        if (used > 0)
            memcpy(fresh, memory, used);
        free(memory);
        return fresh;
    }
#endif
    (void)used;
    if (size == 0) { /* `realloc` with size 0 need not free the memory */
        free(memory);
        return NULL;
    }
    return realloc(memory, size);
}
