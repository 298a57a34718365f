#pragma once
#include <cstdint>
#include <string>

#include "hm/pipeline/common/run_records.hpp"

namespace hm {

/// Messages of a stage of a flight.
struct StageCounts {
  std::string stage;
  std::uint64_t in = 0, out = 0;
  std::uint64_t dropped = 0;  ///< lost on a link, damaged, refused or without a result
};

/// Latencies or ages of a stage of a flight.
struct StageLatency {
  std::string stage;
  Summary latency_s;
};

}  // namespace hm
