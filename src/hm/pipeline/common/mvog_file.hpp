#pragma once
#include <filesystem>

#include "hm/core/params.hpp"
#include "hm/core/result.hpp"
#include "hm/geometry/occupancy_grid_2d.hpp"
#include "hm/mvog/multi_volume_grid.hpp"

namespace hm {

/// Reads a multi-volume occupancy grid (.mvog). Errors name the file and the byte.
Result<MultiVolumeGrid> read_mvog(const std::filesystem::path& path);

/// Heights between which a grid is cut into a plan; among the parameters of section `laser`.
struct SliceParams {
  double slice_bottom_m = 0.3;
  double slice_top_m = 1.8;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"slice_bottom_m", {-1000, 1000}, "map.pgm: lowest height; planar recordings: all heights"},
      self.slice_bottom_m);
    v(ParamDoc{"slice_top_m", {-1000, 1000}, "map.pgm: greatest height"}, self.slice_top_m);
  }
};

/// True when all of a map lies within one layer, as scans without mirrors and tilt make it.
bool is_planar(const MultiVolumeGrid& map);
/// The horizontal part of a grid that scans see: between slice_bottom_m and slice_top_m; a map of one layer
/// as a whole.
Result<OccupancyGrid2D> plan_of(const MultiVolumeGrid& map, const SliceParams& heights);

}  // namespace hm
