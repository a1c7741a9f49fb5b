#pragma once

// Hot loops compiled with and without AVX2; the program takes one when it starts (needs glibc's indirect
// functions). Neither has fused multiplications, so that both give the same bytes. Sanitizers instrument the
// resolver that picks a clone before they are ready for it. Without AVX2 an epoch takes half as much time
// again.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__GLIBC__) && \
    !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__)
#define CANYON_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define CANYON_CLONES
#endif
