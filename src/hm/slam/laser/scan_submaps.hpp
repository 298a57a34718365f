#pragma once
#include <cstddef>
#include <list>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "hm/laser/matching/planar_scan.hpp"
#include "hm/slam/laser/scan_graph_params.hpp"
#include "hm/slam/laser/search/correlative_map.hpp"

namespace hm {

/// Keyframe of the scan graph.
struct GraphKeyframe2D {
  PlanarScan scan;  ///< in the frame of the base
  SE2 T_odom_base;
  /// Covariance of T_previous_base as (x, y, angle), in the frame of the previous keyframe.
  Mat3 covariance = Mat3::Zero();
  /// The same of what wheels measured, where they measured all of it.
  std::optional<Mat3> wheel_covariance = {};
  double height_m = 0;  ///< of the vehicle: scans at other heights show other things
};

/// Consecutive keyframes that are searched together for loops. They keep their relative odometry poses, whose
/// drift over such a short distance is small, so that optimisation does not change a submap.
struct ScanSubmap {
  std::size_t first = 0, end = 0;  ///< keyframes [first, end)
  [[nodiscard]] std::size_t anchor() const { return first + (end - first) / 2; }
};

/// Points of a scan within a range of the laser, evenly thinned to at most `max_points`.
std::vector<Vec2> points_within(const PlanarScan& scan, double range_m, std::size_t max_points);

/// Scan of a submap by a laser at `origin_m` (in the frame of the base) from a pose: in each direction the
/// nearest point of its scans, in the frame of that base. For matching: half of what a laser that sees half
/// of its surroundings shows on its way back, no single scan of the way there shows.
PlanarScan submap_scan(const ScanSubmap& submap, std::span<const GraphKeyframe2D> keyframes,
                       const SE2& T_odom_base, const Vec2& origin_m);

/// Cache of the submaps' likelihood rasters in the frames of their anchors, built on first use; holds the
/// last sixteen used.
class SubmapRasters {
 public:
  explicit SubmapRasters(const ScanGraph2DParams& params) : params_(params) {}
  struct Raster {
    std::size_t first;  // first keyframe of the submap
    CorrelativeMap map;
  };
  const Raster& raster(const ScanSubmap& submap, std::span<const GraphKeyframe2D> keyframes);

 private:
  ScanGraph2DParams params_;
  std::list<Raster> kept_;  // most recently used first
};

}  // namespace hm
