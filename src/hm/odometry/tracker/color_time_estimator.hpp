#pragma once
#include <optional>
#include <span>

#include "hm/odometry/tracker/tracker_registration.hpp"

namespace hm {

/// A registered frame, kept until the camera's velocity after it is known, too.
struct TimedFrame {
  std::size_t reference = 0;  ///< identity of the keyframe that it is compared with
  SE3 T_odom_camera;
  std::optional<Vec6> twist_before_s;  ///< mean velocity over the interval before [m/s; rad/s]
  bool is_keyframe = false;
  std::vector<LandmarkMatch> matches;

  /// Motion at its time, the mean of those in the intervals before and after it.
  [[nodiscard]] InstantMotion motion(const Vec6& twist_after_s, double interval_s) const {
    const Vec6 twist_s = twist_before_s.value_or(twist_after_s);
    return {0.5 * (twist_s + twist_after_s), (twist_after_s - twist_s) / interval_s};
  }
  template <class Archive>
  void visit_state(Archive& archive) {
    archive(reference, T_odom_camera, twist_before_s, is_keyframe, matches);
  }
};

/// Estimates when the rows of the colour images are exposed (ColorTimes) from the residuals of landmarks in
/// registered frames: a linear Gaussian estimate [readout; delay], with the pose of each frame eliminated.
/// Only frames in which the camera moves otherwise than at the landmarks' first observation contribute.
class ColorTimeEstimator {
 public:
  /// Starts from a prior; without `estimates` it is used as it is.
  ColorTimeEstimator(const ColorTimes& prior, bool estimates);

  /// Adds a registered frame with its depth grid and its motion.
  void add(const MapKeyframe& reference, const TimedFrame& frame, const DepthGrid& grid,
           const InstantMotion& motion, const PinholeCamera& camera, const DepthNoise& noise);
  /// Times to be used: the prior if it is not 0, and the estimate once it clearly differs from 0. Frames of
  /// synchronous global shutters are tracked as if there were no estimate, to the bit.
  [[nodiscard]] ColorTimes in_use() const;
  /// The estimate and its standard deviations.
  [[nodiscard]] ColorTimes times() const;
  [[nodiscard]] ColorTimes sigma() const;

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(information_, vector_, significant_);
  }

 private:
  [[nodiscard]] bool differs_from_zero() const;

  ColorTimes prior_;
  bool estimates_;
  bool significant_ = false;
  Mat2 prior_information_;
  Vec2 prior_vector_;
  Mat2 information_ = Mat2::Zero();  ///< of the frames, s^-2
  Vec2 vector_ = Vec2::Zero();       ///< information times estimate, s^-1
};

}  // namespace hm
