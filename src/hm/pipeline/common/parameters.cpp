#include "hm/pipeline/common/parameters.hpp"

#include <fmt/format.h>

#include <cmath>

namespace hm {
namespace {

std::string number_text(double value) {
  return std::abs(value) >= 1e6 ? fmt::format("{:.0e}", value) : fmt::format("{}", value);
}

/// The allowed values in words: "0.002 to 0.5", "projection, traversal", "true or false".
std::string allowed_text(const ParamRef& param) {
  if (const auto* choice = std::get_if<ChoiceRef>(&param.value))
    return fmt::format("{}", fmt::join(choice->names, ", "));
  if (std::holds_alternative<bool*>(param.value)) return "true or false";
  if (std::holds_alternative<std::string*>(param.value)) return "a text";
  const auto [low, high] = param.range;
  if (std::isfinite(low) && std::isfinite(high))
    return fmt::format("{} to {}", number_text(low), number_text(high));
  if (std::isfinite(low)) return fmt::format("at least {}", number_text(low));
  if (std::isfinite(high)) return fmt::format("at most {}", number_text(high));
  return "any number";
}

}  // namespace

Result<void> apply_settings(ParamList list, const std::vector<std::string>& settings) {
  for (const std::string& setting : settings)
    if (auto set = list.set(setting); !set) {
      set.error().where = setting;
      return set;
    }
  return list.check();
}

std::string to_markdown(const ParamList& list, ParamLevel level) {
  std::string out, section;
  for (const ParamRef& param : list.all()) {
    if (param.level != level) continue;
    const std::size_t dot = param.name.find('.');
    if (const std::string own = param.name.substr(0, dot); own != section) {
      out +=
          fmt::format("\n## {}\n| parameter | default | allowed | what it does |\n|---|---|---|---|\n", own);
      section = own;
    }
    out += fmt::format("| `{}` | `{}` | {} | {} |\n", param.name, value_text(param), allowed_text(param),
                       param.help);
  }
  return out;
}

std::string explain(const ParamRef& param) {
  return fmt::format("{} = {}\n  {}\n  allowed: {}\n", param.name, value_text(param), param.help,
                     allowed_text(param));
}

}  // namespace hm
