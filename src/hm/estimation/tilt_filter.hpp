#pragma once
#include "hm/core/param_doc.hpp"
#include "hm/estimation/filter_math.hpp"

namespace hm {

/// Parameters of the attitude filter for IMUs without their own orientation.
template <class Scalar>
struct BasicTiltFilterParams {
  Scalar time_constant_s = Scalar(4.0);
  /// The same during the first kStart_s.
  static constexpr Scalar kStartTimeConstant_s = Scalar(0.2);
  /// Duration of the initial phase with a shorter time constant.
  static constexpr Scalar kStart_s = Scalar(1.0);
  /// Specific force whose magnitude differs more from gravity is not used.
  static constexpr Scalar kGravityToleranceRatio = Scalar(0.15);
  /// Time constant over which acceleration is estimated from the velocity.
  static constexpr Scalar kAccelerationTimeConstant_s = Scalar(0.2);

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"time_constant_s",
               {0.05, 1000},
               "time constant of correcting the gyroscope by gravity; smaller corrects faster, but is "
               "disturbed more by acceleration"},
      self.time_constant_s);
  }
};
using TiltFilterParams = BasicTiltFilterParams<double>;

/// Complementary filter: integrates the gyroscope and corrects the tilt towards the measured gravity with a
/// time constant, whenever the specific force has about the magnitude of gravity. Yaw comes from the
/// gyroscope only. The first sample sets the tilt. No heap allocation; inputs must be finite.
template <class Scalar>
class BasicTiltFilter {
 public:
  using Params = BasicTiltFilterParams<Scalar>;
  using Vector3 = FilterVector<Scalar, 3>;
  using Quaternion = FilterQuaternion<Scalar>;
  explicit BasicTiltFilter(const Params& params = {}) : params_(params) {}
  /// Updates the attitude to the end of an interval of `dt_s` (0 for the first sample).
  void update(const Vector3& angular_velocity_rad_s, const Vector3& specific_force_m_s2, Scalar dt_s);
  [[nodiscard]] bool ready() const { return ready_; }
  [[nodiscard]] const Quaternion& R_world_body() const { return R_world_body_; }

 private:
  Params params_;
  bool ready_ = false;
  Scalar running_s_ = Scalar(0);
  Quaternion R_world_body_ = Quaternion::Identity();
};
using TiltFilter = BasicTiltFilter<double>;

/// Estimates gravity from the specific force by subtracting the vehicle's acceleration, derived from its
/// estimated velocity; both use the same low-pass filter. Keeps the tilt correct in long curves.
template <class Scalar>
class BasicAccelerationCompensator {
 public:
  using Params = BasicTiltFilterParams<Scalar>;
  using Vector3 = FilterVector<Scalar, 3>;
  using Quaternion = FilterQuaternion<Scalar>;
  explicit BasicAccelerationCompensator(const Params& params = {})
      : time_constant_s_(params.kAccelerationTimeConstant_s) {}
  /// Adds a sample and the velocity estimated before it; returns the specific force of gravity in the body
  /// frame.
  Vector3 update(const Vector3& specific_force_body_m_s2, const Vector3& velocity_world_m_s,
                 const Quaternion& R_world_body, Scalar dt_s);
  /// Resets when the velocity is unknown.
  void reset() { ready_ = false; }

 private:
  Scalar time_constant_s_;
  bool ready_ = false;
  Vector3 force_world_m_s2_ = Vector3::Zero(), slow_velocity_m_s_ = Vector3::Zero();
};
using AccelerationCompensator = BasicAccelerationCompensator<double>;

}  // namespace hm
