#include "hm/pipeline/laser/run/laser_events.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/check.hpp"

namespace hm {
namespace {

/// Leaves out what lies outside of begin_s .. begin_s + duration_s of the recording.
void keep_range(std::vector<LaserEvent>& events, const LaserRunParams& params) {
  if (events.empty()) return;
  const Time begin = events.front().due + Duration::from_seconds(params.begin_s);
  const Time end = begin + Duration::from_seconds(params.duration_s);
  std::erase_if(events, [&](const LaserEvent& event) {
    return event.due < begin || (params.duration_s > 0 && event.due > end);
  });
}

/// Within this angle of straight down a range sensor measures the height.
constexpr double kMostOffDown_rad = 0.8;

/// Mount of the range sensor, if it measures the height: it is known to look down, and has measured at all.
std::optional<SE3> range_mount(const LaserRecording& recording) {
  const auto& mount = recording.range.T_base_range;
  if (!mount || -mount->rotation()(2, 0) < std::cos(kMostOffDown_rad)) return std::nullopt;
  return std::ranges::any_of(recording.range.readings, &RangeReading::is_return) ? mount : std::nullopt;
}

}  // namespace

LaserEvents::LaserEvents(const LaserRecording& recording, const LaserPipeline& pipeline,
                         const LaserRunParams& params) {
  HM_CHECK(params.scan_stride >= 1, "scan_stride = {}", params.scan_stride);
  for (std::size_t i = 0; i < recording.imu.size(); ++i)
    events_.push_back({recording.imu[i].stamp, LaserEvent::Kind::kImu, 0, i});
  for (std::size_t i = 0; i < recording.odometry.size(); ++i)
    events_.push_back({recording.odometry[i].stamp, LaserEvent::Kind::kOdometry, 0, i});
  for (std::size_t i = 0; pipeline.uses_range() && i < recording.range.readings.size(); ++i)
    events_.push_back({recording.range.readings[i].stamp, LaserEvent::Kind::kRange, 0, i});
  for (std::size_t laser = 0; laser < recording.lasers.size(); ++laser) {
    if (!pipeline.uses(laser)) continue;
    const auto& scans = recording.lasers[laser].scans;
    for (std::size_t i = 0; i < scans.size(); i += static_cast<std::size_t>(params.scan_stride))
      events_.push_back({scans[i].stamp_of(scans[i].size()), LaserEvent::Kind::kScan, laser, i});
  }
  std::stable_sort(events_.begin(), events_.end(),
                   [](const LaserEvent& a, const LaserEvent& b) { return a.due < b.due; });
  keep_range(events_, params);
  for (const LaserEvent& event : events_)
    if (event.kind == LaserEvent::Kind::kScan) scan_dues_.push_back(event.due);
}

std::size_t LaserEvents::scans_between(Time after, Time until) const {
  const auto first = std::upper_bound(scan_dues_.begin(), scan_dues_.end(), after);
  const auto last = std::upper_bound(scan_dues_.begin(), scan_dues_.end(), until);
  return last > first ? static_cast<std::size_t>(last - first) : 0;
}

LaserPlatform laser_platform(const LaserRecording& recording) {
  LaserPlatform platform;
  for (const LaserStream& stream : recording.lasers) {
    LaserRig rig;
    if (platform.rigs.empty() && recording.rig) rig = *recording.rig;
    rig.T_base_laser = stream.T_base_laser;
    platform.rigs.push_back(rig);
  }
  if (!platform.rigs.empty()) platform.rigs.front().T_base_range = range_mount(recording);
  platform.has_imu = !recording.imu.empty();
  platform.has_odometry = !recording.odometry.empty();
  return platform;
}

void give(LaserPipeline& pipeline, const LaserRecording& recording, const LaserEvent& event) {
  switch (event.kind) {
    case LaserEvent::Kind::kImu:
      return pipeline.add_imu(recording.imu[event.index]);
    case LaserEvent::Kind::kOdometry:
      return pipeline.add_odometry(recording.odometry[event.index]);
    case LaserEvent::Kind::kRange:
      return pipeline.add_range(recording.range.readings[event.index]);
    case LaserEvent::Kind::kScan:
      return pipeline.add_scan(recording.lasers[event.stream].scans[event.index], event.stream);
  }
}

}  // namespace hm
