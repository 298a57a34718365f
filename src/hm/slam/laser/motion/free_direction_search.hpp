#pragma once
#include <optional>
#include <vector>

#include "hm/laser/odometry/scan_odometry.hpp"
#include "hm/slam/laser/motion/recent_keyframes.hpp"
#include "hm/slam/laser/search/correlative_map.hpp"

namespace hm {

/// Finds how far a scan lies along a direction that point-to-line matching leaves free, as along a corridor.
///
/// The reveals of doors and the ends of niches are seen by few beams: too few for a line each, and what pairs
/// of points hold there is as often wrong as right. But where a wall steps back, each beam near the step
/// misses the wall by the depth of the niche unless the scan lies right. So the scan is moved along the
/// direction, scored on the walls of the last keyframes (Olson, ICRA 2009), and the scores are weighed with
/// the prediction: the result is the mean of the posterior. Walls are lines from beam to beam, as single
/// points of grazing beams would fit best where the vehicle had stood still; and the scan's walls are those
/// so near that the keyframes' reach beyond them at every shift, as else the smallest shift would fit best.
///
/// Deterministic; not thread safe.
class FreeDirectionSearch {
 public:
  /// Largest shift that is looked at.
  static constexpr double kReach_m = 0.55;

  /// Adds a scan with known pose.
  void add(const PlanarScan& scan, const SE2& T_odom_base);
  /// How far along `direction_odom` (a unit vector) the scan lies from T_odom_base, which was predicted with
  /// the standard deviation `predicted_sigma_m` along it; nothing where there are too few walls.
  std::optional<FoundShift> find(const PlanarScan& scan, const SE2& T_odom_base, const Vec2& direction_odom,
                                 double predicted_sigma_m);
  void clear();

 private:
  const CorrelativeMap& raster();

  RecentKeyframes<std::vector<Vec2>> keyframes_;  // points along walls, in `odom`
  std::optional<CorrelativeMap> raster_;          // of keyframes_; built on first use
};

}  // namespace hm
