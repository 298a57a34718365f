#include "hm/slam/pose_graph/pose_uncertainty.hpp"

#include <Eigen/LU>

#include "hm/geometry/planar_covariance.hpp"

namespace hm {
namespace {

/// Distance that converts a variance of angle to one of position, for ordering paths by a scalar.
constexpr double kPlanarLever_m = 5;

}  // namespace

Mat3 edge_covariance(const PoseEdge2D& edge) {
  return turned_covariance(edge.T_from_to.rotation(), edge.information.inverse());
}

Mat3 edge_information(const SE2& T_from_to, const Mat3& covariance) {
  return turned_covariance(T_from_to.rotation().transpose(), covariance).inverse();
}

Mat3 inverse_covariance(const SE2& T_a_b, const Mat3& covariance_a_b) {
  const SE2 T_b_a = T_a_b.inverse();
  Mat3 jacobian = -Mat3::Identity();
  jacobian.topLeftCorner<2, 2>() = -T_b_a.rotation();
  jacobian(0, 2) = T_b_a.y();
  jacobian(1, 2) = -T_b_a.x();
  return jacobian * covariance_a_b * jacobian.transpose();
}

double PlanarPaths::size_of(const Mat3& covariance) {
  return covariance(0, 0) + covariance(1, 1) + kPlanarLever_m * kPlanarLever_m * covariance(2, 2);
}

template class PathUncertainty<PlanarPaths>;

}  // namespace hm
