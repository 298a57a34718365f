#pragma once
#include "hm/pipeline/flight/flight_messages.hpp"
#include "hm/sim/vehicle/vehicle.hpp"

namespace hm {

/// The simulated vehicle's motor controllers: they start and stop the motors on demand, which takes them a
/// while, and hold commanded speeds in between.
class MotorControllers {
 public:
  /// Time that starting and stopping take.
  static constexpr Duration kTransition{300'000'000};

  /// Takes a message; the newest counts.
  void receive(const MotorMessage& message);
  /// Command of the vehicle's rotors at a time, called once a step.
  VehicleCommand step(Time now);
  /// True when the controllers report that the motors turn.
  [[nodiscard]] bool motors_on() const { return is_on_; }

 private:
  MotorMessage message_;
  std::optional<Time> since_;  ///< of a transition
  bool is_on_ = false;
};

}  // namespace hm
