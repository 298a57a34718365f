#pragma once
#include <string>
#include <utility>
#include <vector>

#include "hm/core/json_value.hpp"

namespace hm {

/// Numbers in the report of a finished run, named by its keys ("frames.integrated").
struct ResultNumbers {
  using Named = std::vector<std::pair<std::string, double>>;
  Named stages_ms;  ///< medians of the `*_ms`
  Named rates_hz;   ///< `*_per_s`
  Named memory;     ///< `*_bytes`
  Named counts;     ///< all other numbers, also those of objects; not of lists and of the verdict
};

/// Numbers of a report.json, in its order; of an object with more than 100 of them the first ones.
ResultNumbers numbers_of_report(const JsonValue& report);

}  // namespace hm
