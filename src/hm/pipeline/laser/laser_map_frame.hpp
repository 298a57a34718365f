#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/occupancy_grid_2d.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/mvog/multi_volume_grid.hpp"
#include "hm/pipeline/common/mvog_file.hpp"
#include "hm/pipeline/laser/laser_params.hpp"
#include "hm/slam/laser/grid_localiser.hpp"
#include "hm/slam/laser/live_laser_loop_closer.hpp"

namespace hm {

/// Origin of the frame `map`: nothing but odometry, places seen again, or a map of an earlier run.
enum class MapFrameSource { kOdometry, kLoops, kSavedMap };

struct LaserMapFrameParams {
  ScanGraph2DParams loops;
  GridLocaliserParams localiser;
  double seek_interval_s = 0.5;
};

/// Effect of one scan on the frame `map`.
struct MapFrameStep {
  SE2 T_map_odom;                            ///< as it was known after this scan
  std::optional<Localisation> localisation;  ///< the scan was searched for in the saved map
  double ms = 0;
};

/// T_map_odom from a moment on.
struct MapFrameChange {
  Time stamp;
  SE2 T_map_odom;
};

/// Place of the control frame `odom` in `map`. `odom` is read, never changed. Not thread safe. Deterministic
/// but for the milliseconds; with a thread for loops, what steps and history say depends on its progress, and
/// what is asked for later waits for it.
class LaserMapFrame {
 public:
  LaserMapFrame() = default;  ///< `map` is `odom`
  static LaserMapFrame from_loops(const LaserMapFrameParams& params, LoopThread thread = LoopThread::kCaller);
  /// While the place is not known, it is searched for every `seek_interval_s`.
  static LaserMapFrame from_saved_map(const OccupancyGrid2D& grid, const LaserMapFrameParams& params);

  /// Takes the scan, its odometry and the height of the vehicle into account.
  MapFrameStep process(const PlanarScan& scan, const OdometryStep& step, double height_m = 0);
  /// LaserLoopCloser::finish().
  void finish(const RunContext& run = {});

  [[nodiscard]] MapFrameSource source() const;
  /// Null unless loops are closed.
  [[nodiscard]] const LaserLoopCloser* loops() const { return loops_ ? &loops_->settled() : nullptr; }
  /// Nothing waits for the thread of loops: what is asked for is known at once.
  [[nodiscard]] bool is_settled() const { return !loops_ || loops_->waiting_keyframes() == 0; }
  /// Every change of T_map_odom while scans came, in order.
  [[nodiscard]] const std::vector<MapFrameChange>& history() const { return history_; }
  /// True when `map` is not simply `odom`.
  [[nodiscard]] bool corrects() const;
  /// With all that is known by now: what brings a pose of `odom` at a moment into `map`. Before a vehicle
  /// was first found in a saved map, as it was then.
  [[nodiscard]] SE2 T_map_odom_at(Time stamp, const SE2& T_odom_base) const;
  /// A trajectory brought into `map`, every pose by T_map_odom_at(); heights and tilts stay.
  [[nodiscard]] Trajectory corrected(const Trajectory& T_odom_base) const;

 private:
  std::optional<Localisation> localise(const PlanarScan& scan, const SE2& T_odom_base);
  void note(Time stamp, const SE2& T_map_odom);

  std::unique_ptr<LiveLaserLoopCloser> loops_;
  std::unique_ptr<GridLocaliser> localiser_;
  Duration seek_interval_;
  bool found_ = false;  // the place in the saved map is being followed
  std::optional<Time> last_search_;
  SE2 T_odom_last_;  // at the scan that was given to the localiser last
  SE2 T_map_odom_;
  std::vector<MapFrameChange> history_;
};

/// The horizontal part of a grid that scans see: between slice_bottom_m and slice_top_m; a map of one layer
/// as a whole.
Result<OccupancyGrid2D> laser_slice(const MultiVolumeGrid& map, const LaserRunParams& params);

/// A map of an earlier run to find a vehicle in: a map_server yaml, a .mvog (its slice), or the folder of a
/// run with one of them. Errors: nothing there, not a map, damaged, or nothing occupied in it.
Result<OccupancyGrid2D> read_saved_laser_map(const std::filesystem::path& path, const LaserRunParams& params);

}  // namespace hm
