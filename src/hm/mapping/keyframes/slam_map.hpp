#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hm/mapping/map_rebuild.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/slam/rgbd/live_rgbd_loop_closer.hpp"

namespace hm {

/// A correction of the map while frames were coming in.
struct LiveCorrection {
  std::size_t frame_index = 0;  ///< before which the map was exchanged
  Time begun, stamp;            ///< of the frames where it began and ended
  MapCorrection map;
  double stall_ms = 0;  ///< for which tracking had to wait: beginning it and exchanging
};

/// The pose of a frame that has just been tracked, by the loops that are closed now; nothing when no loop
/// connects its submap with the first.
std::optional<SE3> pose_in_map(const LiveRgbdLoopCloser::Snapshot& now, const TrackedFrame& tracked);

/// The dense map of a SLAM run: frames come in where loops put them now; what they have moved is rebuilt
/// beside the map on a thread of its own, then exchanged, so that the map is whole at any moment. When that
/// happens depends on the machine's speed; after correct() the map is that of the final poses, to the bit.
class SlamMap {
 public:
  /// `frames` gives every frame of add() again by its index, and must outlive the map.
  SlamMap(const MappingParams& parameters, const FrameSource& frames, const RunContext& run);
  ~SlamMap();

  /// To be called before every frame with the poses after loop closure (slam.rebuild_online).
  void follow(const LiveRgbdLoopCloser::Snapshot& now, const RgbdFrame& frame);
  /// Brings a frame with a pose into the map; one of a later submap when a loop has connected it. Its
  /// images may be taken away. Not after out_of_memory().
  void add(RgbdFrame& frame, const TrackedFrame& tracked);
  /// Brings the map to its final poses: those of odometry if loops have moved nothing by more than
  /// slam.rebuild_shift_voxel. It is made again unless it is already there. Gives up what follow() has begun.
  /// Where the new map does not fit into memory (MapCorrection::out_of_memory) the old one stays.
  MapCorrection correct(const CorrectedKeyframes& keyframes);
  /// The mesh that odometry's poses give, to compare with.
  TriangleMesh mesh_of_odometry();

  [[nodiscard]] DensePipeline& dense();
  [[nodiscard]] const DensePipeline& dense() const;
  [[nodiscard]] std::size_t frames_mapped() const;
  [[nodiscard]] const std::vector<LiveCorrection>& corrections() const;
  /// What the system has is used up by the map, in words with the remedy: no more frames go in. Empty: it is
  /// not.
  [[nodiscard]] const std::string& out_of_memory() const;
  /// Describes its size and the progress of a rebuild, for a progress line.
  [[nodiscard]] std::string progress() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
