#pragma once
#include <cstddef>
#include <list>
#include <memory>
#include <span>
#include <vector>

#include "hm/laser/matching/planar_scan.hpp"
#include "hm/slam/laser/correlative_map.hpp"
#include "hm/slam/laser/observed_area.hpp"
#include "hm/slam/laser/scan_graph_params.hpp"

namespace hm {

/// A keyframe as the graph keeps it.
struct GraphKeyframe2D {
  PlanarScan scan;  ///< in the frame of the base
  SE2 T_odom_base;
  /// Covariance of T_previous_base as (x, y, angle), in the frame of the previous keyframe.
  Mat3 covariance = Mat3::Zero();
};

/// Consecutive keyframes that loops are searched in together: as odometry placed them, which errs little over
/// so short a way, and which no solution of the graph changes.
struct ScanSubmap {
  std::size_t first = 0, end = 0;  ///< keyframes [first, end)
  [[nodiscard]] std::size_t anchor() const { return first + (end - first) / 2; }
};

/// Points of a scan within a range of its laser, at most `max_points` of them, evenly taken.
std::vector<Vec2> points_within(const PlanarScan& scan, double range_m, std::size_t max_points);

/// The likelihood rasters of submaps, in the frames of their anchors: made when first used, the last sixteen
/// kept.
class SubmapRasters {
 public:
  explicit SubmapRasters(const ScanGraph2DParams& params) : params_(params) {}
  struct Raster {
    std::size_t first;  // keyframe of the submap
    CorrelativeMap map;
    ObservedArea seen;
  };
  const Raster& raster(const ScanSubmap& submap, std::span<const GraphKeyframe2D> keyframes);

 private:
  ScanGraph2DParams params_;
  std::list<Raster> kept_;  // the last one used first
};

}  // namespace hm
