#pragma once
#include <limits>
#include <string_view>

namespace hm {

/// Allowed range of a number, both ends included.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
};

/// Audience of a parameter: `hm params show` lists the basic ones, with `--expert` all.
enum class ParamLevel { kExpert, kBasic };

/// Name, range and help text of one member of a parameter struct. The name ends with the unit (_m, _rad, _hz
/// ...).
struct ParamDoc {
  std::string_view name;
  Range range;
  std::string_view help;
  ParamLevel level = ParamLevel::kExpert;
};

}  // namespace hm
