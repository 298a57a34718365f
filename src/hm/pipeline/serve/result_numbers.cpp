#include "hm/pipeline/serve/result_numbers.hpp"

#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

namespace hm {
namespace {

constexpr std::size_t kMostCounts = 100;

/// The name without this ending, nothing if it has another one.
std::optional<std::string> without_ending(std::string_view name, std::string_view ending) {
  if (!name.ends_with(ending)) return std::nullopt;
  return std::string(name.substr(0, name.size() - ending.size()));
}

/// Adds a value that is a number.
void add_number(const std::string& name, const JsonValue& json, ResultNumbers& numbers) {
  const double value = json.number_or(std::numeric_limits<double>::quiet_NaN());
  if (!std::isfinite(value)) return;
  if (auto rate = without_ending(name, "_per_s"))
    numbers.rates_hz.emplace_back(std::move(*rate), value);
  else if (auto memory = without_ending(name, "_bytes"))
    numbers.memory.emplace_back(std::move(*memory), value);
  else if (numbers.counts.size() < kMostCounts)
    numbers.counts.emplace_back(name, value);
}

}  // namespace

ResultNumbers numbers_of_report(const JsonValue& report) {
  ResultNumbers numbers;
  if (!report.as_object()) return numbers;
  for (const auto& [name, value] : *report.as_object()) {
    add_number(name, value, numbers);
    if (!value.as_object() || name == "verdict") continue;
    if (auto stage = without_ending(name, "_ms")) {
      if (value.find("median"))
        numbers.stages_ms.emplace_back(std::move(*stage), value.number_at("median", 0));
      continue;
    }
    for (const auto& [part, of_part] : *value.as_object()) add_number(name + "." + part, of_part, numbers);
  }
  return numbers;
}

}  // namespace hm
