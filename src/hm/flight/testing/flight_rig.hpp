#pragma once
#include <deque>
#include <functional>
#include <memory>

#include "hm/control/testing/quadrotor_body.hpp"
#include "hm/core/rng.hpp"
#include "hm/flight/autopilot.hpp"

namespace hm {

/// A quadrotor with sensors, motor controllers and a flat floor, flown by an Autopilot: poses at 40 Hz 20 ms
/// late, heights at 40 Hz, IMU with orientation at 1 kHz. Members switch what goes wrong.
class FlightRig {
 public:
  explicit FlightRig(const AutopilotParams& params = {}, const QuadrotorBodySettings& body_settings = {});

  void run_ms(int count);
  /// Runs a step with a command of pilot 1 (if it names none) stamped now; returns why it was refused.
  Refusal send(FlightCommand command);
  Refusal send(CommandKind kind);
  Refusal send_mode(FlightPhase mode);
  Refusal go_to(float x_m, float y_m, float z_m, float yaw_rad = 0);
  Refusal fly_velocity(float x_m_s, float y_m_s, float z_m_s = 0);
  /// Engages and takes off; ends hovering 5 s later.
  void take_off();
  /// Millisecond `i` (from 0) of a flight that engages after 1.5 s, takes off after 2.5 s and gives control
  /// up.
  void take_off_step(int i);
  /// Steps until the condition holds; how many milliseconds that took, -1 if never within `most_ms`.
  template <class Condition>
  int ms_until(Condition condition, int most_ms) {
    for (int i = 0; i <= most_ms; ++i) {
      if (condition()) return i;
      run_ms(1);
    }
    return -1;
  }

  std::unique_ptr<Autopilot> autopilot;
  /// Called after each step of the autopilot, before the vehicle moves.
  std::function<void(const FlightRig&)> after_step;
  /// Another autopilot that drives the vehicle in place of this one, which still sees the same inputs.
  std::function<AutopilotOutputs(const AutopilotInputs&)> drive;
  QuadrotorBody body;
  Time now{1'000'000'000};
  AutopilotInputs inputs;  ///< of the last step
  bool imu = true, pose = true, height = true, motors_work = true, rc = true, alive = true, clearance = true;
  std::optional<float> battery_ratio, obstacle_m;
  float pose_turned_rad = 0, pose_shift_m = 0;
  double imu_ahead_s = 0;  ///< of the clock that stamps the IMU's samples
  double largest_tilt_rad = 0, hardest_touch_m_s = 0;
  Time last_pose, last_height;  ///< stamps of the last ones that were sent

  static constexpr double kFeet_m = 0.195;  ///< of the base when it stands
  [[nodiscard]] bool stands() const { return body.position.z() <= kFeet_m + 1e-9; }

 private:
  void sense();
  void step();
  void move(const AutopilotOutputs& outputs);
  void turn_motors(MotorDemand demand);
  Rng rng_{7}, imu_rng_{8};
  int steps_ = 0, motor_steps_ = 0;
  bool motors_on_ = false;
  std::deque<Eigen::Vector4d> past_;  // position and yaw of the last milliseconds
};

}  // namespace hm
