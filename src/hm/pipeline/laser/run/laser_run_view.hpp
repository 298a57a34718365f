#pragma once
#include <span>

#include "hm/io/laser/laser_recording.hpp"
#include "hm/pipeline/laser/laser_pipeline.hpp"
#include "hm/pipeline/laser/run/laser_summary.hpp"
#include "hm/pipeline/live/live_view.hpp"

namespace hm {

/// Shows the scans of a laser, in the frame of the map, to somebody who watches: ends of the beams that
/// returned. `T_map_laser`: of the whole scan.
void show_scan(LiveView& view, const LaserScan& scan, const SE3& T_map_laser);

/// Heights of the slice of a laser's map that is shown: those of the parameters, or all for a map of one
/// layer.
void show_grid(LiveView& view, const MultiVolumeGrid& map, const SE2& T_map_grid,
               const LaserRunParams& params, bool is_planar);

/// Shows a run of run_laser() while it goes on.
class LaserRunView {
 public:
  /// `scans_total`: that the run will process. All others must outlive it.
  LaserRunView(LiveView& view, const LaserRecording& recording, std::size_t scans_total,
               const LaserRunParams& params)
      : view_(view), recording_(recording), params_(params), scans_total_(scans_total) {}

  /// A scan that was processed, the map, and the path so far after a correction.
  void show(const LaserStep& step, const LaserPipeline& pipeline, const Trajectory& T_odom_base);
  /// The finished path and map.
  void show_end(const MultiVolumeGrid& map, const LaserSummary& summary);

 private:
  void show_path(const Trajectory& T_map_base);
  [[nodiscard]] const LaserScan* scan_of(const LaserStep& step) const;

  LiveView& view_;
  const LaserRecording& recording_;
  const LaserRunParams& params_;
  SE2 T_map_odom_;  ///< of the path that is shown
  std::size_t scans_total_, scans_ = 0, scans_without_pose_ = 0, keyframes_ = 0;
};

}  // namespace hm
