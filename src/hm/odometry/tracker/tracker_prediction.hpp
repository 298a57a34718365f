#pragma once
#include <optional>
#include <vector>

#include "hm/odometry/registration/photometric_alignment.hpp"
#include "hm/odometry/registration/surface_following.hpp"
#include "hm/odometry/tracker/tracker_frame.hpp"

namespace hm {

/// Data of the last frame with a pose for predicting the next one.
struct PredictionReference {
  PhotometricReference picture;
  DepthGrid grid;
  [[nodiscard]] std::size_t memory_bytes() const {
    return picture.memory_bytes() + grid.depth_m.size() * sizeof(float);
  }
};
PredictionReference make_prediction_reference(const TrackerFrame& frame, const PinholeCamera& camera);

/// Constant velocity model of the camera; velocities are per second, so that dropped frames are handled.
class ConstantVelocity {
 public:
  /// Updates with the camera's motion T_last_current over `duration_s`.
  void update(const SE3& T_last_current, double duration_s);
  void reset() { twist_ = Vec6::Zero(); }
  /// Mean velocity of the last motion [m/s; rad/s], camera frame; nothing if it is unknown.
  [[nodiscard]] std::optional<Vec6> twist_s() const {
    return twist_.isZero(0) ? std::nullopt : std::optional(twist_);
  }
  /// Predicted motion over the next `duration_s`, at most that of half a second, since the velocity is not
  /// constant for longer.
  [[nodiscard]] SE3 motion(double duration_s) const;
  template <class Archive>
  void visit_state(Archive& archive) {
    archive(twist_);
  }

 private:
  Vec6 twist_ = Vec6::Zero();  ///< m/s and rad/s, in the camera's frame
};

/// A pose with an orthonormal rotation, where that of products differs from one by more than 1e-10: errors of
/// rounding grow without end where a pose is multiplied by what was computed from it. Others keep their bits.
SE3 renormalised(const SE3& pose);

/// Guesses of the motion since the reference.
struct MotionGuess {
  SE3 by_velocity;                   ///< at constant velocity
  std::optional<Mat3> R_ref_cur;     ///< from a gyroscope
  bool may_have_turned_far = false;  ///< after a long gap, as at a few frames per second
};

/// Predicts the camera's motion since the reference by photometric alignment (photometric_alignment.hpp).
/// After a long gap, where repeating patterns cause errors, also uses guesses from the depth surfaces and
/// searches over rotations.
SE3 predict_motion(const PredictionReference& reference, const TrackerFrame& frame, const MotionGuess& guess,
                   const DepthNoise& noise);

/// Whether the frame's picture, at a coarse scale where motion blur matters little, is that of the
/// reference moved by T_ref_cur. Nothing when they share too little texture to say so.
std::optional<bool> shows_the_same(const PredictionReference& reference, const TrackerFrame& frame,
                                   const SE3& T_ref_cur);

/// Motions from aligning the surfaces of the two depth images, starting from the guesses
/// (surface_following.hpp).
std::vector<SurfaceMotion> motions_by_surface(const PredictionReference& reference, const TrackerFrame& frame,
                                              const std::vector<SE3>& guesses_T_ref_cur,
                                              const DepthNoise& noise);

}  // namespace hm
