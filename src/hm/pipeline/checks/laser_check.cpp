#include "hm/pipeline/checks/laser_check.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/statistics.hpp"
#include "hm/pipeline/checks/laser_findings.hpp"

namespace hm {
namespace {

/// True when two scans hold the same numbers, one by one (NaN equals NaN here).
bool same_ranges(const LaserScan& a, const LaserScan& b) {
  return std::ranges::equal(a.ranges_m, b.ranges_m,
                            [](float x, float y) { return x == y || (std::isnan(x) && std::isnan(y)); });
}

/// The returns of at most a thousand scans, and how many of all beams are one.
void describe_ranges(const LaserStream& laser, LaserStreamStats& report) {
  constexpr std::size_t kMostScans = 1000;
  const std::size_t step = laser.scans.size() / kMostScans + 1;
  std::vector<double> returns_m;
  std::size_t beams = 0, returns = 0;
  for (std::size_t i = 0; i < laser.scans.size(); ++i) {
    const LaserScan& scan = laser.scans[i];
    beams += scan.size();
    for (std::size_t b = 0; b < scan.size(); ++b) {
      if (!scan.is_return(b)) continue;
      ++returns;
      if (i % step == 0) returns_m.push_back(static_cast<double>(scan.ranges_m[b]));
    }
  }
  const auto share = [&](std::size_t count) {
    return beams > 0 ? static_cast<double>(count) / static_cast<double>(beams) : 0.0;
  };
  report.returns_ratio = share(returns);
  report.no_returns_ratio = share(laser.no_returns);
  report.invalid_ratio = share(laser.invalid);
  if (returns_m.empty()) return;
  const auto [nearest, farthest] = std::ranges::minmax_element(returns_m);
  report.nearest_m = *nearest, report.farthest_m = *farthest;
  report.farthest_exactly_ratio =
      static_cast<double>(std::ranges::count(returns_m, *farthest)) / static_cast<double>(returns_m.size());
  report.median_m = quantile(std::move(returns_m), 0.5);
}

void describe_latency(const LaserStream& laser, LaserStreamStats& report) {
  std::vector<double> latencies_s;
  for (std::size_t i = 0; i < laser.received.size(); ++i)
    latencies_s.push_back((laser.received[i] - laser.scans[i].stamp).seconds());
  if (latencies_s.empty()) return;
  report.max_latency_s = *std::ranges::max_element(latencies_s);
  report.latency_s = quantile(std::move(latencies_s), 0.5);
}

LaserStreamStats describe_laser(const LaserStream& laser) {
  LaserStreamStats report;
  report.stream = describe_stream(laser.name, stamps_of(laser.scans), laser.scans.size());
  const LaserScan& first = laser.scans.front();
  report.beams = report.fewest_beams = first.size();
  report.angle_min_rad = first.angle_min_rad;
  report.angle_max_rad = first.angle_rad(first.size() - 1);
  report.angle_increment_rad = first.angle_increment_rad;
  report.time_increment_s = first.time_increment_s;
  report.range_min_m = first.range_min_m;
  report.range_max_m = first.range_max_m;
  std::size_t repeated = 0;
  for (std::size_t i = 0; i < laser.scans.size(); ++i) {
    report.beams = std::max(report.beams, laser.scans[i].size());
    report.fewest_beams = std::min(report.fewest_beams, laser.scans[i].size());
    repeated += i > 0 && same_ranges(laser.scans[i - 1], laser.scans[i]);
  }
  report.repeated_ratio = static_cast<double>(repeated) / static_cast<double>(laser.scans.size());
  report.sentinels_m = laser.sentinels_m;
  report.T_base_laser = laser.T_base_laser;
  report.mount_source = laser.mount_source;
  describe_ranges(laser, report);
  describe_latency(laser, report);
  return report;
}

/// Means over one stretch of time.
struct Stretch {
  double force_m_s2 = 0, spread_m_s2 = 0, turning_rad_s = 0;
};

Stretch describe_stretch(std::span<const ImuSample> samples) {
  Stretch stretch;
  Vec3 turning = Vec3::Zero();
  double sum = 0, sum_of_squares = 0;
  for (const ImuSample& sample : samples) {
    const double force = sample.specific_force_m_s2.norm();
    sum += force;
    sum_of_squares += force * force;
    turning += sample.angular_velocity_rad_s;
  }
  const auto n = static_cast<double>(samples.size());
  stretch.force_m_s2 = sum / n;
  stretch.spread_m_s2 =
      std::sqrt(std::max(0.0, sum_of_squares / n - stretch.force_m_s2 * stretch.force_m_s2));
  stretch.turning_rad_s = (turning / n).norm();
  return stretch;
}

ImuReport describe_imu(const std::vector<ImuSample>& imu) {
  constexpr double kStretch_s = 0.5;
  ImuReport report;
  report.stream = describe_stream("imu", stamps_of(imu), imu.size());
  report.has_orientation = imu.front().R_world_imu.has_value();
  std::vector<double> forces_m_s2;
  for (const ImuSample& sample : imu) forces_m_s2.push_back(sample.specific_force_m_s2.norm());
  report.force_m_s2 = quantile(std::move(forces_m_s2), 0.5);
  const auto samples = static_cast<std::size_t>(std::max(2.0, kStretch_s * report.stream.rate_hz));
  Stretch stillest = describe_stretch(std::span(imu).first(std::min(samples, imu.size())));
  for (std::size_t begin = samples / 2; begin + samples <= imu.size();
       begin += std::max<std::size_t>(1, samples / 2)) {
    const Stretch stretch = describe_stretch(std::span(imu).subspan(begin, samples));
    if (stretch.spread_m_s2 + stretch.turning_rad_s < stillest.spread_m_s2 + stillest.turning_rad_s)
      stillest = stretch;
  }
  report.still_force_m_s2 = stillest.force_m_s2;
  report.still_turning_rad_s = stillest.turning_rad_s;
  report.still_spread_m_s2 = stillest.spread_m_s2;
  return report;
}

std::optional<StreamReport> describe_if_any(const char* name, const std::vector<Time>& stamps) {
  if (stamps.empty()) return std::nullopt;
  return describe_stream(name, stamps, stamps.size());
}

}  // namespace

LaserRecordingReport inspect_laser_recording(const LaserRecording& recording) {
  LaserRecordingReport report;
  report.kind = to_string(recording.kind);
  report.path = recording.path.string();
  report.odometry_source = recording.odometry_source;
  report.truth_source = recording.truth_source;
  for (const LaserStream& laser : recording.lasers)
    if (!laser.scans.empty()) report.lasers.push_back(describe_laser(laser));
  if (!recording.imu.empty()) report.imu = describe_imu(recording.imu);
  report.ranges = describe_if_any("ranges", stamps_of(recording.range.readings));
  report.odometry = describe_if_any("odometry", stamps_of(recording.odometry));
  report.truth = describe_if_any("truth", stamps_of(recording.truth));
  report.odometry_length_m = path_length(recording.odometry);
  report.truth_length_m = path_length(recording.truth);
  report.has_rig = recording.rig.has_value();
  report.notes = recording.notes;
  find_odd_stamps(recording, report);
  for (const LaserStreamStats& laser : report.lasers) find_odd_scans(laser, report);
  if (report.imu) find_odd_units(*report.imu, report);
  find_odd_odometry(recording, report);
  find_odd_mounts(recording, report);
  return report;
}

}  // namespace hm
