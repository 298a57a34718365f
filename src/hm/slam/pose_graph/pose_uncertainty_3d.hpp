#pragma once
#include <cstddef>

#include "hm/geometry/pose_graph_3d.hpp"
#include "hm/slam/pose_graph/path_uncertainty.hpp"

namespace hm {

/// Spatial geometry for PathUncertainty: covariances of perturbations (moved_by) in the frame of the target
/// node.
struct SpatialPaths {
  using Pose = SE3;
  using Covariance = Mat6;
  using Edge = PoseEdge3D;
  using Graph = PoseGraph3D;
  /// Scalar by which paths are ordered, m^2.
  static double size_of(const Mat6& covariance);
  static bool is_odometry(const PoseEdge3D& edge) { return edge.kind == PoseEdgeKind::kOdometry; }
  static Mat6 edge_covariance(const PoseEdge3D& edge);
  static double path_m(const PoseEdge3D& edge) {
    return is_odometry(edge) ? edge.T_from_to.translation().norm() : 0;
  }
  static Mat6 inverse(const SE3& T_a_b, const Mat6& covariance) {
    return inverse_covariance(T_a_b, covariance);
  }
  static Mat6 compose(const SE3&, const Mat6& covariance_a_b, const SE3& T_b_c, const Mat6& covariance_b_c) {
    return compose_covariance(covariance_a_b, T_b_c, covariance_b_c);
  }
  /// Not needed, since covariances are in the frame of the target.
  static SE3 seen_pose(const PoseGraph3D&, std::size_t, std::size_t) { return {}; }
};
extern template class PathUncertainty<SpatialPaths>;
using PathUncertainty3D = PathUncertainty<SpatialPaths>;
using SeenUncertainty = PathUncertainty3D::Seen;

}  // namespace hm
