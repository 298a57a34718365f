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

/// A feature of two keyframes that is one point in space, found by verify_place or match_covisible.
struct FeatureLink {
  std::uint32_t keyframe_a = 0, feature_a = 0, keyframe_b = 0, feature_b = 0;
};

/// Observation of a landmark.
struct BundleObservation {
  std::uint32_t keyframe = 0;
  Vec2 pixel = Vec2::Zero();
  Eigen::Matrix2d pixel_covariance = Eigen::Matrix2d::Identity();
  double depth_m = 0;  ///< 0: none
  double depth_sigma_m = 0;
};

struct BundleLandmark {
  Vec3 p_map = Vec3::Zero();
  std::vector<BundleObservation> observations;  ///< at most one of a keyframe, ascending
};

/// Keyframes and landmarks that are adjusted together.
struct Bundle {
  PinholeCamera camera;
  std::vector<SE3> T_map_camera;
  std::vector<BundleLandmark> landmarks;
  std::vector<std::size_t> fixed;  ///< keyframes that stay
  /// Further constraints on the motion between keyframes, as in a pose graph.
  std::vector<PoseEdge3D> edges;
};

struct LandmarkNoise {
  /// Standard deviation in pixels of matched features: corners are found again this well from other places
  /// (in the house 0.5 and 1 leave a little more error).
  double feature_sigma_px = 0.8;
  double shared_depth_ratio =
      1.5;  ///< readings of a landmark share errors: each counts as so much less certain
};

/// The landmarks of keyframes at bundle.T_map_camera. Odometry's are taken as it saw them
/// (Keyframe::observations, or as the next keyframe has refined them). A link adds its younger feature to the
/// older one's landmark as a further observation, or the other way round; links between features that are of
/// none become landmarks of their own, left out when they would have two features of a keyframe. Placed at
/// the weighted mean of what keyframes see; those that only one sees, and those never seen with depth, are
/// left out.
void make_landmarks(Bundle& bundle, std::span<const Keyframe* const> keyframes,
                    std::span<const FeatureLink> links, const LandmarkNoise& noise = {});

struct BundleParams {
  int max_iterations = 30;
  /// Beyond, an observation loses its influence (Cauchy); 0: never. In deviations as they turn out to be
  /// (from the median of the residuals), at most those stated: matches are often better than stated.
  double loss_sigmas = 2.0;
  /// Number of other keyframes with which a keyframe shares landmarks, on average; beyond, the normal
  /// equations are solved by conjugate gradients. If all keyframes see the same place, the time of a Cholesky
  /// factorisation grows with their cube, while conjugate gradients, which never form the Schur complement,
  /// cost the same for each observation however many keyframes there are. (1,000 keyframes of the simulated
  /// house: 34, 600 of one room: 184. At 60 both take the same time.)
  double most_covisible = 60;
};

struct BundleResult {
  bool converged = false;    ///< the poses are of use: with `interrupted`, as good as they were by then
  bool interrupted = false;  ///< asked to stop
  int iterations = 0;
  bool conjugate_gradients = false;         ///< instead of the factorisation (BundleParams::most_covisible)
  std::size_t observations = 0;             ///< adjusted
  std::size_t observations_behind = 0;      ///< dropped: their landmark begins behind their camera
  double initial_cost = 0, final_cost = 0;  ///< half the sum of the robust squares, by the last pass's loss
  double error_before_px = 0, error_after_px = 0;  ///< reprojection, median over observations
  std::string message;
};

/// Moves keyframes and landmarks to the robust least squares optimum of reprojection and depth (Triggs et al.
/// 1999; depth residual (z - reading) / sigma) and of the edges. Keyframes without landmarks and edges stay.
/// Two passes, Schur complement (solved by sparse Cholesky, or by conjugate gradients preconditioned by its
/// diagonal blocks: Agarwal et al., ECCV 2010), analytic Jacobians, one thread, deterministic. Nothing moves
/// when it fails. Reports its progress by iterations; when `run` is asked to stop it ends after the iteration
/// in work and keeps what that has found.
BundleResult adjust_bundle(Bundle& bundle, const BundleParams& params = {}, const RunContext& run = {});

/// Derivatives of the residual [u; v; depth] by the keyframe's move (moved_by) and by the landmark: 3 x 9.
Eigen::Matrix<double, 3, 9> observation_jacobian(const PinholeCamera& camera, const SE3& T_map_camera,
                                                 const Vec3& p_map);

}  // namespace hm
