#include "hm/pipeline/checks/laser_findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/core/text/counted.hpp"
#include "hm/sensors/odometry_jump.hpp"

namespace hm {
namespace {

void add(LaserRecordingReport& report, LaserFindingKind kind, std::string message) {
  report.findings.push_back({kind, std::move(message)});
}

void find_gap(const StreamReport& stream, LaserRecordingReport& report) {
  constexpr double kLongGap_s = 0.5, kLongGap_intervals = 5;
  if (stream.rate_hz > 0 && stream.longest_gap_s > std::max(kLongGap_s, kLongGap_intervals / stream.rate_hz))
    add(report, LaserFindingKind::kGap,
        fmt::format("{}: {}, the longest {:.2f} s, at {:.1f} Hz", stream.name, counted(stream.gaps, "gap"),
                    stream.longest_gap_s, stream.rate_hz));
}

/// First and last stamp of a stream.
struct Span {
  Time begin, end;
};

/// Two streams of one recording that share no time were stamped by clocks that disagree.
void find_apart(const char* name, const Span& span, const Span& scans, LaserRecordingReport& report) {
  const Duration apart = span.begin > scans.end ? span.begin - scans.end : scans.begin - span.end;
  if (apart.ns > 0)
    add(report, LaserFindingKind::kStamps,
        fmt::format("{} and scans do not overlap in time: they are {:.3f} s apart", name, apart.seconds()));
}

template <class Item>
std::optional<Span> span_of(const std::vector<Item>& items) {
  if (items.empty()) return std::nullopt;
  return Span{items.front().stamp, items.back().stamp};
}

}  // namespace

void find_odd_stamps(const LaserRecording& recording, LaserRecordingReport& report) {
  for (const SkippedLines& skipped : recording.skipped) {
    if (skipped.reason == SkippedLines::Reason::kDamaged) continue;  // place by place below
    add(report,
        skipped.reason == SkippedLines::Reason::kStampNotIncreasing ? LaserFindingKind::kStamps
                                                                    : LaserFindingKind::kDamage,
        to_string(skipped));
  }
  for (const std::string& damage : recording.damage) add(report, LaserFindingKind::kDamage, damage);
  if (!recording.corrected_stamps.empty())
    add(report, LaserFindingKind::kStamps,
        fmt::format("{} ran backwards and {} corrected", counted(recording.corrected_stamps.size(), "stamp"),
                    recording.corrected_stamps.size() == 1 ? "was" : "were"));
  for (const LaserStreamStats& laser : report.lasers) find_gap(laser.stream, report);
  if (report.imu) find_gap(report.imu->stream, report);
  for (const auto* stream : {&report.ranges, &report.odometry})
    if (*stream) find_gap(**stream, report);
  const auto scans = recording.lasers.empty() ? std::nullopt : span_of(recording.lasers.front().scans);
  if (!scans) return;
  if (const auto imu = span_of(recording.imu)) find_apart("imu", *imu, *scans, report);
  if (const auto odometry = span_of(recording.odometry)) find_apart("odometry", *odometry, *scans, report);
  if (const auto truth = span_of(recording.truth)) find_apart("truth", *truth, *scans, report);
}

void find_odd_scans(const LaserStreamStats& laser, LaserRecordingReport& report) {
  constexpr double kFewReturns_ratio = 0.05, kMarker_ratio = 0.05, kRepeated_ratio = 0.1;
  constexpr double kFullTurn_rad = 2 * std::numbers::pi + 0.01, kLate_s = 1.0, kEarly_s = -0.001;
  constexpr double kFarthestMedian_m = 200;
  const std::string& name = laser.stream.name;
  if (laser.median_m > kFarthestMedian_m)
    add(report, LaserFindingKind::kRangeUnits,
        fmt::format("{}: the median range is {:.0f} m: are the ranges in millimetres?", name,
                    laser.median_m));
  if (laser.returns_ratio < kFewReturns_ratio)
    add(report, LaserFindingKind::kRanges,
        fmt::format("{}: only {:.1f} % of the beams return", name, 100 * laser.returns_ratio));
  else if (laser.nearest_m == laser.farthest_m)
    add(report, LaserFindingKind::kRanges, fmt::format("{}: all ranges are {} m", name, laser.nearest_m));
  else if (laser.farthest_exactly_ratio > kMarker_ratio)
    add(report, LaserFindingKind::kRanges,
        fmt::format(
            "{}: {:.1f} % of the returns are exactly {:.6g} m, the largest: perhaps a marker for no return",
            name, 100 * laser.farthest_exactly_ratio, laser.farthest_m));
  if (laser.repeated_ratio > kRepeated_ratio)
    add(report, LaserFindingKind::kRanges,
        fmt::format("{}: {:.0f} % of the scans equal the one before in every range", name,
                    100 * laser.repeated_ratio));
  if (laser.fewest_beams != laser.beams)
    add(report, LaserFindingKind::kAngles,
        fmt::format("{}: scans have from {} to {} beams", name, laser.fewest_beams, laser.beams));
  if (std::fabs(laser.angle_max_rad - laser.angle_min_rad) > kFullTurn_rad)
    add(report, LaserFindingKind::kAngles,
        fmt::format("{}: the beams span {:.1f} degrees, more than a full turn", name,
                    std::fabs(laser.angle_max_rad - laser.angle_min_rad) * 180 / std::numbers::pi));
  if (laser.latency_s && (*laser.latency_s > kLate_s || *laser.latency_s < kEarly_s))
    add(report, LaserFindingKind::kStamps,
        fmt::format("{}: scans arrive {:.3f} s after their stamp: the clocks differ", name,
                    *laser.latency_s));
}

void find_odd_units(const ImuReport& imu, LaserRecordingReport& report) {
  constexpr double kTolerance_ratio = 0.05, kStill_ratio = 0.05, kTurning_rad_s = 0.35;
  const double force = imu.still_force_m_s2;
  const auto near = [&](double expected) {
    return std::fabs(force - expected) < 2 * kTolerance_ratio * expected;
  };
  const bool was_still = imu.still_spread_m_s2 < kStill_ratio * force;
  const std::string said =
      fmt::format("imu: the specific force at rest is {:.4g} instead of 9.81 m/s2", force);
  if (near(1))
    add(report, LaserFindingKind::kImuUnits, said + ": it seems to be in g");
  else if (near(1000))
    add(report, LaserFindingKind::kImuUnits, said + ": it seems to be in thousandths of g");
  else if (force < 0.1 * kGravity_m_s2)
    add(report, LaserFindingKind::kImuUnits, said + ": gravity seems to have been taken out");
  else if (was_still && std::fabs(force - kGravity_m_s2) > kTolerance_ratio * kGravity_m_s2)
    add(report, LaserFindingKind::kImuUnits, said);
  if (was_still && imu.still_turning_rad_s > kTurning_rad_s)
    add(report, LaserFindingKind::kImuUnits,
        fmt::format("imu: it turns at {:.3g} rad/s while the force is steady: degrees, or a large bias",
                    imu.still_turning_rad_s));
}

namespace {

/// Headings in degrees read as radians go beyond a turn, and by steps that no vehicle makes.
void find_degrees(const std::vector<WrittenHeading>& headings, LaserRecordingReport& report) {
  constexpr double kBeyondATurn_rad = 2 * std::numbers::pi + 1, kFast_rad_s = 10, kMany_ratio = 0.1;
  double largest_rad = 0;
  std::size_t steps = 0, odd_steps = 0;
  for (std::size_t i = 0; i < headings.size(); ++i) {
    largest_rad = std::max(largest_rad, std::fabs(headings[i].heading_rad));
    if (i == 0 || headings[i].heading_rad == headings[i - 1].heading_rad) continue;
    const double time_s = (headings[i].stamp - headings[i - 1].stamp).seconds();
    if (time_s <= 0) continue;
    const double step_rad = std::fabs(headings[i].heading_rad - headings[i - 1].heading_rad);
    ++steps;
    odd_steps += step_rad > std::numbers::pi || step_rad > kFast_rad_s * time_s;
  }
  const double odd_ratio = steps > 0 ? static_cast<double>(odd_steps) / static_cast<double>(steps) : 0.0;
  if (largest_rad > kBeyondATurn_rad && odd_ratio > kMany_ratio)
    add(report, LaserFindingKind::kOdometry,
        fmt::format("the headings of the odometry look like degrees: up to {:.1f}, and {:.0f} % of their "
                    "changes are over pi, or over {:.0f} in a second",
                    largest_rad, 100 * odd_ratio, kFast_rad_s));
}

}  // namespace

void find_odd_odometry(const LaserRecording& recording, LaserRecordingReport& report) {
  constexpr double kStill_m = 1e-3, kLong_s = 5;
  if (recording.lasers.empty())
    add(report, LaserFindingKind::kMissing, "there are no scans: nothing to make a map of");
  if (report.odometry && report.odometry_length_m < kStill_m && report.odometry->duration_s > kLong_s)
    add(report, LaserFindingKind::kOdometry, "odometry does not move");
  find_degrees(recording.written_headings, report);
  const Trajectory& poses = recording.odometry;
  std::size_t count = 0;
  double longest_m = 0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    if (!odometry_jumps(poses[i - 1], poses[i])) continue;
    ++count;
    longest_m = std::max(
        longest_m, (poses[i].T_world_base.translation() - poses[i - 1].T_world_base.translation()).norm());
  }
  if (count > 0)
    add(report, LaserFindingKind::kOdometry,
        fmt::format("odometry jumps {}, up to {:.4g} m at once: scan matching does without it there",
                    counted(count, "time"), longest_m));
}

void find_odd_mounts(const LaserRecording& recording, LaserRecordingReport& report) {
  for (const LaserStream& laser : recording.lasers)
    if (!laser.mount_problem.empty()) add(report, LaserFindingKind::kMount, laser.mount_problem);
}

}  // namespace hm
