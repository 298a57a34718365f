#pragma once
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hm/estimation/fusion_types.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/laser/height/height_estimator.hpp"
#include "hm/laser/odometry/scan_odometry.hpp"
#include "hm/laser/odometry/scan_projection.hpp"
#include "hm/mvog/multi_volume_grid.hpp"
#include "hm/pipeline/laser/laser_map_frame.hpp"
#include "hm/pipeline/laser/laser_params.hpp"
#include "hm/pipeline/laser/laser_sweep.hpp"
#include "hm/sensors/imu.hpp"
#include "hm/sensors/laser_rig.hpp"
#include "hm/slam/laser/scan_visits.hpp"

namespace hm {

/// Outcome of a scan.
enum class LaserScanStatus {
  kPosed,          ///< it has a pose, and is in the map
  kNotProjected,   ///< none of it can be used in the plane (tilt, no attitude, no return)
  kNotMatched,     ///< scan matching gave no answer
  kNoOdometry,     ///< the recording's odometry does not reach its time
  kTimeBackwards,  ///< not later than the scan before: ignored
  kNoHeight,       ///< posed, but not in the map: the height is not known yet
};
std::string_view to_string(LaserScanStatus status);

/// Readings of the range sensor that were processed, and how many of them gave a height.
struct RangeCounts {
  std::size_t processed = 0, used = 0;
};

/// Result of one scan.
struct LaserStep {
  std::size_t laser = 0;
  Time scan_stamp;  ///< of the scan, as it was given
  Time stamp;       ///< the moment of the pose
  LaserScanStatus status = LaserScanStatus::kNotMatched;
  std::string reason;              ///< in words, where there is no pose
  std::optional<SE3> T_odom_base;  ///< never corrected: for control
  MapFrameStep map_frame;          ///< where `odom` lies in `map`, as it was known then
  OdometryStep odometry;           ///< of scan matching; empty where poses are the recording's odometry
  bool matched_scan = false;       ///< `odometry` is filled
  std::optional<Mat3> planar_covariance;  ///< of its (x, y, yaw) along the axes of `odom`, where it is known
  std::optional<HeightEstimate> height;   ///< where the rig measures it
  std::optional<VehicleState> state;      ///< fused with the IMU, at the newest sample of it
  Vec3 velocity_base = Vec3::Zero();      ///< vx, vy (m/s), yaw rate (rad/s) from scan matching
  BeamScanStats beams;                    ///< what went into the map
  std::vector<SweepKnot> sweep;           ///< how it went there, where `map` is not `odom`
  double project_ms = 0, match_ms = 0, insert_ms = 0;
  double total_ms = 0;  ///< all that was done when it was processed
};

/// The perception half of the laser system (dissertation 2.2, 2.5), in memory: scans become poses
/// (projection, scan matching, height, fusion) and a multi-volume occupancy grid.
///
/// Inputs of one kind come in order of their stamps. A scan waits until IMU and odometry have reached its end
/// (`max_wait_s` at most); what became of it is then in take_steps(). The grid is in the frame `odom`, which
/// nothing corrects. Where `odom` lies in `map` is learned from places seen again, or from a map of an
/// earlier run: map_frame(). The grid in the frame `map`: rebuild_laser_map(). Not thread safe; deterministic
/// but for the milliseconds and, with a thread for loops, for T_map_odom until finish().
class LaserPipeline {
 public:
  /// A laser whose scan plane is tilted less than this is horizontal.
  static constexpr double kMaxHorizontalTilt_rad = 0.35;

  /// `saved_map`: a map to find the vehicle in; loops are not closed then. `loops`: where they are searched
  /// for.
  LaserPipeline(const LaserParameters& params, LaserPlatform platform,
                const OccupancyGrid2D* saved_map = nullptr, LoopThread loops = LoopThread::kCaller);
  ~LaserPipeline();

  void add_imu(const ImuSample& sample);
  void add_odometry(const StampedPose& T_odom_base);
  /// Adds a reading of a range sensor that looks down (LaserRig::T_base_range of the first laser); readings
  /// outside its limits are counted. Not used where a mirror looks down, which measures better.
  void add_range(const RangeReading& reading);
  /// `laser`: its index in the platform.
  void add_scan(LaserScan scan, std::size_t laser = 0);
  /// No more input: scans that wait are processed with what there is, loops are closed a last time and, until
  /// a stop is requested, revised, and keyframes registered.
  void finish(const RunContext& run = {});
  /// The scans that were processed since the last call, in order.
  std::vector<LaserStep> take_steps();

  /// True: poses come from scan matching; false: from the recording's odometry.
  [[nodiscard]] bool matches_scans() const;
  /// Scans of this laser are used.
  [[nodiscard]] bool uses(std::size_t laser) const;
  [[nodiscard]] bool uses_range() const;
  /// Heights are measured, by a mirror or a range sensor.
  [[nodiscard]] bool measures_height() const;
  [[nodiscard]] const RangeCounts& range_counts() const;
  [[nodiscard]] const MultiVolumeGrid& map() const;
  /// How long before their stamps scans were measured, on the clock of the odometry, as learned so far.
  [[nodiscard]] Duration odometry_delay() const;
  [[nodiscard]] const LaserMapFrame& map_frame() const;
  /// Scans along the path (of the first laser, if it is horizontal), to be compared with those of other
  /// visits.
  [[nodiscard]] const ScanVisits& visits() const;
  /// The floors found so far, lowest first; empty where the height is not measured.
  [[nodiscard]] std::vector<FloorLevel> floors() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// True when the scan plane of a laser mounted so is level enough for scan matching in the plane.
bool scans_horizontally(const LaserRig& rig);

}  // namespace hm
