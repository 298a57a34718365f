#include "hm/io/rgbd/named_images.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <span>
#include <utility>

#include "hm/io/bytes/file_name.hpp"
#include "hm/io/bytes/input_file.hpp"
#include "hm/io/bytes/text_lines.hpp"
#include "hm/io/pose/pose_matrix_file.hpp"
#include "hm/io/pose/trajectory_file.hpp"

namespace hm::detail {
namespace {

namespace fs = std::filesystem;

bool is_image(const fs::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg" || extension == ".pgm" ||
         extension == ".ppm";
}

bool is_digits(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

/// True for "12.5" or "0012": digits with at most one decimal point.
bool is_numeric_name(std::string_view stem) {
  const std::size_t point = stem.find('.');
  if (point == std::string_view::npos) return is_digits(stem);
  return is_digits(stem.substr(0, point)) && is_digits(stem.substr(point + 1));
}

/// The number in a file's name, empty where there is none: `depth_000123` and `frame000123` without the word
/// before it, and `0000001-000000033333` (frame and time of the device) without what follows the frame.
std::string_view number_in(std::string_view stem) {
  while (!stem.empty() && (std::isalpha(static_cast<unsigned char>(stem.front())) != 0 ||
                           stem.front() == '_' || stem.front() == '-'))
    stem.remove_prefix(1);
  const std::size_t dash = stem.find('-');
  const bool is_pair =
      dash != std::string_view::npos && is_digits(stem.substr(0, dash)) && is_digits(stem.substr(dash + 1));
  if (is_pair) return stem.substr(0, dash);
  return is_numeric_name(stem) ? stem : std::string_view();
}

/// Unit of the numbers in the names of a folder's images.
enum class NameUnit { kSeconds, kMilliseconds, kMicroseconds, kNanoseconds, kFrames };

NameUnit unit_of(std::string_view stem) {
  const std::size_t point = stem.find('.');
  switch (std::min(point, stem.size())) {  // digits of the current Unix time
    case 19:
      return NameUnit::kNanoseconds;
    case 16:
      return NameUnit::kMicroseconds;
    case 13:
      return NameUnit::kMilliseconds;
    case 10:
      return NameUnit::kSeconds;
    default:
      return point == std::string_view::npos ? NameUnit::kFrames : NameUnit::kSeconds;
  }
}

std::string_view to_words(NameUnit unit) {
  constexpr std::array<std::string_view, 5> kWords{"seconds", "milliseconds", "microseconds", "nanoseconds",
                                                   "frame numbers"};
  return kWords[static_cast<std::size_t>(unit)];
}

std::optional<Time> time_of(std::string_view stem, NameUnit unit, double rate_hz) {
  return unit == NameUnit::kFrames ? StampRule{rate_hz}.parse(stem) : parse_stamp(stem);
}

/// Images of one kind: in a folder of their own, or with a word before their numbers.
struct Stream {
  std::string_view folder, word = {};
};
constexpr std::array kDepthStreams{Stream{"depth"}, Stream{"results", "depth"}};
constexpr std::array kColorStreams{Stream{"rgb"}, Stream{"color"}, Stream{"colour"}, Stream{"image"},
                                   Stream{"images"}};
constexpr std::array kColorOfResults{Stream{"results", "frame"}};
constexpr std::array kPoseStreams{Stream{"pose"}, Stream{"poses"}};

std::vector<fs::path> files_of(const fs::path& recording, const Stream& stream,
                               bool (*is_kind)(const fs::path&)) {
  std::vector<fs::path> files;
  std::error_code code;
  for (auto at = fs::directory_iterator(recording / stream.folder, code); !code && at != end(at);
       at.increment(code))
    if (is_kind(at->path()) && at->path().filename().string().starts_with(stream.word))
      files.push_back(at->path());
  return files;
}

/// Images of one stream by increasing time; names that are not numbers and repeated times are counted.
ImageList list_stream(const fs::path& recording, const Stream& stream, NameUnit unit, double rate_hz) {
  ImageList list;
  const std::string name(stream.folder);
  SkippedLines malformed{SkippedLines::Reason::kMalformed, name, 0, 0, "image"};
  SkippedLines repeated{SkippedLines::Reason::kStampNotIncreasing, name, 0, 0, "image"};
  for (const fs::path& path : files_of(recording, stream, is_image)) {
    const std::string stem = path.stem().string();
    const std::string_view number = number_in(stem);
    const auto stamp = number.empty() ? std::nullopt : time_of(number, unit, rate_hz);
    if (stamp)
      list.images.push_back({*stamp, (fs::path(name) / path.filename()).string()});
    else if (malformed.count++ == 0)
      malformed.place = path.filename().string();
  }
  std::ranges::sort(list.images, [](const StampedImage& a, const StampedImage& b) {
    return a.stamp != b.stamp ? a.stamp < b.stamp : a.path < b.path;
  });
  const auto same = [](const StampedImage& a, const StampedImage& b) { return a.stamp == b.stamp; };
  const auto rest = std::ranges::unique(list.images, same);
  repeated.count = rest.size();
  if (!rest.empty()) repeated.place = rest.front().path;
  list.images.erase(rest.begin(), rest.end());
  for (const SkippedLines& skipped : {malformed, repeated})
    if (skipped.count > 0) list.skipped.push_back(skipped);
  return list;
}

/// Most frequent unit of the names, since numbers in one folder may differ in length.
std::optional<NameUnit> unit_of_names(const std::vector<fs::path>& files) {
  std::array<std::size_t, 5> votes{};
  for (const fs::path& path : files) {
    const std::string stem = path.stem().string();
    if (const std::string_view number = number_in(stem); !number.empty())
      ++votes[static_cast<std::size_t>(unit_of(number))];
  }
  const auto most = std::ranges::max_element(votes);
  if (*most == 0) return std::nullopt;
  return static_cast<NameUnit>(most - votes.begin());
}

struct FoundStream {
  Stream stream;
  NameUnit unit;
};
/// The first of these streams that has images with numbers.
std::optional<FoundStream> first_of(const fs::path& recording, std::span<const Stream> streams) {
  for (const Stream& stream : streams)
    if (const auto unit = unit_of_names(files_of(recording, stream, is_image)))
      return FoundStream{stream, *unit};
  return std::nullopt;
}

bool is_text(const fs::path& path) { return lower_extension(path) == ".txt"; }

/// One matrix a file; empty where the stream has none.
PoseList read_matrices(const fs::path& recording, const Stream& stream, double rate_hz) {
  const std::vector<fs::path> files = files_of(recording, stream, is_text);
  PoseList list;
  const auto unit = unit_of_names(files);
  if (!unit) return list;
  std::map<SkippedLines::Reason, SkippedLines> skipped;
  const auto skip = [&](SkippedLines::Reason reason, const fs::path& path) {
    const SkippedLines first{reason, std::string(stream.folder), 0, 0, "pose", path.filename().string()};
    ++skipped.try_emplace(reason, first).first->second.count;
  };
  std::map<Time, fs::path> by_time;
  for (const fs::path& path : files) {
    const std::string stem = path.stem().string();
    const std::string_view number = number_in(stem);
    const auto stamp = number.empty() ? std::nullopt : time_of(number, *unit, rate_hz);
    if (!stamp)
      skip(SkippedLines::Reason::kMalformed, path);
    else if (!by_time.emplace(*stamp, path).second)
      skip(SkippedLines::Reason::kStampNotIncreasing, path);
  }
  for (const auto& [stamp, path] : by_time) {
    if (const auto pose = read_pose_matrix(path)) {
      list.poses.push_back({stamp, *pose});
    } else {
      skip(skip_reason(pose.error()), path);
      list.lost.push_back(stamp);
    }
  }
  for (const auto& [reason, lines] : skipped) list.skipped.push_back(lines);
  return list;
}

}  // namespace

bool has_named_images(const fs::path& folder) {
  for (const char* list : {"depth.txt", "associations.txt", "associated.txt", "associate.txt"})
    if (is_file(folder / list)) return false;
  return first_of(folder, kDepthStreams).has_value();
}

Result<NamedImages> list_named_images(const fs::path& folder, double rate_hz) {
  const auto depth = first_of(folder, kDepthStreams);
  if (!depth)
    return fail(ErrorCode::kNotFound, folder / kDepthStreams[0].folder,
                "no image that is named by a stamp or a number");
  NamedImages named;
  named.has_stamps = depth->unit != NameUnit::kFrames;
  named.lists.depth = list_stream(folder, depth->stream, depth->unit, rate_hz);
  std::string color_note = "no colour: there is no rgb, color, colour, image or images beside it";
  const bool is_beside = depth->stream.folder == kColorOfResults[0].folder;
  if (const auto color = is_beside ? first_of(folder, kColorOfResults) : first_of(folder, kColorStreams)) {
    named.lists.color = list_stream(folder, color->stream, color->unit, rate_hz);
    color_note = fmt::format("colour from {}/", color->stream.folder);
  }
  named.note = fmt::format("no depth.txt: depth images of {}/ by their names, read as {}{}; {}",
                           depth->stream.folder, to_words(depth->unit),
                           named.has_stamps ? "" : fmt::format(" at {:g} Hz", rate_hz), color_note);
  return named;
}

Result<std::optional<NamedPoses>> find_named_poses(const fs::path& folder, std::span<const Time> stamps,
                                                   double rate_hz) {
  for (const Stream& stream : kPoseStreams) {
    PoseList list = read_matrices(folder, stream, rate_hz);
    if (!list.poses.empty()) return NamedPoses{std::move(list), fmt::format("{}/", stream.folder)};
  }
  if (!is_file(folder / "traj.txt")) return std::nullopt;
  auto poses = read_trajectory_of(folder / "traj.txt", stamps);
  if (!poses) return forward_error(poses);
  return NamedPoses{{std::move(*poses), {}, {}}, "traj.txt"};
}

}  // namespace hm::detail
