#pragma once
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/mapping/map_rebuild.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/slam/rgbd/live_rgbd_loop_closer.hpp"

namespace hm {

/// Record of a map correction during tracking.
struct LiveCorrection {
  std::size_t frame_index = 0;  ///< frame before which the map was exchanged
  Time begun, stamp;            ///< stamps of the frames at its start and end
  MapCorrection map;
  double stall_ms = 0;  ///< delay of tracking by starting and exchanging
};

/// Pose in the map of a frame that has just been tracked, using the current loop closures; nothing when no
/// loop connects its submap with the first one.
std::optional<SE3> pose_in_map(const LiveRgbdLoopCloser::Snapshot& now, const TrackedFrame& tracked);

/// Dense map of a SLAM run. Frames are integrated at their current loop-corrected poses; parts moved by loop
/// closures are rebuilt on a separate thread and then exchanged, so that the map is complete at any time. The
/// time of the exchange depends on the machine's speed; after correct() the map is bit-identical to one built
/// with the final poses.
class SlamMap {
 public:
  /// `frames` must provide every frame passed to add() by its index, and must outlive the map.
  SlamMap(const MappingParams& parameters, const FrameSource& frames, const RunContext& run);
  ~SlamMap();

  /// Applies the current loop-corrected poses; call before every frame (slam.rebuild_online).
  void follow(const LiveRgbdLoopCloser::Snapshot& now, const RgbdFrame& frame);
  /// Integrates a frame with a pose; one of a later submap only after a loop has connected it. May move the
  /// frame's images out. Does nothing once out_of_memory() is set.
  /// False: the frame has no reading in range, or does not fit into memory, and is not part of the map.
  bool add(RgbdFrame& frame, const TrackedFrame& tracked);
  /// Continues an earlier run, whose map is not there: notes the frames that it gave to add(), in order and
  /// without T_map_camera, before the first add(). With slam.rebuild_online they are then integrated on the
  /// other thread while new frames come in, else by correct().
  void restore(std::span<const Observation> earlier);
  /// False from restore() until the frames of the earlier run are in the map.
  [[nodiscard]] bool is_complete() const;
  /// Rotates the map about its origin at the next correct(), whose keyframes must be in the rotated frame.
  void set_turn(const Mat3& R_turned_map);
  /// Brings the map to the final poses: those of odometry if loops have moved nothing by more than
  /// slam.rebuild_shift_voxel. Rebuilds the map unless it is already correct. Cancels a rebuild started by
  /// follow(). If the new map does not fit into memory (MapCorrection::out_of_memory), the map is unchanged.
  MapCorrection correct(const CorrectedKeyframes& keyframes);
  /// Mesh of the uncorrected odometry poses, for comparison; of all frames, or of keyframes alone, which is
  /// enough for a picture and takes a fraction of the time.
  TriangleMesh mesh_of_odometry(bool keyframes_alone);

  /// At least 1, from now on: of integration, correct() and mesh_of_odometry(); the rebuilding of follow()
  /// has one.
  void set_threads(int threads);
  [[nodiscard]] DensePipeline& dense();
  [[nodiscard]] const DensePipeline& dense() const;
  [[nodiscard]] std::size_t frames_mapped() const;
  /// Frames given to add(); the frame source can read each of them again.
  [[nodiscard]] std::vector<Observation> observations() const;
  [[nodiscard]] const std::vector<LiveCorrection>& corrections() const;
  /// Reason why no more frames are integrated (out of memory); empty otherwise.
  [[nodiscard]] const std::string& out_of_memory() const;
  /// Size and rebuild progress as text, for a progress line.
  [[nodiscard]] std::string progress() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
