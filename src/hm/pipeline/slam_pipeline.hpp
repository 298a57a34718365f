#pragma once
#include <functional>
#include <memory>
#include <optional>

#include "hm/pipeline/map_correction.hpp"
#include "hm/pipeline/visual_tracking.hpp"
#include "hm/slam/rgbd/live_rgbd_loop_closer.hpp"

namespace hm {

/// The RGB-D system (dissertation ch. 3 and 4): a recording without poses -> trajectory, keyframes in a pose
/// graph, dense map. Tracking and mapping on the calling thread (and the map's), pictures and loop closing on
/// threads of their own. The result does not depend on their pace: the map is made with odometry's poses and
/// brought to the corrected ones at the end.
class SlamPipeline {
 public:
  /// The recording must outlive the pipeline.
  SlamPipeline(const Recording& recording, const Parameters& parameters, const RunContext& run);
  ~SlamPipeline();
  SlamPipeline(const SlamPipeline&) = delete;
  SlamPipeline& operator=(const SlamPipeline&) = delete;

  /// Reads, tracks and maps all frames of the parameters' range; asked to stop, what there is.
  void track_and_map();
  /// Waits for the loop closer, solves a last time, adjusts.
  void close_loops();
  /// Rebuilds what loops have moved; frames of a map that nothing connects to the first are taken out.
  void correct_dense_map();

  struct State {
    VisualTrack track;     ///< T_odom_camera; complete after close_loops()
    Trajectory corrected;  ///< T_map_camera of the same frames; those of unconnected maps are left out
    std::shared_ptr<const CorrectedKeyframes> keyframes;
    RgbdLoopStatistics loops;
    RgbdAlignmentReport alignment;
    PoseGraph3D graph;
    MapCorrection correction;
    std::size_t frames_total = 0, frames_mapped = 0, frames_apart = 0;  ///< apart: in unconnected maps
    Summary map_ms;
    bool interrupted = false;
    double seconds = 0;          ///< of track_and_map()
    double close_seconds = 0;    ///< waiting for loops and adjusting
    double largest_shift_m = 0;  ///< of a position of the trajectory, by correction
  };
  [[nodiscard]] const State& state() const;
  State& state();
  [[nodiscard]] DensePipeline& dense();
  [[nodiscard]] const ObservationLog& observations() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
