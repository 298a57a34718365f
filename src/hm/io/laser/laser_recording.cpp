#include "hm/io/laser/laser_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "hm/io/bytes/skip_counter.hpp"
#include "hm/io/laser/laser_guess.hpp"
#include "hm/io/laser/laser_readers.hpp"
#include "hm/io/laser/laser_rig_file.hpp"
#include "hm/io/lists/pose_list.hpp"

namespace hm {
namespace {

Result<LaserRecording> read_kind(LaserRecordingKind kind, const std::filesystem::path& path,
                                 const LaserRecordingOptions& options) {
  switch (kind) {
    case LaserRecordingKind::kRosBag:
      return detail::read_laser_bag(path, options);
    case LaserRecordingKind::kCarmen:
      return detail::read_carmen_log(path);
    case LaserRecordingKind::kG2oLaser:
      return detail::read_g2o_laser_log(path);
    case LaserRecordingKind::kWeanHall:
      return detail::read_wean_hall_log(path);
    case LaserRecordingKind::kMoos:
      return detail::read_moos_log(path);
    case LaserRecordingKind::kBreezySlam:
      return detail::read_breezy_log(path);
    case LaserRecordingKind::kEurocImu:
      return detail::read_euroc_folder(path);
  }
  return fail(ErrorCode::kInternal, path, "no such kind of recording");
}

/// Reads rig.toml beside the recording.
Result<void> add_rig(LaserRecording& recording) {
  std::error_code ignored;
  const std::filesystem::path rig_path = recording.path.parent_path() / "rig.toml";
  if (!std::filesystem::exists(rig_path, ignored)) return {};
  auto rig = read_laser_rig(rig_path);
  if (!rig) return forward_error(rig);
  recording.rig = *rig;
  if (rig->T_base_range) {
    recording.range.T_base_range = rig->T_base_range;
    recording.range.mount_source = "rig.toml";
  }
  if (recording.lasers.empty()) return {};
  LaserStream& laser = recording.lasers.front();
  laser.T_base_laser = rig->T_base_laser;
  laser.mount_source = "rig.toml";
  laser.mount_problem.clear();
  return {};
}

/// Reads groundtruth.txt beside the recording, if it is the only recording there; one that cannot be read is
/// noted.
void add_truth(LaserRecording& recording) {
  std::error_code ignored;
  const std::filesystem::path truth_path = recording.path.parent_path() / "groundtruth.txt";
  if (!std::filesystem::exists(truth_path, ignored) ||
      detail::laser_files_in(recording.path.parent_path()).size() > 1)
    return;
  auto truth = detail::read_pose_list(truth_path);
  if (!truth) {
    recording.notes.push_back("the true poses are not used: " + to_string(truth.error()));
    return;
  }
  recording.truth = std::move(truth->poses);
  recording.truth_source = "groundtruth.txt";
  detail::add_skipped(recording, std::move(truth->skipped));
}

/// Says where the range sensor is mounted, or why that is unknown.
void note_range_mount(LaserRecording& recording) {
  const RangeStream& range = recording.range;
  if (range.readings.empty()) return;
  recording.notes.push_back(
      range.T_base_range
          ? fmt::format("{}: mount of the range sensor from {}", range.name, range.mount_source)
          : fmt::format(
                "{}: {}: the range sensor is not used, unless [range] of a rig.toml says where it looks",
                range.name,
                range.mount_source.empty() ? "no transform gives its mount" : range.mount_source));
}

}  // namespace

void detail::add_skipped(LaserRecording& recording, std::vector<SkippedLines> skipped) {
  for (SkippedLines& lines : skipped) {
    recording.notes.push_back(to_string(lines));
    recording.skipped.push_back(std::move(lines));
  }
}

std::string_view to_string(LaserRecordingKind kind) {
  switch (kind) {
    case LaserRecordingKind::kRosBag:
      return "ROS bag";
    case LaserRecordingKind::kCarmen:
      return "CARMEN log";
    case LaserRecordingKind::kG2oLaser:
      return "pose graph with scans";
    case LaserRecordingKind::kWeanHall:
      return "Wean Hall log";
    case LaserRecordingKind::kMoos:
      return "MOOS log";
    case LaserRecordingKind::kBreezySlam:
      return "BreezySLAM log";
    case LaserRecordingKind::kEurocImu:
      return "EuRoC IMU";
  }
  return "unknown";
}

Result<LaserRecording> open_laser_recording(const std::filesystem::path& path,
                                            const LaserRecordingOptions& options) {
  const auto found = detail::find_laser_file(path, options.kind);
  if (!found) return forward_error(found);
  auto recording = read_kind(found->kind, found->path, options);
  if (!recording) return recording;
  if (const auto added = add_rig(*recording); !added) return forward_error(added);
  note_range_mount(*recording);
  add_truth(*recording);
  return recording;
}

bool is_laser_recording(const std::filesystem::path& path) {
  return detail::find_laser_file(path, std::nullopt).has_value();
}

}  // namespace hm
