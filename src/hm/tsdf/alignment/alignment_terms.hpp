#pragma once
#include <cstddef>
#include <cstdint>

#include "hm/tsdf/alignment/alignment_points.hpp"
#include "hm/tsdf/grid/voxel_lookup.hpp"

namespace hm {

/// Of the largest distance that an observation tells: up to here few of the eight voxels are saturated.
inline constexpr double kNearSurface_ratio = 0.75;
/// Slopes of the distance below this are no surface.
inline constexpr double kLeastSlope = 0.3;

/// A camera pose as the terms need it: single precision relative to voxels nearby, so that it does not matter
/// how far from the world's origin the camera is.
struct AlignmentView {
  float R[9] = {};                   ///< camera to world axes, row by row
  float t_centre_m[3] = {};          ///< the camera, relative to the centre of turning
  float centre_voxel[3] = {};        ///< that centre relative to the first voxel's centre, in voxels
  std::int32_t first_voxel[3] = {};  ///< world index
  float voxel_size_m = 0;
  float near_surface_units = 0;  ///< distances beyond are saturated: they tell nothing
  float min_slope2_units = 0;    ///< squared gradient, units a voxel, below which there is no surface

  AlignmentView(const SE3& T_world_camera, const Vec3& p_world_centre, const VolumeGrid& grid,
                double distance_limit_m);
};

/// What the readings say about a pose: weighted normal equations H xi = -b of the distances from the surface,
/// xi = [shift; turn] in world axes about the centre of turning; and sums over readings.
struct AlignmentTerms {
  Mat6 H = Mat6::Zero();  ///< information but for the factor robust_sigmas_ratio^2
  Vec6 b = Vec6::Zero();
  double weight = 0;  ///< sum of the readings' weights: H of one direction that all of them see fully
  double cost = 0;    ///< sum of robust costs, 1 for each reading that does not agree or has no surface near
  double on_map = 0;  ///< readings near enough to a surface to be compared
  double agreeing = 0;   ///< of them, within the width of the robust function
  double square_m2 = 0;  ///< of the agreeing ones, sum of squared distances
};

/// The terms of the first `count` readings. The corners of readings that moved on to other voxels are looked
/// up.
AlignmentTerms sum_alignment_terms(const AlignmentView& view, std::size_t count, VoxelLookup& lookup,
                                   AlignmentPoints& points);

}  // namespace hm
