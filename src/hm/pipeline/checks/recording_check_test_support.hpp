#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

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

}  // namespace hm::recording_check_test
