#pragma once
#include <optional>
#include <span>
#include <string_view>

namespace hm {

/// The name that a mistyped or shortened word most likely stands for: one that contains the word ("voxel" for
/// "tsdf.voxel_size_m"; of several the one where it begins a part of the name, then the shortest), else one
/// with few letters changed (at most a third of them). Letter case is ignored. Nothing when none is near.
std::optional<std::string_view> nearest_name(std::string_view word, std::span<const std::string_view> names);

}  // namespace hm
