#pragma once
#include <functional>
#include <memory>
#include <optional>

#include "hm/pipeline/rgbd/slam_alignment.hpp"
#include "hm/mapping/slam_map.hpp"
#include "hm/pipeline/rgbd/visual_tracking.hpp"

namespace hm {

/// The RGB-D system (dissertation ch. 3 and 4): a recording without poses -> trajectory, keyframes in a pose
/// graph, dense map. Tracking and mapping on the calling thread (and the map's), images, loop closing and
/// the rebuilding of what loops move on threads of their own. The result does not depend on their pace: at
/// the end the map is brought to the final poses.
class SlamPipeline {
 public:
  /// The recording must outlive the pipeline.
  SlamPipeline(const Recording& recording, const Parameters& parameters, const RunContext& run);
  ~SlamPipeline();
  SlamPipeline(const SlamPipeline&) = delete;
  SlamPipeline& operator=(const SlamPipeline&) = delete;

  /// Reads, tracks and maps all frames of the parameters' range; stopped early, those so far.
  void track_and_map();
  /// Waits for the loop closer, solves a last time, adjusts.
  void close_loops();
  /// The mesh of odometry's poses, to compare with; before correct_dense_map().
  TriangleMesh mesh_of_odometry();
  /// Brings the map to the final poses; frames of a map that nothing connects to the first are not in it. Not
  /// to be stopped: a run that was stopped early gets the right map of what there is.
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
