#pragma once
#include <filesystem>
#include <optional>
#include <string>

namespace hm {

/// Describes a file or folder of a known but unsupported format (exports of phone apps, videos, archives, ROS
/// 2 bags, databases), and how to convert it. Recognised by names and first bytes. Nothing when the format is
/// unknown.
std::optional<std::string> describe_foreign_format(const std::filesystem::path& path);

}  // namespace hm
