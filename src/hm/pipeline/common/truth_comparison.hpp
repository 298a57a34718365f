#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hm/evaluation/trajectory_error.hpp"
#include "hm/io/rgbd/recording.hpp"

namespace hm {

/// The poses that trajectories of a recording are compared with: its truth, else the poses as they were given
/// (evaluate_trajectory() interpolates for itself), else, for a recording in memory that has only these, the
/// poses of its depth images. Empty: it has none.
Trajectory true_trajectory(const RecordingInfo& info);

/// Where the poses as given, and the true_trajectory(), of a recording were read: "room/groundtruth.txt",
/// absolute; empty without poses.
std::filesystem::path pose_source(const RecordingInfo& info);
std::filesystem::path truth_source(const RecordingInfo& info);

/// The comparison of a trajectory that a run writes to a TUM file: as it stands in the file, so that every
/// verb that compares, and `hm evaluate trajectory` with the file, have the same numbers.
Result<TrajectoryError> evaluate_written(const Trajectory& truth, const Trajectory& estimate,
                                         const TrajectoryErrorParams& params);

/// "the estimate is 0.500 times the size of the truth"; empty where it has the truth's size (wrong_size).
std::string wrong_size_in_words(const TrajectoryError& error);

/// evaluate_written() with the recording's true_trajectory(); nothing where there is none (or less than three
/// poses of the estimate); what is wrong, and another size than the truth's, becomes a warning.
std::optional<TrajectoryError> compare_with_truth(const Trajectory& estimate, const RecordingInfo& info,
                                                  const TrajectoryErrorParams& params,
                                                  std::vector<std::string>& warnings);

/// Pose of the first frame from this one on that the recording gives one for.
std::optional<SE3> first_true_pose(const RecordingInfo& info, std::size_t first_frame);

}  // namespace hm
