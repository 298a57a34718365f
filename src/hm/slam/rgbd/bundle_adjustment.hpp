#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/odometry/keyframe.hpp"

namespace hm {

/// A feature of two keyframes that is one point in space, as verify_place found it.
struct FeatureLink {
  std::uint32_t keyframe_a = 0, feature_a = 0, keyframe_b = 0, feature_b = 0;
};

/// One sight of a landmark.
struct LandmarkObservation {
  std::uint32_t keyframe = 0;
  Vec2 pixel = Vec2::Zero();
  double depth_m = 0;  ///< 0: none
  double depth_sigma_m = 0;
};

struct Landmark {
  Vec3 p_map = Vec3::Zero();
  std::vector<LandmarkObservation> observations;  ///< at most one of a keyframe
};

/// Merges linked features into landmarks. One that would have two features of a keyframe is ambiguous and
/// left out. Placed at the weighted mean of what its keyframes see.
std::vector<Landmark> make_landmarks(std::span<const Keyframe* const> keyframes,
                                     std::span<const SE3> T_map_camera, std::span<const FeatureLink> links);

struct BundleParams {
  int max_iterations = 30;
  double pixel_sigma_px = 1.0;
  double loss_sigmas = 2.0;  ///< beyond, an observation loses its influence (Huber)
};

struct BundleResult {
  bool converged = false;
  int iterations = 0;
  std::size_t observations = 0;
  double initial_cost = 0, final_cost = 0;         ///< half the sum of the robust squares
  double error_before_px = 0, error_after_px = 0;  ///< reprojection, RMS over observations
  std::string message;
};

/// Moves keyframes and landmarks to the robust least squares optimum of reprojection and depth (Triggs et al.
/// 1999; depth residual (z - reading) / sigma). Keyframes of `fixed` stay, and those without landmarks. Schur
/// complement, analytic Jacobians, one thread, deterministic. Nothing moves when it fails.
BundleResult adjust_bundle(const PinholeCamera& camera, std::vector<SE3>& T_map_camera,
                           std::vector<Landmark>& landmarks, std::span<const std::size_t> fixed,
                           const BundleParams& params = {});

/// Derivatives of the residual [u; v; depth] by the keyframe's move (moved_by) and by the landmark: 3 x 9.
Eigen::Matrix<double, 3, 9> observation_jacobian(const PinholeCamera& camera, const SE3& T_map_camera,
                                                 const Vec3& p_map);

}  // namespace hm
