#pragma once
#include <optional>
#include <vector>

#include "hm/odometry/registration/photometric_alignment.hpp"
#include "hm/odometry/registration/surface_following.hpp"
#include "hm/odometry/tracker/tracker_frame.hpp"

namespace hm {

/// What the last frame with a pose offers for finding the next one.
struct PredictionReference {
  PhotometricReference picture;
  DepthGrid grid;
  [[nodiscard]] std::size_t memory_bytes() const {
    return picture.memory_bytes() + grid.depth_m.size() * sizeof(float);
  }
};
PredictionReference make_prediction_reference(const TrackerFrame& frame, const PinholeCamera& camera);

/// The motion of a camera that keeps its velocity. Velocities are of a second, not of a frame: after dropped
/// frames the motion is as much longer.
class ConstantVelocity {
 public:
  /// The camera has moved by T_last_current between two stamps; the later one comes last.
  void update(const SE3& T_last_current, double duration_s);
  void reset() { twist_ = Vec6::Zero(); }
  /// The motion over the next `duration_s`; over a long gap that of the first half second, because cameras do
  /// not keep their velocity for longer.
  [[nodiscard]] SE3 motion(double duration_s) const;

 private:
  Vec6 twist_ = Vec6::Zero();  ///< m/s and rad/s, in the camera's frame
};

/// What is known of the motion since the reference.
struct MotionGuess {
  SE3 by_velocity;                   ///< if the camera goes on as before
  std::optional<Mat3> R_ref_cur;     ///< from a gyroscope
  bool may_have_turned_far = false;  ///< long ago: at a few frames a second
};

/// The motion of the camera since the reference, from brightness (photometric_alignment.hpp). After a long
/// gap patterns that repeat lead it astray: then the surfaces of the two depth pictures give guesses too, and
/// turns are searched.
SE3 predict_motion(const PredictionReference& reference, const TrackerFrame& frame, const MotionGuess& guess,
                   const DepthNoise& noise);

/// The motions that the surfaces of the two depth pictures lead to from the guesses (surface_following.hpp).
std::vector<SurfaceMotion> motions_by_surface(const PredictionReference& reference, const TrackerFrame& frame,
                                              const std::vector<SE3>& guesses_T_ref_cur,
                                              const DepthNoise& noise);

}  // namespace hm
