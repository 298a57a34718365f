#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/io/laser/laser_recording.hpp"

namespace hm::detail {

struct FoundLaserFile {
  std::filesystem::path path;
  LaserRecordingKind kind;
};

/// The recording that a path means: the file itself, or the only one in a folder; its kind from its first
/// bytes unless given.
Result<FoundLaserFile> find_laser_file(const std::filesystem::path& path,
                                       std::optional<LaserRecordingKind> kind);

/// The laser recordings right inside of a folder, by name.
std::vector<FoundLaserFile> laser_files_in(const std::filesystem::path& folder);

}  // namespace hm::detail
