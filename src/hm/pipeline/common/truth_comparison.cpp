#include "hm/pipeline/common/truth_comparison.hpp"

#include <fmt/format.h>

#include "hm/io/pose/trajectory_file.hpp"

namespace hm {

Trajectory true_trajectory(const RecordingInfo& info) {
  if (!info.truth.empty()) return info.truth;
  if (!info.trajectory.empty()) return info.trajectory;
  Trajectory poses;
  for (std::size_t i = 0; i < info.frame_poses.size() && i < info.stamps.size(); ++i)
    if (info.frame_poses[i] && (poses.empty() || info.stamps[i] > poses.back().stamp))
      poses.push_back({info.stamps[i], *info.frame_poses[i]});
  return poses;
}

std::filesystem::path pose_source(const RecordingInfo& info) {
  return info.trajectory_source.empty() ? std::filesystem::path()
                                        : std::filesystem::absolute(info.path / info.trajectory_source);
}

std::filesystem::path truth_source(const RecordingInfo& info) {
  return info.truth.empty() ? pose_source(info) : std::filesystem::absolute(info.path / "groundtruth.txt");
}

Result<TrajectoryError> evaluate_written(const Trajectory& truth, const Trajectory& estimate,
                                         const TrajectoryErrorParams& params) {
  return evaluate_trajectory(truth, as_in_tum_file(estimate), params);
}

std::string wrong_size_in_words(const TrajectoryError& error) {
  if (!error.wrong_size || !error.size_ratio) return {};
  return fmt::format("the estimate is {:.3f} times the size of the truth", *error.size_ratio);
}

std::optional<TrajectoryError> compare_with_truth(const Trajectory& estimate, const RecordingInfo& info,
                                                  const TrajectoryErrorParams& params,
                                                  std::vector<std::string>& warnings) {
  const Trajectory truth = true_trajectory(info);
  if (truth.empty() || estimate.size() < 3) return std::nullopt;
  auto error = evaluate_written(truth, estimate, params);
  if (error) {
    if (const std::string size = wrong_size_in_words(*error); !size.empty())
      warnings.push_back(size +
                         "; is the depth scale wrong (--depth-units-per-m), or the truth in another unit?");
    return std::move(*error);
  }
  warnings.push_back("the trajectory cannot be compared with the recording's poses: " +
                     to_string(error.error()));
  return std::nullopt;
}

std::optional<SE3> first_true_pose(const RecordingInfo& info, std::size_t first_frame) {
  const Trajectory truth = true_trajectory(info);
  const Duration max_gap = Duration::from_seconds(RecordingOptions{}.max_pose_gap_s);
  for (std::size_t i = first_frame; i < info.stamps.size(); ++i)
    if (const auto T_world_camera = pose_at(truth, info.stamps[i], max_gap)) return T_world_camera;
  return std::nullopt;
}

}  // namespace hm
