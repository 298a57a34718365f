#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hm/link/codec/mavlink_commands.hpp"

namespace hm {

/// A parameter that a ground station may read and set.
struct LinkParameter {
  std::string name;  ///< at most 16 letters
  float value = 0, min = 0, max = 0;
  bool is_integer = false;
};

/// Answers the parameter protocol (mavlink.io, "Parameter Protocol"). What is asked for is queued; next()
/// gives one answer at a time, so that a list does not fill the line.
class ParameterServer {
 public:
  explicit ParameterServer(std::vector<LinkParameter> parameters);

  void receive(const MavParamRequestList& request);
  /// By index, or by name if the index is negative. Unknown ones are not answered.
  void receive(const MavParamRequestRead& request);
  /// A value that is NaN, out of range, or not whole where it has to be changes nothing; the answer is the
  /// value that holds. `changed` is called for one that does change.
  void receive(const MavParamSet& request);
  std::optional<MavParamValue> next();

  [[nodiscard]] const std::vector<LinkParameter>& parameters() const { return parameters_; }
  std::function<void(const LinkParameter&)> changed;

 private:
  void queue(std::size_t index);
  [[nodiscard]] std::optional<std::size_t> find(std::string_view name) const;

  std::vector<LinkParameter> parameters_;
  std::vector<bool> queued_;
  std::size_t at_ = 0;
};

}  // namespace hm
