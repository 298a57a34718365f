#include <fmt/format.h>

#include <cmath>

#include "hm/core/angle.hpp"
#include "hm/pipeline/inspect/laser_check.hpp"

namespace hm {
namespace {

JsonValue sentinels_json(const LaserStreamStats& laser) {
  JsonValue list = JsonValue::array();
  for (const auto& [range, count] : laser.sentinels_m)
    list.push_back(JsonValue::object(
        {{"range_m", std::isfinite(range) ? JsonValue(static_cast<double>(range)) : JsonValue("inf")},
         {"count", static_cast<std::int64_t>(count)}}));
  return list;
}

JsonValue laser_json(const LaserStreamStats& laser) {
  JsonValue json = to_json(laser.stream);
  json["beams"] = static_cast<std::int64_t>(laser.beams);
  json["fewest_beams"] = static_cast<std::int64_t>(laser.fewest_beams);
  json["angle_min_rad"] = laser.angle_min_rad;
  json["angle_max_rad"] = laser.angle_max_rad;
  json["angle_increment_rad"] = laser.angle_increment_rad;
  json["time_increment_s"] = laser.time_increment_s;
  json["range_min_m"] = laser.range_min_m;
  json["range_max_m"] = laser.range_max_m;
  json["returns_ratio"] = laser.returns_ratio;
  json["no_returns_ratio"] = laser.no_returns_ratio;
  json["invalid_ratio"] = laser.invalid_ratio;
  json["nearest_m"] = laser.nearest_m;
  json["median_m"] = laser.median_m;
  json["farthest_m"] = laser.farthest_m;
  json["sentinels"] = sentinels_json(laser);
  json["repeated_ratio"] = laser.repeated_ratio;
  json["latency_s"] = laser.latency_s ? JsonValue(*laser.latency_s) : JsonValue();
  json["max_latency_s"] = laser.max_latency_s ? JsonValue(*laser.max_latency_s) : JsonValue();
  return json;
}

JsonValue imu_json(const ImuReport& imu) {
  JsonValue json = to_json(imu.stream);
  json["has_orientation"] = imu.has_orientation;
  json["force_m_s2"] = imu.force_m_s2;
  json["still_force_m_s2"] = imu.still_force_m_s2;
  json["still_spread_m_s2"] = imu.still_spread_m_s2;
  json["still_turning_rad_s"] = imu.still_turning_rad_s;
  return json;
}

JsonValue poses_json(const StreamReport& stream, double length_m) {
  JsonValue json = to_json(stream);
  json["path_length_m"] = length_m;
  return json;
}

constexpr std::string_view kIndent = "           ";

std::string stream_text(const StreamReport& s) {
  std::string text = fmt::format("{:<10} {}", s.name, s.count);
  if (s.rate_hz > 0)
    text += fmt::format(", {:.1f} Hz, {:.2f} s, longest interval {:.0f} ms", s.rate_hz, s.duration_s,
                        1e3 * s.longest_gap_s);
  return text;
}

std::string sentinels_text(const LaserStreamStats& laser) {
  std::string text;
  for (const auto& [range, count] : laser.sentinels_m)
    text += fmt::format("{}{:.6g} m {} times", text.empty() ? "" : ", ", range, count);
  return text.empty() ? "none" : text;
}

std::string laser_text(const LaserStreamStats& laser) {
  std::string text = stream_text(laser.stream) + "\n";
  text += fmt::format("{}{} beams over {:.1f} deg ({:.1f} to {:.1f}, every {:.3f}), {:.2f} to {:.4g} m\n",
                      kIndent, laser.beams, (laser.angle_max_rad - laser.angle_min_rad) * kDegreesPerRadian,
                      laser.angle_min_rad * kDegreesPerRadian, laser.angle_max_rad * kDegreesPerRadian,
                      laser.angle_increment_rad * kDegreesPerRadian, laser.range_min_m, laser.range_max_m);
  text += fmt::format("{}{:.1f} % return, from {:.2f} to {:.2f} m, median {:.2f} m\n", kIndent,
                      100 * laser.returns_ratio, laser.nearest_m, laser.farthest_m, laser.median_m);
  text += fmt::format("{}{:.1f} % see nothing (markers: {}), {:.1f} % invalid\n", kIndent,
                      100 * laser.no_returns_ratio, sentinels_text(laser), 100 * laser.invalid_ratio);
  if (laser.latency_s)
    text += fmt::format("{}arrives {:.1f} ms after its stamp (median; at most {:.1f})\n", kIndent,
                        1e3 * *laser.latency_s, 1e3 * *laser.max_latency_s);
  return text;
}

std::string imu_text(const ImuReport& imu) {
  return fmt::format("{}{}\n{}stillest half second: {:.3f} m/s2, turning {:.4f} rad/s\n",
                     stream_text(imu.stream), imu.has_orientation ? ", with orientation" : "", kIndent,
                     imu.still_force_m_s2, imu.still_turning_rad_s);
}

}  // namespace

std::string_view to_string(LaserFindingKind kind) {
  switch (kind) {
    case LaserFindingKind::kStamps:
      return "stamps";
    case LaserFindingKind::kGap:
      return "gap";
    case LaserFindingKind::kRanges:
      return "ranges";
    case LaserFindingKind::kAngles:
      return "angles";
    case LaserFindingKind::kImuUnits:
      return "imu_units";
    case LaserFindingKind::kOdometry:
      return "odometry";
    case LaserFindingKind::kDamage:
      return "damage";
    case LaserFindingKind::kMissing:
      return "missing";
  }
  return "unknown";
}

JsonValue to_json(const LaserRecordingReport& report) {
  JsonValue json = JsonValue::object({{"kind", report.kind}, {"path", report.path}});
  json["lasers"] = JsonValue::array();
  for (const LaserStreamStats& laser : report.lasers) json["lasers"].push_back(laser_json(laser));
  json["imu"] = report.imu ? imu_json(*report.imu) : JsonValue();
  json["ranges"] = report.ranges ? to_json(*report.ranges) : JsonValue();
  json["odometry"] = report.odometry ? poses_json(*report.odometry, report.odometry_length_m) : JsonValue();
  json["truth"] = report.truth ? poses_json(*report.truth, report.truth_length_m) : JsonValue();
  json["truth_source"] = report.truth_source;
  json["has_rig"] = report.has_rig;
  json["findings"] = JsonValue::array();
  for (const LaserFinding& finding : report.findings)
    json["findings"].push_back(
        JsonValue::object({{"kind", to_string(finding.kind)}, {"message", finding.message}}));
  json["notes"] = JsonValue::array();
  for (const std::string& note : report.notes) json["notes"].push_back(note);
  return json;
}

std::string to_text(const LaserRecordingReport& report) {
  std::string text = fmt::format("recording  {} ({})\n", report.path, report.kind);
  for (const LaserStreamStats& laser : report.lasers) text += laser_text(laser);
  if (report.imu) text += imu_text(*report.imu);
  if (report.ranges) text += stream_text(*report.ranges) + "\n";
  if (report.odometry)
    text += fmt::format("{}; path {:.2f} m\n", stream_text(*report.odometry), report.odometry_length_m);
  if (report.truth)
    text += fmt::format("{}; path {:.2f} m, from {}\n", stream_text(*report.truth), report.truth_length_m,
                        report.truth_source);
  if (report.has_rig) text += "rig        rig.toml\n";
  for (std::size_t i = 0; i < report.notes.size(); ++i)
    text += fmt::format("{}{}\n", i == 0 ? "notes      " : kIndent, report.notes[i]);
  if (report.findings.empty()) return text + "looks right: nothing odd was found\n";
  for (const LaserFinding& finding : report.findings) text += "LOOKS WRONG  " + finding.message + "\n";
  return text;
}

}  // namespace hm
