#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace hm {

/// Finds the name closest to a mistyped or shortened word: one that contains the word ("voxel" for
/// "tsdf.voxel_size_m"; of several the one with the word at the start of a part, then the shortest), else one
/// at a small edit distance (at most a third of the letters). Case-insensitive. Nothing when no name is
/// close.
std::optional<std::string_view> nearest_name(std::string_view word, std::span<const std::string_view> names);

/// Why a word is none of these names, with the one that may have been meant: "unknown world 'hous'; did you
/// mean 'house'?", or else all of them. `kind`: of what they name.
std::string unknown_name(std::string_view kind, std::string_view word,
                         std::span<const std::string_view> names);

}  // namespace hm
