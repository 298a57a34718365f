#pragma once
#include <filesystem>
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

struct EarlierMap;

/// How a run goes on in the saved map of an earlier one (hm slam --continue).
struct ContinuedMap {
  std::filesystem::path folder;       ///< of the earlier result
  std::size_t earlier_keyframes = 0;  ///< of the saved map: the first nodes of the graph
  /// From the first frame of the new recording to the keyframe at which the two maps became one; nothing: the
  /// saved map was not recognised.
  std::optional<double> recognised_at_s;
  std::size_t loops = 0;   ///< edges of the final graph between the earlier keyframes and the new ones
  BestMapMatch best;       ///< of all comparisons of a new keyframe with one of another map
  double best_at_s = 0;    ///< of the new recording
  int inliers_needed = 0;  ///< of a loop; two loops must agree
};

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
  std::optional<ContinuedMap> continued;  ///< with an earlier map
  /// Keyframes of the graph's nodes: those of an earlier map, then those of the track.
  std::vector<std::shared_ptr<const Keyframe>> graph_keyframes;
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

/// Turns all poses about the origin of the map.
void turn(SlamState& state, const Mat3& R_turned_map);
/// The trajectory with its frame moved.
Trajectory moved(const Trajectory& path, const SE3& T_moved_map);
/// Moves odometry's trajectory so that it begins where the map has its first pose.
void begin_odometry_in_map(SlamState& state);
/// Largest shift of a position of the trajectory by correction, metres.
double largest_shift_m(const SlamState& state);
/// How the graph's final loops join the earlier keyframes, its first nodes, with the new recording.
ContinuedMap continued_map(const SlamState& state, const EarlierMap& earlier, int inliers_needed);

}  // namespace hm
