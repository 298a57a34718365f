#pragma once
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "hm/core/run_context.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/pose_graph_3d.hpp"
#include "hm/odometry/feature/keyframe.hpp"
#include "hm/odometry/registration/surface_grid.hpp"
#include "hm/slam/rgbd/covisibility_matches.hpp"
#include "hm/slam/rgbd/disparity_offset.hpp"
#include "hm/slam/rgbd/focal_length_check.hpp"

namespace hm {

/// Depth image of a keyframe, of the size of the keyframe's camera.
struct KeyframeDepth {
  DepthImage depth;
  SE3 T_camera_depth;  ///< pose of the camera when the depth image was taken, relative to the keyframe's
};

/// Gives the depth images of keyframes again.
struct KeyframeDepths {
  /// Nothing where the image cannot be read. No function: there are no depth images.
  std::function<std::optional<KeyframeDepth>(const Keyframe&)> read;
  DepthNoise noise;
};

/// How far the surfaces that pairs of keyframes show lie apart, with two sets of poses.
struct SurfaceAgreement {
  std::size_t views = 0;  ///< compared: a keyframe's surfaces with the depth image of another
  /// Means over the views of the mean distance along the normal, metres.
  double distance_m = 0, other_distance_m = 0;
  /// Means over the views of the mean of log(1 + (d / 2 sigma)^2) (Cauchy), d the distance.
  double cost = 0, other_cost = 0;
};

/// Surfaces in the depth images of keyframes: what depth says of the poses, besides features. Keeps about
/// 0.1 MB a keyframe.
class KeyframeSurfaces {
 public:
  KeyframeSurfaces(const PinholeCamera& camera, std::span<const std::shared_ptr<const Keyframe>> keyframes,
                   const KeyframeDepths& depths, const RunContext& run = {});

  /// Relative surface factor: motion from keyframe a to b by the point-to-plane distances of their surfaces
  /// (dissertation 4.2.8, between two depth images), as an edge of a pose graph. Its information is that of
  /// the distances, readings of a surface counting a thirtieth, with an error that all of them share. It is
  /// zero where the surfaces leave the motion free: a wall holds its normal and two turns. Nothing if less
  /// than 30 % of a's surface is found again.
  [[nodiscard]] std::optional<PoseEdge3D> factor(std::uint32_t a, std::uint32_t b, const SE3& T_a_b) const;

  /// Compares the same points of the same views with both sets of poses. Points of which one set says that
  /// they are hidden (over 0.1 m apart) do not count, nor views with less than 100 points.
  [[nodiscard]] SurfaceAgreement agreement(std::span<const KeyframePair> pairs,
                                           std::span<const SE3> T_map_camera,
                                           std::span<const SE3> T_map_other) const;

  /// Self-calibration of disparity by these pairs (estimate_disparity_offset()).
  [[nodiscard]] DisparityOffset disparity_offset(std::span<const KeyframePair> pairs,
                                                 std::span<const SE3> T_map_camera,
                                                 const RunContext& run = {}) const;
  /// Whether the camera's focal length is right, by these pairs (check_focal_length()).
  [[nodiscard]] FocalLengthCheck focal_length(std::span<const KeyframePair> pairs,
                                              std::span<const SE3> T_map_camera,
                                              const RunContext& run = {}) const;

 private:
  struct Surface {
    DepthGrid grid;
    std::vector<SurfaceElement> elements;  ///< of its own depth image
    SE3 T_camera_depth;
  };
  [[nodiscard]] std::vector<SurfacePair> surface_pairs(std::span<const KeyframePair> pairs,
                                                       std::span<const SE3> T_map_camera) const;
  void compare(const KeyframePair& pair, std::span<const SE3> T_map_camera, std::span<const SE3> T_map_other,
               SurfaceAgreement& sums) const;

  DepthNoise noise_;
  std::vector<std::optional<Surface>> surfaces_;
};

}  // namespace hm
