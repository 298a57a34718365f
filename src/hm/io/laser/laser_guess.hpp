#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/io/laser/laser_recording.hpp"

namespace hm::detail {

struct FoundLaserFile {
  std::filesystem::path path;
  LaserRecordingKind kind;
};

/// Finds the recording at a path: the file itself, or the only one in a folder. Its kind is recognised from
/// its first bytes unless given. Error when there is none or more than one.
Result<FoundLaserFile> find_laser_file(const std::filesystem::path& path,
                                       std::optional<LaserRecordingKind> kind);

/// Laser recordings directly in a folder, sorted by name.
std::vector<FoundLaserFile> laser_files_in(const std::filesystem::path& folder);
/// What is said where these are more than one; empty otherwise.
std::string several_laser_files(const std::vector<FoundLaserFile>& files);

}  // namespace hm::detail
