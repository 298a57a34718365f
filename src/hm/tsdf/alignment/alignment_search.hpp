#pragma once
#include <cstddef>

#include "hm/tsdf/alignment/alignment_step.hpp"
#include "hm/tsdf/alignment/alignment_terms.hpp"

namespace hm {

/// How surfaces are sought along rays, for poses so far off that readings fall where distances are saturated.
struct SurfaceSearch {
  double reach_m = 0;         ///< before a reading and behind it
  double near_surface_m = 0;  ///< distances beyond are saturated; also the step along the ray
  double width_m = 0;         ///< of the robust weight
  std::size_t count = 0;      ///< of the readings, the first so many ...
  std::size_t every = 1;      ///< ... and of these every n-th is used
};

/// Where the camera is, and what it turns about.
struct SearchPose {
  const SE3& T_world_camera;
  const Vec3& p_world_centre;
};

/// The normal equations of the readings' distances from planes: the map's surface nearest to the reading on
/// its own ray, as in projective point-to-plane matching with a picture cast from the map (Newcombe et al.,
/// ISMAR 2011). Of the sums, only weight, agreeing (readings with a surface) and cost are filled.
AlignmentTerms sum_search_terms(const SurfaceSearch& search, const AlignmentPoints& points,
                                const SearchPose& pose, VoxelLookup& lookup);

}  // namespace hm
