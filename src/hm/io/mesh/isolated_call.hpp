#pragma once
#include <cstdint>
#include <functional>
#include <string>

#include "hm/core/result.hpp"

namespace hm {

/// Limits of a process that reads a file.
struct IsolationLimits {
  std::uint64_t memory_bytes = 0;  ///< address space besides what the calling process has
  int cpu_s = 0;                   ///< processor time; four times as much on the clock
};

/// Runs `work` in a process of its own (a fork) and returns its result, so that foreign code that crashes,
/// loops or takes too much memory on a malformed file costs that process only. What it prints is dropped; its
/// other effects on memory are lost. Errors: those of `work`; kCorrupted where the process crashed or took
/// longer than the limit; kInternal where there is no process to be had. Sanitized builds have no limit of
/// memory.
Result<std::string> call_isolated(const std::string& where, const IsolationLimits& limits,
                                  const std::function<Result<std::string>()>& work);

}  // namespace hm
