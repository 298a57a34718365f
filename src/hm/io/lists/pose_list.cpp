#include "hm/io/lists/pose_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "hm/io/bytes/skip_counter.hpp"
#include "hm/io/lists/pose_table.hpp"

namespace hm::detail {
namespace {

/// Tolerance of a quaternion's length: text files are rounded, but a row of zeros is not a rotation.
constexpr double kQuaternionTolerance = 0.05;

/// Reads the lines of one file into a list.
class PoseListReader {
 public:
  PoseListReader(const TextFile& file, const std::filesystem::path& path, const StampRule& rule)
      : file_(file), table_(pose_table(file)), rule_(rule), skips_(path) {}
  Result<PoseList> read();

 private:
  std::string add(const TextLine& line);

  const TextFile& file_;
  PoseTable table_;
  const StampRule& rule_;
  SkipCounter skips_;
  PoseList list_;
  std::vector<std::size_t> line_numbers_;
};

/// Adds the pose of a line. Returns what is wrong with it; empty: nothing.
std::string PoseListReader::add(const TextLine& line) {
  const std::vector<std::string_view> columns = pose_columns(line.text);
  if (columns.size() == 4)
    return "4 columns: positions without orientations, where a pose is `stamp tx ty tz qx qy qz qw`";
  if (columns.size() < 8 || (columns.size() > 8 && !table_.has_comma_header))
    return fmt::format("expected `stamp tx ty tz qx qy qz qw`, found {} columns", columns.size());
  const auto stamp = rule_.frame_rate_hz ? rule_.parse(columns[0]) : table_.stamp(columns[0]);
  if (!stamp) return fmt::format("`{}` is not a stamp", columns[0]);
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < 7; ++i) {
    const auto number = parse_number(columns[i + 1]);
    if (!number) return fmt::format("`{}` is not a number", columns[i + 1]);
    v[i] = *number;
  }
  if (table_.real_part_first) std::rotate(v.begin() + 3, v.begin() + 4, v.end());
  const bool finite = std::ranges::all_of(v, [](double x) { return std::isfinite(x); });
  const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
  if (!finite || !(std::fabs(q.norm() - 1.0) <= kQuaternionTolerance)) {
    skips_.add(finite ? SkippedLines::Reason::kNotRigid : SkippedLines::Reason::kNotFinite, line.number);
    list_.lost.push_back(*stamp);
    return {};
  }
  list_.poses.push_back({*stamp, SE3(q, Vec3(v[0], v[1], v[2]))});
  line_numbers_.push_back(line.number);
  return {};
}

Result<PoseList> PoseListReader::read() {
  const auto parsed =
      parse_lines(file_, table_.lines, skips_, [this](const TextLine& line) { return add(line); });
  if (!parsed) return forward_error(parsed);
  list_.poses = keep_increasing(
      std::move(list_.poses), line_numbers_, [](const StampedPose& p) { return p.stamp; }, skips_);
  list_.skipped = skips_.take();
  std::ranges::sort(list_.lost);
  return std::move(list_);
}

}  // namespace

Result<PoseList> read_pose_list(const std::filesystem::path& path, const StampRule& rule) {
  const auto file = TextFile::read(path);
  if (!file) return forward_error(file);
  return PoseListReader(*file, path, rule).read();
}

std::optional<SE3> pose_between(const PoseList& list, Time stamp, Duration max_gap) {
  // A stamp beyond all poses by at most 0.01 s takes the first or last pose.
  constexpr Duration kMaxExtrapolation{10'000'000};
  const auto after = std::ranges::lower_bound(list.poses, stamp, {}, &StampedPose::stamp);
  if (after != list.poses.end() && after != list.poses.begin() && after->stamp != stamp) {
    const auto lost = std::ranges::upper_bound(list.lost, (after - 1)->stamp);
    if (lost != list.lost.end() && *lost < after->stamp) return std::nullopt;
  }
  return pose_at(list.poses, stamp, max_gap, kMaxExtrapolation);
}

}  // namespace hm::detail
