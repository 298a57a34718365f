#pragma once
#include <functional>
#include <memory>
#include <optional>

#include "hm/pipeline/rgbd/slam_alignment.hpp"
#include "hm/mapping/slam_map.hpp"
#include "hm/pipeline/rgbd/visual_tracking.hpp"

namespace hm {

/// The RGB-D system (dissertation ch. 3 and 4): a recording without poses -> trajectory, keyframes in a pose
/// graph, dense map. Tracking and mapping on the calling thread (and the map's), pictures, loop closing and
/// the rebuilding of what loops move on threads of their own. The result does not depend on their pace: at
/// the end the map is brought to the final poses.
class SlamPipeline {
 public:
  /// The recording must outlive the pipeline.
  SlamPipeline(const Recording& recording, const Parameters& parameters, const RunContext& run);
  ~SlamPipeline();
  SlamPipeline(const SlamPipeline&) = delete;
  SlamPipeline& operator=(const SlamPipeline&) = delete;

  /// Called after every frame with the index of the next one; an error ends the run.
  using AfterFrame = std::function<Result<void>(std::size_t next_frame)>;
  /// Reads, tracks and maps all frames of the parameters' range; asked to stop, what there is. An error is
  /// one of `after_frame`.
  Result<void> track_and_map(const AfterFrame& after_frame = {});
  /// The poses of all frames up to now, as loops place them now; those of unconnected maps are left out.
  [[nodiscard]] Trajectory trajectory_now() const;
  /// Waits for the loop closer, solves a last time, adjusts.
  void close_loops();
  /// The mesh of odometry's poses, to compare with; before correct_dense_map().
  TriangleMesh mesh_of_odometry();
  /// Brings the map to the final poses; frames of a map that nothing connects to the first are not in it. Not
  /// to be stopped: a run that was asked to stop gets the right map of what there is.
  void correct_dense_map();

  struct State {
    VisualTrack track;  ///< T_odom_camera, with slam.align as aligned; complete after close_loops()
    std::optional<SlamAlignmentSummary> dense_alignment;  ///< with slam.align
    Trajectory corrected;  ///< T_map_camera of the same frames; those of unconnected maps are left out
    std::shared_ptr<const CorrectedKeyframes> keyframes;
    RgbdLoopStatistics loops;
    RgbdAlignmentReport alignment;
    PoseGraph3D graph;
    std::vector<LiveCorrection> live_corrections;                       ///< while tracking
    MapCorrection correction;                                           ///< the last one, at the end
    std::size_t frames_total = 0, frames_mapped = 0, frames_apart = 0;  ///< apart: in unconnected maps
    Summary frame_ms;  ///< tracking, mapping and what corrections take of a frame's time; not waiting
    std::size_t frames_done = 0;  ///< index of the first frame that was not looked at
    bool interrupted = false;
    double seconds = 0;          ///< of track_and_map()
    double close_seconds = 0;    ///< waiting for loops and adjusting
    double largest_shift_m = 0;  ///< of a position of the trajectory, by correction
  };
  [[nodiscard]] const State& state() const;
  State& state();
  [[nodiscard]] DensePipeline& dense();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
