#pragma once
#include <array>
#include <cstdint>
#include <limits>

#include "hm/control/attitude_controller.hpp"
#include "hm/control/expected_response.hpp"
#include "hm/control/hover_thrust.hpp"
#include "hm/control/mixer.hpp"
#include "hm/control/position_controller.hpp"
#include "hm/control/setpoint_shaper.hpp"

namespace hm {

/// Output of the cascade: speeds of the four rotors, or attitude and thrust for a vehicle with an inner loop
/// of its own.
enum class CascadeOutputKind : std::uint8_t { kRotors, kAttitudeThrust };
inline constexpr std::array<std::string_view, 2> kCascadeOutputKindNames{"rotors", "attitude_thrust"};

struct CascadeParams {
  CascadeOutputKind output = CascadeOutputKind::kRotors;
  float tilt_gain_ratio = 1;
  float tilt_response_s = 0.07F;
  float thrust_response_s = 0.02F;  ///< time constant with which vertical acceleration follows its command
  float tilt_slew_rad_s = 10;
  float yaw_slew_rad_s2 = 20;       ///< maximum change of the yaw rate command in a second
  float thrust_slew_per_s = 5;      ///< maximum change of the thrust in a second, per full thrust
  float rotor_slew_rad_s2 = 60000;  ///< maximum change of a rotor's commanded speed in a second
  ShaperParams shaper;
  PositionParams position;
  AttitudeParams attitude;
  HoverThrustParams hover;

  /// Only its own members; the parts are sections of their own.
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"output", {}, "what the vehicle takes"}, self.output, kCascadeOutputKindNames);
    v(ParamDoc{"tilt_gain_ratio", {0.3, 2}, "tilt that the inner loop settles at, per commanded tilt"},
      self.tilt_gain_ratio);
    v(ParamDoc{"tilt_response_s",
               {0, 1},
               "time constant with which horizontal acceleration follows its command"},
      self.tilt_response_s);
    v(ParamDoc{"tilt_slew_rad_s", {0.1, 1000}, "maximum change of the roll and pitch commands in a second"},
      self.tilt_slew_rad_s);
  }
};

/// The vehicle as the estimator sees it. Position and velocity in the odom frame, rates and specific force
/// (what an accelerometer at rest measures is +9.81 upwards) in the base frame.
struct ControlState {
  Vec3f position_m = Vec3f::Zero(), velocity_m_s = Vec3f::Zero();
  Attitude attitude;
  Vec3f rates_rad_s = Vec3f::Zero();
  Vec3f specific_force_m_s2 = Vec3f(0, 0, kGravityF_m_s2);
  /// Off the ground: integrals and hover thrust learn. On the ground they stand.
  bool airborne = false;
  /// The ground may carry part of the weight: the hover thrust does not learn, since it would take the
  /// ground's force for the rotors' and hide the touch-down.
  bool may_touch_ground = false;
};

/// Roll, pitch, yaw rate, thrust: command of the inner loop. Thrust as a share of what all rotors give at
/// full speed.
struct RpytCommand {
  float roll_rad = 0, pitch_rad = 0, yaw_rate_rad_s = 0, thrust_ratio = 0;
};

/// Limits for the moment, below those of the parameters; the defaults do not limit.
struct FlightLimits {
  float speed_m_s = 1e3F, climb_m_s = 1e3F, sink_m_s = 1e3F;
  float tilt_rad = kPiF;
  float thrust_ratio = 1;  ///< upper limit; falls to 0 while a landed vehicle's rotors are slowed down
};

/// Set-point of the cascade. Vertical kDisabled stops the rotors; horizontal kDisabled is level, heading
/// kDisabled does not turn.
struct CascadeCommand {
  FlightModes modes;
  MotionGoal goal;     ///< of axes in kPosition and kVelocity
  RpytCommand direct;  ///< of axes in kDirect: roll and pitch, yaw rate, thrust
  /// Whether `goal` passes the set-point shaper. If not, the goal is a moment of a motion that is within
  /// limits already (position, velocity, yaw, yaw rate), with this acceleration.
  bool shaped = true;
  Vec3f acceleration_m_s2 = Vec3f::Zero();
  FlightLimits limits;
};

struct CascadeOutput {
  RpytCommand rpyt;                           ///< always
  std::array<float, 4> rotor_speed_rad_s{};   ///< with CascadeOutputKind::kRotors; order as RotorLayout
  std::array<float, 4> rotor_thrust_ratio{};  ///< the same as thrust per thrust at full speed, 0 to 1
  MotionReference reference;                  ///< what the position controller follows
  Vec3f specific_force_m_s2 = Vec3f::Zero();  ///< commanded, odom frame, after all limits
  float hover_thrust_ratio = 0;               ///< estimated thrust that carries the vehicle, per full thrust
  float lagged_thrust_ratio = 0;              ///< thrust that the rotors have by now, per full thrust
  bool tilt_limited = false, thrust_limited = false, yaw_limited = false;
};

/// The default controller, one step per `step_s` (1 ms): shaped set-points, position, velocity with drag fed
/// forward, thrust vector, attitude, rates, rotors. Every output has a limit and a slew limit. Changes of
/// modes start from the command in force, so that no output jumps.
///
/// Input that is no number changes nothing: the last output stands (bad state) or the last good command (bad
/// command), and is counted.
class Cascade {
 public:
  [[gnu::cold]] Cascade(const CascadeParams& params, const QuadrotorModel& model, float step_s = 0.001F);
  /// As constructed: rotors stopped, nothing learned.
  [[gnu::cold]] void reset();
  /// Tells what another controller commands, so that the next step continues from there.
  [[gnu::cold]] void start_from(const ControlState& state, const RpytCommand& current);
  const CascadeOutput& step(const ControlState& state, const CascadeCommand& command);
  [[nodiscard]] const CascadeOutput& output() const { return output_; }
  [[nodiscard]] Vec3f stopping_point() const { return shaper_.stopping_point(); }
  [[nodiscard]] Vec3f integral_m_s2() const { return position_.integral_m_s2(); }
  [[nodiscard]] std::uint32_t bad_states() const { return bad_states_; }
  [[nodiscard]] std::uint32_t bad_commands() const { return bad_commands_; }

 private:
  struct Wanted {
    float roll_rad, pitch_rad, yaw_rate_rad_s, thrust_n;
    Vec3f specific_force_m_s2;  // within the position controller's limits
  };
  [[nodiscard]] Vec3f direction_of(const RpytCommand& command, float yaw_rad) const;
  [[nodiscard]] Vec3f force_of(const RpytCommand& command, float yaw_rad) const;
  void restart_changed_axes(const ControlState& state, float yaw_rad);
  const MotionReference& refer(const ControlState& state, float yaw_rad);
  PositionErrors errors_of(const MotionReference& reference, const ControlState& state);
  Wanted want(const ControlState& state, float yaw_rad);
  void limit(const Wanted& wanted, float yaw_rad);
  float drive_rotors(const ControlState& state, float yaw_rad);
  void stop_rotors();
  void learn(const ControlState& state, const Wanted& wanted, float yaw_rad, float thrust_n);

  CascadeParams params_;
  QuadrotorModel model_;
  float step_s_, full_thrust_n_;
  SetpointShaper shaper_;
  ExpectedResponse expected_;
  PositionController position_;
  AttitudeController attitude_;
  HoverThrust hover_;
  Mixer mixer_;
  SlewLimiter roll_, pitch_, yaw_rate_, thrust_;
  std::array<SlewLimiter, 4> rotors_;
  CascadeCommand command_;
  FlightModes modes_;  // of the last step
  MotionReference exact_;
  CascadeOutput output_;
  std::uint32_t bad_states_ = 0, bad_commands_ = 0;
};

}  // namespace hm
