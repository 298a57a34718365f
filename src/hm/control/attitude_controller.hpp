#pragma once
#include "hm/control/quadrotor_model.hpp"
#include "hm/control/signal_limits.hpp"
#include "hm/geometry/float/attitude.hpp"

namespace hm {

struct AttitudeParams {
  float tilt_per_s = 16;
  float yaw_per_s = 3.2F;
  float tilt_rate_rad_s = 6;  ///< maximum rate of roll and pitch
  /// Maximum yaw rate; twice that of the shaper, so that errors are made up for.
  static constexpr float kMaxYawRate_rad_s = 2;
  float rate_xy_per_s = 60, rate_z_per_s = 10;
  float rate_integral_per_s = 2;  ///< integral gain of the rates, per proportional gain

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"tilt_per_s", {0.5, 60}, "turning rate per error of roll and pitch"}, self.tilt_per_s);
    v(ParamDoc{"yaw_per_s", {0.1, 30}, "turning rate per yaw error"}, self.yaw_per_s);
    v(ParamDoc{"rate_xy_per_s", {1, 200}, "angular acceleration per error of the rates of roll and pitch"},
      self.rate_xy_per_s);
    v(ParamDoc{"rate_z_per_s", {0.5, 100}, "angular acceleration per error of the yaw rate"},
      self.rate_z_per_s);
  }
};

/// From attitude to torque. Tilt first: roll and pitch errors are those of the shortest turn that brings the
/// vehicle's z axis to its set-point, whatever the yaw error (Brescianini, Hehn and D'Andrea 2013), and have
/// the higher gain. Beyond tilt_acceleration/tilt_per_s^2 the wanted rate grows with the square root of the
/// error, so that the rotors can brake the turn. Rates: J (Kw (w_ref - w) + I - Kd dw/dt) + w x J w, with the
/// derivative of the measured, low-passed rates only: set-points cause no kick.
class AttitudeController {
 public:
  AttitudeController(const AttitudeParams& params, const QuadrotorModel& model, float step_s);
  void reset();
  /// Rates in the base frame that reduce the error, plus a yaw rate about the vertical.
  [[nodiscard]] Vec3f wanted_rates(const Attitude& wanted, const Attitude& measured,
                                   float yaw_rate_rad_s) const;
  /// Torque in the base frame, N m, for these rates. Inputs must be numbers.
  const Vec3f& step(const Vec3f& wanted_rates_rad_s, const Vec3f& rates_rad_s);
  /// Ends the step: the integrals learn the torque that the mixer left.
  void applied(const Vec3f& torque_n_m);

 private:
  AttitudeParams params_;
  float step_s_;
  Vec3f inertia_, gains_, damping_;
  LowPass low_pass_;
  bool started_ = false;
  Vec3f error_ = Vec3f::Zero(), integral_ = Vec3f::Zero(), torque_ = Vec3f::Zero();
};

/// Error of an attitude as two turns of the vehicle: first the shortest one that brings its z axis to the
/// wanted direction (a rotation vector in the base frame, with z = 0), then one about that axis.
struct TiltYawError {
  Vec3f tilt_rad = Vec3f::Zero();
  float yaw_rad = 0;
};
[[nodiscard]] TiltYawError tilt_yaw_error(const Attitude& wanted, const Attitude& measured);

}  // namespace hm
