#pragma once
/// WIENERTREE_CLONES before a function compiles it for AVX2 and AVX-512 as well and picks at load time. Only
/// for functions of plain IEEE operations in files compiled with -ffp-contract=off: every clone then returns
/// the same bits. Not under a sanitizer, whose run-time is not up yet when the choice is made.
#if defined(__x86_64__) && defined(__linux__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#if defined(__has_feature)
#if !__has_feature(address_sanitizer) && !__has_feature(thread_sanitizer) && !__has_feature(memory_sanitizer)
#define WIENERTREE_CLONES __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#endif
#else
#define WIENERTREE_CLONES __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#endif
#endif
#if !defined(WIENERTREE_CLONES)
#define WIENERTREE_CLONES
#endif
