#pragma once
#include <optional>

#include "hm/core/time.hpp"
#include "hm/geometry/float/float_math.hpp"

namespace hm {

/// Compares the horizontal acceleration that the tilt of the rotors makes with the one that the poses show.
/// When the sensor of the poses is turned on the vehicle, one is the other turned by the same angle, and
/// position control spirals outwards.
///
/// Both are low-passed alike; the angle is that of the mean of their products over about a second.
class TiltCheck {
 public:
  void reset() { *this = {}; }
  /// A pose that the estimator accepted or refused: its stamp, later than the previous one, and position.
  void add_pose(Time stamp, float x_m, float y_m);
  /// A step: horizontal acceleration by the tilt, odom frame, over a time span.
  void step(float x_m_s2, float y_m_s2, float dt_s);
  /// Angle from the acceleration by tilt to that of the poses; nothing while either is too small to tell.
  [[nodiscard]] std::optional<float> mismatch_rad() const;

 private:
  struct Planar {
    float x = 0, y = 0;
  };
  int poses_ = 0;
  Time stamp_;
  Planar position_, velocity_, pose_acceleration_;  // of the poses, the last one low-passed
  Planar tilt_acceleration_;                        // low-passed
  float dot_ = 0, cross_ = 0;
};

}  // namespace hm
