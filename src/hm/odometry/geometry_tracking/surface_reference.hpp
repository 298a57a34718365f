#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "hm/odometry/registration/surface_grid.hpp"

namespace hm {

/// Depth image with a known pose that others are compared with.
struct SurfaceReference {
  std::uint64_t identity = 0;
  SE3 T_odom_depth;                ///< pose of the camera when the image was taken
  Mat6 covariance = Mat6::Zero();  ///< of the pose, relative to the model: left perturbation in odom
  const DepthGrid* grid = nullptr;
};

/// Pixel nearest to where a point of the camera's frame is seen, be it in the image or not; nothing within 5
/// cm of the camera's plane or behind it.
std::optional<Eigen::Vector2i> nearest_pixel(const PinholeCamera& camera, const Vec3& p);

/// Mean of the readings; 1 m without any.
double mean_depth_m(const DepthGrid& grid);

/// Share of the readings (0 to 1) that `reference` also has, from their depths alone, at a motion that may be
/// wrong by a few centimetres.
double shared_view(const DepthGrid& reference, const DepthGrid& current, const SE3& T_ref_cur);

/// References chosen for a frame.
struct ChosenReferences {
  std::vector<std::size_t> indices;
  bool has_close = false;  ///< one of all references shows nearly the same view
};

/// Chooses the references for a frame at a predicted pose: those that share most of its view, and those that
/// share enough and have the most certain poses, so that the frame is held by the oldest of the model that it
/// still sees.
ChosenReferences choose_references(std::span<const SurfaceReference> references, const DepthGrid& current,
                                   const SE3& T_odom_depth);

}  // namespace hm
