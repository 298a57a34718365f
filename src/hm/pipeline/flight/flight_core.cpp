#include "hm/pipeline/flight/flight_core.hpp"

namespace hm {
namespace {

class HostCore : public FlightCore {
 public:
  explicit HostCore(const AutopilotParams& params) : autopilot_(params) {}
  AutopilotOutputs step(const AutopilotInputs& inputs) override { return autopilot_.step(inputs); }
  [[nodiscard]] BasicVehicleState<float> estimate() const override { return autopilot_.estimate(); }

 private:
  Autopilot autopilot_;
};

}  // namespace

std::unique_ptr<FlightCore> make_host_core(const AutopilotParams& params) {
  return std::make_unique<HostCore>(params);
}

}  // namespace hm
