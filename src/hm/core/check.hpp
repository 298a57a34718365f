#pragma once
#include <fmt/core.h>

#include <string>

namespace hm {
[[noreturn]] void check_failed(const char* file, int line, const char* condition, const std::string& details);
}

/// Aborts with file, line, condition and a formatted message when a precondition is broken. Enabled in every
/// build type. For bugs only, never for bad input. Example: HM_CHECK(i < n, "i = {}, n = {}", i, n);
#define HM_CHECK(condition, ...)                                                         \
  do {                                                                                   \
    if (!(condition)) [[unlikely]]                                                       \
      ::hm::check_failed(__FILE__, __LINE__, #condition, ::fmt::format("" __VA_ARGS__)); \
  } while (false)
