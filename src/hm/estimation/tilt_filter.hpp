#pragma once
#include <Eigen/Geometry>

#include "hm/core/params.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Parameters of the attitude filter for IMUs without their own orientation.
struct TiltFilterParams {
  double time_constant_s = 4.0;
  /// The same during the first start_s.
  static constexpr double kStartTimeConstant_s = 0.2;
  double start_s = 1.0;
  /// Specific force whose magnitude differs more from gravity is not used.
  static constexpr double kGravityToleranceRatio = 0.15;
  /// Time constant over which acceleration is estimated from the velocity.
  static constexpr double kAccelerationTimeConstant_s = 0.2;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"time_constant_s",
               {0.05, 1000},
               "time constant of correcting the gyroscope by gravity; smaller corrects faster, but is "
               "disturbed more by acceleration"},
      self.time_constant_s);
    v(ParamDoc{"start_s", {0, 60}, "duration of the initial phase with a shorter time constant"},
      self.start_s);
  }
};

/// Complementary filter: integrates the gyroscope and corrects the tilt towards the measured gravity with a
/// time constant, whenever the specific force has about the magnitude of gravity. Yaw comes from the
/// gyroscope only. The first sample sets the tilt. No heap allocation; inputs must be finite.
class TiltFilter {
 public:
  explicit TiltFilter(const TiltFilterParams& params = {}) : params_(params) {}
  /// Updates the attitude to the end of an interval of `dt_s` (0 for the first sample).
  void update(const Vec3& angular_velocity_rad_s, const Vec3& specific_force_m_s2, double dt_s);
  [[nodiscard]] bool ready() const { return ready_; }
  [[nodiscard]] const Eigen::Quaterniond& R_world_body() const { return R_world_body_; }

 private:
  TiltFilterParams params_;
  bool ready_ = false;
  double running_s_ = 0;
  Eigen::Quaterniond R_world_body_ = Eigen::Quaterniond::Identity();
};

/// Estimates gravity from the specific force by subtracting the vehicle's acceleration, derived from its
/// estimated velocity; both use the same low-pass filter. Keeps the tilt correct in long curves.
class AccelerationCompensator {
 public:
  explicit AccelerationCompensator(const TiltFilterParams& params = {})
      : time_constant_s_(params.kAccelerationTimeConstant_s) {}
  /// Adds a sample and the velocity estimated before it; returns the specific force of gravity in the body
  /// frame.
  Vec3 update(const Vec3& specific_force_body_m_s2, const Vec3& velocity_world_m_s,
              const Eigen::Quaterniond& R_world_body, double dt_s);
  /// Resets when the velocity is unknown.
  void reset() { ready_ = false; }

 private:
  double time_constant_s_;
  bool ready_ = false;
  Vec3 force_world_m_s2_ = Vec3::Zero(), slow_velocity_m_s_ = Vec3::Zero();
};

}  // namespace hm
