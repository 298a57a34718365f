#include <algorithm>
#include <array>
#include <cmath>
#include <system_error>

#include "hm/io/bytes/input_file.hpp"
#include "hm/io/bytes/skip_counter.hpp"
#include "hm/io/laser/laser_readers.hpp"
#include "hm/io/rosbag/bag_messages.hpp"

namespace hm::detail {
namespace {

/// Items of a table with their lines.
template <class Item>
struct Table {
  std::vector<Item> items;
  std::vector<std::size_t> lines;
};

/// Line `a,b,c,...`: its stamp in nanoseconds, and the following numbers.
struct CsvLine {
  Time stamp;
  std::vector<double> numbers;
};

std::optional<CsvLine> parse_csv(std::string_view text) {
  CsvLine line;
  bool first = true;
  while (true) {
    const std::size_t comma = text.find(',');
    const auto columns = words(text.substr(0, comma));
    if (columns.size() != 1) return std::nullopt;
    const auto number = parse_number(columns[0]);
    if (!number) return std::nullopt;
    if (first) {
      const auto stamp = parse_stamp_ns(columns[0]);
      if (!stamp) return std::nullopt;
      line.stamp = *stamp;
    } else {
      line.numbers.push_back(*number);
    }
    first = false;
    if (comma == std::string_view::npos) return line;
    text.remove_prefix(comma + 1);
  }
}

/// Reads a table; `make` converts a line to an item, or returns the reason why it cannot.
template <class Item, class Make>
Result<std::vector<Item>> read_table(const std::filesystem::path& path, LaserRecording& recording,
                                     Make make) {
  const auto file = TextFile::read(path);
  if (!file) return forward_error(file);
  Table<Item> table;
  SkipCounter skips(path);
  for (const TextLine& line : file->lines()) {
    const auto csv = parse_csv(line.text);
    Item item;
    const auto wrong = csv ? make(*csv, item) : SkippedLines::Reason::kMalformed;
    if (wrong) {
      const bool cut_off = !line.ended && *wrong == SkippedLines::Reason::kMalformed;
      skips.add(cut_off ? SkippedLines::Reason::kCutOff : *wrong, line.number);
      continue;
    }
    table.items.push_back(std::move(item));
    table.lines.push_back(line.number);
  }
  auto kept = keep_increasing(
      std::move(table.items), table.lines, [](const Item& item) { return item.stamp; }, skips);
  add_skipped(recording, skips.take());
  return kept;
}

using Wrong = std::optional<SkippedLines::Reason>;

/// Columns: stamp, angular velocity, specific force.
Wrong make_imu(const CsvLine& line, ImuSample& sample) {
  const auto& v = line.numbers;
  if (v.size() != 6) return SkippedLines::Reason::kMalformed;
  sample.stamp = line.stamp;
  sample.angular_velocity_rad_s = {v[0], v[1], v[2]};
  sample.specific_force_m_s2 = {v[3], v[4], v[5]};
  const bool finite = std::ranges::all_of(v, [](double x) { return std::isfinite(x); });
  return finite ? Wrong{} : SkippedLines::Reason::kNotFinite;
}

/// Columns: stamp, position, quaternion with the real part first; the rest is ignored.
Wrong make_pose(const CsvLine& line, StampedPose& pose) {
  const auto& v = line.numbers;
  if (v.size() < 7) return SkippedLines::Reason::kMalformed;
  if (!std::all_of(v.begin(), v.begin() + 7, [](double x) { return std::isfinite(x); }))
    return SkippedLines::Reason::kNotFinite;
  const auto rotation = rotation_of({v[4], v[5], v[6], v[3]});
  if (!rotation) return SkippedLines::Reason::kNotRigid;
  pose = {line.stamp, SE3(*rotation, Vec3(v[0], v[1], v[2]))};
  return {};
}

std::filesystem::path first_existing(const std::vector<std::filesystem::path>& paths) {
  for (const auto& path : paths)
    if (is_file(path)) return path;
  return {};
}

/// Path of the truth of an IMU file, in the layout of the data set or flat.
std::filesystem::path truth_file(const std::filesystem::path& imu_file) {
  const auto folder = imu_file.parent_path();
  if (imu_file.filename() == "data.csv")
    return first_existing({folder.parent_path() / "state_groundtruth_estimate0" / "data.csv"});
  return first_existing({folder / "gt0.csv"});
}

}  // namespace

std::filesystem::path euroc_imu_file(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(path, ignored)) return first_existing({path});
  return first_existing({path / "imu0" / "data.csv", path / "mav0" / "imu0" / "data.csv", path / "imu0.csv"});
}

Result<LaserRecording> read_euroc_folder(const std::filesystem::path& path) {
  const auto imu_file = euroc_imu_file(path);
  if (imu_file.empty()) return fail(ErrorCode::kNotFound, path, "no imu0/data.csv or imu0.csv");
  LaserRecording recording{.kind = LaserRecordingKind::kEurocImu, .path = imu_file};
  auto imu = read_table<ImuSample>(imu_file, recording, make_imu);
  if (!imu) return forward_error(imu);
  if (imu->empty()) return fail(ErrorCode::kCorrupted, imu_file, "no line holds a reading of an IMU");
  recording.imu = std::move(*imu);
  const auto truth_path = truth_file(imu_file);
  if (truth_path.empty()) return recording;
  auto truth = read_table<StampedPose>(truth_path, recording, make_pose);
  if (!truth) return forward_error(truth);
  recording.truth = std::move(*truth);
  if (!recording.truth.empty()) recording.truth_source = truth_path.filename().string();
  return recording;
}

}  // namespace hm::detail
