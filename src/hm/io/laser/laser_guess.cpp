#include "hm/io/laser/laser_guess.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <system_error>

#include "hm/io/bytes/file_name.hpp"
#include "hm/io/bytes/foreign_format.hpp"
#include "hm/io/bytes/input_file.hpp"
#include "hm/io/bytes/text_lines.hpp"
#include "hm/io/laser/laser_readers.hpp"

namespace hm::detail {
namespace {

constexpr const char* kLookedFor =
    "a ROS bag, a CARMEN log (FLASER, ROBOTLASER1 ...), VERTEX2 with ROBOTLASER1 lines, a Wean Hall log (L "
    "and O "
    "lines), a MOOS .alog with LMS_LASER_2D, a BreezySLAM .dat, or EuRoC's imu0/data.csv";

std::string first_bytes(const std::filesystem::path& path) {
  constexpr std::uint64_t kGlanceBytes = std::uint64_t{1} << 16;
  auto file = InputFile::open(path);
  if (!file) return {};
  std::string bytes(static_cast<std::size_t>(std::min(file->size(), kGlanceBytes)), '\0');
  if (!file->read(bytes.data(), bytes.size())) return {};
  return bytes;
}

bool is_numeric(const std::vector<std::string_view>& columns, std::size_t from) {
  return std::all_of(columns.begin() + static_cast<std::ptrdiff_t>(from), columns.end(),
                     [](std::string_view word) { return parse_number(word).has_value(); });
}

bool is_carmen_word(std::string_view word) {
  constexpr std::array kWords{"FLASER", "RLASER", "LASER3", "ODOM", "PARAM", "SYNC", "TRUEPOS"};
  return std::ranges::find(kWords, word) != kWords.end() || word.starts_with("ROBOTLASER") ||
         word.starts_with("RAWLASER");
}

/// Recording kind recognised from a line, if any.
std::optional<LaserRecordingKind> kind_of_line(std::string_view line) {
  constexpr std::size_t kWeanOdometryWords = 5, kWeanMinLaserWords = 9, kBreezyMinWords = 100;
  const auto columns = words(line);
  const std::string_view first = columns[0];
  if (is_carmen_word(first)) return LaserRecordingKind::kCarmen;
  if (line.starts_with("%%") && line.find("LOG FILE") != std::string_view::npos)
    return LaserRecordingKind::kMoos;
  if (columns.size() > 1 && columns[1].starts_with("LMS_LASER_2D")) return LaserRecordingKind::kMoos;
  const bool wean = (first == "O" && columns.size() == kWeanOdometryWords) ||
                    (first == "L" && columns.size() >= kWeanMinLaserWords);
  if (wean && is_numeric(columns, 1)) return LaserRecordingKind::kWeanHall;
  if (columns.size() >= kBreezyMinWords && is_numeric(columns, 0)) return LaserRecordingKind::kBreezySlam;
  return std::nullopt;
}

std::optional<LaserRecordingKind> kind_of_text(std::string bytes) {
  if (bytes.starts_with("#timestamp") && bytes.find("w_RS_S_x") != std::string::npos)
    return LaserRecordingKind::kEurocImu;
  if (bytes.find("CARMEN Logfile") != std::string::npos && bytes.starts_with('#'))
    return LaserRecordingKind::kCarmen;
  const bool is_graph = bytes.starts_with("VERTEX2 ") || bytes.find("\nVERTEX2 ") != std::string::npos;
  if (is_graph && bytes.find("\nROBOTLASER1 ") != std::string::npos) return LaserRecordingKind::kG2oLaser;
  constexpr std::size_t kMostLines = 50;
  const TextFile text(std::move(bytes), "");
  const auto lines = text.lines();
  for (std::size_t i = 0; i < std::min(kMostLines, lines.size()); ++i)
    if (const auto kind = kind_of_line(lines[i].text)) return kind;
  return std::nullopt;
}

std::optional<LaserRecordingKind> guess_kind(const std::filesystem::path& path) {
  std::string bytes = first_bytes(path);
  if (bytes.starts_with("#ROSBAG V") || bytes.starts_with("#ROSRECORD")) return LaserRecordingKind::kRosBag;
  if (bytes.empty() || std::memchr(bytes.data(), 0, bytes.size()) != nullptr) return std::nullopt;
  return kind_of_text(std::move(bytes));
}

/// True for a folder of depth images, which may also contain a bag; it is then read as images.
bool has_images(const std::filesystem::path& folder) {
  std::error_code ignored;
  return std::filesystem::exists(folder / "depth.txt", ignored) ||
         std::filesystem::exists(folder / "associations.txt", ignored);
}

std::string not_laser(const std::filesystem::path& path) {
  const auto foreign = describe_foreign_format(path);
  return foreign ? "not a laser recording: " + *foreign
                 : fmt::format("not a laser recording; looked for {}", kLookedFor);
}

Result<FoundLaserFile> find_in_folder(const std::filesystem::path& folder) {
  if (const auto imu = euroc_imu_file(folder); !imu.empty())
    return FoundLaserFile{imu, LaserRecordingKind::kEurocImu};
  if (has_images(folder))
    return fail(ErrorCode::kNotFound, folder, "this folder holds depth images, not a laser recording");
  const auto files = laser_files_in(folder);
  if (files.empty()) return fail(ErrorCode::kNotFound, folder, "{}", not_laser(folder));
  if (const std::string several = several_laser_files(files); !several.empty())
    return fail(ErrorCode::kUsage, folder, "{}", several);
  return files[0];
}

}  // namespace

std::vector<FoundLaserFile> laser_files_in(const std::filesystem::path& folder) {
  constexpr std::array kExtensions{".bag", ".active", ".log", ".clf", ".carmen", ".alog", ".dat"};
  std::vector<FoundLaserFile> found;
  std::error_code code;
  for (auto at = std::filesystem::directory_iterator(folder, code); !code && at != end(at);
       at.increment(code)) {
    const auto& path = at->path();
    if (std::ranges::find(kExtensions, lower_extension(path)) == kExtensions.end()) continue;
    if (const auto kind = guess_kind(path)) found.push_back({path, *kind});
  }
  std::ranges::sort(found, {}, &FoundLaserFile::path);
  return found;
}

std::string several_laser_files(const std::vector<FoundLaserFile>& files) {
  if (files.size() < 2) return {};
  return fmt::format("{} laser recordings in this folder ({}, {}{}): name one, as {}", files.size(),
                     files[0].path.filename().string(), files[1].path.filename().string(),
                     files.size() > 2 ? " ..." : "", files[0].path.string());
}

Result<FoundLaserFile> find_laser_file(const std::filesystem::path& path,
                                       std::optional<LaserRecordingKind> kind) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored))
    return fail(ErrorCode::kNotFound, path, "there is nothing here");
  if (std::filesystem::is_directory(path, ignored)) {
    auto found = find_in_folder(path);
    if (found && kind) found->kind = *kind;
    return found;
  }
  if (!kind) kind = guess_kind(path);
  if (!kind) return fail(ErrorCode::kUnsupported, path, "{}", not_laser(path));
  return FoundLaserFile{path, *kind};
}

}  // namespace hm::detail
