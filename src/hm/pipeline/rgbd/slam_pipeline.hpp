#pragma once
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/core/run_context.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/level/up_direction.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

class DensePipeline;
class FrameSource;
class Recording;
struct EarlierMap;
struct RgbdParameters;
struct SavedSlam;
struct SlamCheckpoint;
struct SlamState;
struct TrackedRecord;

/// Input for SLAM frame by frame.
struct SlamInput {
  PinholeCamera camera;  ///< of depth and colour, without lens distortion
  /// The first frame's pose in `map`, whose frame is kept; none: at the origin, looking along x as seen from
  /// above. z is then up as far as floor and walls tell (slam.level), roughly so from the first frame on and
  /// after finish() as the whole map has it; SlamPipeline::up() says how it was found.
  std::optional<SE3> T_map_first_camera = {};
  /// Gives the n-th frame of add() again as frame n (from 0), to rebuild what a loop has moved; must outlive
  /// the pipeline. Null: the pipeline keeps the frames of the map itself (FrameArchive).
  const FrameSource* frames = nullptr;
  std::size_t max_kept_bytes = 0;  ///< caps what the pipeline keeps itself; 0: no cap
  bool is_from_kinect = false;     ///< start from a Kinect's row times (sensor_prior.hpp)
};

/// Called by SlamPipeline::add() while it is at work on a frame; each may be empty.
struct SlamHooks {
  /// The frame's pose is known, that of SlamStep::T_odom_camera; keyframe and map follow. Not with
  /// slam.align, which changes the pose.
  OnPose on_pose = {};
  /// Asked before the frame is mapped; true leaves it out of the map, since others wait.
  std::function<bool()> is_late = {};
};

/// Outcome of a frame of SlamPipeline::add().
struct SlamStep {
  TrackingStatus status = TrackingStatus::kSkipped;
  std::string reason;                ///< in words, with numbers, when there is no pose
  std::optional<SE3> T_odom_camera;  ///< continuous, never corrected: for control
  /// In the map, with the loops that are closed by now; none while nothing connects where tracking began anew
  /// with the first frame.
  std::optional<SE3> T_map_camera;
  bool keyframe = false;
  bool is_mapped = false;     ///< integrated into the map
  std::string out_of_memory;  ///< why the map takes no more frames, with the remedy; poses continue
};

/// How far a SlamPipeline has come.
struct SlamCounts {
  std::size_t frames = 0, frames_tracked = 0, frames_lost = 0;
  std::size_t keyframes = 0;
  std::size_t loops = 0;  ///< accepted
  /// Did not fit into max_kept_bytes: they leave the map when a loop makes it be rebuilt.
  std::size_t frames_not_kept = 0;
  std::size_t kept_bytes = 0;  ///< by the pipeline's own archive
};

/// The RGB-D system (dissertation ch. 3 and 4): frames without poses -> trajectory, keyframes in a pose
/// graph, dense map. Tracking and mapping on the calling thread (and the map's), loop closing and the
/// rebuilding of what loops move on threads of their own. One thread calls it. Poses and map while frames
/// come in depend on the pace of these threads; the result does not: finish() brings the map to the final
/// poses.
///
/// Frames come from the caller, one by one:
///
///     auto slam = SlamPipeline::create({camera}, {"tsdf.voxel_size_m=0.04"}).value();
///     for (...) slam.add(frame);
///     slam.finish();
///     write_mesh("mesh.ply", slam.mesh());
///
/// or from a recording (the second constructor), which it reads ahead itself.
///
/// Memory: the map (DensePipeline), keyframes (about 0.1 MB each), and, unless SlamInput::frames gives them
/// again, every frame of the map, compressed without loss: about 0.5 MB for one of 640 x 480, 15 MB a second
/// at 30 Hz. `slam.map_stride=3` maps and keeps every third one.
class SlamPipeline {
 public:
  /// `settings`: parameters as "section.key=value" (docs/parameters.md; sections as of `hm slam`). Errors: an
  /// unknown key, a value out of range, parameters that contradict.
  static Result<SlamPipeline> create(const SlamInput& input, const std::vector<std::string>& settings = {},
                                     const RunContext& run = {});
  /// The same with parameters that have been checked (check_parameters()).
  static SlamPipeline create(const SlamInput& input, const RgbdParameters& parameters, const RunContext& run);
  /// Takes its frames from a recording, which must outlive the pipeline: track_and_map() instead of add().
  /// With an earlier map, which must outlive it too, it goes on there: the loops of the saved keyframes are
  /// closed again first, tracking begins at an origin of its own, and once a loop joins the two all poses are
  /// those of the saved map. SlamState::continued says whether and when.
  SlamPipeline(const Recording& recording, const RgbdParameters& parameters, const RunContext& run,
               const EarlierMap* earlier = nullptr);
  ~SlamPipeline();
  SlamPipeline(SlamPipeline&&) noexcept;
  SlamPipeline& operator=(SlamPipeline&&) = delete;

  /// Tracks a frame and brings it into the map. Stamps increase; images are of the camera's size and free
  /// of lens distortion, colour registered to depth. A frame that cannot be used is skipped, one that is not
  /// recognised is lost, each with its reason; both change nothing. Not after finish().
  SlamStep add(RgbdFrame frame, const SlamHooks& hooks = {});
  /// Closes the last loops, adjusts, and brings the map to the final poses. Not to be stopped. kOutOfMemory:
  /// frames are missing in the map, or its corrected copy does not fit; the poses are final, the map is
  /// unchanged.
  Result<void> finish();

  /// T_map_camera of the frames with a pose; complete, and corrected by all loops, after finish(). Frames of
  /// maps that nothing connects to the first are left out.
  [[nodiscard]] const Trajectory& trajectory() const;
  [[nodiscard]] SlamCounts counts() const;
  /// Up in the map; unknown before finish().
  [[nodiscard]] UpDirection up() const;
  /// The mesh of the map as it is now.
  TriangleMesh mesh();
  /// At least 1, from now on, instead of RunContext::threads.
  void set_threads(int threads);
  /// The map as it is now, to save and to query (map_query.hpp).
  [[nodiscard]] DensePipeline& dense();

  // ---- a recording, step by step (run_slam) ----
  /// Called after every frame with the index of the next one; an error ends the run.
  using AfterFrame = std::function<Result<void>(std::size_t next_frame)>;
  /// Reads, tracks and maps all frames of the parameters' range; stopped early, those so far. An error is
  /// one of `after_frame`, or kOutOfMemory.
  Result<void> track_and_map(const AfterFrame& after_frame = {});
  /// Continues a run that was saved with this recording and these parameters (check_continues), before
  /// track_and_map(): that then begins at the checkpoint's next frame. Trajectory, keyframes, loops and the
  /// finished map are those of a run that was never interrupted, to the bit. Reads about
  /// odometry_tracker.max_keyframes frames again, and closes the loops of the saved keyframes again. Errors:
  /// VisualOdometry::restore().
  Result<void> resume(const SavedSlam& saved);
  /// Whether the run can be saved: with slam.align, and the published methods of odometry, it cannot.
  [[nodiscard]] bool can_be_saved() const;
  /// The last frame of track_and_map().
  [[nodiscard]] const TrackedRecord& last_frame() const;
  /// The state before `next_frame`, to be continued; program, recording and journal are the caller's. Not
  /// after close_loops().
  [[nodiscard]] SlamCheckpoint checkpoint(std::size_t next_frame) const;
  /// False after resume() until the map also holds the saved run's frames.
  [[nodiscard]] bool map_is_complete() const;
  /// The poses of all frames up to now, as loops place them now; those of unconnected maps are left out.
  [[nodiscard]] Trajectory trajectory_now() const;
  /// Waits for the loop closer, solves a last time, adjusts.
  void close_loops();
  /// Finds up in the map; where nothing gives the map's frame (slam.level), all poses are turned so that it
  /// is z, and correct_dense_map() makes the map of them. After close_loops().
  void level();
  /// The mesh of odometry's poses, to compare with, of all frames or of keyframes alone; before
  /// correct_dense_map().
  TriangleMesh mesh_of_odometry(bool keyframes_alone);
  /// Brings the map to the final poses; frames of a map that nothing connects to the first are not in it. Not
  /// to be stopped: a run that was stopped early gets the right map of what there is. Errors: as finish().
  Result<void> correct_dense_map();
  /// The frames of the map, by the indices of keyframes.
  [[nodiscard]] const FrameSource& frames() const;
  /// slam_state.hpp
  using State = SlamState;
  [[nodiscard]] const State& state() const;
  State& state();

 private:
  struct Impl;
  explicit SlamPipeline(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
