#include "hm/odometry/published/model_registration.hpp"

#include <fmt/format.h>

#include <vector>

namespace hm {

namespace {

/// Pairs of model points (a) and frame points (b) transformed by the estimated pose.
std::vector<PointPair> closest_pairs(std::span<const UncertainPoint> points, const PointModel& model,
                                     const SE3& T_odom_camera, double max_distance_m) {
  std::vector<PointPair> pairs;
  for (const UncertainPoint& point : points) {
    const PointIndex::Neighbour near = model.nearest(T_odom_camera * point.mean, max_distance_m);
    if (near.index < 0) continue;
    const UncertainPoint& known = model.points()[static_cast<std::size_t>(near.index)];
    pairs.push_back({known.mean, point.mean, known.covariance, point.covariance});
  }
  return pairs;
}

}  // namespace

ModelRegistration register_to_model(std::span<const UncertainPoint> points_camera, const PointModel& model,
                                    const SE3& predicted_T_odom_camera, const ModelIcpParams& params) {
  ModelRegistration result;
  result.T_odom_camera = predicted_T_odom_camera;
  std::vector<PointPair> pairs;
  while (result.iterations < params.kMaxIcpIterations) {
    ++result.iterations;
    pairs = closest_pairs(points_camera, model, result.T_odom_camera, params.kMaxPairDistance_m);
    result.pairs = static_cast<int>(pairs.size());
    if (result.pairs < params.kMinPairs) {
      result.reason = fmt::format("{} of {} features are within {} m of the model, {} needed", result.pairs,
                                  points_camera.size(), params.kMaxPairDistance_m, params.kMinPairs);
      return result;
    }
    const auto fitted = register_points(pairs);
    if (!fitted) {
      result.reason = fmt::format("the {} paired features lie on a line", result.pairs);
      return result;
    }
    const SE3 step = *fitted * result.T_odom_camera.inverse();
    result.T_odom_camera = *fitted;
    if (step.translation().norm() < params.kConverged_m && step.angle() < params.kConverged_rad) break;
  }
  const auto covariance = registration_covariance(pairs, result.T_odom_camera);
  result.found = covariance.has_value() && is_rigid(result.T_odom_camera);
  result.covariance = covariance.value_or(Mat6::Zero());
  if (!result.found) result.reason = fmt::format("{} pairs do not determine a pose", result.pairs);
  return result;
}

}  // namespace hm
