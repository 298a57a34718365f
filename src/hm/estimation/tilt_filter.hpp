#pragma once
#include <Eigen/Geometry>

#include "hm/core/params.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Attitude from gyroscope and gravity, for IMUs that give no orientation of their own.
struct TiltFilterParams {
  double time_constant_s = 4.0;
  /// Time constant during the first start_s seconds, seconds: short, so that the unknown first attitude is
  /// corrected quickly.
  static constexpr double kStartTimeConstant_s = 0.2;
  double start_s = 1.0;
  /// Specific force that differs more from gravity does not correct.
  static constexpr double kGravityToleranceRatio = 0.15;
  /// Over which the estimated velocity tells the acceleration.
  static constexpr double kAccelerationTimeConstant_s = 0.2;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"time_constant_s", {0.05, 1000}, "how fast gravity corrects the gyroscope"},
      self.time_constant_s);
    v(ParamDoc{"start_s", {0, 60}, "how long the beginning is"}, self.start_s);
  }
};

/// Complementary filter: the gyroscope turns the attitude, and gravity pulls its tilt back with a time
/// constant whenever the specific force is about as long as gravity. Yaw is the gyroscope's alone. The first
/// sample sets the tilt. No heap; inputs must be finite.
class TiltFilter {
 public:
  explicit TiltFilter(const TiltFilterParams& params = {}) : params_(params) {}
  /// The attitude at the end of an interval of `dt_s` (0 for the first sample).
  void update(const Vec3& angular_velocity_rad_s, const Vec3& specific_force_m_s2, double dt_s);
  [[nodiscard]] bool ready() const { return ready_; }
  [[nodiscard]] const Eigen::Quaterniond& R_world_body() const { return R_world_body_; }

 private:
  TiltFilterParams params_;
  bool ready_ = false;
  double running_s_ = 0;
  Eigen::Quaterniond R_world_body_ = Eigen::Quaterniond::Identity();
};

/// Gravity alone, out of what an accelerometer feels: specific force minus the vehicle's own acceleration, as
/// the change of its estimated velocity shows it, both low-passed alike. Keeps the tilt right in long curves.
class AccelerationCompensator {
 public:
  explicit AccelerationCompensator(const TiltFilterParams& params = {})
      : time_constant_s_(params.kAccelerationTimeConstant_s) {}
  /// The next sample, and the velocity estimated before it; gravity's specific force in the body.
  Vec3 update(const Vec3& specific_force_body_m_s2, const Vec3& velocity_world_m_s,
              const Eigen::Quaterniond& R_world_body, double dt_s);
  /// Nothing is known of the velocity (any more).
  void reset() { ready_ = false; }

 private:
  double time_constant_s_;
  bool ready_ = false;
  Vec3 force_world_m_s2_ = Vec3::Zero(), slow_velocity_m_s_ = Vec3::Zero();
};

}  // namespace hm
