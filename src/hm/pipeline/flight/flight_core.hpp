#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "hm/core/result.hpp"
#include "hm/flight/autopilot.hpp"

namespace hm {

/// Text message of an autopilot.
struct CoreText {
  bool is_warning = false;
  std::string text;
};

/// The autopilot that a flight is flown by: on this host, on an emulated board, or another one behind a link.
class FlightCore {
 public:
  virtual ~FlightCore() = default;
  /// How often tracking was lost before the pose of the next step (PoseMessage::restarts).
  virtual void note_restarts(std::uint8_t /*restarts*/) {}
  /// One step of 1 ms.
  virtual AutopilotOutputs step(const AutopilotInputs& inputs) = 0;
  /// Its estimate after the last step.
  [[nodiscard]] virtual BasicVehicleState<float> estimate() const = 0;
  /// Why it does not work any more (an emulator that ended); nothing while it works.
  [[nodiscard]] virtual std::optional<Error> failure() const { return std::nullopt; }
  /// All that it has said since the start.
  [[nodiscard]] virtual std::span<const CoreText> texts() const { return {}; }
};

/// The autopilot of this library, on this host.
std::unique_ptr<FlightCore> make_host_core(const AutopilotParams& params);

}  // namespace hm
