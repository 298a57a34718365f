#pragma once
#include <memory>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/rgbd/recording.hpp"

namespace hm {

/// Whose poses the result of a run stands on.
enum class PoseUse {
  kBuildsOn,      ///< the given ones: a wrong reading of them spoils the result
  kComparesWith,  ///< its own; given ones are only compared with
};

struct PreflightOptions {
  PoseUse poses = PoseUse::kBuildsOn;
  const Trajectory* given = nullptr;  ///< T_world_camera to be used instead of the recording's own poses
  double max_pose_gap_s = 0.15;       ///< between two of `given` that one in the middle is interpolated from
  bool force = false;                 ///< what makes a result impossible is a warning too
  bool register_color = true;         ///< where colour is not registered to depth
  bool needs_color = false;           ///< the run can make nothing of depth images alone
};

/// Sentences about a recording, with number and remedy, each once.
struct Preflight {
  std::vector<std::string> warnings;
  std::vector<std::string>
      doubts;  ///< those of them for which the result is doubtful, whatever it looks like
};

/// Checks a recording before a run begins: the checks of inspect_recording() on few frames (about twenty
/// images are decoded), and what its reader left out. A recording whose colour is not registered to depth is
/// replaced by one where it is, if its images show how (fit_color_registration()). Error (kInvalidValue): no
/// sensible result can come out, because depth is in another unit, the poses that the run builds on are
/// inverted, not in metres or of another clock, fy has the wrong sign, depth images are empty, or colour is
/// missing where the run needs it.
Result<Preflight> check_before_run(std::unique_ptr<Recording>& recording, const PreflightOptions& options);

/// What the images of a camera show to be wrong, for frames that were taken live: colour that is not
/// registered to depth, a depth unit that no such sensor has, hardly any depth. About twenty images are
/// decoded; nothing is changed.
Preflight check_images(const Recording& recording);

/// Findings of inspect_laser_recording() and what the reader left out, each sentence once. Error
/// (kInvalidValue), unless forced: the ranges of a laser are in another unit.
Result<std::vector<std::string>> check_before_laser_run(const LaserRecording& recording, bool force);

}  // namespace hm
