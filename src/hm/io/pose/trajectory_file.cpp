#include "hm/io/pose/trajectory_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hm/io/bytes/output_file.hpp"
#include "hm/io/bytes/skip_counter.hpp"
#include "hm/io/bytes/text_lines.hpp"
#include "hm/io/lists/pose_table.hpp"

namespace hm {
namespace {

enum class Format { kQuaternions, kKitti, kMatrices, kRedwood };

constexpr double kQuaternionTolerance = 1e-2;

std::optional<std::uint32_t> parse_frame_number(std::string_view text) {
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// tx ty tz qx qy qz qw, qw >= 0.
std::array<double, 7> tum_values(const SE3& pose) {
  Eigen::Vector4d q = pose.quaternion().coeffs();
  if (q.w() < 0) q = -q;
  const Vec3& t = pose.translation();
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

/// The inverse of tum_values().
SE3 pose_of_tum(const std::array<double, 7>& v) {
  return {Eigen::Quaterniond(v[6], v[3], v[4], v[5]), Vec3(v[0], v[1], v[2])};
}

/// What becomes of a line whose stamp does not come after the one before.
enum class Repeated { kIsAnError, kIsLeftOut };

/// Reads one file line by line; recognises the format from its header or the first line of data.
class TrajectoryReader {
 public:
  explicit TrajectoryReader(const TextFile& file, Repeated repeated = Repeated::kIsAnError)
      : file_(file), table_(detail::pose_table(file)), repeated_(repeated) {}

  Result<Trajectory> read() {
    if (table_.has_comma_header) format_ = Format::kQuaternions;
    for (const TextLine& line : table_.lines) {
      where_ = file_.where(line);
      line_number_ = line.number;
      if (const auto added = add(line.text); !added) return forward_error(added);
    }
    if (trajectory_.empty()) return fail(ErrorCode::kCorrupted, file_.where(), "holds no pose");
    if (frame_) return fail(ErrorCode::kCorrupted, where_, "the last matrix is cut off");
    return std::move(trajectory_);
  }
  [[nodiscard]] bool has_stamps() const { return format_ == Format::kQuaternions; }
  /// Numbers of the frames, where poses have no stamps.
  [[nodiscard]] const std::vector<std::size_t>& frames() const { return frames_; }
  [[nodiscard]] bool names_frames() const { return format_ == Format::kRedwood; }
  /// Number of the line where each pose was read.
  [[nodiscard]] const std::vector<std::size_t>& line_numbers() const { return line_numbers_; }

 private:
  using Row = std::vector<std::string_view>;

  Result<void> add(std::string_view line) {
    const Row row = detail::pose_columns(line);
    if (!format_) {
      format_ = format_of(row.size());
      if (!format_)
        return fail(
            ErrorCode::kCorrupted, where_,
            "{} columns{} where a trajectory has 8 (TUM), 12 (KITTI), 16 (Replica) or 3 (Redwood), or "
            "starts with '#timestamp' (EuRoC)",
            row.size(), row.size() == 4 ? " (positions without orientations?)" : "");
    }
    if (*format_ == Format::kRedwood) return add_redwood(row);
    const std::size_t wanted = *format_ == Format::kKitti ? 12 : *format_ == Format::kMatrices ? 16 : 8;
    if (row.size() < wanted || (row.size() > wanted && !table_.has_comma_header))
      return fail(ErrorCode::kCorrupted, where_, "{} columns instead of {}", row.size(), wanted);
    return wanted == 8 ? add_quaternion(row) : add_matrix(row, trajectory_.size());
  }

  static std::optional<Format> format_of(std::size_t columns) {
    switch (columns) {
      case 8:
        return Format::kQuaternions;
      case 12:
        return Format::kKitti;
      case 16:
        return Format::kMatrices;
      case 3:
        return Format::kRedwood;
      default:
        return std::nullopt;
    }
  }

  /// A line of a block: the frame's number with two others, then the rows of the matrix.
  Result<void> add_redwood(const Row& row) {
    if (!frame_) {
      if (row.size() != 3)
        return fail(ErrorCode::kCorrupted, where_, "{} columns instead of 3: a matrix begins with its frame",
                    row.size());
      frame_ = parse_frame_number(row[0]);
      if (!frame_) return fail(ErrorCode::kCorrupted, where_, "'{}' is no frame number", row[0]);
      if (parse_frame_number(row[1]) != frame_)
        return fail(ErrorCode::kCorrupted, where_, "'{} {}' is a pair of frames: motions are no trajectory",
                    row[0], row[1]);
      return {};
    }
    if (row.size() != 4)
      return fail(ErrorCode::kCorrupted, where_, "{} columns instead of 4 in a matrix", row.size());
    rows_.insert(rows_.end(), row.begin(), row.end());
    if (rows_.size() < 16) return {};
    const Row whole = std::exchange(rows_, {});
    return add_matrix(whole, *std::exchange(frame_, std::nullopt));
  }

  Result<void> add_quaternion(const Row& row) {
    const auto stamp = table_.stamp(row[0]);
    if (!stamp)
      return fail(ErrorCode::kCorrupted, where_, "'{}' is no stamp in {}", row[0],
                  table_.in_nanoseconds ? "nanoseconds" : "seconds");
    std::array<double, 7> v{};
    if (const auto read = numbers(row, 1, v); !read) return read;
    if (table_.real_part_first) std::rotate(v.begin() + 3, v.begin() + 4, v.end());
    const double length = Eigen::Vector4d(v[3], v[4], v[5], v[6]).norm();
    if (!(std::abs(length - 1.0) <= kQuaternionTolerance))
      return fail(ErrorCode::kInvalidValue, where_, "the quaternion's length is {}, not 1", length);
    return append({*stamp, pose_of_tum(v)});
  }

  /// 12 or 16 numbers, row by row.
  Result<void> add_matrix(const Row& row, std::size_t frame) {
    std::array<double, 16> v{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
    if (const auto read = numbers(row, 0, std::span(v).first(row.size())); !read) return read;
    Mat4 matrix;
    for (int i = 0; i < 16; ++i) matrix(i / 4, i % 4) = v[static_cast<std::size_t>(i)];
    const auto pose = SE3::from_matrix(matrix);
    if (!pose) return fail(pose.error().code, where_, "{}", pose.error().message);
    frames_.push_back(frame);
    return append({Time::from_seconds(static_cast<double>(frame)), *pose});
  }

  Result<void> numbers(const Row& row, std::size_t first, std::span<double> out) {
    for (std::size_t i = 0; i < out.size(); ++i) {
      const auto value = parse_number(row[first + i]);
      if (!value || !std::isfinite(*value))
        return fail(ErrorCode::kCorrupted, where_, "'{}' is no finite number", row[first + i]);
      out[i] = *value;
    }
    return {};
  }

  Result<void> append(const StampedPose& pose) {
    const bool refuses = repeated_ == Repeated::kIsAnError || !has_stamps();
    if (refuses && !trajectory_.empty() && pose.stamp <= trajectory_.back().stamp)
      return fail(ErrorCode::kInvalidValue, where_,
                  "the stamp does not come after the one before ({} ns back)",
                  (trajectory_.back().stamp - pose.stamp).ns);
    trajectory_.push_back(pose);
    line_numbers_.push_back(line_number_);
    return {};
  }

  const TextFile& file_;
  detail::PoseTable table_;
  Repeated repeated_;
  std::string where_;            ///< the line that is being read
  std::size_t line_number_ = 0;  ///< its number
  std::optional<Format> format_;
  Trajectory trajectory_;
  std::vector<std::size_t> line_numbers_;  ///< where each pose was read
  std::optional<std::uint32_t> frame_;     ///< Redwood: whose matrix is being read
  Row rows_;                               ///< what has been read of it
  std::vector<std::size_t> frames_;
};

/// Appends a number with 9 decimals, zero without sign.
void append_decimals(fmt::memory_buffer& out, double value) {
  fmt::format_to(std::back_inserter(out), "{:.9f}", std::abs(value) < 5e-10 ? 0.0 : value);
}

}  // namespace

Result<Trajectory> read_trajectory(const std::filesystem::path& path) {
  const auto file = TextFile::read(path);
  if (!file) return forward_error(file);
  return TrajectoryReader(*file).read();
}

Result<TrajectoryFile> read_trajectory_file(const std::filesystem::path& path) {
  const auto file = TextFile::read(path);
  if (!file) return forward_error(file);
  TrajectoryReader reader(*file, Repeated::kIsLeftOut);
  auto poses = reader.read();
  if (!poses) return forward_error(poses);
  detail::SkipCounter skips(path);
  Trajectory increasing = detail::keep_increasing(
      std::move(*poses), reader.line_numbers(), [](const StampedPose& pose) { return pose.stamp; }, skips);
  return TrajectoryFile{std::move(increasing), reader.has_stamps(), reader.names_frames(), skips.take()};
}

Result<Trajectory> read_trajectory_of(const std::filesystem::path& path, std::span<const Time> stamps) {
  const auto file = TextFile::read(path);
  if (!file) return forward_error(file);
  TrajectoryReader reader(*file);
  auto poses = reader.read();
  if (!poses || reader.has_stamps()) return poses;
  if (!reader.names_frames() && poses->size() != stamps.size())
    return fail(ErrorCode::kInvalidValue, path, "holds {} poses without stamps, and the recording {} frames",
                poses->size(), stamps.size());
  for (std::size_t i = 0; i < poses->size(); ++i) {
    const std::size_t frame = reader.frames()[i];
    if (frame >= stamps.size())
      return fail(ErrorCode::kInvalidValue, path,
                  "has a pose of frame {}, and the recording {} frames, from 0 on", frame, stamps.size());
    (*poses)[i].stamp = stamps[frame];
  }
  return poses;
}

Result<void> write_tum_trajectory(const std::filesystem::path& path, const Trajectory& trajectory) {
  OutputFile file(path);
  for (const StampedPose& pose : trajectory) {
    fmt::memory_buffer line;
    line.append(stamp_text(pose.stamp));
    for (const double value : tum_values(pose.T_world_base)) {
      line.push_back(' ');
      append_decimals(line, value);
    }
    line.push_back('\n');
    file.write(line.data(), line.size());
  }
  return file.finish();
}

Trajectory as_in_tum_file(const Trajectory& trajectory) {
  Trajectory rounded;
  rounded.reserve(trajectory.size());
  for (const StampedPose& pose : trajectory) {
    std::array<double, 7> values = tum_values(pose.T_world_base);
    for (double& value : values) {
      fmt::memory_buffer text;
      append_decimals(text, value);
      value = parse_number({text.data(), text.size()}).value_or(value);
    }
    rounded.push_back({pose.stamp, pose_of_tum(values)});
  }
  return rounded;
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
