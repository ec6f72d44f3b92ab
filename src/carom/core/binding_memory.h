/* Resizable memory for the Python bindings: the core's `Resize` function. */

#pragma once

#include <stdlib.h>
#include <string.h>
#if defined(__linux__)
#include <sys/mman.h>
#endif

/* Enlarge memory as `realloc` does, and keep its first `used` bytes. Size 0 frees the memory.

   Fresh memory in small pages costs as much time as the rest of recording, and `realloc` never moves memory to large
   pages. So from a few megabytes on, the rows are copied to new memory in large pages. From a gigabyte on, memory is
   too scarce for a second copy. */
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
