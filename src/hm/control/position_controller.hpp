#pragma once
#include "hm/core/param_doc.hpp"
#include "hm/geometry/float/float_math.hpp"

namespace hm {

struct PositionParams {
  float position_xy_per_s = 1.5F, position_z_per_s = 2;
  float velocity_xy_per_s = 3, velocity_z_per_s = 5;
  float integral_xy_per_s2 = 0.8F, integral_z_per_s2 = 2;
  float anti_windup_s = 0.5F;      ///< time constant with which saturation unloads the integrals
  float max_integral_m_s2 = 2.5F;  ///< limit of each integral
  float correction_m_s = 1;        ///< maximum velocity that position errors ask for
  float tilt_rad = 0.349F;
  float most_thrust_ratio = 1.7F;  ///< maximum thrust per weight

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"position_xy_per_s", {0, 10}, "horizontal velocity per position error"},
      self.position_xy_per_s);
    v(ParamDoc{"position_z_per_s", {0, 10}, "vertical velocity per position error"}, self.position_z_per_s);
    v(ParamDoc{"velocity_xy_per_s", {0, 20}, "horizontal acceleration per velocity error"},
      self.velocity_xy_per_s);
    v(ParamDoc{"velocity_z_per_s", {0, 20}, "vertical acceleration per velocity error"},
      self.velocity_z_per_s);
    v(ParamDoc{"integral_xy_per_s2", {0, 20}, "integral gain of the horizontal velocity error"},
      self.integral_xy_per_s2);
    v(ParamDoc{"integral_z_per_s2", {0, 20}, "integral gain of the vertical velocity error"},
      self.integral_z_per_s2);
    v(ParamDoc{"tilt_rad", {0.02, 1}, "maximum tilt of the thrust", ParamLevel::kBasic}, self.tilt_rad);
  }
};

/// Errors at one moment, odom frame. On axes whose velocity is controlled, the position error is
/// zero.
struct PositionErrors {
  Vec3f position_m = Vec3f::Zero();         ///< reference minus estimate
  Vec3f velocity_m_s = Vec3f::Zero();       ///< reference minus estimate
  Vec3f feed_forward_m_s2 = Vec3f::Zero();  ///< acceleration of the reference, and what drag takes
};

/// From position to thrust: P on position, PI on velocity, per axis of the odom frame:
///
///     v = clamp(Kp (p_ref - p)) + v_ref - v_est,   a = a_ref + Kv v + I,   f = a + g
///
/// where f, the specific force of the rotors, is limited: vertical part and length to shares of the weight,
/// tilt to the tilt limit; the vertical part comes first. There is no derivative of a set-point, thus no
/// kick. The
/// integrals follow dI/dt = Ki v + (f_applied - f)/T with what the vehicle really got of f (`applied`), so
/// that they do not wind up whatever saturates. The second term only unloads an integral: it does not drive
/// it beyond zero, where it would have to come back from.
class PositionController {
 public:
  PositionController(const PositionParams& params, float step_s) : params_(params), step_s_(step_s) {}
  void reset() { integral_ = Vec3f::Zero(); }
  /// Specific force of the rotors, m/s^2, odom frame, up positive. The errors must be numbers.
  const Vec3f& step(const PositionErrors& errors, float tilt_limit_rad);
  /// Ends the step: the integrals learn the specific force that left the last limit. Axes that something else
  /// controls keep their integral.
  void applied(const Vec3f& specific_force_m_s2, bool horizontal, bool vertical);
  [[nodiscard]] const Vec3f& integral_m_s2() const { return integral_; }
  /// Specific force before limits, of the last step.
  [[nodiscard]] const Vec3f& wanted_m_s2() const { return wanted_; }

 private:
  PositionParams params_;
  float step_s_;
  Vec3f integral_ = Vec3f::Zero(), velocity_error_ = Vec3f::Zero();
  Vec3f wanted_ = Vec3f::Zero(), limited_ = Vec3f::Zero();
};

/// Specific force within limits: vertical part at least `least`, length at most `most` (m/s^2), tilt at most
/// `tilt_rad`; the vertical part is kept before the horizontal one.
[[nodiscard]] Vec3f limited_specific_force(const Vec3f& force_m_s2, float least_m_s2, float most_m_s2,
                                           float tilt_rad);

}  // namespace hm
