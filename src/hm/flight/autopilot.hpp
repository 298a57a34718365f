#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "hm/control/cascade.hpp"
#include "hm/control/published_controller.hpp"
#include "hm/estimation/state_estimator.hpp"
#include "hm/flight/command_gate.hpp"
#include "hm/flight/fail_safes.hpp"
#include "hm/flight/flight_state_machine.hpp"
#include "hm/flight/guidance.hpp"
#include "hm/flight/gyro_calibration.hpp"
#include "hm/flight/tilt_check.hpp"
#include "hm/flight/touchdown_detector.hpp"

namespace hm {

struct AutopilotParams {
  ControlLaw law = ControlLaw::kCascade;
  GuidanceParams guidance;
  CommandParams commands;
  FailSafeParams fail_safes;
  BasicStateEstimatorParams<float> estimator;
  CascadeParams cascade;
  PublishedControlParams published;
  QuadrotorModel vehicle;
  ImuMounting<float> imu;

  [[gnu::cold]] AutopilotParams();
  /// Only its own members; the parts are sections of their own.
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"law", {}, "controller of position and velocity: the default one, or the dissertation's"},
      self.law, kControlLawNames);
  }
};

/// Inputs that arrived since the last step.
struct AutopilotInputs {
  Time now;  ///< the vehicle's clock; each step later than the one before, nominally by 1 ms
  std::optional<InertialReading<float>> imu;
  std::optional<PoseReading<float>> pose;
  std::optional<BasicHeightReading<float>> height;
  std::optional<FlightCommand> command;
  bool motors_on = false;              ///< as the motor controllers report
  bool rc_enabled = true;              ///< switch of the remote control
  bool computer_alive = false;         ///< a sign of life of the on-board computer arrived
  std::optional<float> battery_ratio;  ///< remaining charge, 0 to 1
  std::optional<float> clearance_m;    ///< feet above the ground
  std::optional<float> obstacle_m;     ///< free way in the direction of flight
};

struct AutopilotOutputs {
  Time stamp;
  MotorDemand motors = MotorDemand::kOff;
  std::array<float, 4> rotor_speed_rad_s{};  ///< 0 unless the motors are to turn
  RpytCommand rpyt;                          ///< for vehicles with an inner loop of their own
  MotionReference reference;                 ///< what the position controller follows, in `odom`
  AutopilotState state = AutopilotState::kOff;
  FlightPhase phase = FlightPhase::kGround;
  SafetyVerdict safety;
  std::optional<float> tilt_mismatch_rad;  ///< angle by which the position sensor seems turned
  Refusal refusal = Refusal::kNone;        ///< of this step's command
  std::uint32_t invalid_inputs = 0;        ///< ignored so far: no numbers, stamps backward or twice
};

/// The autopilot: estimator, state machine, fail-safes, guidance and controllers. One call of `step` each
/// millisecond; no clock, heap, input or output of its own, the same bits on a host and on a microcontroller.
/// Invalid input is ignored and counted; no output is ever anything but a finite number.
class Autopilot {
 public:
  [[gnu::cold]] explicit Autopilot(const AutopilotParams& params = {});
  const AutopilotOutputs& step(const AutopilotInputs& inputs);
  [[nodiscard]] const AutopilotOutputs& outputs() const { return outputs_; }
  [[nodiscard]] const BasicVehicleState<float>& estimate() const { return state_; }
  [[nodiscard]] const CommandGate& gate() const { return gate_; }
  [[nodiscard]] const FlightStateMachine& machine() const { return machine_; }
  [[nodiscard]] const Guidance& guidance() const { return guidance_; }
  [[nodiscard]] const Cascade& cascade() const { return cascade_; }

 private:
  void estimate(const AutopilotInputs& inputs);
  void take_imu(InertialReading<float> imu);
  void take_pose(const PoseReading<float>& pose);
  void take_height(const BasicHeightReading<float>& height);
  [[nodiscard]] bool is_newer(Time stamp, const std::optional<Time>& used);
  [[nodiscard]] PoseReading<float> turn_back(const PoseReading<float>& pose);
  [[nodiscard]] bool is_doubtful(const PoseReading<float>& pose);
  [[nodiscard]] bool jumps(const PoseReading<float>& pose) const;
  void check_tilt(const ControlState& state);
  [[nodiscard]] ControlState control_state() const;
  [[nodiscard]] Refusal may_take_off(const AutopilotInputs& inputs) const;
  [[nodiscard]] Refusal obey(const FlightCommand& command, const AutopilotInputs& inputs);
  [[nodiscard]] Refusal obey_in_flight(const FlightCommand& command);
  [[nodiscard]] Refusal change_mode(FlightPhase mode);
  [[nodiscard]] float cos_tilt_error() const;
  [[nodiscard]] SafetyInputs safety_inputs(const AutopilotInputs& inputs) const;
  void respond(const SafetyVerdict& verdict);
  void follow_phase();
  void fly();
  void find_ground();
  void publish(Refusal refusal);

  // The parameters that no part below keeps.
  ControlLaw law_;
  float idle_speed_rad_s_;
  FailSafeParams limits_;
  FilterMatrix<float, 3> R_base_imu_;

  BoardEstimator estimator_;
  FlightStateMachine machine_;
  FailSafes fail_safes_;
  CommandGate gate_;
  Guidance guidance_;
  TouchdownDetector touchdown_;
  TiltCheck tilt_;
  GyroCalibration gyro_;
  PublishedController published_;
  Cascade cascade_;

  bool started_ = false, e_stop_ = false, computer_seen_ = false;
  Time now_, pose_at_, height_at_, imu_at_, set_point_at_, computer_at_;
  std::optional<Time> pose_used_, height_used_;  // stamps of the last that the estimator took
  std::optional<Time> refused_since_, jumped_at_, mismatch_since_;
  std::optional<PoseReading<float>> last_pose_;
  std::optional<float> turned_rad_;           // by which the poses' sensor is turned; latched in the air
  Vec3f turned_back_m_ = Vec3f::Zero();       // the last pose, turned back
  FlightPhase phase_ = FlightPhase::kGround;  // that guidance has entered
  SafetyAction action_ = SafetyAction::kNone;
  FailSafe action_reason_ = FailSafe::kEStop;
  BasicVehicleState<float> state_;
  Attitude attitude_;  // of its angles
  Vec3f specific_force_m_s2_ = Vec3f(0, 0, kGravityF_m_s2);
  Vec3f last_rates_rad_s_ = Vec3f::Zero(), last_force_m_s2_ = Vec3f::Zero();  // of the IMU as it is mounted
  std::optional<float> clearance_m_;
  float carried_m_s2_ = 0;
  float takeoff_height_m_ = 0, battery_ratio_ = 1;
  bool battery_known_ = false;
  AutopilotOutputs outputs_;
};

}  // namespace hm
