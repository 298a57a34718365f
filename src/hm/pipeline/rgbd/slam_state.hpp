#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "hm/core/statistics.hpp"
#include "hm/geometry/level/up_direction.hpp"
#include "hm/geometry/pose_graph_3d.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/mapping/keyframes/slam_map.hpp"
#include "hm/pipeline/rgbd/slam_alignment.hpp"
#include "hm/pipeline/rgbd/visual_tracking.hpp"
#include "hm/slam/rgbd/rgbd_loop_closer.hpp"

namespace hm {

/// Everything that a run through SlamPipeline has found out.
struct SlamState {
  VisualTrack track;  ///< T_odom_camera, with slam.align as aligned; complete after close_loops()
  std::optional<SlamAlignmentSummary> dense_alignment;  ///< with slam.align
  Trajectory corrected;  ///< T_map_camera of the same frames; those of unconnected maps are left out
  std::shared_ptr<const CorrectedKeyframes> keyframes;
  UpDirection up;           ///< in the map; z where it was levelled
  bool levelled = false;    ///< the map's frame was chosen by `up` (slam.level); else it was given
  double levelled_rad = 0;  ///< by which the finished map was turned, beyond how it began
  RgbdLoopStatistics loops;
  RgbdAlignmentReport alignment;
  PoseGraph3D graph;
  std::vector<LiveCorrection> live_corrections;  ///< while tracking
  MapCorrection correction;                      ///< the last one, at the end
  std::size_t frames_total = 0, frames_mapped = 0,
              frames_disconnected = 0;  ///< the last: in unconnected maps
  Summary frame_ms;  ///< tracking, mapping and what corrections take of a frame's time; not waiting
  std::size_t frames_done = 0;  ///< index of the first frame that was not looked at
  bool interrupted = false;
  double seconds = 0;          ///< of track_and_map()
  double close_seconds = 0;    ///< waiting for loops and adjusting
  double largest_shift_m = 0;  ///< of a position of the trajectory, by correction
};

}  // namespace hm
