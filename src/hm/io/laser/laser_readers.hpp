#pragma once
#include <filesystem>
#include <string>

#include "hm/io/bytes/text_lines.hpp"
#include "hm/io/laser/laser_recording.hpp"

/// One reader per kind of laser recording. Each fills streams, odometry and truth, and counts what it skips;
/// files beside the recording (rig, truth) are added by open_laser_recording().
namespace hm::detail {

Result<LaserRecording> read_laser_bag(const std::filesystem::path& path,
                                      const LaserRecordingOptions& options);
Result<LaserRecording> read_carmen_log(const std::filesystem::path& path);
/// Reads VERTEX2 / EDGE2 / ROBOTLASER1 lines. Its poses are optimised, so they are read as truth.
Result<LaserRecording> read_g2o_laser_log(const std::filesystem::path& path);
Result<LaserRecording> read_wean_hall_log(const std::filesystem::path& path);
Result<LaserRecording> read_moos_log(const std::filesystem::path& path);
Result<LaserRecording> read_breezy_log(const std::filesystem::path& path);
Result<LaserRecording> read_euroc_folder(const std::filesystem::path& path);

/// EuRoC IMU file of a path (a folder, or the file itself); empty when there is none.
std::filesystem::path euroc_imu_file(const std::filesystem::path& path);

/// Appends the counts of skipped lines or messages.
void add_skipped(LaserRecording& recording, std::vector<SkippedLines> skipped);

}  // namespace hm::detail
