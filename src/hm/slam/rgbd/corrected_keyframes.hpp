#pragma once
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/geometry/trajectory.hpp"

namespace hm {

/// Pose of a keyframe by odometry and after global alignment.
struct CorrectedKeyframe {
  std::size_t frame_index = 0;
  Time stamp;
  int submap = 0;
  int map = 0;  ///< index of the map; submaps connected by loops share one, 0 for the first submap
  SE3 T_odom_camera, T_map_camera;
  std::optional<SE3> T_odom_arrived = {};  ///< pose to which drifted frames before lead (EndOfDrift)
};

/// Keyframe poses after global alignment, in order of time; a value that may be passed between threads. A map
/// not connected to the first one stays where odometry placed it.
class CorrectedKeyframes {
 public:
  CorrectedKeyframes() = default;
  explicit CorrectedKeyframes(std::vector<CorrectedKeyframe> keyframes) : keyframes_(std::move(keyframes)) {}

  [[nodiscard]] const std::vector<CorrectedKeyframe>& keyframes() const { return keyframes_; }
  /// Correction at the last keyframe; identity without keyframes.
  [[nodiscard]] SE3 T_map_odom() const;
  /// Corrected pose of a camera with odometry pose T_odom_camera: interpolated in time between the
  /// corrections of the keyframes before and after it in the same submap (linear translation, slerp), or
  /// corrected by the only one. Nothing without keyframes.
  [[nodiscard]] std::optional<SE3> T_map_camera(Time stamp, const SE3& T_odom_camera) const;
  /// Index of the map at a time (CorrectedKeyframe::map). 0 without keyframes.
  [[nodiscard]] int map_at(Time stamp) const;
  /// Transforms a trajectory from `odom` to `map`.
  [[nodiscard]] Trajectory corrected(const Trajectory& T_odom_camera) const;

 private:
  /// Index of the last keyframe not after the stamp; 0 if there is none.
  [[nodiscard]] std::size_t keyframe_before(Time stamp) const;
  std::vector<CorrectedKeyframe> keyframes_;
};

}  // namespace hm
