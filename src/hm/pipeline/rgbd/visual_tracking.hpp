#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/statistics.hpp"
#include "hm/evaluation/trajectory_error.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/odometry/interface/inertial_hints.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/pipeline/rgbd/resume/tracked_record.hpp"
#include "hm/pipeline/rgbd/rgbd_parameter_list.hpp"
#include "hm/pipeline/verdict/run_verdict.hpp"
#include "hm/report/summary_tree.hpp"

namespace hm {

/// One frame of a run through visual odometry.
struct VisualFrame {
  std::size_t index = 0;  ///< in the recording
  Time stamp;
  TrackingStatus status = TrackingStatus::kSkipped;
  int submap = 0;
  bool keyframe = false;
  double sigma_m = 0;  ///< of the position, as the covariance has it: root of the trace
  double wait_ms = 0;  ///< for the images
  TrackingNumbers numbers;
};

/// Frames in a row without a pose.
struct LostStretch {
  std::size_t first_frame = 0, last_frame = 0, frames = 0;
  double duration_s = 0;
  std::string reason;  ///< of the first of them
};

/// A frame that was not tracked, and why.
struct UnusedFrame {
  std::size_t index = 0;
  std::string reason;
};

/// Result of visual odometry over a recording.
struct VisualTrack {
  std::size_t frames_total = 0;  ///< of the recording, within the parameters' range
  std::size_t frames_read = 0, frames_tracked = 0, frames_lost = 0;
  std::size_t frames_by_depth = 0;  ///< of those tracked: by their depth images alone
  std::vector<UnusedFrame> unused;  ///< could not be read, or not be used
  std::vector<VisualFrame> frames;  ///< those that were read
  std::vector<LostStretch> lost;
  Trajectory trajectory;  ///< T_odom_camera of the frames that have a pose
  std::vector<std::shared_ptr<const Keyframe>> keyframes;
  Summary track_ms;
  std::size_t model_points = 0, relocalised = 0, memory_bytes = 0;
  int submaps = 0;
  double readout_s = 0, color_delay_s = 0;  ///< of the colour images, as found in the end
  std::string imu_source;                   ///< empty: no inertial device was used
  std::size_t turns_given = 0, gravity_used = 0, gravity_rejected = 0;  ///< frames
  std::size_t inertial_used = 0, bridged = 0;                           ///< frames
  std::string imu_unused_reason;  ///< why preintegrated readings are not trusted in the end
};

/// Visual odometry over the frames of a recording, with the books that a report needs.
class VisualTracking {
 public:
  struct Start {
    std::size_t frames_total = 0;  ///< that are to come
    SE3 T_odom_first_camera;
    std::shared_ptr<const CarriedImu> imu = nullptr;
    bool is_from_kinect = false;  ///< start from a Kinect's row times (sensor_prior.hpp)
  };
  /// The camera must be free of lens distortion.
  VisualTracking(const OdometryParams& parameters, const PinholeCamera& camera, const Start& start);
  /// Begins at this pose instead; before a frame has one.
  void set_first_camera(const SE3& T_odom_first_camera);
  /// Tracks a frame, or notes why it could not be read. `on_pose`: VisualOdometry::track().
  TrackedFrame take(std::size_t index, const Result<RgbdFrame>& frame, double wait_ms,
                    const OnPose& on_pose = {});
  [[nodiscard]] const VisualTrack& track() const { return track_; }
  /// Record of the last frame of take().
  [[nodiscard]] const TrackedRecord& last() const { return last_; }

  /// Writes what later frames depend on; false: the method cannot (VisualOdometry::save).
  bool save(StateWriter& state) const;
  /// Continues a run with these frames, before the first take(). Errors: VisualOdometry::restore().
  Result<void> restore(StateReader& state, std::span<const TrackedRecord> records,
                       const OdometryHistory& history);
  /// The books, complete.
  VisualTrack finish();

 private:
  void note(const TrackedRecord& record);
  void note_lost(const TrackedRecord& record);

  OdometryParams parameters_;
  PinholeCamera camera_;
  std::unique_ptr<VisualOdometry> odometry_;
  InertialHints hints_;
  VisualTrack track_;
  std::vector<double> times_ms_;
  TrackedRecord last_;
  Time lost_since_;
  bool lost_ = false;
};

/// Warnings about frames that are unused, tracked by depth alone or lost.
std::vector<std::string> warnings_of(const VisualTrack& track);
/// Whether this method can make nothing of frames without colour.
bool needs_color(const OdometryParams& parameters);
/// Adds what speaks against a trajectory: frames without a pose.
void judge_tracking(const VisualTrack& track, RunVerdict& verdict);
/// Explains in words that there is no pose at all.
std::string why_no_pose(const VisualTrack& track, const std::vector<std::string>& warnings = {});
/// frames{read,tracked,by_depth,lost,unused}, track_ms{median,mean,p99}, path_length_m, keyframes,
/// model_points, submaps, relocalised, lost_stretches, imu{source,...}
/// (with one).
void visit(const VisualTrack& track, SummaryTree& v);
/// ate_rmse_m, rpe_frame_m, rpe_second_m, rpe_second_rad, rpe_metre_m (those without a span are left out).
void visit_error(const TrajectoryError& error, SummaryTree& v);
/// Lines for a terminal of a summary with these values.
std::string tracking_lines(const SummaryTree& summary);

}  // namespace hm
