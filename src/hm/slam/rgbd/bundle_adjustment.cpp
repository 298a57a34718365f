#include "hm/slam/rgbd/bundle_adjustment.hpp"

#include <ceres/ceres.h>
#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "hm/core/check.hpp"
#include "hm/core/statistics.hpp"
#include "hm/slam/pose_graph/pose_edge_cost.hpp"
#include "hm/slam/pose_graph/pose_manifold.hpp"

namespace hm {
namespace {

using detail::PoseState;

/// Minimum depth of a landmark for projection.
constexpr double kMinDepth_m = 0.05;
constexpr double kLeastVarianceScale = 0.01;  // lower limit of the variance scale of the observations
/// Maximum number of successive shorter steps, since a step must not put a landmark behind a camera.
constexpr int kMostInvalidSteps = 12;
constexpr int kPasses = 2;  // the second pass uses the residuals of the first to scale the outlier threshold

Vec3 residual(const PinholeCamera& camera, const Vec3& p_camera, const BundleObservation& seen) {
  const Vec2 pixel = camera.project(p_camera);
  return {pixel.x() - seen.pixel.x(), pixel.y() - seen.pixel.y(), p_camera.z() - seen.depth_m};
}

/// Matrix that scales a residual to unit standard deviation; the row of a missing depth is zero.
Mat3 whitening(const BundleObservation& seen) {
  Mat3 whiten = Mat3::Zero();
  whiten.topLeftCorner<2, 2>() = seen.pixel_covariance.llt().matrixL().solve(Eigen::Matrix2d::Identity());
  if (seen.depth_m > 0 && seen.depth_sigma_m > 0) whiten(2, 2) = 1 / seen.depth_sigma_m;
  return whiten;
}

/// Residual [u; v; depth], predicted minus observed, in standard deviations. There are hundreds of thousands
/// of them: each holds little, and camera and observation must outlive it.
class ObservationCost : public ceres::SizedCostFunction<3, 7, 3> {
 public:
  ObservationCost(const PinholeCamera& camera, const BundleObservation& seen) : camera_(camera), seen_(seen) {
    const Mat3 whiten = whitening(seen);
    whiten_ = {whiten(0, 0), whiten(1, 0), whiten(1, 1), whiten(2, 2)};
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const SE3 T_map_camera = detail::pose_of(parameters[0]);
    const Eigen::Map<const Vec3> p_map(parameters[1]);
    const Vec3 p_camera = T_map_camera.inverse() * p_map;
    if (p_camera.z() < kMinDepth_m) return false;
    Mat3 whiten;
    whiten << whiten_[0], 0, 0, whiten_[1], whiten_[2], 0, 0, 0, whiten_[3];
    Eigen::Map<Vec3>(residuals, 3) = whiten * residual(camera_, p_camera, seen_);
    if (jacobians == nullptr) return true;
    const Eigen::Matrix<double, 3, 9> jacobian = whiten * observation_jacobian(camera_, T_map_camera, p_map);
    if (jacobians[0] != nullptr) detail::write_by_move<3>(jacobian.leftCols<6>(), jacobians[0]);
    using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    if (jacobians[1] != nullptr) Eigen::Map<RowMajor>(jacobians[1], 3, 3) = jacobian.rightCols<3>();
    return true;
  }

 private:
  const PinholeCamera& camera_;
  const BundleObservation& seen_;
  std::array<double, 4> whiten_;  ///< lower triangle of the upper left 2 x 2, and the last of the diagonal
};

bool is_behind(const Bundle& bundle, const BundleLandmark& landmark, const BundleObservation& seen) {
  return (bundle.T_map_camera[seen.keyframe].inverse() * landmark.p_map).z() < kMinDepth_m;
}

/// Removes observations that cannot be projected, and landmarks with fewer than two left. Returns the number
/// of observations behind their camera.
std::size_t drop_behind(Bundle& bundle) {
  std::size_t dropped = 0;
  for (BundleLandmark& landmark : bundle.landmarks)
    dropped += std::erase_if(landmark.observations, [&](const BundleObservation& seen) {
      return is_behind(bundle, landmark, seen);
    });
  std::erase_if(bundle.landmarks,
                [](const BundleLandmark& landmark) { return landmark.observations.size() < 2; });
  return dropped;
}

/// Median reprojection error in pixels; infinite for observations behind their camera.
double reprojection_error_px(const Bundle& bundle) {
  std::vector<double> errors;
  for (const BundleLandmark& landmark : bundle.landmarks)
    for (const BundleObservation& seen : landmark.observations) {
      const Vec3 p_camera = bundle.T_map_camera[seen.keyframe].inverse() * landmark.p_map;
      errors.push_back(p_camera.z() < kMinDepth_m ? std::numeric_limits<double>::infinity()
                                                  : (bundle.camera.project(p_camera) - seen.pixel).norm());
    }
  return errors.empty() ? 0 : middle_value(std::span(errors));
}

/// Ratio of the squared residuals to their expectation (median, at most 1), to scale the outlier threshold.
double residual_variance_scale(const Bundle& bundle) {
  std::vector<double> ratios;
  for (const BundleLandmark& landmark : bundle.landmarks)
    for (const BundleObservation& seen : landmark.observations) {
      const Vec3 p_camera = bundle.T_map_camera[seen.keyframe].inverse() * landmark.p_map;
      const bool has_depth = seen.depth_m > 0 && seen.depth_sigma_m > 0;
      const double squared = (whitening(seen) * residual(bundle.camera, p_camera, seen)).squaredNorm();
      ratios.push_back(squared / (has_depth ? kMedianChi2Of3 : kMedianChi2Of2));
    }
  return ratios.empty() ? 1 : std::clamp(middle_value(std::span(ratios)), kLeastVarianceScale, 1.0);
}

/// Reports Ceres' iterations to a run, and stops Ceres on request.
class ProgressOfRun : public ceres::IterationCallback {
 public:
  ProgressOfRun(const RunContext& run, int done, int total) : run_(run), done_(done), total_(total) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (run_.progress)
      run_.progress({"bundle adjustment", static_cast<std::size_t>(done_ + summary.iteration),
                     static_cast<std::size_t>(total_), fmt::format("cost {:.4g}", summary.cost)});
    if (!run_.stop.stop_requested()) return ceres::SOLVER_CONTINUE;
    interrupted_ = true;
    return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
  }
  [[nodiscard]] bool interrupted() const { return interrupted_; }

 private:
  const RunContext& run_;
  int done_, total_;
  bool interrupted_ = false;
};

/// Every observation has the same loss.
ceres::Problem::Options with_shared_loss() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

struct BlockValues {
  std::vector<PoseState> poses;
  std::vector<Vec3> points;
};

BlockValues values_of(const Bundle& bundle) {
  BlockValues values;
  for (const SE3& T : bundle.T_map_camera) values.poses.push_back(detail::pose_state(T));
  for (const BundleLandmark& landmark : bundle.landmarks) values.points.push_back(landmark.p_map);
  return values;
}

/// Parameter blocks of Ceres. The bundle's observations must outlive it.
struct Unknowns : BlockValues {
  Unknowns(BlockValues begin, double loss_sigmas)
      : BlockValues(std::move(begin)),
        loss(loss_sigmas > 0 ? std::make_unique<ceres::CauchyLoss>(loss_sigmas) : nullptr) {}
  std::unique_ptr<ceres::LossFunction> loss;
  ceres::Problem problem{with_shared_loss()};
};

void add_observations(const Bundle& bundle, Unknowns& unknowns) {
  for (std::size_t l = 0; l < bundle.landmarks.size(); ++l)
    for (const BundleObservation& seen : bundle.landmarks[l].observations) {
      HM_CHECK(seen.keyframe < unknowns.poses.size(), "keyframe {} of {}", seen.keyframe,
               unknowns.poses.size());
      unknowns.problem.AddResidualBlock(new ObservationCost(bundle.camera, seen), unknowns.loss.get(),
                                        unknowns.poses[seen.keyframe].data(), unknowns.points[l].data());
    }
}

void add_edges(const Bundle& bundle, Unknowns& unknowns) {
  for (const PoseEdge3D& edge : bundle.edges) {
    HM_CHECK(edge.from < unknowns.poses.size() && edge.to < unknowns.poses.size() && edge.from != edge.to,
             "edge from {} to {} of {} keyframes", edge.from, edge.to, unknowns.poses.size());
    unknowns.problem.AddResidualBlock(detail::new_pose_edge_cost(edge), nullptr,
                                      unknowns.poses[edge.from].data(), unknowns.poses[edge.to].data());
  }
}

/// Sets the elimination order (landmarks first), the fixed keyframes and the manifold.
std::shared_ptr<ceres::ParameterBlockOrdering> order(const Bundle& bundle, Unknowns& unknowns) {
  const auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (Vec3& point : unknowns.points) ordering->AddElementToGroup(point.data(), 0);
  for (PoseState& pose : unknowns.poses) {
    if (!unknowns.problem.HasParameterBlock(pose.data())) continue;
    unknowns.problem.SetManifold(pose.data(), detail::new_pose_manifold());
    ordering->AddElementToGroup(pose.data(), 1);
  }
  for (const std::size_t keyframe : bundle.fixed)
    if (double* pose = unknowns.poses[keyframe].data(); unknowns.problem.HasParameterBlock(pose))
      unknowns.problem.SetParameterBlockConstant(pose);
  return ordering;
}

void write_back(Unknowns& unknowns, Bundle& bundle) {
  for (std::size_t i = 0; i < bundle.T_map_camera.size(); ++i) {
    const double* pose = unknowns.poses[i].data();
    if (unknowns.problem.HasParameterBlock(pose) && !unknowns.problem.IsParameterBlockConstant(pose))
      bundle.T_map_camera[i] = detail::pose_of(pose);
  }
  for (std::size_t l = 0; l < bundle.landmarks.size(); ++l) bundle.landmarks[l].p_map = unknowns.points[l];
}

/// Mean number of other keyframes with which a keyframe shares landmarks.
double mean_covisible(const Bundle& bundle) {
  const std::size_t keyframes = bundle.T_map_camera.size();
  std::vector<std::vector<std::size_t>> landmarks_of(keyframes);
  for (std::size_t l = 0; l < bundle.landmarks.size(); ++l)
    for (const BundleObservation& seen : bundle.landmarks[l].observations)
      landmarks_of[seen.keyframe].push_back(l);
  std::vector<std::size_t> met_by(keyframes, keyframes);  // last keyframe found to share with it
  std::size_t pairs = 0;
  for (std::size_t k = 0; k < keyframes; ++k) {
    met_by[k] = k;
    for (const std::size_t l : landmarks_of[k])
      for (const BundleObservation& seen : bundle.landmarks[l].observations)
        pairs += std::exchange(met_by[seen.keyframe], k) != k ? 1 : 0;
  }
  return keyframes == 0 ? 0 : static_cast<double>(pairs) / static_cast<double>(keyframes);
}

void choose_solver(bool conjugate_gradients, ceres::Solver::Options& options) {
  options.linear_solver_type = conjugate_gradients ? ceres::ITERATIVE_SCHUR : ceres::SPARSE_SCHUR;
  options.preconditioner_type = ceres::SCHUR_JACOBI;
}

ceres::Solver::Summary solve(Bundle& bundle, const BundleParams& params, double loss_sigmas,
                             bool conjugate_gradients, ProgressOfRun& progress) {
  Unknowns unknowns(values_of(bundle), loss_sigmas);
  add_observations(bundle, unknowns);
  add_edges(bundle, unknowns);
  ceres::Solver::Options options;
  choose_solver(conjugate_gradients, options);
  options.linear_solver_ordering = order(bundle, unknowns);
  options.num_threads = 1;
  options.max_num_iterations = params.max_iterations;
  options.function_tolerance = 1e-5;
  options.max_num_consecutive_invalid_steps = kMostInvalidSteps;
  options.callbacks.push_back(&progress);
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &unknowns.problem, &summary);
  if (summary.IsSolutionUsable()) write_back(unknowns, bundle);
  return summary;
}

/// Cost of a bundle with other poses and points.
double cost_of(const Bundle& bundle, BlockValues at, double loss_sigmas) {
  Unknowns unknowns(std::move(at), loss_sigmas);
  add_observations(bundle, unknowns);
  add_edges(bundle, unknowns);
  double cost = std::numeric_limits<double>::infinity();
  unknowns.problem.Evaluate({}, &cost, nullptr, nullptr, nullptr);
  return cost;
}

std::size_t count_observations(const Bundle& bundle) {
  std::size_t count = 0;
  for (const BundleLandmark& landmark : bundle.landmarks) count += landmark.observations.size();
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

BundleResult adjust_bundle(Bundle& bundle, const BundleParams& params, const RunContext& run) {
  BundleResult result;
  result.error_before_px = result.error_after_px = reprojection_error_px(bundle);
  Bundle adjusted = bundle;
  result.observations_behind = drop_behind(adjusted);
  result.observations = count_observations(adjusted);
  if (adjusted.landmarks.empty()) {
    result.message =
        result.observations_behind > 0 ? "all landmarks are behind their cameras" : "no landmarks";
    return result;
  }
  result.conjugate_gradients = mean_covisible(adjusted) > params.most_covisible;
  BlockValues begin = values_of(adjusted);
  double loss_sigmas = 0;
  for (int pass = 0; pass < kPasses && !result.interrupted; ++pass) {
    loss_sigmas = params.loss_sigmas * std::sqrt(residual_variance_scale(adjusted));
    ProgressOfRun progress(run, pass * params.max_iterations, kPasses * params.max_iterations);
    const ceres::Solver::Summary summary =
        solve(adjusted, params, loss_sigmas, result.conjugate_gradients, progress);
    result.message = summary.message;
    result.iterations += static_cast<int>(summary.iterations.size()) - 1;
    result.final_cost = summary.final_cost;
    result.converged = summary.IsSolutionUsable();
    result.interrupted = progress.interrupted();
    if (!result.converged) return result;
  }
  result.initial_cost = cost_of(adjusted, std::move(begin), loss_sigmas);
  bundle.T_map_camera = std::move(adjusted.T_map_camera);
  bundle.landmarks = std::move(adjusted.landmarks);
  result.error_after_px = reprojection_error_px(bundle);
  return result;
}

}  // namespace hm
