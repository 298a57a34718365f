#include <algorithm>
#include <map>
#include <numbers>

#include "hm/io/laser/laser_log.hpp"

namespace hm::detail {
namespace {

constexpr double kCentimetre_m = 0.01;
constexpr double kRange_m = 80.0;         // of the SICK LMS; 81.83 stands for no return
constexpr std::size_t kOtherColumns = 8;  // of an L line: all but the ranges

SE3 pose_in_cm(NumberReader& reader) {
  const SE2 pose = reader.pose();
  return SE2(kCentimetre_m * pose.translation(), pose.angle()).to_se3();
}

/// `L x y theta xl yl thetal r1 ... rn t`: vehicle, laser, ranges from right to left; `O x y theta t`.
class WeanHallReader {
 public:
  WeanHallReader(const std::filesystem::path& path, std::size_t beams)
      : log_(path, LaserRecordingKind::kWeanHall), beams_(beams) {}

  void read(const TextLine& line) {
    const auto columns = words(line.text);
    if (columns[0] == "O")
      read_odometry(columns, line);
    else if (columns[0] == "L")
      read_scan(columns, line);
    else
      log_.skip_malformed(line);
  }
  Result<LaserRecording> finish() {
    if (T_base_laser_) log_.set_mounting("laser", *T_base_laser_);
    return log_.finish();
  }

 private:
  void read_odometry(const std::vector<std::string_view>& columns, const TextLine& line) {
    NumberReader reader(columns, 1);
    const SE3 pose = pose_in_cm(reader);
    const Time stamp = reader.stamp();
    if (!reader.ok() || reader.remaining() > 0) return log_.skip_malformed(line);
    log_.add_odometry({stamp, pose}, line);
  }

  void read_scan(const std::vector<std::string_view>& columns, const TextLine& line) {
    if (columns.size() != kOtherColumns + beams_) return log_.skip_malformed(line);
    NumberReader reader(columns, 1);
    const SE3 T_odom_base = pose_in_cm(reader), T_odom_laser = pose_in_cm(reader);
    LaserScan scan;
    scan.ranges_m = reader.floats(beams_, kCentimetre_m);
    scan.stamp = reader.stamp();
    if (!reader.ok()) return log_.skip_malformed(line);
    scan.angle_min_rad = -std::numbers::pi / 2;
    scan.angle_increment_rad = std::numbers::pi / static_cast<double>(beams_ % 2 == 0 ? beams_ : beams_ - 1);
    scan.range_max_m = kRange_m;
    if (!T_base_laser_) T_base_laser_ = T_odom_base.inverse() * T_odom_laser;
    log_.add_odometry({scan.stamp, T_odom_base}, line);
    log_.add_scan("laser", std::move(scan), line);
  }

  LaserLog log_;
  std::optional<SE3> T_base_laser_;
  std::size_t beams_;
};

/// Number of beams of most scans; damaged lines have another number of columns.
std::size_t usual_beams(const std::vector<TextLine>& lines) {
  std::map<std::size_t, std::size_t> counts;
  for (const TextLine& line : lines)
    if (const auto columns = words(line.text); columns[0] == "L" && columns.size() > kOtherColumns + 1)
      ++counts[columns.size() - kOtherColumns];
  const auto most = std::ranges::max_element(counts, {}, [](const auto& entry) { return entry.second; });
  return most == counts.end() ? 0 : most->first;
}

}  // namespace

Result<LaserRecording> read_wean_hall_log(const std::filesystem::path& path) {
  const auto file = TextFile::read(path);
  if (!file) return forward_error(file);
  const auto lines = file->lines();
  WeanHallReader reader(path, usual_beams(lines));
  for (const TextLine& line : lines) reader.read(line);
  return reader.finish();
}

}  // namespace hm::detail
