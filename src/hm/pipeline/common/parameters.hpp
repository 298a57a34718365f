#pragma once
#include <functional>
#include <memory>
#include <string>

#include "hm/core/params.hpp"

namespace hm {

/// The sections that one part of the program brings: values with their defaults, references to them, and what
/// contradicts.
struct ParameterPart {
  std::shared_ptr<void> values;
  ParamList list;
  std::function<Result<void>()> check;  ///< empty: nothing can contradict
};

/// A part made of a struct of values, the function that lists its sections, and check_parameters() where it
/// has one.
template <class Values>
ParameterPart make_parameter_part(ParamList (*list_of)(Values&)) {
  auto values = std::make_shared<Values>();
  ParameterPart part{values, list_of(*values), {}};
  if constexpr (requires { check_parameters(*values); })
    part.check = [values] { return check_parameters(*values); };
  return part;
}

/// Sets parameters from "section.key=value" each, and checks all of the list. An error names the setting.
Result<void> apply_settings(ParamList list, const std::vector<std::string>& settings);

/// The parameters of one level as a Markdown table for each section (docs/parameters.md).
std::string to_markdown(const ParamList& list, ParamLevel level);
/// One parameter in words: value, range or choices, help.
std::string explain(const ParamRef& param);

}  // namespace hm
