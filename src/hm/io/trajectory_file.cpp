#include "hm/io/trajectory_file.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>

#include "hm/io/input_file.hpp"
#include "hm/io/output_file.hpp"

namespace hm {
namespace {

enum class Format { kTum, kEuroc, kKitti };

constexpr std::size_t kMaxColumns = 32;
constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr std::int64_t kMaxSeconds = 9'000'000'000;  ///< what 64 bits of nanoseconds hold
constexpr double kQuaternionTolerance = 1e-2;

/// The cells of one line; blanks around them are removed.
struct Row {
  std::array<std::string_view, kMaxColumns> cells;
  std::size_t count = 0;
};

std::string_view trim(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

Row split(std::string_view line, bool at_commas) {
  Row row;
  while (!line.empty() && row.count < kMaxColumns) {
    std::size_t end = at_commas ? line.find(',') : line.find_first_of(" \t");
    row.cells[row.count++] = trim(line.substr(0, end));
    if (end == std::string_view::npos) break;
    line.remove_prefix(end + 1);
    if (!at_commas) line = trim(line);
  }
  return row;
}

std::optional<double> parse_number(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// Seconds in decimals to nanoseconds without rounding; digits beyond the ninth are dropped.
std::optional<Time> parse_seconds(std::string_view text) {
  if (text.find_first_of("eE") != std::string_view::npos) {
    const auto value = parse_number(text);
    if (!value || std::abs(*value) >= static_cast<double>(kMaxSeconds)) return std::nullopt;
    return Time::from_seconds(*value);
  }
  const bool negative = !text.empty() && text.front() == '-';
  if (negative || (!text.empty() && text.front() == '+')) text.remove_prefix(1);
  std::int64_t whole = 0, fraction = 0;
  std::size_t digits = 0, i = 0;
  for (; i < text.size() && text[i] >= '0' && text[i] <= '9'; ++i, ++digits) {
    whole = whole * 10 + (text[i] - '0');
    if (whole >= kMaxSeconds) return std::nullopt;
  }
  if (i < text.size() && text[i] == '.') {
    std::int64_t unit = kNsPerSecond / 10;
    for (++i; i < text.size() && text[i] >= '0' && text[i] <= '9'; ++i, ++digits, unit /= 10)
      fraction += unit * (text[i] - '0');
  }
  if (i != text.size() || digits == 0) return std::nullopt;
  const std::int64_t ns = whole * kNsPerSecond + fraction;
  return Time{negative ? -ns : ns};
}

std::optional<Time> parse_nanoseconds(std::string_view text) {
  std::int64_t ns = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), ns);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return Time{ns};
}

/// Reads one file line by line; knows the format from its first line of data.
class TrajectoryReader {
 public:
  explicit TrajectoryReader(InputFile& file) : file_(file) {}

  Result<Trajectory> read() {
    std::string_view line;
    while (file_.read_line(line)) {
      line = trim(line);
      if (line.starts_with("#timestamp") && line.find(',') != std::string_view::npos)
        format_ = Format::kEuroc;
      if (line.empty() || line.front() == '#') continue;
      if (const auto added = add(line); !added) return forward_error(added);
    }
    if (trajectory_.empty()) return fail(ErrorCode::kCorrupted, file_.name(), "holds no pose");
    return std::move(trajectory_);
  }

 private:
  Result<void> add(std::string_view line) {
    const Row row = split(line, format_ == Format::kEuroc);
    if (!format_) {
      if (row.count == 8) format_ = Format::kTum;
      if (row.count == 12) format_ = Format::kKitti;
      if (!format_)
        return fail(
            ErrorCode::kCorrupted, file_.at_line(),
            "{} columns where a trajectory has 8 (TUM) or 12 (KITTI), or starts with '#timestamp' (EuRoC)",
            row.count);
    }
    const std::size_t wanted = *format_ == Format::kKitti ? 12 : 8;
    if (row.count < wanted || (row.count > wanted && *format_ != Format::kEuroc))
      return fail(ErrorCode::kCorrupted, file_.at_line(), "{} columns instead of {}", row.count, wanted);
    return *format_ == Format::kKitti ? add_matrix(row) : add_quaternion(row);
  }

  Result<void> add_quaternion(const Row& row) {
    const bool euroc = *format_ == Format::kEuroc;
    const auto stamp = euroc ? parse_nanoseconds(row.cells[0]) : parse_seconds(row.cells[0]);
    if (!stamp)
      return fail(ErrorCode::kCorrupted, file_.at_line(), "'{}' is no stamp in {}", row.cells[0],
                  euroc ? "nanoseconds" : "seconds");
    std::array<double, 7> v{};
    if (const auto read = numbers(row, 1, v); !read) return read;
    const Eigen::Quaterniond q =
        euroc ? Eigen::Quaterniond(v[3], v[4], v[5], v[6]) : Eigen::Quaterniond(v[6], v[3], v[4], v[5]);
    if (!(std::abs(q.norm() - 1.0) <= kQuaternionTolerance))
      return fail(ErrorCode::kInvalidValue, file_.at_line(), "the quaternion's length is {}, not 1",
                  q.norm());
    return append({*stamp, SE3(q, Vec3(v[0], v[1], v[2]))});
  }

  Result<void> add_matrix(const Row& row) {
    std::array<double, 12> v{};
    if (const auto read = numbers(row, 0, v); !read) return read;
    Mat4 matrix = Mat4::Identity();
    for (int i = 0; i < 12; ++i) matrix(i / 4, i % 4) = v[static_cast<std::size_t>(i)];
    const auto pose = SE3::from_matrix(matrix);
    if (!pose) return fail(pose.error().code, file_.at_line(), "{}", pose.error().message);
    return append({Time{static_cast<std::int64_t>(trajectory_.size()) * kNsPerSecond}, *pose});
  }

  template <std::size_t N>
  Result<void> numbers(const Row& row, std::size_t first, std::array<double, N>& out) {
    for (std::size_t i = 0; i < N; ++i) {
      const auto value = parse_number(row.cells[first + i]);
      if (!value)
        return fail(ErrorCode::kCorrupted, file_.at_line(), "'{}' is no finite number", row.cells[first + i]);
      out[i] = *value;
    }
    return {};
  }

  Result<void> append(const StampedPose& pose) {
    if (!trajectory_.empty() && pose.stamp <= trajectory_.back().stamp)
      return fail(ErrorCode::kInvalidValue, file_.at_line(),
                  "the stamp does not come after the one before ({} ns back)",
                  (trajectory_.back().stamp - pose.stamp).ns);
    trajectory_.push_back(pose);
    return {};
  }

  InputFile& file_;
  std::optional<Format> format_;
  Trajectory trajectory_;
};

/// A number with 9 decimals, zero without a sign.
void append_decimals(fmt::memory_buffer& out, double value) {
  fmt::format_to(std::back_inserter(out), "{:.9f}", std::abs(value) < 5e-10 ? 0.0 : value);
}

void append_stamp(fmt::memory_buffer& out, Time stamp) {
  const bool negative = stamp.ns < 0;
  const std::uint64_t ns =
      negative ? 0 - static_cast<std::uint64_t>(stamp.ns) : static_cast<std::uint64_t>(stamp.ns);
  fmt::format_to(std::back_inserter(out), "{}{}.{:09}", negative ? "-" : "", ns / kNsPerSecond,
                 ns % kNsPerSecond);
}

}  // namespace

Result<Trajectory> read_trajectory(const std::filesystem::path& path) {
  auto file = InputFile::open(path);
  if (!file) return forward_error(file);
  return TrajectoryReader(*file).read();
}

Result<void> write_tum_trajectory(const std::filesystem::path& path, const Trajectory& trajectory) {
  OutputFile file(path);
  for (const StampedPose& pose : trajectory) {
    Eigen::Vector4d q = pose.T_world_base.quaternion().coeffs();
    if (q.w() < 0) q = -q;
    const Vec3& t = pose.T_world_base.translation();
    fmt::memory_buffer line;
    append_stamp(line, pose.stamp);
    for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
      line.push_back(' ');
      append_decimals(line, value);
    }
    line.push_back('\n');
    file.write(line.data(), line.size());
  }
  return file.finish();
}

Result<void> write_kitti_trajectory(const std::filesystem::path& path, const Trajectory& trajectory) {
  OutputFile file(path);
  for (const StampedPose& pose : trajectory) {
    const Mat4 matrix = pose.T_world_base.matrix();
    fmt::memory_buffer line;
    for (int i = 0; i < 12; ++i) {
      if (i > 0) line.push_back(' ');
      append_decimals(line, matrix(i / 4, i % 4));
    }
    line.push_back('\n');
    file.write(line.data(), line.size());
  }
  return file.finish();
}

}  // namespace hm
