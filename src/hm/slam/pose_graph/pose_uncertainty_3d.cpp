#include "hm/slam/pose_graph/pose_uncertainty_3d.hpp"

#include <Eigen/Cholesky>

namespace hm {
namespace {

/// Distance that converts a variance of rotation to one of position, for ordering paths by a scalar.
constexpr double kLever_m = 3;

}  // namespace

double SpatialPaths::size_of(const Mat6& covariance) {
  return covariance.topLeftCorner<3, 3>().trace() +
         kLever_m * kLever_m * covariance.bottomRightCorner<3, 3>().trace();
}

Mat6 SpatialPaths::edge_covariance(const PoseEdge3D& edge) {
  return edge.information.llt().solve(Mat6::Identity());
}

template class PathUncertainty<SpatialPaths>;

}  // namespace hm
