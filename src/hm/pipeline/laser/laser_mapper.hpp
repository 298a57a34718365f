#pragma once
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/occupancy_grid_2d.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/mvog/multi_volume_grid.hpp"
#include "hm/sensors/imu.hpp"
#include "hm/sensors/laser_rig.hpp"
#include "hm/sensors/laser_scan.hpp"

namespace hm {

/// Where the vehicle was when a scan was measured. Frames: `base` (x forward, y left, z up), `odom` and `map`
/// (z up; both begin at the base of the first scan).
struct LaserPose {
  Time stamp;                      ///< of the pose, within the sweep
  std::size_t laser = 0;           ///< whose scan it is
  std::string reason;              ///< in words, where there is no pose, or the scan is not in the map
  std::optional<SE3> T_odom_base;  ///< continuous, never corrected: for control
  std::optional<SE3> T_map_base;   ///< with what loops, or a saved map, say by now; may jump
  /// Height of the base above the floor of the take-off; only with a mirror or sensor that looks down.
  std::optional<double> height_m;
  Vec3 velocity_base = Vec3::Zero();  ///< vx, vy (m/s), yaw rate (rad/s), of scan matching
};

/// The perception half of the laser system (dissertation 2.2, 2.5), scan by scan: projection, scan matching,
/// height and fusion give poses; loops, or a map of an earlier run, correct them; scans become a multi-volume
/// occupancy grid.
///
/// Inputs of one kind come in order of their stamps. A scan waits until IMU and odometry have reached its end
/// (laser.max_wait_s at most), so that take_poses() may give nothing for it at once. One thread calls it;
/// loops are searched for and solved on another, so that no scan waits for them. Deterministic but for
/// T_map_base of take_poses(), which depends on how far that thread is.
///
/// Memory: the grid (`mvog.max_map_mb` caps it), and while loops are closed every scan with its pose (5 kB
/// for 1,081 beams, 12 MB a minute at 40 Hz), from which corrected_map() is made.
class LaserMapper {
 public:
  /// `settings`: parameters as "section.key=value" (docs/parameters.md; sections as of `hm laser`).
  /// `saved_map`: a map to find the vehicle in; no loops are closed then. Errors: a platform without a laser,
  /// an unknown key, a value out of range.
  static Result<LaserMapper> create(LaserPlatform platform, const std::vector<std::string>& settings = {},
                                    const OccupancyGrid2D* saved_map = nullptr);
  ~LaserMapper();
  LaserMapper(LaserMapper&&) noexcept;
  LaserMapper& operator=(LaserMapper&&) noexcept;

  void add_imu(const ImuSample& sample);
  void add_odometry(const StampedPose& T_odom_base);
  /// Adds a reading of a range sensor that looks down; needs LaserRig::T_base_range, and no mirror that looks
  /// down.
  void add_range(const RangeReading& reading);
  /// `laser`: its index in the platform. A scan that cannot be used is none: take_poses() gives the reason.
  void add_scan(LaserScan scan, std::size_t laser = 0);
  /// No more input comes: scans that wait are processed with what there is, loops are solved a last time.
  /// Waits for the thread of loops, as do trajectory(), corrects() and corrected_map().
  void finish();
  /// The poses of the scans that were processed since the last call, in order.
  std::vector<LaserPose> take_poses();

  /// T_map_base of all scans with a pose, corrected by all that is known now.
  [[nodiscard]] Trajectory trajectory() const;
  /// True when `map` is not simply `odom`: a loop was closed, or the vehicle found in a saved map.
  [[nodiscard]] bool corrects() const;
  /// The grid as it grows, in `odom`: for what acts now. Queries: at(), cast_ray(), slice() ...
  [[nodiscard]] const MultiVolumeGrid& map() const;
  /// The grid of the corrected poses, in `map`: every scan is inserted again, which takes as long as the map
  /// took to grow. A copy of map() where nothing can be corrected (no loops, no saved map).
  [[nodiscard]] MultiVolumeGrid corrected_map() const;

 private:
  struct Impl;
  explicit LaserMapper(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
