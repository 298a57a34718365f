#pragma once
#include <optional>
#include <span>

#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

class ParallelLoop;
class VolumeGrid;

/// Sample of a volume grid at a point, trilinear between the eight voxels around it (dissertation 4.2.3: a
/// sampled signed distance function).
struct GridSample {
  bool known = false;  ///< all eight voxels were observed; else nothing below is set
  /// Signed distance to the surface, metres: positive in front of it, negative behind; clamped to the
  /// truncation of its readings.
  double distance_m = 0;
  Vec3 gradient =
      Vec3::Zero();           ///< of the distance, metres per metre, world axes; points away from the surface
  double weight = 0;          ///< in observations at the narrowest truncation
  std::optional<Rgb8> color;  ///< of the voxels with colour; only near surfaces
};

/// Samples a grid at a point in world coordinates (metres). A point that is not finite or outside the grid is
/// unknown. Thread safe while no thread changes the grid.
GridSample query_grid(const VolumeGrid& grid, const Vec3& p_world);

/// The same for many points; `samples` must have the same length. Fastest if neighbours in the list are
/// neighbours in space. Results do not depend on the number of threads.
void query_grid(const VolumeGrid& grid, std::span<const Vec3> p_world, std::span<GridSample> samples,
                const ParallelLoop& loop);

}  // namespace hm
