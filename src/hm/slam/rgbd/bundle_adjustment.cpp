#include "hm/slam/rgbd/bundle_adjustment.hpp"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>

#include "hm/core/check.hpp"
#include "hm/slam/pose_manifold.hpp"

namespace hm {
namespace {

using detail::PoseState;

/// A landmark nearer to the camera's plane than this is not projected.
constexpr double kMinDepth_m = 0.05;

/// [u; v; depth] beyond what was observed, each in its deviations.
class ObservationCost : public ceres::SizedCostFunction<3, 7, 3> {
 public:
  ObservationCost(const PinholeCamera& camera, const LandmarkObservation& seen, double pixel_sigma_px)
      : camera_(camera), seen_(seen) {
    const bool has_depth = seen.depth_m > 0 && seen.depth_sigma_m > 0;
    weights_ << 1 / pixel_sigma_px, 1 / pixel_sigma_px, has_depth ? 1 / seen.depth_sigma_m : 0;
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const SE3 T_map_camera = detail::pose_of(parameters[0]);
    const Eigen::Map<const Vec3> p_map(parameters[1]);
    const Vec3 p_camera = T_map_camera.inverse() * p_map;
    if (p_camera.z() < kMinDepth_m) return false;
    const Vec2 pixel = camera_.project(p_camera);
    const Vec3 error(pixel.x() - seen_.pixel.x(), pixel.y() - seen_.pixel.y(), p_camera.z() - seen_.depth_m);
    Eigen::Map<Vec3>(residuals, 3) = weights_.cwiseProduct(error);
    if (jacobians == nullptr) return true;
    const Eigen::Matrix<double, 3, 9> jacobian =
        weights_.asDiagonal() * observation_jacobian(camera_, T_map_camera, p_map);
    if (jacobians[0] != nullptr) detail::write_by_move<3>(jacobian.leftCols<6>(), jacobians[0]);
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    if (jacobians[1] != nullptr) Eigen::Map<RowMajor>(jacobians[1], 3, 3) = jacobian.rightCols<3>();
    return true;
  }

 private:
  PinholeCamera camera_;
  LandmarkObservation seen_;
  Vec3 weights_;
};

/// Root mean square over observations in front of their cameras, pixels.
double reprojection_error_px(const PinholeCamera& camera, const std::vector<SE3>& poses,
                             const std::vector<Landmark>& landmarks) {
  double sum = 0;
  std::size_t count = 0;
  for (const Landmark& landmark : landmarks)
    for (const LandmarkObservation& seen : landmark.observations) {
      const Vec3 p_camera = poses[seen.keyframe].inverse() * landmark.p_map;
      if (p_camera.z() < kMinDepth_m) continue;
      sum += (camera.project(p_camera) - seen.pixel).squaredNorm();
      ++count;
    }
  return count == 0 ? 0 : std::sqrt(sum / static_cast<double>(count));
}

/// The unknowns as Ceres has them.
struct Unknowns {
  std::vector<PoseState> poses;
  std::vector<Vec3> points;
};

std::size_t add_observations(const PinholeCamera& camera, const std::vector<Landmark>& landmarks,
                             const BundleParams& params, Unknowns& unknowns, ceres::Problem& problem) {
  std::size_t count = 0;
  for (std::size_t l = 0; l < landmarks.size(); ++l)
    for (const LandmarkObservation& seen : landmarks[l].observations) {
      HM_CHECK(seen.keyframe < unknowns.poses.size(), "keyframe {} of {}", seen.keyframe,
               unknowns.poses.size());
      problem.AddResidualBlock(new ObservationCost(camera, seen, params.pixel_sigma_px),
                               params.loss_sigmas > 0 ? new ceres::HuberLoss(params.loss_sigmas) : nullptr,
                               unknowns.poses[seen.keyframe].data(), unknowns.points[l].data());
      ++count;
    }
  return count;
}

}  // namespace

Eigen::Matrix<double, 3, 9> observation_jacobian(const PinholeCamera& camera, const SE3& T_map_camera,
                                                 const Vec3& p_map) {
  const Vec3 p = T_map_camera.inverse() * p_map;
  Mat3 by_point;
  by_point << camera.fx / p.z(), 0, -camera.fx * p.x() / (p.z() * p.z()),  //
      0, camera.fy / p.z(), -camera.fy * p.y() / (p.z() * p.z()),          //
      0, 0, 1;
  Eigen::Matrix<double, 3, 9> jacobian;
  jacobian << -by_point, by_point * skew(p), by_point * T_map_camera.rotation().transpose();
  return jacobian;
}

BundleResult adjust_bundle(const PinholeCamera& camera, std::vector<SE3>& T_map_camera,
                           std::vector<Landmark>& landmarks, std::span<const std::size_t> fixed,
                           const BundleParams& params) {
  BundleResult result;
  result.error_before_px = result.error_after_px = reprojection_error_px(camera, T_map_camera, landmarks);
  if (landmarks.empty()) {
    result.message = "no landmarks";
    return result;
  }
  Unknowns unknowns;
  for (const SE3& T : T_map_camera) unknowns.poses.push_back(detail::pose_state(T));
  for (const Landmark& landmark : landmarks) unknowns.points.push_back(landmark.p_map);
  ceres::Problem problem;
  result.observations = add_observations(camera, landmarks, params, unknowns, problem);
  auto* ordering = new ceres::ParameterBlockOrdering;
  for (Vec3& point : unknowns.points) ordering->AddElementToGroup(point.data(), 0);
  for (PoseState& pose : unknowns.poses) {
    if (!problem.HasParameterBlock(pose.data())) continue;
    problem.SetManifold(pose.data(), detail::new_pose_manifold());
    ordering->AddElementToGroup(pose.data(), 1);
  }
  for (const std::size_t keyframe : fixed)
    if (double* pose = unknowns.poses[keyframe].data(); problem.HasParameterBlock(pose))
      problem.SetParameterBlockConstant(pose);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_SCHUR;
  options.linear_solver_ordering.reset(ordering);
  options.num_threads = 1;
  options.max_num_iterations = params.max_iterations;
  options.function_tolerance = 1e-5;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  result.message = summary.message;
  result.iterations = static_cast<int>(summary.iterations.size()) - 1;
  result.initial_cost = summary.initial_cost;
  result.final_cost = summary.final_cost;
  result.converged = summary.IsSolutionUsable();
  if (!result.converged) return result;
  for (std::size_t i = 0; i < T_map_camera.size(); ++i) {
    const double* pose = unknowns.poses[i].data();
    if (problem.HasParameterBlock(pose) && !problem.IsParameterBlockConstant(pose))
      T_map_camera[i] = detail::pose_of(pose);
  }
  for (std::size_t l = 0; l < landmarks.size(); ++l) landmarks[l].p_map = unknowns.points[l];
  result.error_after_px = reprojection_error_px(camera, T_map_camera, landmarks);
  return result;
}

}  // namespace hm
