#include <cmath>
#include <numbers>

#include "hm/io/laser/laser_log.hpp"

/// Logs of the BreezySLAM example: a wheeled rover of Mines ParisTech with a Hokuyo URG-04LX.
namespace hm::detail {
namespace {

constexpr std::size_t kHeaderColumns = 25, kBeams = 682;
constexpr double kMillimetre_m = 1e-3;
constexpr double kBeamStep_rad = 2 * std::numbers::pi / 1024;
constexpr double kBeamTime_s = 0.1 / 1024;  // ten turns a second
constexpr double kUrgRangeMin_m = 0.02, kUrgRangeMax_m = 5.6;
// Parameters of the rover from the example.
constexpr double kWheelRadius_m = 0.077, kHalfAxle_m = 0.165, kLaserForward_m = 0.145;
constexpr double kRadiansPerTick = 2 * std::numbers::pi / 2000;

/// Wheel odometry: integrates arcs between two counts of both wheels.
class WheelOdometry {
 public:
  SE2 add(double left_ticks, double right_ticks) {
    if (started_) {
      const double left_m = (left_ticks - left_ticks_) * kRadiansPerTick * kWheelRadius_m;
      const double right_m = (right_ticks - right_ticks_) * kRadiansPerTick * kWheelRadius_m;
      const double turn_rad = (right_m - left_m) / (2 * kHalfAxle_m);
      pose_ = pose_ * SE2::exp({(left_m + right_m) / 2, 0, turn_rad});
    }
    started_ = true;
    left_ticks_ = left_ticks;
    right_ticks_ = right_ticks;
    return pose_;
  }

 private:
  SE2 pose_;
  double left_ticks_ = 0, right_ticks_ = 0;
  bool started_ = false;
};

/// `stamp_us x left_ticks right_ticks ... r1 ... r682`, ranges in millimetres from right to left.
void read_line(const TextLine& line, WheelOdometry& wheels, LaserLog& log) {
  constexpr double kMostMicroseconds = 9e15;
  const auto columns = words(line.text);
  NumberReader reader(columns, 0);
  const double stamp_us = reader.number();
  reader.skip(1);
  const double left_ticks = reader.number(), right_ticks = reader.number();
  reader.skip(kHeaderColumns - 4);
  LaserScan scan;
  scan.ranges_m = reader.floats(kBeams, kMillimetre_m);
  if (!reader.ok() || reader.remaining() > 0 || std::fabs(stamp_us) > kMostMicroseconds)
    return log.skip_malformed(line);
  scan.stamp = Time{std::llround(stamp_us) * 1000};
  scan.angle_increment_rad = kBeamStep_rad;
  scan.time_increment_s = kBeamTime_s;
  scan.angle_min_rad = -kBeamStep_rad * static_cast<double>(kBeams - 1) / 2;
  scan.range_min_m = kUrgRangeMin_m;
  scan.range_max_m = kUrgRangeMax_m;
  log.add_odometry({scan.stamp, wheels.add(left_ticks, right_ticks).to_se3()}, line);
  log.add_scan("laser", std::move(scan), line);
}

}  // namespace

Result<LaserRecording> read_breezy_log(const std::filesystem::path& path) {
  const auto file = TextFile::read(path);
  if (!file) return forward_error(file);
  LaserLog log(path, LaserRecordingKind::kBreezySlam);
  log.set_mounting("laser", SE2(kLaserForward_m, 0, 0).to_se3());
  WheelOdometry wheels;
  for (const TextLine& line : file->lines()) read_line(line, wheels, log);
  return log.finish();
}

}  // namespace hm::detail
