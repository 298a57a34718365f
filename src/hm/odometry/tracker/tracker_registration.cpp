#include "hm/odometry/tracker/tracker_registration.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

constexpr double kRegistrationConverged = 2e-5;  // metres and radians
constexpr int kWideGateIterations = 2;           // of the surface's association
constexpr double kWideGate_m = 0.03;
constexpr double kMaxVarianceScale = 16;      // beyond this the pose is wrong
constexpr double kLeastVarianceScale = 0.02;  // of the covariance, however well the matches agree
constexpr double kSharedErrors =
    2.5;                        // errors of landmarks in one frame are correlated; calibrated over seeds
constexpr int kFewInliers = 6;  // whose residuals say nothing of the variance
// Of inertial factors among landmarks, whose sightings in a keyframe err together but count as independent.
// Simulated house, seed 1, 800 frames at 5 Hz: rotations err by up to 0.09 rad without, 0.03 with it.
constexpr double kInertialWeight = 33;
constexpr double kRegistrationDamping = 1e-3;  // keeps the system regular in unobserved directions

/// Equations of a pose from those of another that moves by `by_pose` times as much.
PoseEquations carried_over(PoseEquations equations, const Mat6& by_pose) {
  equations.information = (by_pose.transpose() * equations.information * by_pose).eval();
  equations.gradient = (by_pose.transpose() * equations.gradient).eval();
  return equations;
}

/// `rows`: motion during the frame, with its `gain` until the time of the depth image.
PoseEquations weighted_surface(const MapKeyframe& reference, const DepthGrid& grid, const SE3& T_odom_camera,
                               const RegistrationParams& params, double extra_gate_m,
                               const RowMotion& rows = {}, double gain = 0) {
  SurfaceMatching matching;
  matching.noise = params.noise;
  matching.extra_gate_m = extra_gate_m;
  SE3 T_ref_cur = reference.T_odom_camera.inverse() * T_odom_camera;
  const bool moves = !rows.is_zero() || reference.T_camera_depth;
  if (moves)
    T_ref_cur = reference.T_camera_depth.value_or(SE3{}).inverse() * T_ref_cur * rows.T_camera_depth();
  PoseEquations equations = surface_equations(reference.surface, grid, T_ref_cur, matching);
  if (moves) equations = carried_over(equations, (1 + gain) * adjoint(rows.T_camera_depth().inverse()));
  equations.information *= params.surface_weight_ratio;
  equations.gradient *= params.surface_weight_ratio;
  equations.cost *= params.surface_weight_ratio;
  return equations;
}

/// Updates the observations' pixels with the velocity that follows from the pose.
void move_to_middle_row(std::span<const LandmarkMatch> matches, const RowMotionModel& motion,
                        const SE3& T_odom_camera, std::span<PointObservation> observations) {
  const RowMotion rows = motion.rows_at(T_odom_camera);
  if (rows.is_zero()) return;
  const SE3 T_camera_odom = T_odom_camera.inverse();
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Vec2& image_pixel = matches[i].image_pixel;
    observations[i].pixel = rows.at_middle_row(image_pixel, (T_camera_odom * observations[i].p_odom).z());
    observations[i].pose_gain = 1 + motion.gain(rows.time_s(image_pixel.y()));
  }
}

double variance_scale(std::span<const PointObservation> observations, const SE3& T_odom_camera,
                      const PinholeCamera& camera, const RegistrationParams& params) {
  if (!params.adapt_variance) return 1;
  return std::clamp(residual_variance_scale(observations, T_odom_camera, camera), 1.0, kMaxVarianceScale);
}

}  // namespace

Registration register_frame(const LocalMap& map, const TrackerFrame& frame,
                            std::vector<LandmarkMatch>& matches, const SE3& T_odom_camera_guess,
                            const PinholeCamera& camera, const RegistrationParams& params) {
  std::vector<PointObservation> observations;
  for (const LandmarkMatch& match : matches) observations.push_back(match.observation);
  const MapKeyframe& reference = map.keyframes().back();
  Registration result{T_odom_camera_guess};
  for (int iteration = 0; iteration < params.max_iterations; ++iteration) {
    move_to_middle_row(matches, frame.motion, result.T_odom_camera, observations);
    const double scale = variance_scale(observations, result.T_odom_camera, camera, params);
    PoseEquations equations = point_equations(observations, result.T_odom_camera, camera, scale);
    if (params.surface_weight_ratio > 0)
      equations += weighted_surface(reference, frame.grid, result.T_odom_camera, params,
                                    iteration < kWideGateIterations ? kWideGate_m : 0.0,
                                    frame.motion.rows_at(result.T_odom_camera),
                                    frame.motion.gain(-frame.motion.times.delay_s));
    if (frame.up) equations += up_equations(*frame.up, result.T_odom_camera);
    if (frame.prior) equations += prior_equations(*frame.prior, result.T_odom_camera);
    result.information = equations.information;
    Mat6 damped = equations.information;
    damped.diagonal().array() += kRegistrationDamping;
    const Vec6 step = -solve_symmetric(damped, equations.gradient);
    if (!step.allFinite() || step.norm() > 1) break;
    result.T_odom_camera = result.T_odom_camera * SE3::exp(step);
    if (iteration >= kWideGateIterations && step.lpNorm<Eigen::Infinity>() < kRegistrationConverged) break;
  }
  move_to_middle_row(matches, frame.motion, result.T_odom_camera, observations);
  for (std::size_t i = 0; i < matches.size(); ++i) matches[i].observation.pixel = observations[i].pixel;
  result.variance_scale = residual_variance_scale(observations, result.T_odom_camera, camera);
  const double limit =
      kOutlierSquaredMahalanobis * variance_scale(observations, result.T_odom_camera, camera, params);
  for (LandmarkMatch& match : matches) {
    const auto residual = point_residual(match.observation, result.T_odom_camera, camera);
    match.inlier = residual && residual->squared_mahalanobis < limit;
    result.inliers += match.inlier ? 1 : 0;
  }
  if (frame.prior) {
    result.by_prior = prior_equations(*frame.prior, result.T_odom_camera);
    if (result.inliers < kFewInliers) result.variance_scale = frame.prior->scale / kSharedErrors;
  }
  return result;
}

double position_sigma_m(const Registration& registration) {
  Mat6 information = registration.information;
  information.diagonal().array() += 1e-6;
  const Mat3 covariance = inverse_of(information).topLeftCorner<3, 3>();
  return std::sqrt(std::max(0.0, symmetric_eigenvalues(covariance)[2]));
}

Mat6 covariance_in_camera(const Registration& registration) {
  Mat6 information = registration.information;
  information.diagonal().array() += kRegistrationDamping;
  return covariance_scale(registration) * inverse_of(information);
}

double covariance_scale(const Registration& registration) {
  return kSharedErrors * std::clamp(registration.variance_scale, kLeastVarianceScale, kMaxVarianceScale);
}

Mat6 covariance_in_odom(const Registration& registration) {
  return covariance_by_adjoint(covariance_in_camera(registration), registration.T_odom_camera);
}

PoseEquations up_equations(const UpPrior& up, const SE3& T_odom_camera) {
  PoseEquations equations;
  const Vec3 predicted = T_odom_camera.rotation().transpose() * up.up_odom;
  const Vec3 residual = predicted - up.up_camera;
  const Mat3 by_rotation = skew(predicted);  // of exp(-rotation) predicted
  const double weight = 1 / (up.sigma_rad * up.sigma_rad);
  equations.information.bottomRightCorner<3, 3>() = weight * by_rotation.transpose() * by_rotation;
  equations.gradient.tail<3>() = weight * by_rotation.transpose() * residual;
  equations.cost = 0.5 * weight * residual.squaredNorm();
  equations.terms = 1;
  return equations;
}

PoseEquations prior_equations(const PosePrior& prior, const SE3& T_odom_camera) {
  const Vec6 d = (prior.T_odom_camera.inverse() * T_odom_camera).log();
  PoseEquations equations;
  equations.information = prior.information;
  equations.gradient = prior.information * d;
  equations.cost = 0.5 * d.dot(equations.gradient);
  equations.terms = 1;
  return equations;
}

Registration registration_by_prior(const PosePrior& prior) {
  Registration result{prior.T_odom_camera, prior.information};
  result.variance_scale = prior.scale / kSharedErrors;
  result.by_prior = prior_equations(prior, prior.T_odom_camera);
  return result;
}

SurfaceFactor surface_factor(const MapKeyframe& reference, const DepthGrid& grid, const SE3& T_odom_camera,
                             const RowMotion& rows, const RegistrationParams& params) {
  const PoseEquations equations = weighted_surface(reference, grid, T_odom_camera, params, 0.0, rows);
  return {reference.identity, reference.T_odom_camera.inverse() * T_odom_camera, equations.information,
          equations.gradient};
}

SurfaceFactor prior_factor(const MapKeyframe& reference, const PosePrior& prior) {
  return {reference.identity, reference.T_odom_camera.inverse() * prior.T_odom_camera, prior.information,
          Vec6::Zero()};
}

SurfaceFactor turn_factor(const MapKeyframe& reference, const GyroTurn& turn, const SE3& T_odom_camera) {
  const Vec3 path = (reference.T_odom_camera.inverse() * T_odom_camera).translation();
  Mat6 information = Mat6::Zero();
  information.bottomRightCorner<3, 3>() = kInertialWeight * turn.covariance.inverse();
  return {reference.identity, SE3(turn.R_begin_end, path), information, Vec6::Zero()};
}

}  // namespace hm
