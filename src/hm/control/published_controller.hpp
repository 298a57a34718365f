#pragma once
#include <array>
#include <cstdint>

#include "hm/control/axis_mode.hpp"
#include "hm/control/cascade.hpp"
#include "hm/core/param_doc.hpp"

namespace hm {

/// Gains of one axis of eq. 2.18. Units: output (rad, rad/s, or percent of full thrust) per unit of error,
/// and per its integral and rate.
struct PiDGains {
  float kp = 0, ki = 0, kd = 0;
  float d_base = 1;        ///< the D gain is kd (1/d_base)^|error|: less damping far from the goal
  float bias = 0;          ///< output at rest
  float max_integral = 0;  ///< of the integral of the error, before ki
  float max_error = 1;     ///< errors are clamped to this
};

/// One axis of the dissertation's controller, 2.3.2: position by PI-D, eq. 2.18 and Fig. 2.7,
///
///     u = bias + kp e + ki Int e dt - kd (1/d_base)^|e| v
///
/// with the D term on the measured velocity (eq. 2.17), so that a step of the set-point causes no kick;
/// velocity and yaw by the same law with kd = 0 (PI).
///
/// Against windup, the integral stops as long as it would drive the output further beyond what left the
/// limits (`applied`), besides its own limit. continue_from() makes the next output equal to a given one;
/// what the integral may not hold of the difference fades with kFade_s.
class PiD {
 public:
  static constexpr float kFade_s = 0.3F;
  PiD(const PiDGains& gains, float step_s);
  void reset();
  /// Another law from the next step on; continue_from() keeps its output from jumping.
  void change_gains(const PiDGains& gains);
  /// Output for this error and measured velocity; numbers only.
  float step(float error, float velocity);
  /// Ends the step: the output after limits.
  void applied(float output);
  /// From the next step on the output continues from this one.
  void continue_from(float output);
  [[nodiscard]] float integral() const { return integral_; }
  /// The D gain at an error.
  [[nodiscard]] float damping(float error) const;

 private:
  PiDGains gains_;
  float step_s_, log_base_, fade_;
  float integral_ = 0, error_ = 0, output_ = 0;
  float offset_ = 0, start_ = 0;
  bool starting_ = false;
};

/// Modes of the four axes: x (pitch), y (roll), z (thrust), yaw. Position and velocity loops close along x
/// and y of the base frame turned level, as published. Default: what the author's launch file sets.
struct PublishedModes {
  AxisMode x = AxisMode::kPosition, y = AxisMode::kPosition, z = AxisMode::kPosition,
           yaw = AxisMode::kPosition;
  friend bool operator==(const PublishedModes&, const PublishedModes&) = default;
};
/// The author's service setCtrlType(Velocity): all axes but z, which stays in kPosition.
[[nodiscard]] PublishedModes published_velocity_modes();

/// The author's gains as launched on the CityFlyer; limits and slew limits of the outputs. Thrust in percent.
/// They belong to that vehicle and its inner loop, so they are no parameters of the program.
struct PublishedControlParams {
  PiDGains position_xy{0.4F, 0.2F, 0.7F, 2.6F, 0, 0.1F, 0.5F};
  PiDGains velocity_x{0.3F, 0.1F, 0, 1, -0.03F, 0.1F, 1};
  PiDGains velocity_y{0.3F, 0.1F, 0, 1, 0, 0.1F, 1};
  PiDGains position_z{20, 5, 25, 1, 48.5F, 0.25F, 1};
  PiDGains velocity_z{20, 0, 0, 1, 48.3F, 0, 1};
  PiDGains yaw{1.2F, 0, 0, 1, 0, 1, 1};
  /// Limit of roll and of pitch.
  float tilt_rad = 0.15F;
  /// Limit of the yaw rate.
  float yaw_rate_rad_s = 1;
  /// Limit of the thrust, per full thrust.
  float thrust_percent = 70;
  float roll_slew_rad_s = 10;         ///< maximum change of roll in a second
  float pitch_slew_rad_s = 100;       ///< maximum change of pitch in a second
  float yaw_slew_rad_s2 = 100;        ///< maximum change of the yaw rate in a second
  float thrust_slew_percent_s = 500;  ///< maximum change of the thrust in a second
};

struct PublishedCommand {
  PublishedModes modes;
  MotionGoal goal;  ///< position and yaw, odom frame; velocity in the base frame turned level, z up; yaw rate
  RpytCommand direct;  ///< of axes in kDirect, by external software
  RpytCommand manual;  ///< of axes in kDisabled, by the pilot's sticks
};

/// The dissertation's controller for a vehicle with its own roll, pitch, yaw rate and thrust loop. Each axis
/// has its own mode; all outputs, of every mode, pass limits and slew limits; an axis whose mode changes
/// continues from its output in force.
///
/// A state or command that is no number changes nothing: the last output stands, and it is counted.
class PublishedController {
 public:
  explicit PublishedController(const PublishedControlParams& params = {}, float step_s = 0.001F);
  void reset();
  /// Starts from the command of another controller: the next step continues from there.
  void start_from(const RpytCommand& current);
  const RpytCommand& step(const ControlState& state, const PublishedCommand& command);
  [[nodiscard]] const RpytCommand& output() const { return output_; }
  [[nodiscard]] std::uint32_t bad_inputs() const { return bad_inputs_; }
  /// Integrals of the laws in force of x, y, z, and of yaw.
  [[nodiscard]] std::array<float, 4> integrals() const;

 private:
  /// The law of an axis in its mode; its output is in the direction of the error.
  struct Axis {
    PiD law;
    AxisMode mode = AxisMode::kDisabled;
    [[nodiscard]] bool has_law() const { return mode == AxisMode::kPosition || mode == AxisMode::kVelocity; }
    void change_mode(AxisMode now, const PiDGains& gains, float output);
  };
  [[nodiscard]] RpytCommand wanted(const ControlState& state, const PublishedCommand& command);
  void limit(const RpytCommand& wanted);
  void change_modes(const PublishedModes& modes);

  PublishedControlParams params_;
  float step_s_;
  Axis x_, y_, z_, yaw_;
  SlewLimiter roll_, pitch_, yaw_rate_, thrust_percent_;
  RpytCommand output_;
  std::uint32_t bad_inputs_ = 0;
};

/// Which controller turns goals into attitude and thrust.
enum class ControlLaw : std::uint8_t { kCascade, kPublished };
inline constexpr std::array<std::string_view, 2> kControlLawNames{"cascade", "published"};

/// Lets the published controller fly what the cascade was to fly: returns the command with its output as a
/// direct one, whose attitude and thrust the cascade's inner loop follows within the same limits. Goals are
/// taken as they are, without the set-point shaper. Stopped rotors (vertical kDisabled) reset it.
[[nodiscard]] CascadeCommand flown_by(PublishedController& controller, const ControlState& state,
                                      const CascadeCommand& command);

}  // namespace hm
