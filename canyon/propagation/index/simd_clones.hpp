#pragma once

// Hot loops for the registers that the machine has (needs glibc's indirect functions). Sanitizers
// instrument the resolver that picks a clone before they are ready for it. Without it an epoch takes half as
// much time again; the results are the same.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__GLIBC__) && \
    !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__)
#define CANYON_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define CANYON_CLONES
#endif
