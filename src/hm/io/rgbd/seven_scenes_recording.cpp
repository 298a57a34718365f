#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "hm/io/pose/pose_matrix_file.hpp"
#include "hm/io/rgbd/recording_listing.hpp"

/// 7-Scenes: frame-XXXXXX.depth.png (or .pgm), .color.png or .jpg, .pose.txt, in the folder or in its seq-XX
/// subfolders.
namespace hm::detail {
namespace {

namespace fs = std::filesystem;

struct FrameFiles {
  fs::path depth, color, pose;
};
using FramesByNumber = std::map<std::uint64_t, FrameFiles>;

/// Number and suffix of frame-000123.SUFFIX.
std::optional<std::pair<std::uint64_t, std::string>> number_and_suffix(const std::string& name) {
  constexpr std::string_view kPrefix = "frame-";
  const std::size_t dot = name.find('.');
  if (!name.starts_with(kPrefix) || dot == std::string::npos) return std::nullopt;
  const std::string digits = name.substr(kPrefix.size(), dot - kPrefix.size());
  if (digits.empty() || digits.size() > 9 || digits.find_first_not_of("0123456789") != std::string::npos)
    return std::nullopt;
  return std::pair{std::stoull(digits), name.substr(dot)};
}

/// 3RScan has the same names, with depth as PGM.
bool is_depth(std::string_view suffix) { return suffix == ".depth.png" || suffix == ".depth.pgm"; }

FramesByNumber frames_in(const fs::path& folder) {
  FramesByNumber frames;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const auto name = number_and_suffix(entry.path().filename().string());
    if (!name) continue;
    const auto& [number, suffix] = *name;
    if (is_depth(suffix) && frames[number].depth.extension() != ".png") frames[number].depth = entry.path();
    if (suffix == ".color.png" || suffix == ".color.jpg" || suffix == ".color.jpeg")
      frames[number].color = entry.path();
    if (suffix == ".pose.txt") frames[number].pose = entry.path();
  }
  return frames;
}

/// The folder itself, or its seq-XX subfolders, in order.
std::vector<fs::path> sequences_of(const fs::path& folder) {
  std::vector<fs::path> sequences;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("seq-") && entry.is_directory(ignored)) sequences.push_back(entry.path());
    const auto frame = number_and_suffix(name);
    if (frame && is_depth(frame->second)) return {folder};
  }
  std::ranges::sort(sequences);
  return sequences;
}

/// True in the folder of a scene of the data set, or in one of its sequences.
bool is_of_seven_scenes(const fs::path& folder) {
  constexpr std::array kScenes{"chess", "fire", "heads", "office", "pumpkin", "redkitchen", "stairs"};
  const fs::path whole = fs::weakly_canonical(folder);
  const std::string name = whole.filename().string();
  return name.find("scenes") != std::string::npos || std::ranges::any_of(kScenes, [&](const char* scene) {
           return name == scene || whole.parent_path().filename() == scene;
         });
}

/// Reads the pose of a frame; missing and invalid ones are counted, and the first of each reason is reported.
std::optional<SE3> pose_of(const FrameFiles& files, RecordingInfo& info) {
  if (files.pose.empty()) return std::nullopt;
  const auto pose = read_pose_matrix(files.pose);
  if (pose) return *pose;
  const auto reason = skip_reason(pose.error());
  for (SkippedLines& known : info.skipped) {
    if (known.reason != reason) continue;
    ++known.count;
    return std::nullopt;
  }
  info.skipped.push_back({reason, files.pose.filename().string(), 1, 0});
  if (reason != SkippedLines::Reason::kNotFinite) add_note(info, to_string(pose.error()));
  return std::nullopt;
}

/// Appends a sequence; frames are numbered from `start` and stamped at the frame rate.
void append_sequence(RecordingListing& listing, const fs::path& folder, Time start, double rate_hz) {
  RecordingInfo& info = listing.info;
  for (auto& [number, files] : frames_in(folder)) {
    if (!files.color.empty()) ++info.color_count;
    if (files.depth.empty() && files.pose.empty()) continue;
    // A pose without a depth image is a gap: reading that frame reports the missing file.
    if (files.depth.empty()) files.depth = folder / fmt::format("frame-{:06}.depth.png", number);
    ListedFrame frame{files.depth, files.color, {}, {}, pose_of(files, info)};
    frame.stamp = frame.color_stamp = start + Duration::from_seconds(static_cast<double>(number) / rate_hz);
    if (frame.T_world_camera) info.trajectory.push_back({frame.stamp, *frame.T_world_camera});
    info.stamps.push_back(frame.stamp);
    listing.frames.push_back(std::move(frame));
  }
}

}  // namespace

bool looks_like_seven_scenes(const fs::path& folder) {
  for (const fs::path& sequence : sequences_of(folder)) {
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(sequence, ignored)) {
      const auto name = number_and_suffix(entry.path().filename().string());
      if (name && is_depth(name->second)) return true;
    }
  }
  return false;
}

Result<RecordingListing> list_seven_scenes(const fs::path& folder, const RecordingOptions& options) {
  RecordingListing listing;
  RecordingInfo& info = listing.info;
  info.kind = RecordingKind::kSevenScenes;
  info.path = folder;
  info.has_own_stamps = false;
  info.trajectory_source = "frame-*.pose.txt";
  KnownCamera known{PinholeCamera{640, 480, 585, 585, 320, 240, {}}, "the 7-Scenes camera", 1000.0};
  known.is_scale_certain = is_of_seven_scenes(folder);
  if (!known.is_scale_certain)
    known.assumption =
        "no camera.txt: the camera of 7-Scenes is used (585 585 320 240, 1000 units of depth per metre), "
        "whose names the files have; "
        "another one needs a camera.txt (or --intrinsics and --depth-units-per-m)";
  const auto rate = choose_camera(info, options, known);
  if (!rate) return forward_error(rate);
  const std::vector<fs::path> sequences = sequences_of(folder);
  if (sequences.empty())
    return fail(ErrorCode::kNotFound, folder, "a 7-Scenes recording needs frame-XXXXXX.depth.png files");
  Time start;
  for (const fs::path& sequence : sequences) {
    append_sequence(listing, sequence, start, *rate);
    if (!info.stamps.empty()) start = info.stamps.back() + Duration::from_seconds(1.0);
  }
  if (sequences.size() > 1)
    add_note(info, fmt::format("{} sequences, one after the other", sequences.size()));
  for (const SkippedLines& skipped : info.skipped) add_note(info, to_string(skipped));
  return listing;
}

}  // namespace hm::detail
