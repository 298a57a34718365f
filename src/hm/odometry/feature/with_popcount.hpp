#pragma once

/// Before a function: it is also compiled with the processor's bit count, which every x86-64 has since 2008
/// but compilers do not assume, and the right one is chosen when the program starts. Sanitizers instrument
/// the function that chooses, which runs before they are ready: with them there is one version only.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define HM_WITH_POPCOUNT __attribute__((target_clones("default", "popcnt")))
#else
#define HM_WITH_POPCOUNT
#endif
