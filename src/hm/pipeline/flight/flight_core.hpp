#pragma once
#include <memory>
#include <optional>

#include "hm/core/result.hpp"
#include "hm/flight/autopilot.hpp"

namespace hm {

/// The autopilot that a flight is flown by: on this host, on an emulated board, or another one behind a link.
class FlightCore {
 public:
  virtual ~FlightCore() = default;
  /// One step of 1 ms.
  virtual AutopilotOutputs step(const AutopilotInputs& inputs) = 0;
  /// Its estimate after the last step.
  [[nodiscard]] virtual BasicVehicleState<float> estimate() const = 0;
  /// Why it does not work any more (an emulator that ended); nothing while it works.
  [[nodiscard]] virtual std::optional<Error> failure() const { return std::nullopt; }
};

/// The autopilot of this library, on this host.
std::unique_ptr<FlightCore> make_host_core(const AutopilotParams& params);

}  // namespace hm
