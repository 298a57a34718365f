#include "hm/link/parameter_server.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/link/codec/mavlink_enums.hpp"

namespace hm {
namespace {

constexpr std::size_t kMaxNameLetters = 16;

std::string_view name_in(const std::array<char, kMaxNameLetters>& field) {
  return {field.data(), static_cast<std::size_t>(std::ranges::find(field, '\0') - field.begin())};
}

}  // namespace

ParameterServer::ParameterServer(std::vector<LinkParameter> parameters)
    : parameters_(std::move(parameters)), queued_(parameters_.size()) {
  for (const LinkParameter& parameter : parameters_)
    HM_CHECK(!parameter.name.empty() && parameter.name.size() <= kMaxNameLetters, "{}", parameter.name);
}

std::optional<std::size_t> ParameterServer::find(std::string_view name) const {
  const auto found = std::ranges::find(parameters_, name, &LinkParameter::name);
  if (found == parameters_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - parameters_.begin());
}

void ParameterServer::queue(std::size_t index) { queued_[index] = true; }

void ParameterServer::receive(const MavParamRequestList&) {
  queued_.assign(queued_.size(), true);
  at_ = 0;
}

void ParameterServer::receive(const MavParamRequestRead& request) {
  if (request.param_index >= 0) {
    if (static_cast<std::size_t>(request.param_index) < parameters_.size())
      queue(static_cast<std::size_t>(request.param_index));
  } else if (const auto index = find(name_in(request.param_id))) {
    queue(*index);
  }
}

void ParameterServer::receive(const MavParamSet& request) {
  const auto index = find(name_in(request.param_id));
  if (!index) return;
  LinkParameter& parameter = parameters_[*index];
  const float value = request.param_value;
  const bool whole = !parameter.is_integer || value == std::round(value);
  if (whole && value >= parameter.min && value <= parameter.max && value != parameter.value) {  // no NaN
    parameter.value = value;
    if (changed) changed(parameter);
  }
  queue(*index);
}

std::optional<MavParamValue> ParameterServer::next() {
  for (std::size_t tried = 0; tried < queued_.size(); ++tried) {
    const std::size_t index = at_;
    at_ = (at_ + 1) % queued_.size();
    if (!queued_[index]) continue;
    queued_[index] = false;
    const LinkParameter& parameter = parameters_[index];
    MavParamValue answer;
    std::ranges::copy(parameter.name, answer.param_id.begin());
    answer.param_value = parameter.value;
    answer.param_type = parameter.is_integer ? kMavParamInt32 : kMavParamFloat;
    answer.param_count = static_cast<std::uint16_t>(parameters_.size());
    answer.param_index = static_cast<std::uint16_t>(index);
    return answer;
  }
  return std::nullopt;
}

}  // namespace hm
