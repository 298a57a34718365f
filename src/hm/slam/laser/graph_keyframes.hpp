#pragma once
#include <optional>

#include "hm/laser/odometry/scan_odometry.hpp"
#include "hm/slam/laser/scan_graph_2d.hpp"

namespace hm {

/// Turns scan odometry into keyframes of a scan graph: a scan becomes one when the vehicle has moved away
/// from the last one, with the covariance of the motion in between, which adds up over odometry's own
/// keyframes.
class GraphKeyframes {
 public:
  explicit GraphKeyframes(const ScanGraph2DParams& params = {}) : params_(params) {}

  /// Takes the odometry result of a scan into account. Nothing for scans that do not become a keyframe.
  std::optional<GraphKeyframe2D> add(const PlanarScan& scan, const OdometryStep& step, double height_m = 0);

 private:
  [[nodiscard]] bool is_due(const SE2& T_odom_base) const;
  [[nodiscard]] Mat3 covariance_since_last(const Mat3& match_odom) const;
  [[nodiscard]] std::optional<Mat3> wheel_covariance_since_last() const;

  ScanGraph2DParams params_;
  std::optional<SE2> T_odom_last_;  ///< of the last keyframe
  // Covariances along the axes of `odom`: of the last keyframe's match, and the sum over odometry keyframes
  // since then.
  Mat3 last_match_ = Mat3::Zero(), keyframes_since_ = Mat3::Zero();
  std::optional<Mat3> wheels_since_ = Mat3::Zero();  ///< of what wheels measured since the last keyframe
  bool unknown_since_ = false;                       ///< odometry was restarted
};

}  // namespace hm
