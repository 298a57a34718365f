#pragma once
#include <optional>
#include <span>

#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

class ParallelLoop;
class VolumeGrid;

/// What a volume grid holds at a point, trilinear between the eight voxels around it (dissertation 4.2.3: a
/// sampled signed distance function).
struct GridSample {
  bool known = false;  ///< all eight voxels were observed; else nothing below is filled
  /// Signed distance to the surface, metres: positive in front of it, negative behind; clamped to the
  /// truncation of the readings that it is made of.
  double distance_m = 0;
  Vec3 gradient =
      Vec3::Zero();           ///< of the distance, metres per metre, world axes: points away from the surface
  double weight = 0;          ///< observations, each counted as one at the narrowest truncation
  std::optional<Rgb8> color;  ///< of the voxels that have one; only near surfaces
};

/// Samples a grid at a point in world coordinates (metres). A point that is not finite, or outside of the
/// grid, is unknown. Any number of threads may query a grid that none changes.
GridSample query_grid(const VolumeGrid& grid, const Vec3& p_world);

/// Queries many points, at the same places of `samples` (as long); fastest where neighbours in the list
/// are neighbours in space. The same values for any number of threads.
void query_grid(const VolumeGrid& grid, std::span<const Vec3> p_world, std::span<GridSample> samples,
                const ParallelLoop& loop);

}  // namespace hm
