#include <fmt/ranges.h>

#include <algorithm>

#include "hm/io/bytes/foreign_format.hpp"
#include "hm/io/bytes/input_file.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/io/rgbd/recording_listing.hpp"

/// Hints for a path without a recording.
namespace hm::detail {
namespace {

namespace fs = std::filesystem;

bool is_recording(const fs::path& folder) {
  return looks_like_tum(folder) || looks_like_icl_nuim(folder) || looks_like_seven_scenes(folder) ||
         is_laser_recording(folder);
}

/// Recordings below a folder, relative to it, sorted. Visits a bounded number of folders.
std::vector<std::string> recordings_inside(const fs::path& folder) {
  constexpr int kMaxDepth = 2, kMaxEntries = 2000;
  std::vector<std::string> found;
  std::error_code code;
  int entries = 0;
  for (auto at =
           fs::recursive_directory_iterator(folder, fs::directory_options::skip_permission_denied, code);
       !code && at != end(at) && entries < kMaxEntries; at.increment(code), ++entries) {
    std::error_code ignored;
    if (!at->is_directory(ignored)) continue;
    const bool is_one = is_recording(at->path());
    if (is_one) found.push_back(at->path().lexically_relative(folder).string());
    if (is_one || at.depth() + 1 >= kMaxDepth) at.disable_recursion_pending();
  }
  std::ranges::sort(found);
  return found;
}

std::string list_some(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 8;
  const std::span some(names.begin(), std::min(kMost, names.size()));
  return fmt::format("{}{}", fmt::join(some, ", "), names.size() > kMost ? " ..." : "");
}

/// Nearest parent folder that is a recording; empty: none.
fs::path recording_above(const fs::path& folder) {
  std::error_code ignored;
  fs::path at = fs::weakly_canonical(folder, ignored);
  for (int steps = 0; steps < 2 && at.has_relative_path(); ++steps) {
    at = at.parent_path();
    if (is_recording(at)) return at;
  }
  return {};
}

}  // namespace

std::string hint_of_place(const fs::path& path) {
  if (const auto foreign = describe_foreign_format(path)) return *foreign;
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) return {};
  if (is_file(path / "run.json")) return "this is a folder of results: `hm info` shows what is in it";
  if (const fs::path above = recording_above(path); !above.empty())
    return fmt::format("the folder above is a recording: try {}", above.string());
  const auto inside = recordings_inside(path);
  if (inside.empty()) return {};
  return fmt::format("{} recording{} inside: {}", inside.size(), inside.size() == 1 ? "" : "s",
                     list_some(inside));
}

}  // namespace hm::detail
