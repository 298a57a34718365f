#pragma once

/// Function attribute that also compiles a version with the popcnt instruction (available on x86-64 since
/// 2008, but not assumed by compilers) and selects one at program start. Disabled with sanitizers, since the
/// selecting function runs before they are initialised.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(HM_SANITIZED)
#define HM_WITH_POPCOUNT __attribute__((target_clones("default", "popcnt")))
#else
#define HM_WITH_POPCOUNT
#endif
