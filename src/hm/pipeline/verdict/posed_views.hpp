#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "hm/core/run_context.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/io/rgbd/recording.hpp"

namespace hm {

/// A depth image that a trajectory has a pose for.
struct PosedView {
  std::size_t index = 0;  ///< in the recording
  double time_s = 0;      ///< since the start of the recording
  SE3 T_world_camera;
};
std::vector<PosedView> posed_views(const RecordingInfo& info, const Trajectory& T_world_camera);

/// Where a camera turns as fast as this, rows and depth image are of other moments than the stamp, and even
/// the true pose does not place them rightly.
inline constexpr double kMaxTurning_rad_s = 1;
/// Angular velocity between two views; 0 where no time lies between them.
double turning_rad_s(const PosedView& before, const PosedView& after);

/// How far two views of a place differ.
struct ViewDifference {
  double contradicted_ratio = 0;  ///< of either view's points, in the free space of the other: the larger
  double offset_ratio = 0;        ///< of depth, averaged over tiles of the image, either way: the smaller
  double tilt_rad = 0;            ///< of what one shows against the other, either way: the smaller
};
/// Views by their numbers.
struct ViewPair {
  std::size_t first = 0, second = 0;
};
/// Difference of every pair, by depth; none where an image cannot be read, or where the views share less than
/// 30 % of their points. On the threads of the run, with its progress as `stage`.
std::vector<std::optional<ViewDifference>> differences(const Recording& recording,
                                                       const std::vector<PosedView>& views,
                                                       std::span<const ViewPair> pairs, const RunContext& run,
                                                       const char* stage);

/// How far the views of every pair differ as their colour images show it (image_motion.hpp), as an angle at
/// the camera; none where they do not show it: no colour, little in common, nothing on the walls. On the
/// threads of the run.
std::vector<std::optional<double>> color_differences_rad(const Recording& recording,
                                                         const std::vector<PosedView>& views,
                                                         std::span<const ViewPair> pairs,
                                                         const RunContext& run);

}  // namespace hm
