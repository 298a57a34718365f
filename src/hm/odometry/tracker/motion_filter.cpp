#include "hm/odometry/tracker/motion_filter.hpp"

#include <Eigen/Core>
#include <algorithm>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

constexpr int kStride = 2;                    // every other cell of the depth grid is enough
constexpr double kFilterWideGate_m = 0.01;    // of the first association
constexpr double kMotionReadingWeight = 0.3;  // readings of one surface are correlated
constexpr double kMotionSigma_m = 0.0005, kMotionSigma_rad = 0.002;  // of surfaces' motion besides noise
constexpr double kLeastTremble_m = 0.0002, kLeastTremble_rad = 0.0001;
constexpr double kPriorSigma =
    0.01;  // m and rad: keeps the model's motion in directions the surfaces leave free
constexpr double kMemory_frames = 20, kFirstFrames = 5;
// Jitter j makes the difference j(k) - j(k-1); its change, j(k) - 2 j(k-1) + j(k-2), has 1 + 4 + 1 variances
// of it, and two of the surfaces' own errors.
constexpr double kJitterOfChange = 6;
constexpr double kMinShareSeen = 0.2;   // of a degree of freedom; with less, the jitter is not estimated
constexpr double kFilterMaxStep = 0.2;  // m and rad: more is a failure

Mat6 diagonal(double translation, double rotation) {
  Vec6 values;
  values << Vec3::Constant(translation), Vec3::Constant(rotation);
  return values.asDiagonal();
}

}  // namespace

/// Motion estimated from the surfaces, with its normal equations and its difference from the model's motion.
struct MotionFilter::SurfaceMotion {
  SE3 T_last_camera;
  PoseEquations equations;
  Vec6 disagreement = Vec6::Zero();  ///< with the model's motion
  Mat6 share_seen = Mat6::Zero();    ///< share of a motion constrained by the surfaces
};

MotionFilter::SurfaceMotion MotionFilter::surface_motion(const DepthGrid& grid,
                                                         const SE3& T_last_camera) const {
  const Mat6 prior = Mat6::Identity() / (kPriorSigma * kPriorSigma);
  SurfaceMotion motion{T_last_camera, {}};
  for (const double extra_gate_m : {kFilterWideGate_m, 0.0}) {
    if (extra_gate_m == 0) motion.T_last_camera = T_last_camera * SE3::exp(motion.disagreement);
    motion.equations = surface_equations(surface_, grid, motion.T_last_camera, {noise_, 1, 4, extra_gate_m});
    motion.equations.information *= kMotionReadingWeight;
    motion.equations.gradient *= kMotionReadingWeight;
    const Mat6 covariance = inverse_of(motion.equations.information + prior);
    motion.share_seen = covariance * motion.equations.information;
    const Vec6 slope = motion.equations.gradient + prior * motion.disagreement;
    motion.disagreement -= covariance * slope;
  }
  return motion;
}

void MotionFilter::note_disagreement(const Vec6& disagreement, const Mat6& share_seen) {
  const auto blend = [this](double& mean, double squares, double seen) {
    if (seen < kMinShareSeen) return;
    mean += std::min(1.0, seen) * (squares / seen - mean) / std::max(frames_, kFirstFrames);
  };
  if (disagreement_ || frames_ == 0) {
    // A first difference has two variances.
    const Vec6 squares = disagreement_ ? Vec6((disagreement - *disagreement_).cwiseAbs2())
                                       : Vec6(0.5 * kJitterOfChange * disagreement.cwiseAbs2());
    frames_ = std::min(frames_ + 1, kMemory_frames);
    blend(translation_m2_, squares.head<3>().sum(), share_seen.topLeftCorner<3, 3>().trace());
    blend(rotation_rad2_, squares.tail<3>().sum(), share_seen.bottomRightCorner<3, 3>().trace());
  }
  disagreement_ = disagreement;
}

Mat6 MotionFilter::model_information() const {
  const auto variance = [](double squares, double sigma, double least) {
    return std::max(least * least, (squares - 2 * sigma * sigma) / kJitterOfChange);
  };
  return diagonal(1 / variance(translation_m2_, kMotionSigma_m, kLeastTremble_m),
                  1 / variance(rotation_rad2_, kMotionSigma_rad, kLeastTremble_rad));
}

SE3 MotionFilter::update(const DepthGrid& grid, const SE3& T_odom_camera) {
  const SurfaceMotion motion = surface_motion(grid, T_odom_model_.inverse() * T_odom_camera);
  note_disagreement(motion.disagreement, motion.share_seen);
  // The surfaces' information on the new pose, after their own errors and those of the last pose.
  const Mat6 loose =
      inverse_of(diagonal(kMotionSigma_m * kMotionSigma_m, kMotionSigma_rad * kMotionSigma_rad) +
                 covariance_by_adjoint(covariance_, motion.T_last_camera.inverse()));
  const Mat6 damping = loose * inverse_of(motion.equations.information + loose);
  const Mat6 of_model = model_information();
  const Mat6 information = damping * motion.equations.information + of_model;
  const SE3 T_predicted = T_odom_last_ * motion.T_last_camera;
  const Vec6 from_model = (T_odom_camera.inverse() * T_predicted).log();
  const Vec6 step =
      -solve_symmetric(information, damping * motion.equations.gradient + of_model * from_model);
  if (!step.allFinite() || step.norm() > kFilterMaxStep) {
    restart(grid, T_odom_camera);
    return T_odom_camera;
  }
  T_odom_last_ = T_predicted * SE3::exp(step);
  covariance_ = inverse_of(information);
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
  T_odom_model_ = T_odom_camera;
  surface_ = sample_surface(grid, noise_, kStride);
  return T_odom_last_;
}

void MotionFilter::restart(const DepthGrid& grid, const SE3& T_odom_camera) {
  T_odom_last_ = T_odom_model_ = T_odom_camera;
  disagreement_.reset();
  covariance_ = inverse_of(model_information());
  surface_ = sample_surface(grid, noise_, kStride);
}

void MotionFilter::restore(const DepthGrid& grid) { surface_ = sample_surface(grid, noise_, kStride); }

Mat6 MotionFilter::covariance_in_odom() const { return covariance_by_adjoint(covariance_, T_odom_last_); }

}  // namespace hm
