#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hm/core/run_context.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/pose_graph_3d.hpp"
#include "hm/odometry/feature/keyframe.hpp"

namespace hm {

/// Match of two keyframes' features that are the same point, from verify_place() or match_covisible().
struct FeatureLink {
  std::uint32_t keyframe_a = 0, feature_a = 0, keyframe_b = 0, feature_b = 0;
};

/// Observation of a landmark.
struct BundleObservation {
  std::uint32_t keyframe = 0;
  Vec2 pixel = Vec2::Zero();
  Eigen::Matrix2d pixel_covariance = Eigen::Matrix2d::Identity();
  double depth_m = 0;  ///< 0: no depth
  double depth_sigma_m = 0;
};

struct BundleLandmark {
  Vec3 p_map = Vec3::Zero();
  std::vector<BundleObservation> observations;  ///< at most one per keyframe, ascending
};

/// Keyframes and landmarks to be adjusted together.
struct Bundle {
  PinholeCamera camera;
  std::vector<SE3> T_map_camera;
  std::vector<BundleLandmark> landmarks;
  std::vector<std::size_t> fixed;  ///< indices of fixed keyframes
  /// Further constraints on the motion between keyframes, as in a pose graph.
  std::vector<PoseEdge3D> edges;
};

struct LandmarkNoise {
  /// Standard deviation of matched features in pixels, i.e. of detecting the same corner from different
  /// positions (0.5 and 1 give a slightly larger error in the simulated house).
  double feature_sigma_px = 0.8;
  /// Factor on the standard deviations of depth readings, whose errors are correlated within a landmark.
  double shared_depth_ratio = 1.5;
};

/// Creates the landmarks of keyframes at bundle.T_map_camera. Odometry's landmarks are used with its
/// observations (Keyframe::observations, refined by the next keyframe if available). A link adds one of its
/// features as a further observation to the landmark of the other, preferably of the older one; links between
/// features without landmarks create landmarks, except those with two features in a keyframe. A landmark's
/// position is the weighted mean of its observations with depth; landmarks with a single observation or
/// without depth are dropped.
void make_landmarks(Bundle& bundle, std::span<const Keyframe* const> keyframes,
                    std::span<const FeatureLink> links, const LandmarkNoise& noise = {});

struct BundleParams {
  int max_iterations = 30;
  /// Scale of the Cauchy loss, in standard deviations; 0: none. The standard deviations are estimated from
  /// the median of the residuals, at most the given ones: matches are often more accurate than stated.
  double loss_sigmas = 2.0;
  /// Mean number of keyframes that share landmarks with a keyframe, above which the normal equations are
  /// solved by conjugate gradients. If all keyframes see the same place, the time of a Cholesky factorisation
  /// is cubic in their number, while conjugate gradients, which never form the Schur complement, take
  /// constant time per observation. (1,000 keyframes of the simulated house: 34, 600 of one room: 184. Equal
  /// at 60.)
  double most_covisible = 60;
};

struct BundleResult {
  bool converged = false;    ///< the poses are usable; if `interrupted`, those of the last iteration
  bool interrupted = false;  ///< stopped by the caller
  int iterations = 0;
  bool conjugate_gradients = false;     ///< used instead of the factorisation (BundleParams::most_covisible)
  std::size_t observations = 0;         ///< used
  std::size_t observations_behind = 0;  ///< dropped, since their landmark is behind the camera initially
  double initial_cost = 0, final_cost = 0;         ///< half the sum of robust squares, last pass's loss
  double error_before_px = 0, error_after_px = 0;  ///< median reprojection error
  std::string message;
};

/// Optimises keyframes and landmarks by robust least squares of reprojection, depth (Triggs et al. 1999;
/// residual (z - reading) / sigma) and edges. Keyframes without landmarks and edges are fixed. Two passes,
/// Schur complement (sparse Cholesky, or conjugate gradients preconditioned by its diagonal blocks: Agarwal
/// et al., ECCV 2010), analytic Jacobians; single-threaded, deterministic. If it fails, nothing is changed.
/// Reports progress per iteration; if `run` is stopped, ends after the current iteration and keeps its
/// result.
BundleResult adjust_bundle(Bundle& bundle, const BundleParams& params = {}, const RunContext& run = {});

/// Derivatives of the residual [u; v; depth] with respect to a perturbation of the keyframe (moved_by) and to
/// the landmark: 3 x 9.
Eigen::Matrix<double, 3, 9> observation_jacobian(const PinholeCamera& camera, const SE3& T_map_camera,
                                                 const Vec3& p_map);

}  // namespace hm
