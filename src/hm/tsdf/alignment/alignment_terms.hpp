#pragma once
#include <cstddef>
#include <cstdint>

#include "hm/tsdf/alignment/alignment_points.hpp"
#include "hm/tsdf/grid/voxel_lookup.hpp"

namespace hm {

/// Share of the distance limit up to which few of the eight voxels are saturated.
inline constexpr double kNearSurface_ratio = 0.75;
/// Smallest gradient norm of the distance at a surface.
inline constexpr double kLeastSlope = 0.3;

/// Camera pose in single precision relative to nearby voxels, so that accuracy does not depend on the
/// distance from the world's origin.
struct AlignmentView {
  float R[9] = {};                   ///< camera to world axes, row by row
  float t_centre_m[3] = {};          ///< camera position relative to the centre of rotation
  float centre_voxel[3] = {};        ///< that centre relative to the first voxel's centre, in voxels
  std::int32_t first_voxel[3] = {};  ///< world index
  float voxel_size_m = 0;
  float near_surface_units = 0;  ///< distances beyond are saturated and unused
  float min_slope2_units = 0;    ///< squared gradient, units a voxel, below which there is no surface

  AlignmentView(const SE3& T_world_camera, const Vec3& p_world_centre, const VolumeGrid& grid,
                double distance_limit_m);
};

/// Weighted normal equations H xi = -b of the readings' distances from the surface, xi = [shift; turn] in
/// world axes about the centre of rotation, and sums over readings.
struct AlignmentTerms {
  Mat6 H = Mat6::Zero();  ///< information up to the factor robust_sigmas_ratio^2
  Vec6 b = Vec6::Zero();
  double weight = 0;     ///< sum of the readings' weights: H of a direction fully constrained by all
  double cost = 0;       ///< sum of robust costs, 1 for each outlier or reading without a surface nearby
  double on_map = 0;     ///< readings close enough to a surface to be compared
  double agreeing = 0;   ///< of them, within the width of the robust function
  double square_m2 = 0;  ///< sum of squared distances of these
};

/// Sums the terms of the first `count` readings; looks up the corners of readings that moved to other voxels.
AlignmentTerms sum_alignment_terms(const AlignmentView& view, std::size_t count, VoxelLookup& lookup,
                                   AlignmentPoints& points);

}  // namespace hm
