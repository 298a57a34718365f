#include "hm/pipeline/flight/motor_controllers.hpp"

namespace hm {

void MotorControllers::receive(const MotorMessage& message) { message_ = message; }

VehicleCommand MotorControllers::step(Time now) {
  const bool starts = message_.demand == MotorDemand::kStart && !is_on_;
  const bool stops = message_.demand == MotorDemand::kStop && is_on_;
  if (!starts && !stops) since_.reset();
  if ((starts || stops) && !since_) since_ = now;
  if (since_ && now - *since_ >= kTransition) is_on_ = starts;
  if (message_.demand == MotorDemand::kOff) is_on_ = false;
  VehicleCommand command;
  if (!is_on_) return command;
  for (std::size_t i = 0; i < kRotors; ++i)
    command.rotor_speed_rad_s[static_cast<Eigen::Index>(i)] =
        static_cast<double>(message_.rotor_speed_rad_s[i]);
  const RpytCommand& rpyt = message_.rpyt;
  command.attitude = {static_cast<double>(rpyt.roll_rad), static_cast<double>(rpyt.pitch_rad),
                      static_cast<double>(rpyt.yaw_rate_rad_s), static_cast<double>(rpyt.thrust_ratio)};
  return command;
}

}  // namespace hm
