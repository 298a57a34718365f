#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/io/laser/laser_log.hpp"

/// CARMEN's text logs, and pose graphs with CARMEN's scan lines.
namespace hm::detail {
namespace {

constexpr double kSickRange_m = 80.0;  // default

/// Scan with the poses in its line.
struct PosedScan {
  LaserScan scan;
  SE2 laser_pose, robot_pose;  ///< in the frame of the odometry, or corrected
  double heading_rad = 0;      ///< of robot_pose, as written
};

/// FLASER n r... x y theta odom_x odom_y odom_theta ipc_stamp host logger_stamp. Half a circle in front.
std::optional<PosedScan> parse_flaser(const std::vector<std::string_view>& columns, double range_max_m) {
  NumberReader reader(columns, 1);
  PosedScan posed;
  LaserScan& scan = posed.scan;
  const std::size_t count = reader.count();
  scan.ranges_m = reader.floats(count, 1.0);
  posed.laser_pose = reader.pose();
  posed.robot_pose = reader.pose();
  posed.heading_rad = reader.heading_rad();
  scan.stamp = reader.stamp();
  if (!reader.ok() || count < 2) return std::nullopt;
  // Both 180 and 181 beams are one degree apart: for an odd number the last one is at +90 degrees.
  const std::size_t steps = count % 2 == 0 ? count : count - 1;
  scan.angle_min_rad = -std::numbers::pi / 2;
  scan.angle_increment_rad = std::numbers::pi / static_cast<double>(steps);
  scan.range_max_m = range_max_m;
  return posed;
}

/// Why a line with FLASER is none, if it is known: old logs end after the ranges, or with the stamp.
std::string problem_of_flaser(const std::vector<std::string_view>& columns) {
  constexpr std::size_t kMostWithoutPoses = 3;  // ipc_stamp host logger_stamp
  NumberReader reader(columns, 1);
  const std::size_t count = reader.count();
  reader.skip(count);
  if (!reader.ok() || count < 2 || reader.remaining() > kMostWithoutPoses) return {};
  return fmt::format("no poses after the {} ranges", count);
}

/// laser_type start_angle fov resolution max_range accuracy remission_mode n r... n remissions...
bool read_laser_part(NumberReader& reader, LaserScan& scan) {
  reader.number();  // laser type
  scan.angle_min_rad = reader.number();
  const double fov_rad = reader.number();
  scan.angle_increment_rad = reader.number();
  scan.range_max_m = reader.number();
  reader.skip(2);  // accuracy, remission mode
  const std::size_t count = reader.count();
  scan.ranges_m = reader.floats(count, 1.0);
  reader.skip(reader.count());
  if (!reader.ok() || count < 1) return false;
  if (scan.angle_increment_rad == 0) scan.angle_increment_rad = fov_rad / static_cast<double>(count);
  return true;
}

/// RAWLASERn: ... ipc_stamp host logger_stamp
std::optional<LaserScan> parse_raw_laser(const std::vector<std::string_view>& columns) {
  NumberReader reader(columns, 1);
  LaserScan scan;
  if (!read_laser_part(reader, scan)) return std::nullopt;
  scan.stamp = reader.stamp();
  return reader.ok() ? std::optional(scan) : std::nullopt;
}

/// ROBOTLASERn: ... laser pose, robot pose, tv rv forward_safety side_safety turn_axis, ipc_stamp host
/// logger.
std::optional<PosedScan> parse_robot_laser(const std::vector<std::string_view>& columns) {
  constexpr std::size_t kSafetyColumns = 5;
  NumberReader reader(columns, 1);
  PosedScan posed;
  if (!read_laser_part(reader, posed.scan)) return std::nullopt;
  posed.laser_pose = reader.pose();
  posed.robot_pose = reader.pose();
  posed.heading_rad = reader.heading_rad();
  reader.skip(kSafetyColumns);
  posed.scan.stamp = reader.stamp();
  return reader.ok() ? std::optional(posed) : std::nullopt;
}

/// Mounting of a laser derived from its poses in all lines, or, if it is not constant, the fact that its pose
/// was corrected afterwards.
struct Mounting {
  std::optional<SE2> T_base_laser;
};

Mounting mounting_of(const std::vector<PosedScan>& scans) {
  constexpr double kTolerance_m = 0.02, kTolerance_rad = 0.02;
  std::vector<SE2> mountings;
  for (const PosedScan& scan : scans) mountings.push_back(scan.robot_pose.inverse() * scan.laser_pose);
  const SE2& middle = mountings[mountings.size() / 2];
  const bool fixed = std::ranges::all_of(mountings, [&](const SE2& mounting) {
    const SE2 difference = middle.inverse() * mounting;
    return difference.translation().norm() < kTolerance_m && std::fabs(difference.angle()) < kTolerance_rad;
  });
  return {fixed ? std::optional(middle) : std::nullopt};
}

/// Reads the lines of a CARMEN log.
class CarmenReader {
 public:
  explicit CarmenReader(const std::filesystem::path& path) : log_(path, LaserRecordingKind::kCarmen) {}
  void read(const TextLine& line);
  Result<LaserRecording> finish();

 private:
  struct Posed {
    std::vector<PosedScan> scans;
    std::vector<TextLine> lines;
  };
  void read_parameter(const std::vector<std::string_view>& columns);
  void read_odometry(const std::vector<std::string_view>& columns, const TextLine& line);
  void read_true_pose(const std::vector<std::string_view>& columns, const TextLine& line);
  void add(const std::string& name, std::optional<PosedScan> scan, const TextLine& line);
  void add_stream(const std::string& name, Posed& posed);

  LaserLog log_;
  std::map<std::string, Posed> posed_;
  double front_max_m_ = kSickRange_m, rear_max_m_ = kSickRange_m;
  bool has_odometry_ = false, has_truth_ = false;
};

void CarmenReader::read(const TextLine& line) {
  const auto columns = words(line.text);
  const std::string name(columns[0]);
  if (name == "FLASER")
    add(name, parse_flaser(columns, front_max_m_), line);
  else if (name == "RLASER")
    add(name, parse_flaser(columns, rear_max_m_), line);
  else if (name.starts_with("ROBOTLASER"))
    add(name, parse_robot_laser(columns), line);
  else if (name.starts_with("RAWLASER")) {
    if (auto scan = parse_raw_laser(columns))
      log_.add_scan(name, std::move(*scan), line);
    else
      log_.skip_malformed(line);
  } else if (name == "ODOM")
    read_odometry(columns, line);
  else if (name == "TRUEPOS")
    read_true_pose(columns, line);
  else if (name == "PARAM")
    read_parameter(columns);
}

void CarmenReader::add(const std::string& name, std::optional<PosedScan> scan, const TextLine& line) {
  if (!scan) {
    const bool is_old = name == "FLASER" || name == "RLASER";
    log_.skip_malformed(line, is_old ? problem_of_flaser(words(line.text)) : std::string());
    return;
  }
  posed_[name].scans.push_back(std::move(*scan));
  posed_[name].lines.push_back(line);
}

void CarmenReader::read_parameter(const std::vector<std::string_view>& columns) {
  if (columns.size() < 3) return;
  const auto value = parse_number(columns[2]);
  if (!value || !(*value > 0) || !std::isfinite(*value)) return;
  if (columns[1].ends_with("front_laser_max")) front_max_m_ = *value;
  if (columns[1].ends_with("rear_laser_max")) rear_max_m_ = *value;
}

void CarmenReader::read_odometry(const std::vector<std::string_view>& columns, const TextLine& line) {
  constexpr std::size_t kVelocityColumns = 3;
  NumberReader reader(columns, 1);
  const SE2 pose = reader.pose();
  const double heading_rad = reader.heading_rad();
  reader.skip(kVelocityColumns);
  const Time stamp = reader.stamp();
  if (!reader.ok()) return log_.skip_malformed(line);
  log_.add_heading({stamp, heading_rad});
  log_.add_odometry({stamp, pose.to_se3()}, line);
  has_odometry_ = true;
}

void CarmenReader::read_true_pose(const std::vector<std::string_view>& columns, const TextLine& line) {
  NumberReader reader(columns, 1);
  const SE2 pose = reader.pose();
  reader.pose();  // odometry
  const Time stamp = reader.stamp();
  if (!reader.ok()) return log_.skip_malformed(line);
  log_.add_truth({stamp, pose.to_se3()}, line);
  log_.set_truth_source("TRUEPOS lines");
  has_truth_ = true;
}

void CarmenReader::add_stream(const std::string& name, Posed& posed) {
  const Mounting mounting = mounting_of(posed.scans);
  if (mounting.T_base_laser) log_.set_mounting(name, mounting.T_base_laser->to_se3());
  const bool gives_odometry = !has_odometry_, gives_truth = !mounting.T_base_laser && !has_truth_;
  for (std::size_t i = 0; i < posed.scans.size(); ++i) {
    const TextLine& line = posed.lines[i];
    const Time stamp = posed.scans[i].scan.stamp;
    if (gives_odometry) {
      log_.add_heading({stamp, posed.scans[i].heading_rad});
      log_.add_odometry({stamp, posed.scans[i].robot_pose.to_se3()}, line);
    }
    if (gives_truth) log_.add_truth({stamp, posed.scans[i].laser_pose.to_se3()}, line);
    log_.add_scan(name, std::move(posed.scans[i].scan), line);
  }
  has_odometry_ = true;
  if (!gives_truth) return;
  has_truth_ = true;
  log_.set_truth_source(fmt::format("poses of {} lines, which differ from their odometry", name));
}

Result<LaserRecording> CarmenReader::finish() {
  for (auto& [name, posed] : posed_) add_stream(name, posed);
  log_.mend_stamps();
  return log_.finish();
}

}  // namespace

Result<LaserRecording> read_carmen_log(const std::filesystem::path& path) {
  const auto file = TextFile::read(path);
  if (!file) return forward_error(file);
  CarmenReader reader(path);
  for (const TextLine& line : file->lines()) reader.read(line);
  return reader.finish();
}

Result<LaserRecording> read_g2o_laser_log(const std::filesystem::path& path) {
  const auto file = TextFile::read(path);
  if (!file) return forward_error(file);
  LaserLog log(path, LaserRecordingKind::kG2oLaser);
  for (const TextLine& line : file->lines()) {
    const auto columns = words(line.text);
    if (!columns[0].starts_with("ROBOTLASER")) continue;
    auto posed = parse_robot_laser(columns);
    if (!posed) {
      log.skip_malformed(line);
      continue;
    }
    log.add_truth({posed->scan.stamp, posed->robot_pose.to_se3()}, line);
    log.add_scan(std::string(columns[0]), std::move(posed->scan), line);
  }
  log.set_truth_source("corrected poses of the pose graph");
  log.mend_stamps();
  return log.finish();
}

}  // namespace hm::detail
