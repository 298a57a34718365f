# Language, warnings, build type, compiler cache, sanitizers.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
# Under sanitizers: soon compiled, with the assertions of Eigen and the standard library, and lines in what is printed.
set(CMAKE_CXX_FLAGS_CHECKED "-O1 -g1 -D_GLIBCXX_ASSERTIONS")
if(NOT DEFINED HM_CCACHE)
  # Looked for once: with a launcher that comes later everything would be compiled again.
  find_program(HM_CCACHE ccache)
endif()
if(HM_CCACHE AND PROJECT_IS_TOP_LEVEL)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${PROJECT_SOURCE_DIR}/cmake/compile_cached.sh ${PROJECT_SOURCE_DIR} ${HM_CCACHE})
endif()

add_library(hm_settings INTERFACE)
# Of tests, to be linked after hm_settings.
add_library(hm_test_settings INTERFACE)
# No contraction to fused multiply-add: SIMD and scalar code, and every CPU, give the same bits.
target_compile_options(hm_settings INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror -ffp-contract=off -fno-math-errno)
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64")
  # Tells Highway that the processor's features cannot be asked for: it compiles its kernels for NEON alone, which every
  # 64-bit ARM has, not for SVE, whose vectors have no fixed size and cannot be kept in arrays and structs.
  target_compile_definitions(hm_settings INTERFACE TOOLCHAIN_MISS_SYS_AUXV_H)
endif()
if(HM_UNITY)
  # A file that is included by a unit is no header, though g++ takes it for one.
  target_compile_options(hm_settings INTERFACE $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-subobject-linkage>)
endif()
if(HM_SANITIZE)
  # Warnings are for the other builds, where they are errors: instrumented code makes g++ 12 warn of uninitialised members
  # inside the standard library, and clang warns of other things.
  target_compile_options(hm_settings INTERFACE -fsanitize=${HM_SANITIZE} -fno-sanitize-recover=all
                         -fno-omit-frame-pointer -Wno-error $<$<COMPILE_LANG_AND_ID:CXX,Clang>:-w>)
  # The compilers have no common way to ask for it.
  target_compile_definitions(hm_settings INTERFACE HM_SANITIZED)
  if(HM_SANITIZE MATCHES "undefined")
    # Checks that cost much compile time and find little: the address sanitizer reports null pointers and what is read
    # through pointers beyond an object.
    target_compile_options(hm_settings INTERFACE -fno-sanitize=vptr,object-size,null,pointer-overflow)
    # The rooms keep this one. After those above, as the last one counts.
    target_compile_options(hm_test_settings INTERFACE -fno-sanitize=alignment)
  endif()
  target_link_options(hm_settings INTERFACE -fsanitize=${HM_SANITIZE})
endif()
if(HM_COVERAGE)
  target_compile_options(hm_settings INTERFACE --coverage)
  target_link_options(hm_settings INTERFACE --coverage)
endif()

# Headers that nearly every file reads, parsed once; each file still includes what it uses (scripts/check_includes.py
# sees what these would hide).
set(hm_precompiled <algorithm> <array> <chrono> <cmath> <cstdint> <deque> <filesystem> <functional> <limits> <map> <memory>
    <mutex> <optional> <set> <span> <string> <string_view> <unordered_map> <utility> <variant> <vector>
    <Eigen/Core> <Eigen/Geometry> <fmt/format.h> <tl/expected.hpp>)
