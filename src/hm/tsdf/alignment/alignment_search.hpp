#pragma once
#include <cstddef>

#include "hm/tsdf/alignment/alignment_step.hpp"
#include "hm/tsdf/alignment/alignment_terms.hpp"

namespace hm {

/// Parameters of searching surfaces along rays, for poses so far off that readings fall where distances are
/// saturated.
struct SurfaceSearch {
  double reach_m = 0;         ///< range before and behind a reading
  double near_surface_m = 0;  ///< distances beyond are saturated; also the step along the ray
  double width_m = 0;         ///< of the robust weight
  std::size_t count = 0;      ///< number of readings, the first ones ......
  std::size_t every = 1;      ///< ... and of these every n-th is used
};

/// Camera pose and centre of rotation.
struct SearchPose {
  const SE3& T_world_camera;
  const Vec3& p_world_centre;
};

/// Normal equations of the readings' point-to-plane distances: the plane is the map's surface nearest to the
/// reading on its own ray, as in projective matching with an image raycast from the map (Newcombe et al.,
/// ISMAR 2011). Of the sums, only weight, agreeing (readings with a surface) and cost are set.
AlignmentTerms sum_search_terms(const SurfaceSearch& search, const AlignmentPoints& points,
                                const SearchPose& pose, VoxelLookup& lookup);

}  // namespace hm
