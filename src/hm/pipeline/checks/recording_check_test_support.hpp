#pragma once
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "hm/io/bytes/file_bytes.hpp"
#include "hm/pipeline/checks/recording_check.hpp"

namespace hm::recording_check_test {

inline RecordingReport inspect(const std::filesystem::path& path, const RecordingOptions& options = {},
                               const InspectOptions& inspect_options = {}) {
  const auto recording = open_recording(path, options);
  EXPECT_TRUE(recording) << to_string(recording.error());
  return recording ? inspect_recording(**recording, inspect_options) : RecordingReport{};
}

inline std::vector<FindingKind> kinds(const RecordingReport& report) {
  std::vector<FindingKind> result;
  for (const Finding& finding : report.findings) result.push_back(finding.kind);
  return result;
}

inline std::string messages(const RecordingReport& report) {
  std::string text;
  for (const Finding& finding : report.findings) text += finding.message + "\n";
  return text;
}

/// Rewrites groundtruth.txt with each pose changed.
inline void change_poses(const std::filesystem::path& folder,
                         const std::function<StampedPose(StampedPose)>& changed) {
  const auto recording = open_recording(folder);
  ASSERT_TRUE(recording);
  std::string text;
  for (const StampedPose& given : (*recording)->info().trajectory) {
    const StampedPose pose = changed(given);
    const Eigen::Quaterniond q = pose.T_world_base.quaternion();
    const Vec3& t = pose.T_world_base.translation();
    text += fmt::format("{:.9f} {} {} {} {} {} {} {}\n", pose.stamp.seconds(), t.x(), t.y(), t.z(), q.x(),
                        q.y(), q.z(), q.w());
  }
  ASSERT_TRUE(write_file_text(folder / "groundtruth.txt", text));
}

/// The i-th image of a folder, by name.
inline std::filesystem::path nth_image(const std::filesystem::path& folder, int i) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry.path());
  std::ranges::sort(files);
  return files.at(static_cast<std::size_t>(i));
}

}  // namespace hm::recording_check_test
