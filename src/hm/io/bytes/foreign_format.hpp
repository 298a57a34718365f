#pragma once
#include <filesystem>
#include <optional>
#include <string>

namespace hm {

/// Describes a file or folder of a format that this program does not read but knows (exports of phone apps,
/// videos, archives, ROS 2 bags, databases), and how to get at something that it reads. Judges by names and
/// first bytes. Nothing when the format is not known.
std::optional<std::string> describe_foreign_format(const std::filesystem::path& path);

}  // namespace hm
