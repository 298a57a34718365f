#pragma once
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/geometry/trajectory.hpp"

namespace hm {

/// A keyframe's place by odometry and after global alignment.
struct CorrectedKeyframe {
  std::size_t frame_index = 0;
  Time stamp;
  int submap = 0;
  int map = 0;  ///< submaps that a loop has connected share one; the first submap's is 0
  SE3 T_odom_camera, T_map_camera;
};

/// Where everything is after global alignment: a value that may be handed from thread to thread. Keyframes
/// are in order of time. Maps that nothing connects to the first one stay where odometry has them.
class CorrectedKeyframes {
 public:
  CorrectedKeyframes() = default;
  explicit CorrectedKeyframes(std::vector<CorrectedKeyframe> keyframes) : keyframes_(std::move(keyframes)) {}

  [[nodiscard]] const std::vector<CorrectedKeyframe>& keyframes() const { return keyframes_; }
  /// The correction at the last keyframe; identity while there is none.
  [[nodiscard]] SE3 T_map_odom() const;
  /// Where the camera was when odometry had T_odom_camera: carried along by the keyframes before and after it
  /// of the same submap, in between by share of the time (line of translation, slerp of rotation); by one of
  /// them where there is no other. Nothing without keyframes.
  [[nodiscard]] std::optional<SE3> T_map_camera(Time stamp, const SE3& T_odom_camera) const;
  /// The map that a moment belongs to (CorrectedKeyframe::map). 0 without keyframes.
  [[nodiscard]] int map_at(Time stamp) const;
  /// A whole trajectory of `odom` brought into `map`.
  [[nodiscard]] Trajectory corrected(const Trajectory& T_odom_camera) const;

 private:
  /// The last keyframe not after the stamp; the first if there is none.
  [[nodiscard]] std::size_t keyframe_before(Time stamp) const;
  std::vector<CorrectedKeyframe> keyframes_;
};

}  // namespace hm
